"""Contacts of a scene, wheels, spheres and blades on planes, as groups of constraints."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms.constraints import nonholonomic
from shellmb.forms.constraints.held import Held, Law
from shellmb.forms.constraints.nonholonomic import Own, both
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.model.locations.ends import change_of, frame_about
from shellmb.model.locations.nodes import FindEnd
from shellmb.model.massless import Scale, gathered
from shellmb.scene.multibody.joints import Contact, KnifeEdge, Rolling

# slip at the start of what was to roll, as a part of the speeds that it is the difference of
SLIPPING = 1e-6
# component of the normal along the scene's x above which that is no axis of a plane
STEEP = 0.9
_ADVICE = "a smaller step, or check whether the wheel lies down"
_TITLES = {"y": "place", "t": "direction", "r": "direction of the radius", "Q": "rotation"}


def bind_contact(joint: Contact, find: FindEnd, length: float) -> BoundJoint:
    """Find the places of a contact, the side it is on, and where it touches.

    Args:
        joint: Description.
        find: Gives the place on a body: its name, where on it, and who asks.
        length: Size of the scene, m.

    Raises:
        SceneError: If there is no such place.
    """
    first = find(joint.first, joint.at, joint.said)
    blade = isinstance(joint, KnifeEdge)
    where: Any = joint.second_at
    if blade and where is None:
        where = tuple(first.point)
    second = find(joint.second, where, joint.said)
    height = float((second.point - first.point) @ np.asarray(joint.normal))
    # the side that the body is on makes the normal, whatever its sign was
    e = _plane_axes(np.asarray(joint.normal) * (-1.0 if height < 0 and not blade else 1.0))
    gap = second.point - first.point
    d = np.eye(3)
    if isinstance(joint, KnifeEdge):
        kind, size, d = "knife edge", length, frame_about(joint.direction)
        own = {"y": e[:2] @ gap, "t": e[:2] @ d[2]}
    elif isinstance(joint, Rolling) and joint.axis is not None:
        kind, size, d = "wheel", joint.radius, frame_about(joint.axis)
        down = -(d[:2] @ e[2])
        r = down / np.linalg.norm(down)
        lowest = gap + size * (r @ d[:2])
        own = {"y": e[:2] @ lowest, "t": e[:2] @ (r[1] * d[0] - r[0] * d[1]), "r": r}
    else:
        assert isinstance(joint, Rolling)
        kind, size = "sphere", joint.radius
        own = {"y": e[:2] @ gap, "Q": (d @ e.T).ravel()}
    return BoundJoint(joint, kind, (first, second), np.array([e, d]), size, start=own)


def _plane_axes(normal: Floats) -> Floats:
    """Axes of a plane as rows: the scene's x as seen in it, or y where x is nearly normal to it."""
    n = normal / np.linalg.norm(normal)
    along = np.eye(3)[0 if abs(n[0]) < STEEP else 1]
    e1 = along - (along @ n) * n
    e1 /= np.linalg.norm(e1)
    return np.array([e1, np.cross(n, e1), n])


