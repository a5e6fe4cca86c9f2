"""Impulses of all that acts from outside, as the balance of momentum of a step sees them.

The row of the state at the end of a step (eq. 29), tested with a rigid translation and with a rigid
rotation of its mid-point configuration. Internal forces and those of joints between bodies do no
work there. What does is assembled into the nodes and summed up: loads and added terms; and what
supports, drivers and joints to ground hold, which are the residuals at the fixed unknowns, and the
multipliers of planes that are not axis-parallel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem

from shellmb.kernels import compiled
from shellmb.model.body import Body
from shellmb.observers.nodal import NodalBody, Nodes, nodal_bodies
from shellmb.schemes.quadratic import QuadraticInTime
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly import BlockSystem
from shellmb.system.fields import Field
from shellmb.system.loops import LoopResiduals, MeshCells, MeshGroup

Floats = npt.NDArray[np.float64]


def last_middle(simulation: Simulation, body: str) -> Floats:
    """Dofs of a body at the middle of the last stage of the step just solved.

    In statics the state itself; in linear statics, whose unknown is small, the reference; over a
    step that is quadratic in time the mean.
    """
    problem, scheme = simulation.problem, simulation.scheme
    levels = problem.levels[body]
    if isinstance(scheme, QuadraticInTime) and levels.push is not None:
        unknown = {stage: f.x.array for stage, f in levels.unknown.items()}
        return np.asarray(scheme.mean(levels.q.x.array, levels.push.x.array, unknown))
    if scheme.linear:
        return np.asarray(levels.q.x.array)
    end = levels.unknown[problem.last].x.array
    if not scheme.dynamic:
        return np.asarray(end)
    stages = scheme.stages
    k = stages.index(problem.last)
    before = levels.unknown[stages[k - 1]] if k else levels.q
    return np.asarray((before.x.array + end) / 2)


class Assembled(Protocol):
    """A system of all bodies: that of a step, or that of the forces at its end."""

    @property
    def system(self) -> BlockSystem: ...  # noqa: D102
    @property
    def fields(self) -> list[Field]: ...  # noqa: D102
    @property
    def last(self) -> str: ...  # noqa: D102

    def number(self, body: str, stage: str) -> int:
        """Number of a body's field."""
        ...


def resistance(problem: Assembled, name: str) -> tuple[LoopResiduals, Floats]:
    """What assembles the virtual work of a group's forces at the end of a step, and place for it.

    Args:
        problem: The system.
        name: Name of the group.
    """
    number = problem.number(name, problem.last)
    field, system = problem.fields[number], problem.system
    cells = MeshCells([field], [0], [system.held[number]])
    return LoopResiduals([MeshGroup(system, [number], cells)]), np.zeros(field.size_all)


@dataclass(frozen=True)
class Exchange:
    """What a step exchanged with the outside.

    Args:
        loads: Impulse and moment of impulse about the origin of loads and added terms, (2, 3).
        supports: The same of supports, drivers and joints to ground, shape (2, 3).
        gross: Sum of the sizes of the nodal impulses, N s; of those that cancel one another, too.
    """

    loads: Floats
    supports: Floats
    gross: float


