"""Potentials and contacts with obstacles as bodies of the system: energies at points of a body."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr
from ufl.corealg.traversal import traverse_unique_terminals

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms import contact as forms
from shellmb.forms.constraints.joints import Place
from shellmb.meshes.nodes import node_mesh
from shellmb.model.body import Elastic, LoadFactors, Rates
from shellmb.model.locations.ends import End, EndGroup, change_of
from shellmb.model.locations.nodes import said_point
from shellmb.model.massless import NodeGroup, Scale
from shellmb.model.potentials.obstacles import shape_of
from shellmb.model.potentials.points import ActingPoints, Points
from shellmb.model.sections.strains import FAR, DistanceEnergy, ExactEnergy
from shellmb.model.user_forms import written
from shellmb.native.expressions import values_at_states
from shellmb.scene.loads.contacts import Contact, Potential
from shellmb.scene.lookup import said


class PotentialGroup(NodeGroup):
    """Base of potentials and contacts: an energy at points of a body.

    Points are nodes: their places are unknowns of the body itself, so that one form at single
    nodes serves shells, beams and rigid bodies alike, and what is seen of a contact, the places of
    nodes, is what is acted on. Energies are of measures that are at most quadratic in the state,
    so that forces over a step are exact (`forms.steps.potentials`).

    Args:
        item: What the scene has, with a name.
        scale: Communicator, and size of the scene.
        points: The points.
        turns: Whether the directors matter.
        carrier: A rigid body that the energy is fixed to: the body's place, a point (3,) and axes
            as rows (3, 3) that move with it; None: it is fixed in space.

    Attributes:
        owner: Name of the body that it acts on.
        seen: That point with the axes at each node; None: there is none.
        resists: Whether it has friction or damping, which the account books as its loss.
        holds: Whether it may hold a body alone: contacts open, and so do not.
    """

    resists = False
    holds = True

    def __init__(
        self,
        item: Any,
        scale: Scale,
        points: Points,
        turns: bool,
        carrier: tuple[End, Floats, Floats] | None = None,
    ) -> None:
        self.item, self.points, self.length = item, points, scale.length
        count, self.owner, self.seen = len(points.ends), points.ends[0].owner, None
        places = [points.bound(turns)]
        if carrier is not None:
            body, point, self._axes = carrier
            carried = [replace(body, point=point)] * count
            self.seen = EndGroup(carried, np.tile(self._axes, (count, 1, 1)), "2", True)
            places.append(self.seen)
        super().__init__(f"{item.label} '{item.name}'", scale.comm, count, places=places)
        self.weight: Expr = self.per_item(points.weights, "weight")
        # of what is a load, the factor that the energy has now
        self.factor: fem.Constant | None = None
        # not zero where the pattern of matrices is looked for: what acts at times only must not be
        # missing there
        self.always = self.constant(0.0)

    @property
    def owners(self) -> set[str]:
        """Names of all bodies that it acts on."""
        return {self.owner} | (set() if self.seen is None else {self.seen.ends[0].owner})

    def measure(self, q: Expr) -> Expr:
        """Measures of order one that the energy is a function of, shape (n,); quadratic at most."""
        raise NotImplementedError

    def potential(self, e: Expr) -> Expr:
        """Energy for a weight of one."""
        raise NotImplementedError

    def by_normals(self, q: Floats, forces: Floats) -> tuple[Floats, Floats]:
        """Parts of forces along normals and across them, as of contacts; none without normals."""
        return forces[:0, 0], forces[:0]

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """The energy."""
        return (ExactEnergy(self.measure, self.potential, self.weight, self.dx),)

    @cached_property
    def _seen_at(self) -> Callable[[Floats], Floats]:
        """Finds points as the carrier sees them, and its axes, at local arrays of some states."""
        q = fem.Function(self.mixed.space)
        found = [self.place(q).x]
        if self.seen is not None:
            frame = self.places(q)[1]
            along = (ufl.dot(e, found[0] - frame.x) for e in frame.e)
            start = self.constant(self.seen.ends[0].point)
            axes = map(self.constant, self._axes)
            found = [sum((s * axis for s, axis in zip(along, axes, strict=True)), start), *frame.e]
        return values_at_states(ufl.as_vector([v[i] for v in found for i in range(3)]), q)

    def seen_positions(self, q: Floats) -> Floats:
        """Positions of the local points as the carrier sees them, in the reference, (n, 3), m."""
        return np.asarray(self._seen_at(q[None])[0, :, :3])


# part of the scene's length by which points may be in an obstacle at the start: round-off
TOUCHING = 1e-9


class ContactGroup(PotentialGroup):
    """Contact of the points of one body with one obstacle, fixed in space or to a rigid body.

    Args:
        contact: Description.
        scale: Communicator, and size of the scene.
        points: The points.
        carrier: Place on the body of the obstacle; None: fixed in space.
    """

    resists = True

    def __init__(self, contact: Contact, scale: Scale, points: Points, carrier: End | None) -> None:
        self.shape = shape_of(contact.obstacle, carrier is not None, points.linear)
        turns = contact.friction * contact.radius > 0
        seen = None if carrier is None else (carrier, self.shape.point, self.shape.axes)
        super().__init__(contact, scale, points, turns, seen)
        self.holds = contact.preloaded
        self.shape.bind(self.constant, scale.length, self.always)
        self._size, self._arm = self.shape.size, self.constant(contact.radius)
        if self.seen is None:
            axes = tuple(self.constant(axis) for axis in self.shape.axes)
            self._fixed = Place(self.constant(self.shape.point), axes)

        def some(value: float | None) -> fem.Constant | None:
            return self.constant(value) if value else None

        stiffness, smoothing = map(self.constant, (contact.stiffness, contact.smoothing))
        lossy = map(some, (contact.relative_damping, contact.friction, contact.slip_speed))
        self._law = forms.Law(stiffness, smoothing, *lossy)

    def _frame(self, q: Expr) -> Place:
        """Point and axes of the obstacle at a state."""
        return self._fixed if self.seen is None else self.places(q)[1]

    def measure(self, q: Expr) -> Expr:
        """Measures from which the distance from the obstacle follows."""
        frame = self._frame(q)
        return self.shape.measure(self.place(q).x - frame.x, frame.e)

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """The energy of the penetrations."""
        if not self.shape.several:
            return super().elastic
        terms = self.measure, self.potential, self.weight, self.dx, self.shape.distance
        return (DistanceEnergy(*terms),)

    def _penetration(self, distance: Expr) -> Expr:
        return self._arm + FAR * self.always - self._size * distance

    def potential(self, e: Expr) -> Expr:
        """Energy of the penetration, by the distance where it follows from several measures."""
        distance = e[0] if self.shape.several else self.shape.distance(e)
        law = self._law
        return forms.energy(self._penetration(distance), law.stiffness, law.smoothing)

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Work of damping and friction, with the motion and the middle of the whole step."""
        law = self._law
        if rates is None or (law.damping is None and law.friction is None):
            return None
        at = mid if rates.middle is None else rates.middle
        place, frame, directions = self.place(at), self._frame(at), (rates.chord, dq)
        moved = [change_of(self.place, at, v) for v in directions]
        carriers = [] if self.seen is None else [change_of(self._frame, at, v) for v in directions]
        r = place.x - frame.x
        n, works = self.shape.normal(r, frame.e), []
        distance = self.shape.distance(self.shape.measure(r, frame.e))
        pressing = forms.force(self._penetration(distance), law.stiffness, law.smoothing)

        def relative(motions: list[Expr], material: Expr) -> list[Expr]:
            """Motions relative to the obstacle, whose material is there, from its point."""
            if not carriers:
                return motions
            y = forms.components(material, frame.e)
            return [m - forms.carried(y, c.x, c.e) for m, c in zip(motions, carriers, strict=True)]

        if law.damping is not None:
            into, out = (ufl.dot(n, motion) for motion in relative([m.x for m in moved], r))
            damped = ufl.variable(forms.resisted(pressing, FAR * self.always - into, law.damping))
            pressing, works = pressing + damped, [damped * out]
        if law.friction is not None:
            foot = r + forms.surface(n, self._arm, place.e)
            surface = [forms.surface_motion(m.x, n, self._arm, place.e, m.e) for m in moved]
            slip, shift = relative(surface, foot)
            along = slip - ufl.dot(slip, n) * n
            works.append(ufl.dot(ufl.variable(forms.friction(pressing, along, law)), shift))
        return self.weight * sum(works) * self.dx

    def penetrations(self, x: Floats) -> Floats:
        """Penetrations of points at positions (n, 3) as the obstacle sees them, (n,), m."""
        return np.asarray(self.item.radius - self.shape.normals(x)[1])

    def by_normals(self, q: Floats, forces: Floats) -> tuple[Floats, Floats]:
        """Parts of forces (n, 3) along the normals, (n,), and what is left of them, (n, 3).

        Args:
            q: A state's array.
            forces: Forces on the local points, N.
        """
        at = self._seen_at(q[None])[0]
        normals, _ = self.shape.normals(at[:, :3])
        if self.seen is not None:
            axes = at[:, 3:].reshape(-1, 3, 3)
            normals = np.einsum("na,nai->ni", normals @ self._axes.T, axes)
            normals /= np.linalg.norm(normals, axis=1)[:, None]
        found = np.vecdot(normals, forces)
        return found, forces - found[:, None] * normals

    def check_start(self) -> None:
        """Refuse points that are in the obstacle.

        Raises:
            SceneError: If there are any and the contact is not preloaded.
        """
        x = np.array([end.point for end in self.points.ends])
        depth = self.penetrations(x)
        inside = depth > TOUCHING * self.length
        if not inside.any() or self.item.preloaded:
            return
        worst = int(np.argmax(depth))
        count = int(np.sum(inside))
        raise SceneError(
            f"{said(self.item)}: {count} of {len(x)} points of '{self.owner}' start in the "
            f"{self.item.obstacle.label}, the one at {said_point(x[worst], self.length)} by "
            f"{depth[worst]:.3g} m; it must start outside, or preloaded must be True"
        )


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


