"""A configuration at work: its steps, counted and timed."""

from __future__ import annotations

from pathlib import Path

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.effects.stepping import Stepping, together
from shellmb.scene import Scene
from tests.bench.bare import BareWork, direct_solver
from tests.bench.record import PARTS, Round

# steps before those that are measured, in small systems, whose data caches can hold
AGAIN, SMALL = 2, 5000


class Runner:
    """A simulation that is run round by round.

    A dynamic one goes on where it was; a static one starts anew for each load step.

    Args:
        scene: The scene.
        folder: Where its observers write.
    """

    def __init__(self, scene: Scene, folder: Path) -> None:
        self.stepping = Stepping(scene, folder, together)
        problem = self.stepping.simulation.problem
        self._iteration = problem.iteration
        self._anew = scene.static
        self._bare: BareWork | None = None

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the linear systems."""
        return self._iteration.linear.size

    def advance(self, steps: int) -> float:
        """Run steps as users do; returns the time they took, s."""
        if not self._anew:
            return self.stepping.advance(steps)
        total = 0.0
        for _ in range(steps):
            self.stepping.again()
            total += self.stepping.advance(1)
        return total

    def round(self, steps: int) -> Round:
        """Run steps, then time their bare work; of several ranks the slowest counts."""
        # others ran in between: without these steps the caches are theirs
        self.advance(AGAIN if self.unknowns < SMALL else 0)
        comm = self.stepping.simulation.model.comm
        before = self._read()
        comm.Barrier()
        took = self.advance(steps)
        done = self._read() - before
        counts, seconds = done[:5] / steps, done[5:]
        self._bare = self._bare or BareWork(self.stepping.simulation.problem)
        bare = self._bare.measure()
        iterations, factorisations, residuals, jacobians, solutions = counts
        own = np.array([took, *seconds]) / steps
        own = np.append(own, bare.total(residuals, jacobians, factorisations, solutions))
        comm.Allreduce(MPI.IN_PLACE, own, op=MPI.MAX)
        parts = dict(zip(PARTS, map(float, own[1:-1]), strict=True))
        numbers = float(iterations), float(factorisations), float(own[0]), float(own[-1])
        return Round(steps, *numbers, parts)

    def _read(self) -> Floats:
        """Counters and clocks so far: five numbers, then the seconds of `PARTS`."""
        iteration, stepping = self._iteration, self.stepping
        inside = iteration.linear.seconds
        return np.array(
            [
                stepping.iterations,
                stepping.factorisations,
                iteration.residuals,
                iteration.linear.jacobians,
                direct_solver(iteration.linear).solutions,
                iteration.residual_seconds,
                *(inside[name] for name in ("jacobian", "reduction", "factor", "solve")),
                *stepping.seconds().values(),
            ]
        )
