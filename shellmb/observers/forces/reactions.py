"""Forces of supports, drivers, joints to ground and contacts, and impulses from outside.

Impulses are of all that acts from outside, as a step's balance sees it: the row of the state at the
end of a step (eq. 29), tested with a rigid translation and with a rigid rotation of its mid-point
configuration. Internal forces and those of joints between bodies do no work there. What does is
assembled into the nodes and summed up: loads and added terms; and what supports, drivers and joints
to ground hold, which are the residuals at the fixed unknowns, and the multipliers of planes that
are not axis-parallel.

Over a step that is quadratic in time the rows P0 and P1 of eq. (Q2) have the mean of a force,
`f_0`, and its first moment in time, `f_1 = <P1 f>`. The moment of a force linear in time about the
path is `<r x f> = <r> x f_0 + 3 <P1 r> x f_1 = <r> x f_0 + D/2 x f_1`, as it is of inertia.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from ufl import Form

from shellmb.arrays import Bools, Floats
from shellmb.model.body import Body
from shellmb.model.model import Model
from shellmb.native.kernels import compile_all
from shellmb.observers.deferred import STEPS, SharedTable, StepValues
from shellmb.observers.fields.nodal import NodalBody, Nodes, NodeSums, nodal_bodies
from shellmb.observers.history import KeptColumns
from shellmb.schemes.residuals.residual import StageForms
from shellmb.simulate.problem import Problem
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.start.consistent import Instant
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.meshgroups import residuals_of_fields

# a system of all bodies: that of a step, or that of the forces at its end
type Assembled = Problem | Instant


def resistance(problem: Assembled, rows: Iterable[tuple[str, str]]) -> Callable[[], Floats]:
    """Make what finds the virtual work of forces of some groups, one behind the other.

    Args:
        problem: The system.
        rows: Names of the groups with the rows that the forces are in.
    """
    numbers = [problem.number(*row) for row in rows]
    every = problem.system.residual_forms
    forms = {k: [form for form, of in every if of == (k,)] for k in numbers}
    return residuals_of_fields(problem.system, forms)


def gathered(system: BlockSystem, local: Floats, reactions: Floats | None = None) -> Floats:
    """Sums of nodal forces of all that share a node, as this rank sees them; collective.

    Args:
        system: The block system.
        local: Forces that this rank finds at each local dof in some steps, shape (k, local dofs).
        reactions: Forces on the fixed unknowns that come on top, shape (k, n).
    """
    fixed = system.fixed if reactions is not None else np.zeros(0, np.int64)
    more = np.zeros((len(local), 0)) if reactions is None else reactions
    found, exchange = np.empty(local.shape), system.exchange
    for row, values, given in zip(found, local, more, strict=True):
        sums = exchange.summed(values)
        sums[fixed] += given
        row[:] = exchange.seen(sums)
    return found


class HeldForces:
    """Forces of supports, drivers and joints to ground in a row.

    Args:
        problem: The system that was solved.
        model: The bodies.
        stage: The row.

    Attributes:
        carriers: Bodies that forces arrive at.
    """

    def __init__(self, problem: Assembled, model: Model, stage: str) -> None:
        self._system = problem.system

        def where(body: str) -> slice:
            return problem.system.numbering.slice(problem.number(body, stage))

        self.carriers = [Carrier(body, where(name)) for name, body in nodal_bodies(model).items()]
        on_arms = (body for body in model.bodies if body.arms is not None)
        self.carriers += [ArmCarrier(body, where(body.name)) for body in on_arms]
        self._planes = [
            (where(plane.name), StepValues(resistance(problem, [(plane.name, stage)])))
            for plane in model.planes
        ]
        self._supported = model.supported
        # what is left of the equations of fixed unknowns is what holds them
        system = problem.system
        self._reactions = StepValues(lambda: system.reactions)

    def take(self, step: int) -> None:
        """Take what a step leaves of them."""
        if not self._supported:
            return
        self._reactions.take(step)
        for _, works in self._planes:
            works.take(step)

    def nodal(self, steps: slice) -> Floats | None:
        """Nodal forces on this rank, shape (k, local dofs); None without any; collective.

        Args:
            steps: Which of those taken.
        """
        if not self._supported:
            return None
        reactions = self._reactions.of(steps)
        local = np.zeros((len(reactions), len(self._system.numbering.local_to_global)))
        for place, works in self._planes:
            # on the left-hand side they resist
            local[:, place] -= works.of(steps)
        return gathered(self._system, local, reactions)


class Carrier:
    """A body that forces arrive at.

    Args:
        body: The body.
        where: Its local dofs among those of the system.
    """

    def __init__(self, body: NodalBody, where: slice) -> None:
        self.name, self._nodes, self._where = body.name, Nodes(body), where
        self._sums = self._nodes.sums()
        # a node that two bodies share counts on the one that it belongs to
        index_map = body.mixed.space.dofmap.index_map
        self._counted = np.ones(index_map.size_local + index_map.num_ghosts)
        self._counted[index_map.size_local :] = 0.0
        for link in body.links:
            self._counted[link.dofs] = 0.0

    def resultants(
        self, q: Floats, whole: float, forces: Sequence[Floats], nodes: Bools | None = None
    ) -> tuple[Floats, Floats]:
        """Force and moment of several sets of forces in some steps, and their gross size.

        Args:
            q: Dofs of some states, or changes of them, shape (k, dofs): points at which they act.
            whole: One for states; zero for changes, which are arms by themselves.
            forces: Nodal forces of the whole system on this rank, of each set, shape (k, n).
            nodes: Markers of the nodes that count, shape (n,); None: all, and all that turns with
                the body and does not move with it.

        Returns:
            Resultants of shape (sets, k, 6), and the sum of the sizes of all forces on positions,
            shape (k,).
        """
        counted = self._counted
        if nodes is not None:
            marked = self._nodes.dofs_of(nodes)
            counted = np.zeros(len(counted))
            counted[marked] = self._counted[marked]
        found = np.zeros((len(forces), len(q), 7))
        for rows, values in zip(found, forces, strict=True):
            rows[:] = self._sums.resultants(q, whole, values[:, self._where], counted)
        return found[..., :6], found[..., 6].sum(axis=0)


class ArmCarrier(Carrier):
    """Arms of a body in modes that forces act on: they turn with it, and do not move with it.

    Args:
        body: What holds them.
        where: Its local dofs among those of the system.
    """

    def __init__(self, body: Any, where: slice) -> None:
        self.name, self._where = body.name, where
        dofs = np.reshape(body.mixed.dofs["u"], (-1, 3)).astype(np.int64)
        self._sums = NodeSums(dofs, body.arms[body.nodes.item], 0, len(dofs))
        self._counted = np.ones(where.stop - where.start)


# numbers of local dofs of all steps that are added up together: more are no quicker
TOGETHER = 100_000

AXES = ("Fx", "Fy", "Fz")
CONTACT = ("normal", "friction")
MOMENTS = ("Mx", "My", "Mz")


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
        self.accepted(simulation)

    def solved(self, simulation: Simulation) -> None:
        """Take the forces of the step."""
        for group, works in self._groups:
            # where forces acted that balance the momentum of the step
            middle, work = simulation.problem.steps[group.name].middle(), works()
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
        for group in simulation.model.contacts:
            x = group.seen_positions(simulation.problem.levels[group.name].q.x.array)
            depth = float(np.max(group.penetrations(x), initial=0.0))
            depth = simulation.model.comm.allreduce(depth, op=MPI.MAX)
            self.values[f"{group.item.name}.penetration"] = depth
        for faces in self._faces:
            self.values[f"{faces.name}.penetration"] = faces.depth()
