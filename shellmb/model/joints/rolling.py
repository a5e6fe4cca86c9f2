"""Contacts of a scene, wheels, spheres and blades on planes, as groups of constraints."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.constraints import held
from shellmb.forms.constraints.held import Held, Law, both
from shellmb.forms.constraints.nonholonomic import Own
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.model.locations.ends import End, frame_about
from shellmb.model.massless import Scale
from shellmb.scene.multibody.rolling import Contact, KnifeEdge, Rolling

FindEnd = Callable[[str, Any, str], End]

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
        self._start = {
            p: self.per_item([contact.start[p] for contact in contacts], f"start_{p}")
            for p in parts
        }
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
        return held.Rolling(Held(self._violation), self.slip, self._reference)

    def looked_at(self, state: Expr) -> Expr:
        """Slips as of a small motion from the reference configuration."""
        return both(self._violation(state), self.slip(self._reference, state))

    def violations_at(self, states: Floats) -> Floats:
        """Values of the constraints on positions; zero for those on velocities."""
        found = super().violations_at(states)
        found[..., self.equations.rows :] = 0.0
        return found

    def gaps(self, states: Floats) -> Floats:
        """Largest violations over local states, of positions only."""
        found = self._evaluate(states)[..., : self.equations.rows]
        slips = np.zeros((len(self.nodes.item), self.equations.slips))
        return np.hstack([np.max(np.abs(found), axis=0), slips])

    def heading(self, row: int, q: Floats) -> Floats:
        """Direction in the plane that a wheel rolls in, or a blade points to, shape (2,)."""
        return self.coordinate("t", row, q)

    def pressure(self, row: int, q: Floats) -> float:
        """Normal force of the last step on the second body of a local cell, N."""
        contact = self.joints[self.nodes.item[row]]
        place = self.ends[0].parts["w1"]
        turned = q[self.mixed.dofs["w1"].reshape(-1, place)[row]].reshape(3, 3)
        normal = contact.axes[0][2] @ (np.eye(3) + contact.ends[0].directors.T @ turned)
        mu = q[self.mixed.dofs["mu"].reshape(-1, self.count)[row]]
        # the first three constraints are the gap at the point of contact
        return -float(self.force.value) * float(mu[:3] @ normal)

    def coordinate(self, part: str, row: int, q: Floats) -> Floats:
        """Contact coordinates of a local cell at a state, shape (n,)."""
        start = self._start[part]
        n = self.equations.parts[part]
        cell = start.function_space.dofmap.list[row, 0]
        at = self.mixed.dofs[part].reshape(-1, n)[row]
        return np.asarray(start.x.array.reshape(-1, n)[cell] + q[at])
