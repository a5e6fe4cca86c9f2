"""Forces of supports, drivers and joints to ground: at nodes, and their sums."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.model.model import Model
from shellmb.model.reduced.onframe import OnArms
from shellmb.observers.fields.nodal import NodalBody, Nodes, nodal_bodies
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import Field
from shellmb.system.assembly.meshgroups import residuals_of
from shellmb.system.assembly.residuals import Residuals


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


# reactions of fixed unknowns, and the work of each group of planes for its dofs
type Taken = tuple[Floats, list[Floats]]
NOTHING: Taken = np.zeros(0), []


def resistance(problem: Assembled, name: str, stage: str | None = None) -> tuple[Residuals, Floats]:
    """Assembly of the virtual work of a group's forces in a row, and memory for it.

    Args:
        problem: The system.
        name: Name of the group.
        stage: The row; None: that of the state at the end of a step.
    """
    number, system = problem.number(name, stage or problem.last), problem.system
    forms = [form for form, rows in system.residual_forms if rows == (number,)]
    return residuals_of(system, number, forms), np.zeros(problem.fields[number].size_all)


class Arms(NamedTuple):
    """Points at which forces act on a body.

    Args:
        q: Dofs of a state, or changes of them.
        whole: One for a state; zero for changes, which are arms by themselves.
    """

    q: Floats
    whole: float


class NodalForces:
    """Forces of all that share a node, summed up.

    Args:
        system: The block system.
    """

    def __init__(self, system: BlockSystem) -> None:
        self._system, self._sum = system, system.x.duplicate()

    def gathered(self, local: Floats, more: PETSc.Vec | None = None) -> Floats:
        """Sums of local nodal forces, as this rank sees them.

        Args:
            local: Forces that this rank finds at each local dof.
            more: Forces on unknowns that come on top.
        """
        exchange = self._system.exchange
        exchange.local[:] = local
        exchange.collect(self._sum)
        if more is not None:
            self._sum.axpy(1.0, more)
        return self._system.local_values(self._sum)


class HeldForces(NodalForces):
    """Forces of supports, drivers and joints to ground in a row.

    Args:
        problem: The system that was solved.
        model: The bodies.
        stage: The row.

    Attributes:
        carriers: Bodies that forces arrive at.
    """

    def __init__(self, problem: Assembled, model: Model, stage: str) -> None:
        super().__init__(problem.system)
        self._held = problem.system.x.duplicate()
        self._held.set(0.0)
        self.carriers: list[Carrier | ArmCarrier] = [
            Carrier(name, body, problem.system.numbering.slice(problem.number(name, stage)))
            for name, body in nodal_bodies(model).items()
        ]
        self.carriers += [
            ArmCarrier(body, problem.system.numbering.slice(problem.number(body.name, stage)))
            for body in model.bodies
            if isinstance(body, OnArms)
        ]
        self._planes = [
            (problem.number(plane.name, stage), *resistance(problem, plane.name, stage))
            for plane in model.planes
        ]
        self._supported = model.supported

    def take(self) -> Taken:
        """Take what a step leaves of the reactions."""
        if not self._supported:
            return NOTHING
        works = []
        for _, residuals, r in self._planes:
            r[:] = 0.0
            residuals.refresh()
            residuals.add(r)
            works.append(r.copy())
        return self._system.reactions.copy(), works

    def nodal(self, taken: Taken | None = None) -> Floats | None:
        """Nodal forces on this rank; None without any; collective.

        Args:
            taken: What a step has left of them; None: of the last one.
        """
        if not self._supported:
            return None
        reactions, works = taken or self.take()
        # what is left of the equations of fixed unknowns is what holds them
        self._held.array[self._system.fixed] = reactions
        if not self._planes:
            return self._system.local_values(self._held)
        local = np.zeros(len(self._system.numbering.local_to_global))
        for (k, *_), r in zip(self._planes, works, strict=True):
            # on the left-hand side they resist
            local[self._system.numbering.slice(k)] -= r
        return self.gathered(local, self._held)


class Carrier:
    """A body that forces arrive at.

    Args:
        name: Its name in the system.
        body: The body.
        where: Its local dofs among those of the system.
    """

    def __init__(self, name: str, body: NodalBody, where: slice) -> None:
        self.name, self._nodes, self._where = name, Nodes(body), where
        self._sums = self._nodes.sums(carried=body.mixed.dofs.get("bubble"))
        # a node that two bodies share counts on the one that it belongs to
        index_map = body.mixed.space.dofmap.index_map
        self._counted = np.ones(index_map.size_local + index_map.num_ghosts)
        self._counted[index_map.size_local :] = 0.0
        for link in body.links:
            self._counted[link.dofs] = 0.0

    def resultants(
        self, arms: Arms, forces: Sequence[Floats], nodes: Bools | None = None
    ) -> tuple[Floats, float]:
        """Force and moment of several sets of forces, and their gross size.

        Args:
            arms: Where they act.
            forces: Nodal forces of the whole system on this rank, of each set.
            nodes: Markers of the nodes that count, shape (n,); None: all, and all that turns with
                the body and does not move with it.

        Returns:
            Resultants of shape (n, 6), and the sum of the sizes of all forces on positions.
        """
        counted = self._counted
        if nodes is not None:
            marked = self._nodes.dofs_of(nodes)
            counted = np.zeros(len(counted))
            counted[marked] = self._counted[marked]
        found = np.zeros((len(forces), 7))
        for row, values in zip(found, forces, strict=True):
            row[:] = self._sums.resultants(arms.q, arms.whole, values[self._where], counted)
        return found[:, :6], float(found[:, 6].sum())


class ArmCarrier:
    """Arms of a body in modes that forces act on: they turn with it, and do not move with it.

    Args:
        body: What holds them.
        where: Its local dofs among those of the system.
    """

    def __init__(self, body: OnArms, where: slice) -> None:
        self.name, self._where, self._dofs = body.name, where, body.mixed.dofs["u"]
        self._rest = body.arms[body.nodes.item]

    def resultants(
        self, arms: Arms, forces: Sequence[Floats], nodes: Bools | None = None
    ) -> tuple[Floats, float]:
        """Moments of several sets of forces, as of `Carrier`."""
        found, gross = np.zeros((len(forces), 6)), 0.0
        x = arms.whole * self._rest + arms.q[self._dofs].reshape(-1, 3)
        for row, values in enumerate(forces):
            force = values[self._where][self._dofs].reshape(-1, 3)
            found[row, 3:] = np.cross(x, force).sum(axis=0)
            gross += float(np.linalg.norm(force, axis=1).sum())
        return found, gross
