"""Forces at the end of each step beside the means over it, and impulses where velocities jump.

Velocities of EP and ED at the ends of steps violate constraints a little. Made consistent by the
impulses `p`, `v = w + M^-1 Dg^T p`, they turn the balance of a step into

    M (w_f - w_i)/h + .. + Dg^T [lambda + (p_f - p_i)/h] = ..

but for terms of second order. What `lambda` alternates with, in EP of first order, is in `p`.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Bools
from shellmb.model.locations.nodes import local_nodes
from shellmb.model.model import Model
from shellmb.observers.deferred import Row
from shellmb.observers.forces.joints import JointColumns, Span, span_of_state, span_of_step
from shellmb.observers.forces.reactions import Assembled, HeldForces
from shellmb.observers.history import KeptColumns
from shellmb.scene.lookup import said
from shellmb.schemes.base import END
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.start.endforces import EndForces

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")

AT_END, MEAN, IMPULSE = "_end", "_mean", "_impulse"


class SupportForces:
    """Forces [N] and moments about the origin [N m] of all supports, in the scene's axes.

    A node that several places have in common counts at the first of them.

    Args:
        problem: The system that was solved.
        model: The bodies.
        balance: Stages of the rows that balance momenta, as of a scheme.

    Attributes:
        names: Columns of the history, `BODY.EDGE.Fx` to `BODY.EDGE.Mz`.
    """

    def __init__(self, problem: Assembled, model: Model, balance: Sequence[str] = (END,)) -> None:
        self._rows = [HeldForces(problem, model, stage) for stage in balance]
        self._comm = model.comm
        # by place: number of the body, and its nodes there
        self._places: dict[str, tuple[int, Bools]] = {}
        numbers = {carrier.name: k for k, carrier in enumerate(self._rows[0].carriers)}
        taken: dict[str, Bools] = {}
        for support in model.scene.supports:
            where: Any = getattr(support, "at", None)
            for described in model.scene.bodies_of(support):
                body = model.meshed[described.name]
                none, name = np.zeros(len(body.mixed.nodes("u")), dtype=bool), body.name
                place = numbers[name], none.copy()
                _, mine = self._places.setdefault(f"{name}.{_place(where)}", place)
                here, found = taken.setdefault(name, none.copy()), none
                found[local_nodes(body, where, said(support))] = True
                mine |= found & ~here
                here |= found
        self.names = [f"{place}.{component}" for place in self._places for component in COMPONENTS]

    def __call__(self, span: Callable[[str], Span]) -> dict[str, float]:
        """Columns of the history; collective.

        Args:
            span: States of a body over which they act, by its name.
        """
        sums = np.zeros((len(self._places), 6))
        for number, held in enumerate(self._rows):
            held.take(0)
            forces = held.nodal(slice(1))
            if forces is None:
                continue
            for row, (k, marks) in enumerate(self._places.values()):
                carrier = held.carriers[k]
                start, end, middle = span(carrier.name)
                # the first moment of a force in time is no force, and acts on the way
                q, whole = ((end - start) / 2, 0.0) if number else (middle, 1.0)
                ((found,),), _ = carrier.resultants(q[None], whole, [forces], marks)
                first = 3 * number
                sums[row, first:] += found[first:]
        self._comm.Allreduce(MPI.IN_PLACE, sums)
        return dict(zip(self.names, sums.ravel().tolist(), strict=True))


def _place(where: object) -> str:
    """An edge, several, a point or coordinates in a name of a column."""
    if isinstance(where, tuple):
        return "+".join(w if isinstance(w, str) else f"{w:g}" for w in where)
    return str(where)


class ImpulseColumns:
    """Impulses that made velocities consistent, of joints, locks and drivers, by their columns.

    Args:
        simulation: The simulation, at its start.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._impulses = simulation.problem.projection
        self._joints = JointColumns(simulation.model, self._impulses)

    def __call__(self, simulation: Simulation) -> Row:
        """Impulses at the present state, N s and N m s; collective."""
        mechanism = simulation.model.mechanism
        at = partial(span_of_state, simulation)
        return self._joints(at) | mechanism.efforts(self._impulses)


