"""Potentials and contacts of a scene as bodies of the system."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr
from ufl.corealg.traversal import traverse_unique_terminals

from shellmb.errors import SceneError
from shellmb.meshes.nodes import node_mesh
from shellmb.model.body import LoadFactors, TimeFunction
from shellmb.model.locations.finder import Finder
from shellmb.model.potentials.contact import ContactGroup
from shellmb.model.potentials.group import PotentialGroup
from shellmb.model.potentials.points import MeshedBody, Points, acting_points
from shellmb.model.user_forms import written
from shellmb.scene import Scene
from shellmb.scene.loads.contacts import Faces
from shellmb.scene.loads.potentials import Potential
from shellmb.scene.lookup import said


class At(NamedTuple):
    """Arguments of the energy of a potential.

    Args:
        x: Position, shape (3,), m.
        u: Displacement, shape (3,), m.
        X: Reference position, shape (3,), m.
        directors: Deformed directors, shape (3,) each: one of a shell, three of a frame.
    """

    x: Expr
    u: Expr
    X: Expr
    directors: tuple[Expr, ...]


@dataclass(frozen=True)
class LoadFactor:
    """The factor of a potential that is a load, which is no virtual work of its own.

    Args:
        factor: The factor.
    """

    factor: fem.Constant

    def virtual_work(self, mid: Expr, dq: Expr) -> None:
        """None: the energy has it."""

    def update(self, average: Callable[[TimeFunction | None], float]) -> None:
        """Set the factor."""
        self.factor.value = average(None)  # type: ignore[assignment]


class UserPotential(PotentialGroup):
    """A user's potential.

    Args:
        item: Description.
        comm: Communicator.
        points: Where it acts.
        length: Size of the scene, m.

    Raises:
        SceneError: If its energy is no scalar of UFL, or does not depend on where the body is.
    """

    def __init__(self, item: Potential, comm: MPI.Comm, points: Points, length: float) -> None:
        self._turns = _uses_directors(item, len(points.ends[0].directors), comm)
        super().__init__(item, comm, points, self._turns, length)
        if item.load:
            self.factor = self.constant(1.0)
            self.weight = self.factor * self.weight
        self._size = self.constant(length)
        self._X = self.data(np.array([end.point for end in points.ends]), "X")
        self._parameters = {name: self.constant(value) for name, value in item.parameters.items()}

    def loads(self) -> LoadFactors | None:
        """Loads that set the load factor; the force follows from the energy."""
        return None if self.factor is None else LoadFactor(self.factor)

    def measure(self, q: Expr) -> Expr:
        """Displacement over the size of the scene, and directors where they matter."""
        place = self.place(q)
        u = (place.x - self._X) / self._size
        directors = place.e if self._turns else ()
        return ufl.as_vector([u[i] for i in range(3)] + [d[i] for d in directors for i in range(3)])

    def potential(self, e: Expr) -> Expr:
        """The user's energy."""
        u = self._size * ufl.as_vector([e[i] for i in range(3)])
        count = len(self.points.ends[0].directors) if self._turns else 0
        directors = tuple(ufl.as_vector([e[3 + 3 * k + i] for i in range(3)]) for k in range(count))
        at = At(self._X + u, u, self._X, directors)
        found = written(self.item.energy, (at, self._parameters), f"{said(self.item)}: energy")
        every = sum(e[k] for k in range(e.ufl_shape[0]))
        return found + self.always * every**2


def _uses_directors(item: Potential, count: int, comm: MPI.Comm) -> bool:
    """Decide whether an energy depends on directors; it must depend on these or on the position.

    Raises:
        SceneError: If it depends on neither.
    """
    domain = node_mesh(comm, 1).mesh
    parameters = {name: fem.Constant(domain, value) for name, value in item.parameters.items()}
    x, u, X, *directors = (fem.Constant(domain, np.zeros(3)) for _ in range(3 + count))
    at, who = At(x, u, X, tuple(directors)), f"{said(item)}: energy"
    used = set(traverse_unique_terminals(written(item.energy, (at, parameters), who)))
    if not used & {x, u, *directors}:
        raise SceneError(
            f"{who} depends neither on at.x nor on at.u or at.directors; it must, or it exerts no "
            "force"
        )
    return bool(used & set(directors))


def potential_groups(
    scene: Scene,
    comm: MPI.Comm,
    find: Finder,
    meshed: Mapping[str, MeshedBody],
    rigid_meshes: Mapping[str, MeshedBody],
    reduced: Mapping[str, Points],
    length: float,
) -> list[PotentialGroup]:
    """All potentials and contacts of a scene; collective.

    Args:
        scene: The scene as it was given, with its rigid shells and beams.
        comm: Communicator.
        find: Places on bodies.
        meshed: Shells and beams.
        rigid_meshes: Meshes of those that are rigid.
        reduced: Points on bodies in modes, by the names of what acts there.
        length: Size of the scene, m.

    Raises:
        SceneError: If there is no such place, a function fails, or a body starts in an obstacle.
    """
    groups: list[PotentialGroup] = []
    contacts = (c for c in scene.contacts if not isinstance(c.obstacle, Faces))
    items: tuple[Any, ...] = (*scene.potentials, *contacts)
    for item in items:
        (body,) = scene.bodies_of(item)
        points = reduced.get(item.name)
        if points is None:
            points = acting_points(body.name, item.at, find, meshed, rigid_meshes, said(item))
        if isinstance(item, Potential):
            groups.append(UserPotential(item, comm, points, length))
        else:
            name = item.obstacle_body
            carrier = None if name is None else find(name, None, said(item))
            contact = ContactGroup(item, comm, points, length, carrier)
            contact.check_start()
            groups.append(contact)
    return groups
