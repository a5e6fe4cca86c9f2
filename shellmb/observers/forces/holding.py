"""What supports, drivers and joints to ground hold: forces at nodes, and their sums."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.model.model import Model
from shellmb.model.reduced.onframe import OnArms
from shellmb.observers.fields.nodal import NodalBody, Nodes, nodal_bodies
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import Field
from shellmb.system.assembly.loops import LoopResiduals, MeshCells, MeshGroup

Floats = npt.NDArray[np.float64]
Marks = npt.NDArray[np.bool_]


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


def resistance(
    problem: Assembled, name: str, stage: str | None = None
) -> tuple[LoopResiduals, Floats]:
    """What assembles the virtual work of a group's forces in a row, and place for it.

    Args:
        problem: The system.
        name: Name of the group.
        stage: The row; None: that of the state at the end of a step.
    """
    number = problem.number(name, stage or problem.last)
    field, system = problem.fields[number], problem.system
    cells = MeshCells([field], [0], [system.held[number]])
    return LoopResiduals([MeshGroup(system, [number], cells)]), np.zeros(field.size_all)


class Arms(NamedTuple):
    """Where forces act on a body.

    Args:
        x: Positions of its nodes, or changes of them, shape (n, 3), m.
        d: Their directors, or changes of them, shape (n, m, 3).
        q: The state that these are of.
    """

    x: Floats
    d: Floats
    q: Floats


class NodalForces:
    """Forces of all that share a node, summed up.

    Args:
        system: The block system.
    """

    def __init__(self, system: BlockSystem) -> None:
        self._system = system
        self._total = system.x.duplicate()
        self._numbers = system.numbering.local_to_global.astype(PETSc.IntType)

    def gathered(self, local: Floats) -> Floats:
        """Sums of local nodal forces, added to those in `_total`."""
        self._total.setValues(self._numbers, local, addv=PETSc.InsertMode.ADD)
        self._total.assemble()
        return self._system.local_values(self._total)


class HeldForces(NodalForces):
    """What supports, drivers and joints to ground hold in a row.

    Args:
        problem: The system that was solved.
        model: The bodies.
        stage: The row.

    Attributes:
        carriers: Bodies that forces arrive at.
    """

    def __init__(self, problem: Assembled, model: Model, stage: str) -> None:
        super().__init__(problem.system)
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

    def nodal(self) -> Floats | None:
        """Nodal forces on this rank; None without any."""
        if not self._supported:
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
        return self.gathered(local)


class Carrier:
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

    def places(self, q: Floats) -> Arms:
        """Arms of forces at a state, about the origin."""
        return Arms(*self._nodes.places(q), q)

    def changes(self, change: Floats) -> Arms:
        """Arms that are changes of a state."""
        return Arms(*self._nodes.changes(change), change)

    def resultants(
        self, arms: Arms, forces: Sequence[Floats], nodes: Marks | None = None
    ) -> tuple[Floats, float]:
        """Force and moment of several sets of forces, and their gross size.

        Args:
            arms: Where they act.
            forces: Nodal forces of the whole system on this rank, of each set.
            nodes: Markers of the nodes that count, shape (n,); None: all.

        Returns:
            Resultants of shape (n, 6), and the sum of the sizes of all forces on positions.
        """
        found, gross, dofs = np.zeros((len(forces), 6)), 0.0, self._dofs
        for row, values in enumerate(forces):
            r = values[self._where].copy()
            r[self._elsewhere] = 0.0
            force = r[dofs["u"]].reshape(-1, 3)
            couples = r[dofs["w"]].reshape(arms.d.shape)
            if nodes is not None:
                force, couples = (np.where(_wide(nodes, a), a, 0.0) for a in (force, couples))
            products = arms.x.T @ force + arms.d.reshape(-1, 3).T @ couples.reshape(-1, 3)
            if "bubble" in dofs and nodes is None:
                # it turns with the body, and does not move with it
                bubble, share = (a[dofs["bubble"]].reshape(-1, 3) for a in (arms.q, r))
                products += bubble.T @ share
            found[row, :3], found[row, 3:] = force.sum(axis=0), axial(products)
            gross += float(np.sqrt(np.einsum("ni,ni->n", force, force)).sum())
        return found, gross


class ArmCarrier:
    """Arms of a body in modes that forces act on: they turn with it, and do not move with it.

    Args:
        body: What holds them.
        where: Its local dofs among those of the system.
    """

    def __init__(self, body: OnArms, where: slice) -> None:
        self.name, self._where, self._dofs = body.name, where, body.mixed.dofs["u"]
        self._rest = body.arms[body.nodes.item]

    def places(self, q: Floats) -> Arms:
        """The arms at a state."""
        return self._arms(self._rest, q)

    def changes(self, change: Floats) -> Arms:
        """Their changes with one of the state."""
        return self._arms(0 * self._rest, change)

    def _arms(self, rest: Floats, q: Floats) -> Arms:
        return Arms(rest + q[self._dofs].reshape(-1, 3), np.zeros((0, 1, 3)), q)

    def resultants(
        self, arms: Arms, forces: Sequence[Floats], nodes: Marks | None = None
    ) -> tuple[Floats, float]:
        """Moments of several sets of forces, as of `Carrier`."""
        found, gross = np.zeros((len(forces), 6)), 0.0
        for row, values in enumerate(forces):
            force = values[self._where][self._dofs].reshape(-1, 3)
            found[row, 3:] = axial(arms.x.T @ force)
            gross += float(np.linalg.norm(force, axis=1).sum())
        return found, gross


def _wide(nodes: Marks, values: Floats) -> Marks:
    """Markers of nodes in the shape of their values."""
    return nodes.reshape(-1, *[1] * (values.ndim - 1))


def axial(products: Floats) -> Floats:
    """`sum a x b` of the matrix `sum a b`."""
    m = products
    return np.array([m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]])