class Impulse:
    """Impulse and moment of impulse about the origin of everything that acts from outside.

    Args:
        simulation: The simulation; the call is collective.
    """

    def __init__(self, simulation: Simulation) -> None:
        problem, model = simulation.problem, simulation.model
        self._system, last = problem.system, problem.last
        self._forms: list[tuple[int, fem.Form]] = []
        for body in model.bodies:
            k = problem.number(body.name, last)
            self._forms += [(k, form) for form in self._acting(simulation, body)]
        self._carriers = [
            _Carrier(name, body, problem.system.numbering.slice(problem.number(name, last)))
            for name, body in nodal_bodies(model).items()
        ]
        self._planes = [
            (problem.number(plane.name, last), *resistance(problem, plane.name))
            for plane in model.planes
        ]
        self._held = model.supported
        self._total = self._system.x.duplicate()
        self._numbers = self._system.numbering.local_to_global.astype(PETSc.IntType)

    @staticmethod
    def _acting(simulation: Simulation, body: Body) -> list[fem.Form]:
        """Virtual work of loads and added terms in the last stage."""
        problem = simulation.problem
        last = problem.forms[body.name][problem.last]
        dq = ufl.TestFunction(body.mixed.space)
        work = [
            form
            for sample in last.samples
            for form in (sample.of_loads(dq), sample.of_terms(body, dq))
        ]
        return [compiled(form) for form in work if form is not None and not form.empty()]

    def of_step(self, simulation: Simulation) -> Exchange:
        """What the step just solved exchanged; collective."""
        assert simulation.last is not None
        sums = np.zeros(13)
        forces = [self._loads(), self._supports()]
        for carrier in self._carriers:
            q = last_middle(simulation, carrier.name)
            found, gross = carrier.resultants(q, [f for f in forces if f is not None])
            rows = [k for k, f in enumerate(forces) if f is not None]
            sums[:12].reshape(2, 6)[rows] += found
            sums[12] += gross
        if simulation.model.comm.size > 1:
            simulation.model.comm.Allreduce(MPI.IN_PLACE, sums)
        sums *= simulation.last.dt
        return Exchange(sums[:6].reshape(2, 3), sums[6:12].reshape(2, 3), float(sums[12]))

    def _loads(self) -> Floats | None:
        """Nodal forces of loads and added terms on this rank; None without any."""
        if not self._forms:
            return None
        local = np.zeros(len(self._numbers))
        for k, form in self._forms:
            fem.assemble_vector(local[self._system.numbering.slice(k)], form)  # type: ignore[arg-type]
        self._total.set(0.0)
        return self._gathered(local)

    def _supports(self) -> Floats | None:
        """Nodal forces of all that holds something on this rank; None without any."""
        if not self._held:
            return None
        # what is left of the equations of fixed unknowns is what holds them
        self._total.set(0.0)
        self._total.array[self._system.fixed] = self._system.reactions
        if not self._planes:
            return self._system.local_values(self._total)
        local = np.zeros(len(self._numbers))
        for k, residuals, r in self._planes:
            r[:] = 0.0
            residuals.refresh()
            residuals.add(r)
            # on the left-hand side they resist
            local[self._system.numbering.slice(k)] -= r
        return self._gathered(local)

    def _gathered(self, local: Floats) -> Floats:
        """Sums of local nodal forces over all that share a node, added to those in `_total`."""
        self._total.setValues(self._numbers, local, addv=PETSc.InsertMode.ADD)
        self._total.assemble()
        return self._system.local_values(self._total)


class _Carrier:
    """A body that forces arrive at.

    Args:
        name: Its name in the system.
        body: The body.
        where: Its local dofs among those of the system.
    """

    def __init__(self, name: str, body: NodalBody, where: slice) -> None:
        self.name, self._nodes, self._where = name, Nodes(body), where
        self._dofs = body.mixed.dofs
        # a node that two bodies share counts on the one that it belongs to
        index_map = body.mixed.space.dofmap.index_map
        ghosts = index_map.size_local + np.arange(index_map.num_ghosts)
        links = [link.dofs for link in body.links]
        self._elsewhere = np.concatenate([*links, ghosts]).astype(np.int32)

    def resultants(self, q: Floats, forces: Sequence[Floats]) -> tuple[Floats, float]:
        """Force and moment about the origin of several sets of forces, and their gross size.

        Args:
            q: Dofs of the state at which they act.
            forces: Nodal forces of the whole system on this rank, of each set.

        Returns:
            Resultants of shape (n, 6), and the sum of the sizes of all forces on positions.
        """
        found, gross, dofs = np.zeros((len(forces), 6)), 0.0, self._dofs
        x, d = self._nodes.places(q)
        for row, values in enumerate(forces):
            r = values[self._where].copy()
            r[self._elsewhere] = 0.0
            force, couples = r[dofs["u"]].reshape(-1, 3), r[dofs["w"]].reshape(-1, 3)
            products = x.T @ force + d.reshape(-1, 3).T @ couples
            if "bubble" in dofs:
                # it turns with the body, and does not move with it
                bubble, share = (a[dofs["bubble"]].reshape(-1, 3) for a in (q, r))
                products += bubble.T @ share
            found[row, :3], found[row, 3:] = force.sum(axis=0), axial(products)
            gross += float(np.sqrt(np.einsum("ni,ni->n", force, force)).sum())
        return found, gross


def axial(products: Floats) -> Floats:
    """`sum a x b` of the matrix `sum a b`."""
    m = products
    return np.array([m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]])