class ContactGroup(JointGroup):
    """All contacts of a scene of one kind.

    The parts besides the places and "mu" hold what contact coordinates have changed by since the
    reference configuration.

    Args:
        scale: Communicator and sizes.
        contacts: The contacts.
        switched: Whether some of them act at times only: none does.
    """

    def __init__(self, scale: Scale, contacts: Sequence[BoundJoint], switched: bool) -> None:
        super().__init__(scale, contacts, switched)
        parts = self.equations.parts
        starts = {p: [contact.start[p] for contact in contacts] for p in parts}
        self._start = {p: self.per_item(values, f"start_{p}") for p, values in starts.items()}
        # of increments: contact coordinates of the reference configuration
        self._reference = fem.Function(self.mixed.space)
        sizes = {p: scale.length if p == "y" else 1.0 for p in parts}
        self.move_along({p: (f"{_TITLES[p]} of {self.title}", sizes[p]) for p in parts}, _ADVICE)
        # whether wheels roll in a direction, or blades point to one
        self.heads = "t" in parts

    @property
    def title(self) -> str:
        """Beginning of its name in messages."""
        return "knife-edge joints" if self.kind == "knife edge" else f"rolling joints, {self.kind}"

    def _coordinates(self, q: Expr) -> Own:
        return {p: self._start[p] + self.layout.part(q, p) for p in self._start}

    def _violation(self, q: Expr) -> Expr:
        own = self._coordinates(q)
        return ufl.as_vector(self.equations.constraints(*self.places(q), own, self.size))

    def slip(self, q: Expr, change: Expr) -> Expr:
        """Slip by a change of state, `A(q) change`, shape (slips,), m; it must vanish."""
        d = {p: self.layout.part(change, p) for p in self._start}
        assert self.equations.slip is not None
        return ufl.as_vector(self.equations.slip(self._coordinates(q), d, self.size))

    @property
    def law(self) -> Law:
        """Constraints on positions, and on velocities behind them."""
        return nonholonomic.Rolling(Held(self._violation), self.slip, self._reference)

    def looked_at(self, state: Expr) -> Expr:
        """Slips as of a small motion from the reference configuration."""
        return both(self._violation(state), self.slip(self._reference, state))

    def violations_at(self, states: Floats) -> Floats:
        """Values of the constraints on positions; zero for those on velocities."""
        found = super().violations_at(states)
        found[..., self.equations.rows :] = 0.0
        return found

    def heading(self, row: int, q: Floats) -> Floats:
        """Direction in the plane that a wheel rolls in, or a blade points to, shape (2,)."""
        start, dofs = self._start["t"], self.mixed.dofs["t"].reshape(-1, 2)
        cell = start.function_space.dofmap.list[row, 0]
        return np.asarray(start.x.array.reshape(-1, 2)[cell] + q[dofs[row]])

    @cached_property
    def sliding(self) -> Callable[[Floats, Floats], Floats]:
        """Finds slip and pressure from the bodies' motion alone, by local arrays of state and rate.

        For each local cell the speed of slip and what it is the difference of, m/s, the place in
        the plane, m, and the normal force of the last step on the second body, N, shape (n, 5).
        """
        return self.reader(self._sliding)

    def columns(self, levels: Any) -> dict[str, float]:
        """Columns of contacts by the functions of a state; collective.

        `JOINT.track1`, `JOINT.track2`: the point of contact in the plane, along its axes, from the
        joint's point of the first body [m]; `JOINT.slip`: speed of slip now [m/s], which vanishes
        to the order of the scheme: what vanishes exactly are its moments over a step.
        """
        local = self.sliding(levels.q.x.array, levels.rates["v"].x.array)
        lines = zip(self.labels, gathered(self.nodes, local).tolist(), strict=True)
        columns = ("track1", 2), ("track2", 3), ("slip", 0)
        return {f"{name}.{column}": line[k] for name, line in lines for column, k in columns}

    def refuse_slip(self, q: Floats, v: Floats) -> None:
        """See that nothing slips in the velocities given; collective.

        Args:
            q: State, as a local array.
            v: Velocity.

        Raises:
            SceneError: If a contact slips; names it.
        """
        found = gathered(self.nodes, self.sliding(q, v))
        for bound, (slip, speed, *_) in zip(self.joints, found, strict=True):
            if slip > SLIPPING * speed:
                raise SceneError(
                    f"{bound.joint.said}: it slips with {slip:.3g} m/s at the start; give initial "
                    "velocities without slip (a wheel's spin is its speed over its radius), or "
                    "assemble=True to begin with the nearest ones"
                )

    def _sliding(self, q: Expr, v: Expr) -> Expr:
        (a, _), own = self.places(q), self._coordinates(q)
        da, db = (change_of(lambda s, k=k: self.places(s)[k], q, v) for k in range(2))  # type: ignore[misc]
        # from the second place to the point of contact, in the vectors of that place
        arm = [-self.size * own["Q"][3 * k + 2] for k in range(3)] if "Q" in own else []
        arm = [self.size * own["r"][k] for k in range(2)] if "r" in own else arm
        rolled = sum((part * e for part, e in zip(arm, db.e, strict=False)), start=0 * db.x)
        y, mu = own["y"], self.layout.part(q, "mu")
        under = da.x + y[0] * da.e[0] + y[1] * da.e[1]
        slip = ufl.as_vector([ufl.dot(e, db.x + rolled - under) for e in a.e[:2]])
        if self.kind == "knife edge":
            t = own["t"]
            slip = ufl.as_vector([(t[0] * slip[1] - t[1] * slip[0]) / _size(t)])
        speeds = _size(db.x) + _size(rolled) + _size(under)
        # the first three constraints are the gap at the point of contact
        pressure = -self.force * sum(mu[k] * a.e[2][k] for k in range(3))
        return ufl.as_vector([_size(slip), speeds, y[0], y[1], pressure])


def _size(vector: Expr) -> Expr:
    return ufl.sqrt(ufl.dot(vector, vector))
