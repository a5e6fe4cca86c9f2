"""Impulses of all that acts from outside, as a step's balance sees them, and forces of contacts.

The row of the state at the end of a step (eq. 29), tested with a rigid translation and with a rigid
rotation of its mid-point configuration. Internal forces and those of joints between bodies do no
work there. What does is assembled into the nodes and summed up: loads and added terms; and what
supports, drivers and joints to ground hold, which are the residuals at the fixed unknowns, and the
multipliers of planes that are not axis-parallel.

Over a step that is quadratic in time the rows P0 and P1 of eq. (Q2) have the mean of a force,
`f_0`, and its first moment in time, `f_1 = <P1 f>`. The moment of a force linear in time about the
path is `<r x f> = <r> x f_0 + 3 <P1 r> x f_1 = <r> x f_0 + D/2 x f_1`, as it is of inertia.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from ufl import Form

from shellmb.arrays import Floats
from shellmb.model.body import Body
from shellmb.native.kernels import compile_all
from shellmb.observers.columns import KeptColumns
from shellmb.observers.deferred_observer import STEPS, SharedTable, StepValues
from shellmb.observers.forces.reactions import HeldForces, gathered, resistance
from shellmb.schemes.residuals.residual import StageForms
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.meshgroups import residuals_of_fields

# numbers of local dofs of all steps that are added up together: more are no quicker
TOGETHER = 100_000

AXES = ("Fx", "Fy", "Fz")
CONTACT = ("normal", "friction")
MOMENTS = ("Mx", "My", "Mz")


def last_middle(simulation: Simulation, body: str) -> Floats:
    """Dofs of a body where forces acted that balance the momentum of the step just solved."""
    return simulation.problem.steps[body].middle()


class Impulse:
    """Impulse and moment of impulse about the origin of everything that acts from outside.

    Args:
        simulation: The simulation; the call is collective.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._rows = [
            _BalanceRow(simulation, stage, first=number == 0)
            for number, stage in enumerate(simulation.scheme.balance)
        ]
        size = len(simulation.problem.system.numbering.local_to_global)
        self._together = max(1, TOGETHER // max(size, 1))
        # of each step: impulses over its length, and that
        self._means = SharedTable(simulation.model.comm, (13,))
        self._dt = np.zeros((STEPS, 1))

    def take(self, dt: float, step: int) -> None:
        """Take what acts in the step just solved; collective.

        Args:
            dt: Its length, s.
            step: Which of the steps that are added up together.
        """
        for row in self._rows:
            row.take(step)
        self._dt[step] = dt
        self._means.take(step, self._find)

    def _find(self, steps: slice, means: Floats) -> None:
        for begin in range(0, len(means), self._together):
            some = slice(begin, min(begin + self._together, len(means)))
            for row in self._rows:
                row.add(slice(steps.start + some.start, steps.start + some.stop), means[some])

    def of_steps(self, steps: slice) -> Floats:
        """Exchange of some steps with the outside, shape (n, 13).

        Of each step impulse and moment of impulse of loads and added terms, then those of supports,
        drivers and joints to ground, and the sum of the sizes of all nodal impulses, N s, of those
        that cancel one another, too.

        Args:
            steps: Which of those taken.
        """
        return np.asarray(self._means.of(steps, self._find) * self._dt[steps])


class _BalanceRow:
    """Forces in one of the rows that balance the momentum of a step.

    Args:
        simulation: The simulation.
        stage: The row.
        first: Whether it has means of forces, and not their first moments in time.
    """

    def __init__(self, simulation: Simulation, stage: str, first: bool) -> None:
        problem = simulation.problem
        self._first, self._system = first, problem.system
        # loads and added terms; all of what potentials exert comes from outside, and what volumes
        # exert on lids, which are no bodies; residuals are against it
        self._acting: list[tuple[float, slice, StepValues]] = []
        for body in simulation.model.bodies:
            row, outside = problem.forms[body.name][stage], body in simulation.model.outside
            if forms := row.residual if outside else _work(row, body):
                number = problem.number(body.name, stage)
                find = residuals_of_fields(self._system, {number: compile_all(forms)})
                where = self._system.numbering.slice(number)
                self._acting.append((-1.0 if outside else 1.0, where, StepValues(find)))
        self._held = HeldForces(problem, simulation.model, stage)
        arms = (
            problem.steps[c.name].middle if first else partial(problem.half_chord, c.name)
            for c in self._held.carriers
        )
        self._arms = [StepValues(arm) for arm in arms]

    def take(self, step: int) -> None:
        """Take forces and where they act."""
        for _, _, works in self._acting:
            works.take(step)
        self._held.take(step)
        for arms in self._arms:
            arms.take(step)

    def add(self, steps: slice, sums: Floats) -> None:
        """Add the resultants of this rank to those of `Impulse.of_steps`, by time."""
        forces = [self._nodal(steps), self._held.nodal(steps)]
        there = [(k, f) for k, f in enumerate(forces) if f is not None]
        for carrier, arms in zip(self._held.carriers, self._arms, strict=True):
            whole = 1.0 if self._first else 0.0
            found, gross = carrier.resultants(arms.of(steps), whole, [f for _, f in there])
            # the first moment of a force in time is no impulse
            first = 0 if self._first else 3
            for (k, _), rows in zip(there, found, strict=True):
                sums[:, 6 * k + first : 6 * k + 6] += rows[:, first:]
            if self._first:
                sums[:, 12] += gross

    def _nodal(self, steps: slice) -> Floats | None:
        """Nodal forces on this rank in some steps; None without any; collective."""
        if not self._acting:
            return None
        size = len(self._system.numbering.local_to_global)
        local = np.zeros((len(range(*steps.indices(STEPS))), size))
        for sign, where, works in self._acting:
            local[:, where] = sign * works.of(steps)
        return gathered(self._system, local)


def _work(row: StageForms, body: Body) -> list[Form]:
    """Virtual work of loads and added terms on a body."""
    dq = ufl.TestFunction(body.mixed.space)
    work = (f for s in row.samples for f in (s.of_loads(dq), s.of_terms(body, dq)))
    return [form for form in work if form is not None and not form.empty()]


class ContactForces(KeptColumns):
    """Forces [N] of potentials and contacts on their bodies, as means over the step.

    Columns are `NAME.Fx` to `NAME.Fz`, NaN before the first step; of contacts also `NAME.normal`,
    `NAME.friction`, sums over the points of what pushes along their normals, and size of the sum of
    what acts across them; `NAME.penetration`, that of the deepest point at the end of the step, m;
    where the obstacle moves with a body `NAME.Mx` to `NAME.Mz`, moment on that body about its
    centre of mass, N m.
    """

    def start(self, simulation: Simulation) -> None:
        """Prepare the loops that assemble the forces, and list the columns."""
        problem = simulation.problem
        groups = simulation.model.potentials
        self._groups = [(g, resistance(problem, [(g.name, problem.last)])) for g in groups]
        for group, _ in self._groups:
            names = (*AXES, *(CONTACT if group in simulation.model.contacts else ()))
            names += () if group.seen is None else MOMENTS
            self.values.update({f"{group.item.name}.{name}": float("nan") for name in names})
        self._faces = problem.couplings
        for faces in self._faces:
            names = (*AXES, *CONTACT)
            self.values.update({f"{faces.name}.{name}": float("nan") for name in names})
        self.idle = not self._groups and not self._faces
        self._depths(simulation)

    def solved(self, simulation: Simulation) -> None:
        """Take the forces of the step."""
        for group, works in self._groups:
            middle, work = last_middle(simulation, group.name), works()
            forces = -work[group.mixed.dofs["u1"]].reshape(-1, 3)
            sums = np.zeros(10)
            sums[:3] = forces.sum(axis=0)
            normal, across = group.by_normals(middle, forces)
            sums[3], sums[4:7] = normal.sum(), across.sum(axis=0)
            if group.seen is not None:
                sums[7:] = group.seen.moments(middle, -work, group.mixed).sum(axis=0)
            simulation.model.comm.Allreduce(MPI.IN_PLACE, sums)
            self._put(group.item.name, [*sums[:4], np.linalg.norm(sums[4:7]), *sums[7:]])
        for faces in self._faces:
            normal, friction = faces.forces()
            across = friction.sum(axis=0)
            whole = [*(normal.sum(axis=0) + across), np.linalg.norm(normal, axis=1).sum()]
            whole.append(np.linalg.norm(across))
            self._put(faces.name, whole)

    def _put(self, who: str, found: Sequence[Any]) -> None:
        """Put those numbers into their columns that there are columns of."""
        for name, value in zip((*AXES, *CONTACT, *MOMENTS), found, strict=False):
            if f"{who}.{name}" in self.values:
                self.values[f"{who}.{name}"] = float(value)

    def accepted(self, simulation: Simulation) -> None:
        """Take the penetrations."""
        self._depths(simulation)

    def _depths(self, simulation: Simulation) -> None:
        for group in simulation.model.contacts:
            x = group.seen_positions(simulation.problem.levels[group.name].q.x.array)
            depth = float(np.max(group.penetrations(x), initial=0.0))
            depth = simulation.model.comm.allreduce(depth, op=MPI.MAX)
            self.values[f"{group.item.name}.penetration"] = depth
        for faces in self._faces:
            self.values[f"{faces.name}.penetration"] = faces.depth()