class BlowColumns(KeptColumns):
    """Impulses [N s, N m s] of joints, locks and drivers where something begins to act.

    Velocities jump then, before a step, by an impact without restitution, which goes through the
    whole mechanism. The row of that step has the impulses, all others have zeros. Directions and
    points are those of the state in which it happens. Columns are named as the forces with
    `_impulse` behind.

    Nothing in statics, and in scenes whose locks and joints act always.
    """

    _new = False

    def start(self, simulation: Simulation) -> None:
        """List the columns."""
        self.idle = not (simulation.scheme.dynamic and simulation.model.mechanism.switches.items)
        if not self.idle:
            self._read = ImpulseColumns(simulation)
            self.values = {f"{name}{IMPULSE}": 0.0 for name in self._read(simulation)}

    def switched(self, simulation: Simulation) -> None:
        """Read the impulses by which velocities were made consistent; collective."""
        self.values, self._new = _ending(self._read(simulation), IMPULSE), True

    def solved(self, simulation: Simulation) -> None:
        """Forget them after the row of their step."""
        if not self._new:
            self.values = dict.fromkeys(self.values, 0.0)
        self._new = False


class EndForceColumns(KeptColumns):
    """Forces of joints and all that acts on them, and of supports, at the end of a step.

    Those of force elements follow from coordinates and rates there, all others from the equations
    of motion (`simulate.start.endforces`). Columns are named as the means with `_end` behind; those
    of supports (`SupportForces`) are there as means, too. NaN before the first step. Those of
    joints, drivers and locks with `_mean` behind are means over a step that go with velocities
    which the constraints allow.

    Nothing without `Output(end_forces=True)`.
    """

    _impulses: ImpulseColumns | None = None

    def start(self, simulation: Simulation) -> None:
        """Make the equations, and list the columns."""
        self.idle = not (simulation.scene.output.end_forces and simulation.scheme.dynamic)
        if self.idle:
            return
        problem, model, balance = simulation.problem, simulation.model, simulation.scheme.balance
        self._solution = EndForces(problem)
        self._joints = JointColumns(model, self._solution)
        self._acting = JointColumns(model, problem, balance)
        self._means = SupportForces(problem, model, balance)
        self._ends = SupportForces(self._solution, model)
        names = [*self._means.names, *self._measured(simulation)]
        if simulation.scheme.rates == ("v",):
            self._impulses = ImpulseColumns(simulation)
            names += [f"{name}{MEAN}" for name in self._impulses(simulation)]
            # a run begins with consistent velocities; how far off they are where it is resumed, is
            # not known
            self._gained, self._before = (
                dict[str, float](),
                0.0 if simulation.t == 0 else float("nan"),
            )
        self.values = dict.fromkeys(names, float("nan"))

    def solved(self, simulation: Simulation) -> None:
        """Take the means of what supports hold."""
        over = partial(span_of_step, simulation)
        self.values.update(self._means(over))
        if self._impulses is not None:
            efforts = simulation.model.mechanism.efforts(simulation.problem)
            self._solved = self._acting(over) | efforts

    def switched(self, simulation: Simulation) -> None:
        """Velocities have been made consistent."""
        self._gained, self._before = {}, 0.0

    def accepted(self, simulation: Simulation) -> None:
        """Solve at the new state."""
        dt = simulation.solved.dt
        self._solution.solve(simulation.t, dt)
        if self._impulses is not None:
            # the solution has begun with the projection of the velocities
            before, self._gained = self._gained, self._impulses(simulation)
            for name, now in self._gained.items():
                force = (now - before.get(name, self._before)) / dt
                self.values[f"{name}{MEAN}"] = self._solved[name] + force
        self.values.update(self._measured(simulation))

    def _measured(self, simulation: Simulation) -> Row:
        mechanism, at = simulation.model.mechanism, partial(span_of_state, simulation)
        efforts = mechanism.efforts(self._solution) | mechanism.tracks(self._solution)
        efforts |= mechanism.elements(simulation.problem, simulation.t)
        return _ending(self._joints(at) | efforts | self._ends(at), AT_END)


def _ending(columns: Row, ending: str) -> Row:
    """Columns with something behind their names."""
    return {f"{name}{ending}": value for name, value in columns.items()}
