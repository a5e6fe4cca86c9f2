"""A stiff body turns under a scheme that does not hold its velocity along stiff fibres.

A scheme that is quadratic in time keeps the strain of a stiff fibre right, and does not see the
velocity along it: what there is of that, `w`, stays, less what the dissipation takes in a step
(the share `kept`). In a body that turns by `theta` in a step it makes itself felt across the fibre,
`v' = -w theta` in a step, and so does that, `w' = -v theta`: both grow by `e^theta`. So it needs

    kept e^theta > 1,     that is     alpha < tanh(theta/2),

and a step for which a fibre is stiff: its vibrations of the frequency `f` turn by `12/(f h)` only
in a step, less than the body does (`theta f h > 12`). Measured in a beam that turns freely by 0.16
rad in a step: growth with alpha = 0.07, none with 0.09 (`tanh(theta/2)` is 0.08); with alpha = 0
growth from a step on that is 1.2 times the one with `theta f h = 12`.

What is watched is the part of the velocity that does not fit the path, `v_2`, against all of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.mesh import Mesh

from shellmb.observers.sizes import stiffness_of
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import Silent, Simulation
from shellmb.watches.base import Caution, said_of

# angle of a vibration in a step, times its frequency and the step
TURNS = 12.0
# highest frequency of longitudinal waves in elements of second degree, times length over speed
HIGHEST = np.sqrt(60)
# exponent from which on there was growth worth the name: a factor of 150
GROWN = 5.0
# share of `2 v_2^2` in the square of the velocity: that of half a radian in a step
BOUND = 1e-3


class StretchRates(Silent):
    """Follows the velocity that does not fit the path where it grows.

    Args:
        sources: The observers of the run.
    """

    name = "stretch rates"

    def __init__(self, sources: Sources) -> None:
        self._turning = sources.turning
        self._grown: dict[str, float] = {}
        self._share: dict[str, float] = {}
        self._turned: dict[str, tuple[float, float]] = {}
        self._frequency: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the highest frequencies of the bodies."""
        if simulation.scheme.rotations.kept is None:
            return
        for name, body in simulation.model.meshed.items():
            size = _smallest(body.domain.mesh, simulation.model.comm)
            self._frequency[name] = HIGHEST * stiffness_of(body).wave_speed / size
            self._grown.setdefault(name, 0.0)
            self._share.setdefault(name, 0.0)

    def solved(self, simulation: Simulation) -> None:
        """Add the step: both of its ends are at hand."""
        kept, last = simulation.scheme.rotations.kept, simulation.last
        if kept is None or last is None:
            return
        for name, frequency in self._frequency.items():
            angle = self._turning.turns[name].mean
            rate = angle + float(np.log(max(kept, 1e-9)))
            if rate <= 0 or angle * frequency * last.dt <= TURNS:
                # what was there decays, or turns on
                self._grown[name] = max(self._grown[name] + min(rate, 0.0), 0.0)
                continue
            self._grown[name] += rate
            if self._grown[name] > GROWN:
                share = _share(simulation, name)
                self._share[name] = max(self._share[name], share)
                if share > BOUND:
                    # before it shows in the motion itself
                    self._turned.setdefault(name, (angle, last.dt))

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """A sentence for each body in which it shows."""
        for name, share in self._share.items():
            if share <= BOUND:
                continue
            angle, dt = self._turned[name]
            alpha = float(np.tanh(angle / 2))
            step = float(np.sqrt(TURNS * dt / (angle * self._frequency[name])))
            smaller = f", or a step of at most {step:.2g} s" if step > 0 else ""
            yield Caution(
                self.name,
                name,
                share,
                BOUND,
                f"{said_of(simulation, name)} is stiff for its step of {dt:.2g} s and turns "
                f"by {angle:.2g} rad in it: velocities along stiff fibres, which "
                f"{simulation.scheme.title} does not hold, have grown to {np.sqrt(share):.0%} of "
                f"its velocity; use --scheme ed3 with an alpha well beyond {alpha:.2g}{smaller}",
            )

    def state(self) -> dict[str, Any]:
        """What was found so far."""
        return {"grown": self._grown, "share": self._share, "turned": self._turned}

    def restore(self, state: dict[str, Any]) -> None:
        """Take it up."""
        self._grown, self._share = dict(state["grown"]), dict(state["share"])
        self._turned = {name: (angle, dt) for name, (angle, dt) in state["turned"].items()}


def _share(simulation: Simulation, name: str) -> float:
    """Of the square of the velocities of all nodes at the end, that of `sqrt(2) v_2`."""
    problem, body = simulation.problem, simulation.model.meshed[name]
    levels = problem.levels[name]
    assert levels.push is not None
    dofs = body.mixed.owned("u")
    q, push = levels.q.x.array[dofs], levels.push.x.array[dofs]
    end, rate = (f.x.array[dofs] for f in levels.unknown.values())
    shake = (push + rate) / 2 - (end - q)
    sums = np.array([2 * shake @ shake, rate @ rate])
    simulation.model.comm.Allreduce(MPI.IN_PLACE, sums)
    return float(sums[0] / sums[1]) if sums[1] > 0 else 0.0


def _smallest(domain: Mesh, comm: MPI.Comm) -> float:
    """Length of the smallest cell, m."""
    cells = np.arange(domain.topology.index_map(domain.topology.dim).size_local, dtype=np.int32)
    mine = float(np.min(domain.h(domain.topology.dim, cells), initial=np.inf))
    return float(comm.allreduce(mine, op=MPI.MIN))