class UserPotential(PotentialGroup):
    """A user's potential.

    Args:
        item: Description.
        scale: Communicator, and size of the scene.
        points: Where it acts.

    Raises:
        SceneError: If its energy is no scalar of UFL, or does not depend on where the body is.
    """

    def __init__(self, item: Potential, scale: Scale, points: Points) -> None:
        self._turns = _uses_directors(item, len(points.ends[0].directors), scale.comm)
        super().__init__(item, scale, points, self._turns)
        if item.load:
            self.factor = self.constant(1.0)
            self.weight = self.factor * self.weight
        self._size = self.constant(scale.length)
        self._X = self.per_item([end.point for end in points.ends], "X")
        self._parameters = {name: self.constant(value) for name, value in item.parameters.items()}

    def loads(self) -> LoadFactors | None:
        """Loads that set the load factor; the force follows from the energy."""
        if (factor := self.factor) is None:
            return None
        value = np.asarray(factor.value)
        return LoadFactors([None], lambda given: value.fill(given[0]), lambda mid, dq: None)

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
    points_of: ActingPoints, scale: Scale
) -> tuple[list[UserPotential], list[ContactGroup]]:
    """All potentials and contacts of a scene; collective.

    Args:
        points_of: Finds where they act.
        scale: Communicator, and size of the scene.

    Raises:
        SceneError: If there is no such place, a function fails, or a body starts in an obstacle.
    """
    scene, contacts = points_of.scene, list[ContactGroup]()
    potentials = [UserPotential(p, scale, points_of(p)) for p in scene.potentials]
    for item in scene.contacts:
        if not item.obstacle.deforms:
            name = item.obstacle_body
            carrier = None if name is None else points_of.find(name, None, said(item))
            contacts.append(ContactGroup(item, scale, points_of(item), carrier))
            contacts[-1].check_start()
    return potentials, contacts
