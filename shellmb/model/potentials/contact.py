"""Contact of the points of a body with a rigid obstacle."""

from __future__ import annotations

from functools import cached_property

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms import contact as forms
from shellmb.forms.constraints.joints import Place
from shellmb.model.body import Elastic, Rates
from shellmb.model.locations.ends import End
from shellmb.model.locations.nodes import said_point
from shellmb.model.potentials.exact import FAR, DistanceEnergy
from shellmb.model.potentials.group import PotentialGroup
from shellmb.model.potentials.obstacles import shape_of
from shellmb.model.potentials.points import Points
from shellmb.scene.loads.contacts import Contact
from shellmb.scene.lookup import said

# part of the scene's length by which points may be in an obstacle at the start: round-off
TOUCHING = 1e-9


class ContactGroup(PotentialGroup):
    """Contact of the points of one body with one obstacle, fixed in space or to a rigid body.

    Args:
        contact: Description.
        comm: Communicator.
        points: The points.
        length: Size of the scene, m.
        carrier: Place on the body of the obstacle; None: fixed in space.
    """

    resists = True

    def __init__(
        self,
        contact: Contact,
        comm: MPI.Comm,
        points: Points,
        length: float,
        carrier: End | None = None,
    ) -> None:
        self.shape = shape_of(contact.obstacle, carrier is not None, points.linear)
        turns = contact.friction * contact.radius > 0
        seen = None if carrier is None else (carrier, self.shape.point, self.shape.axes)
        super().__init__(contact, comm, points, turns, length, seen)
        self.shape.bind(self.constant, length, self.always)
        self._size, self._arm = self.shape.size, self.constant(contact.radius)
        if self.seen is None:
            axes = tuple(self.constant(axis) for axis in self.shape.axes)
            self._fixed = Place(self.constant(self.shape.point), axes)

        def some(value: float | None) -> fem.Constant | None:
            return self.constant(value) if value else None

        self._law = forms.Law(
            self.constant(contact.stiffness),
            self.constant(contact.smoothing),
            some(contact.relative_damping),
            some(contact.friction),
            some(contact.slip_speed),
        )

    def _frame(self, q: Expr) -> Place:
        """Point and axes of the obstacle at a state."""
        return self._fixed if self.seen is None else self.seen.place(q, self.layout)

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
        place, frame = self.place(at), self._frame(at)
        moved, virtual = self.moved(at, rates.chord), self.moved(at, dq)
        r = place.x - frame.x
        n, total = self.shape.normal(r, frame.e), None
        distance = self.shape.distance(self.shape.measure(r, frame.e))
        pressing = forms.force(self._penetration(distance), law.stiffness, law.smoothing)
        if law.damping is not None:
            into, out = (
                ufl.dot(n, self._relative(m, at, v, r))
                for m, v in ((moved, rates.chord), (virtual, dq))
            )
            damped = forms.resisted(pressing, FAR * self.always - into, law.damping)
            pressing, total = pressing + damped, damped * out
        if law.friction is not None:
            foot = r + forms.surface(n, self._arm, place.e)
            slip, shift = (
                self._relative(
                    Place(forms.surface_motion(m.x, n, self._arm, place.e, m.e), ()), at, v, foot
                )
                for m, v in ((moved, rates.chord), (virtual, dq))
            )
            along = slip - ufl.dot(slip, n) * n
            work = ufl.dot(forms.friction(pressing, along, law), shift)
            total = work if total is None else total + work
        return self.weight * total * self.dx

    def _relative(self, moved: Place, at: Expr, v: Expr, r: Expr) -> Expr:
        """A motion relative to the obstacle, whose material is at `r` from its point."""
        if self.seen is None:
            return moved.x
        frame = self._frame(at)
        change = self.changed(self._frame, at, v)
        return moved.x - forms.carried(r, frame.e, change.x, change.e)

    def penetrations(self, x: Floats) -> Floats:
        """Penetrations of points at positions (n, 3) as the obstacle sees them, (n,), m."""
        return np.asarray(self.item.radius - self.shape.normals(x)[1])

    def by_normals(self, q: Floats, forces: Floats) -> tuple[Floats, Floats]:
        """Parts of forces (n, 3) along the normals, (n,), and what is left of them, (n, 3).

        Args:
            q: A state's array.
            forces: Forces on the local points, N.
        """
        normals, _ = self.shape.normals(self.seen_positions(q))
        if self.seen is not None:
            normals = np.einsum("nij,nj->ni", self.seen.rotations(q, self.mixed), normals)
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
