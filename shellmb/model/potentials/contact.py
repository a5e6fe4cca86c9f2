"""Contact of the points of a body with a rigid obstacle."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms import contact as forms
from shellmb.model.body import Rates
from shellmb.model.locations.nodes import said_point
from shellmb.model.potentials.exact import FAR
from shellmb.model.potentials.group import PotentialGroup
from shellmb.model.potentials.points import Points
from shellmb.scene.loads.contacts import Ball, Contact, Plane, Rod
from shellmb.scene.lookup import said

# distance from a centre or axis, in radii, within which there is no direction any more
CORE = 1e-3
# part of the scene's length by which points may be in an obstacle at the start: round-off
TOUCHING = 1e-9


class ContactGroup(PotentialGroup):
    """Contact of the points of one body with one obstacle.

    Args:
        contact: Description.
        comm: Communicator.
        points: The points.
        length: Size of the scene, m.
    """

    def __init__(self, contact: Contact, comm: MPI.Comm, points: Points, length: float) -> None:
        super().__init__(contact, comm, points, contact.friction * contact.radius > 0, length)
        obstacle: Any = contact.obstacle
        self.radius = 0.0 if isinstance(obstacle, Plane) else float(obstacle.radius)
        self.sign = -1.0 if getattr(obstacle, "inside", False) else 1.0
        self.point = np.array(obstacle.center if isinstance(obstacle, Ball) else obstacle.point)
        axis = getattr(obstacle, "normal", getattr(obstacle, "axis", (0.0, 0.0, 0.0)))
        self.axis = np.array(axis) / max(float(np.linalg.norm(axis)), 1e-300)
        self._kind = type(obstacle)
        given = self.length, self.radius, self.sign, contact.radius
        self._size, self._big, self._sign, self._arm = map(self.constant, given)
        self._point, self._axis = self.constant(self.point), self.constant(self.axis)

        def some(value: float | None) -> fem.Constant | None:
            return self.constant(value) if value else None

        self._law = forms.Law(
            self.constant(contact.stiffness),
            self.constant(contact.smoothing),
            some(contact.relative_damping),
            some(contact.friction),
            some(contact.slip_speed),
        )

    def _away(self, x: Expr) -> Expr:
        """From the centre or the axis, shape (3,), m."""
        r = x - self._point
        return r if self._kind is Ball else r - ufl.dot(r, self._axis) * self._axis

    def measure(self, q: Expr) -> Expr:
        """Distance from the plane, or the square of that from the centre or axis.

        Where positions are quadratic themselves the vector from there.
        """
        x = self.place(q).x
        if self._kind is Plane:
            return ufl.as_vector([ufl.dot(self._axis, x - self._point) / self._size])
        r = self._away(x) / self._size
        return ufl.as_vector([ufl.dot(r, r)]) if self.points.linear else r

    def _penetration(self, e: Expr) -> Expr:
        """Penetration by the measure, m."""
        arm = self._arm + FAR * self.always
        if self._kind is Plane:
            return arm - self._size * e[0]
        core = (CORE * self._big / self._size) ** 2
        square = e[0] if self.points.linear else ufl.dot(e, e)
        # a path may pass through the centre
        distance = self._size * ufl.sqrt(ufl.conditional(ufl.gt(square, core), square, core))
        return arm + self._sign * (self._big - distance)

    def potential(self, e: Expr) -> Expr:
        """Energy of the penetration."""
        return forms.energy(self._penetration(e), self._law.stiffness, self._law.smoothing)

    def _normal(self, q: Expr) -> Expr:
        """Unit vector from the obstacle to the body."""
        if self._kind is Plane:
            return self._axis
        r = self._away(self.place(q).x)
        return self._sign * r / ufl.sqrt(ufl.dot(r, r) + (CORE * self._big) ** 2 * CORE)

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Work of damping and friction, with the motion and the middle of the whole step."""
        law = self._law
        if rates is None or (law.damping is None and law.friction is None):
            return None
        at = mid if rates.middle is None else rates.middle
        place, moved, virtual = self.place(at), self.moved(at, rates.chord), self.moved(at, dq)
        n, total = self._normal(at), None
        push = forms.force(self._penetration(self.measure(at)), law.stiffness, law.smoothing)
        if law.damping is not None:
            rate = FAR * self.always - ufl.dot(n, moved.x)
            damped = forms.resisted(push, rate, law.damping)
            push, total = push + damped, damped * ufl.dot(n, virtual.x)
        if law.friction is not None:
            slip, shift = (
                forms.surface_motion(m.x, n, self._arm, place.e, m.e) for m in (moved, virtual)
            )
            along = slip - ufl.dot(slip, n) * n
            work = ufl.dot(forms.friction(push, along, law), shift)
            total = work if total is None else total + work
        return self.weight * total * self.dx

    def normals(self, x: Floats) -> tuple[Floats, Floats]:
        """Normals at positions (n, 3), and the penetrations of points there, (n,), m."""
        r = x - self.point
        if self._kind is Plane:
            return np.tile(self.axis, (len(x), 1)), self.item.radius - r @ self.axis
        if self._kind is Rod:
            r = r - np.outer(r @ self.axis, self.axis)
        distance = np.linalg.norm(r, axis=1)
        normals = self.sign * r / np.maximum(distance, CORE * self.radius)[:, None]
        return normals, self.item.radius + self.sign * (self.radius - distance)

    def nearest(self, start: Floats, end: Floats) -> Floats:
        """Where points that move straight are nearest to the centre or axis, shape (n, 3)."""
        move, r = end - start, start - self.point
        if self._kind is Rod:
            move, r = (v - np.outer(v @ self.axis, self.axis) for v in (move, r))
        square = np.maximum(np.vecdot(move, move), 1e-300)
        share = np.clip(-np.vecdot(r, move) / square, 0.0, 1.0)
        return np.asarray(start + share[:, None] * (end - start))

    def check_start(self) -> None:
        """Refuse points that are in the obstacle.

        Raises:
            SceneError: If there are any and the contact is not preloaded.
        """
        x = np.array([end.point for end in self.points.ends])
        _, depth = self.normals(x)
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
