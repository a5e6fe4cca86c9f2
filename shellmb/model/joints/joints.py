"""Joints of a scene as groups of constraints: all of one kind share a mesh and its kernels.

Edges and areas of shells are welded to a frame by eq. (35) at each of their nodes: it stays where
it is in the frame of a rigid body, of the ground or of a beam's node, and so does its director.
What all of them carry adds up to one force and moment of the joint.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms.constraints.joints import BUNDLED, KINDS, JointKind
from shellmb.forms.constraints.nonholonomic import CONTACTS
from shellmb.forms.loads import dead_force
from shellmb.forms.steps.discrete import variation
from shellmb.model.body import LoadFactors, MassiveBody
from shellmb.model.joints.constraints import ConstraintGroup, GivenValues
from shellmb.model.locations.ends import End, EndGroup, end_pair, frame_about
from shellmb.model.locations.nodes import FindEnd, Meshed, shared_nodes
from shellmb.model.massless import NONE, NodeGroup, Scale, timed_loads
from shellmb.model.user_forms import check_equations, own_kind
from shellmb.scene import Scene
from shellmb.scene.loads.loads import Gravity
from shellmb.scene.multibody import joints as scene_joints
from shellmb.scene.multibody.joints import Joint
from shellmb.scene.values.validate import show

# two points count as one below this part of the scene's length
TOGETHER = 1e-9


@dataclass(frozen=True)
class BoundJoint:
    """A joint with its places and axes.

    Args:
        joint: Description.
        kind: Kind of its constraints, a key of `forms.constraints.joints.KINDS`.
        ends: Its places on the first and the second body.
        axes: Vectors `e1, e2, e3` of both places as rows, shape (2, 3, 3).
        length: Length of a distance joint or a radius, m; 1 for others.
        own: Constraints that a user gave; None: those of the kind.
        about: Reference position of the point of the first body that its moment is about, shape
            (3,), m: one point for all nodes of a region. None: its own point on the second body.
        start: Contact coordinates of the reference configuration by name, shape (n,) each.
    """

    joint: Joint
    kind: str
    ends: tuple[End, End]
    axes: Floats
    length: float = 1.0
    own: JointKind | None = None
    about: Floats | None = None
    start: Mapping[str, Floats] = NONE

    @property
    def equations(self) -> JointKind:
        """Constraints of the joint."""
        return self.own or (CONTACTS if self.start else KINDS)[self.kind]

    @property
    def shown(self) -> Floats:
        """Axes of its forces in the results, as rows: they turn with the first place.

        Those of all nodes of a region are those of the scene as they turn with the first body.
        """
        scene = self.joint.along_scene or self.about is not None
        return np.eye(3) if scene else np.asarray(self.axes[0])

    @property
    def vectors(self) -> tuple[int, int]:
        """Number of vectors that its places must have."""
        return self.equations.vectors

    @property
    def key(self) -> tuple[Any, ...]:
        """Key that joints with common kernels share: none shares those of a user's joint."""
        needed = (end.needed(n) for end, n in zip(self.ends, self.vectors, strict=True))
        return self.joint.name if self.own else self.kind, *needed


def apart(ends: tuple[End, End], length: float, who: str) -> float:
    """Distance of two points, m.

    Args:
        ends: The points.
        length: Size of the scene, m.
        who: Who asks, for the error.

    Raises:
        SceneError: If both are at the same place: there is no direction between them.
    """
    found = float(np.linalg.norm(ends[1].point - ends[0].point))
    if not found > TOGETHER * length:
        raise SceneError(
            f"{who}: its ends are at the same point; they must be apart in the given positions"
        )
    return found


def bind_joint(joint: Any, find: FindEnd, size: float) -> BoundJoint:
    """Find the places of a joint and the axes it needs there.

    Args:
        joint: Description.
        find: Gives the place on a body: its name, where on it, and who asks.
        size: Size of the scene, m.

    Raises:
        SceneError: If there is no such place, or a shell's director is not where it should be.
    """
    first = find(joint.first, joint.at, joint.said)
    where = joint.second_at if joint.second_at is not None else tuple(first.point)
    second = find(joint.second, where, joint.said)
    kind, lines, length = joint.label.removesuffix(" joint"), joint.lines, 1.0
    if joint.about_director:
        lines = (_director(joint, second),) * 2
    elif kind == "weld" and not second.framed:
        # a shell's node carries no moment about its director: all there is to weld is eq. (35)
        kind, lines = "shell revolute", (second.directors[0],) * 2
    axes = np.array([frame_about(line) for line in lines] or [np.eye(3)] * 2)
    framed = len(first.directors), len(second.directors)
    if kind == "own":
        own = own_kind(joint, framed)
        check_equations(joint, own, framed, len(joint.values))
        return BoundJoint(joint, kind, (first, second), axes, own=own)
    if kind == "distance":
        length = apart((first, second), size, joint.said)
        if joint.given:
            kind = "given distance"
        else:
            length = joint.length or length
    kind = "cylindrical" if joint.tied else kind
    bound = BoundJoint(joint, kind, (first, second), axes, length)
    if kind not in KINDS:
        raise SceneError(
            f"{joint.said}: its equations are missing; KINDS must have them under {show(kind)}, or "
            "use OwnJoint"
        )
    if bound.equations.constraints not in BUNDLED:
        check_equations(joint, bound.equations, framed, len(joint.given))
    return bound


def _director(joint: scene_joints.ShellRevolute, end: End) -> Floats:
    """Director of the shell at the joint, checked against the given axis."""
    director = end.directors[0]
    if joint.axis is not None:
        axis = np.asarray(joint.axis) / np.linalg.norm(joint.axis)
        if abs(float(axis @ director)) < 1 - 1e-3:
            raise SceneError(
                f"{joint.said}: axis is {joint.axis}; the shell's director is "
                f"({', '.join(f'{c:.3g}' for c in director)}) there, and must be the axis"
            )
    return director


class JointGroup(ConstraintGroup):
    """All joints of a scene that share kind and kinds of ends.

    Args:
        scale: Communicator and sizes.
        joints: The joints.
        switched: Whether some of them act at times only.
    """

    def __init__(self, scale: Scale, joints: Sequence[BoundJoint], switched: bool) -> None:
        self.joints = list(joints)
        self.kind, framed = joints[0].kind, joints[0].key[1:]
        self.ends = end_pair([j.ends for j in joints], [j.axes for j in joints], framed)
        self.given = GivenValues([joint.joint for joint in joints])
        self.equations = kind = joints[0].equations
        self.directions = kind.directions
        super().__init__(
            f"{self.title} ({'/'.join(map(str, framed))})",
            scale.comm,
            len(joints),
            kind.rows + kind.slips,
            self._violation,
            *scale.of(kind.rows + kind.slips, kind.directions),
            switched,
            own={**kind.parts, **self.given.parts},
            places=self.ends,
        )
        self.size = self.per_item([j.length for j in joints], "length")
        self.labels = [joint.joint.name for joint in joints]
        self.given.prescribe(self)

    @property
    def title(self) -> str:
        """Beginning of its name in messages."""
        return f"{self.kind} joints"

    def _violation(self, q: Expr) -> Expr:
        values = self.given.values(q, self.layout)
        return ufl.as_vector(self.equations.constraints(*self.places(q), self.size, *values))


def joint_groups[G: JointGroup](
    scale: Scale, joints: Sequence[BoundJoint], switched: frozenset[str], kind: type[G]
) -> list[G]:
    """Groups of joints of one kind.

    Args:
        scale: Communicator and sizes.
        joints: All joints.
        switched: Names of the joints that do not act always.
        kind: Class of the groups.
    """
    keys = dict.fromkeys(joint.key for joint in joints)
    groups = []
    for key in keys:
        members = [joint for joint in joints if joint.key == key]
        some = any(joint.joint.name in switched for joint in members)
        groups.append(kind(scale, members, some))
    return groups


class PointMasses(NodeGroup, MassiveBody):
    """Masses of joints, at places of the bodies.

    Args:
        scene: The scene.
        comm: Communicator.
        items: Places, all on bodies with the same number of directors, and masses there, kg.
        directors: Number of directors that matter: some of the places are off their nodes.
    """

    def __init__(
        self, scene: Scene, comm: MPI.Comm, items: Sequence[tuple[End, float]], directors: int
    ) -> None:
        ends, masses = zip(*items, strict=True)
        end = EndGroup(ends, np.array([np.eye(3)] * len(ends)), "1", directors > 0)
        super().__init__(f"joint masses ({directors})", comm, len(ends), places=[end])
        self.kinematic = frozenset(self.mixed.parts)
        self.mass = self.per_item(masses, "m")
        self.gravity, self._dynamic = everywhere(scene), not scene.static

    def position(self, q: Expr) -> Expr:
        """Positions of the masses, m."""
        return self.place(q).x

    def velocity(self, v: Expr) -> Expr:
        """Velocities of the masses: the position is linear in the state."""
        return variation(self.position, v, v, ufl.Coefficient(self.mixed.space))

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces."""
        if not self._dynamic:
            return None
        return self.mass * ufl.dot(self.velocity(rate), self.velocity(dq)) * ufl.dx

    def vectors_at(self, q: Expr) -> Mapping[str, Sequence[Expr]]:
        """The places at a state, which have arms on bodies within them already."""
        return {"u1": [self.position(q)]}

    def loads(self) -> LoadFactors | None:
        """Their weight."""
        loads = [(g.time, self.constant(np.array(g.acceleration))) for g in self.gravity]
        return timed_loads(self.nodes.mesh, loads, self._weight) if loads else None

    def _weight(self, acceleration: fem.Constant, mid: Expr, dq: Expr) -> Form:
        return dead_force(self.mass * acceleration, self.velocity(dq)) * ufl.dx


def everywhere(scene: Scene) -> list[Gravity]:
    """Loads of gravity on all that has a mass."""
    return [load for load in scene.weights if load.body is None]


def point_masses(scene: Scene, comm: MPI.Comm, joints: Sequence[BoundJoint]) -> list[PointMasses]:
    """Half of each joint's mass at each of its ends.

    Args:
        scene: The scene.
        comm: Communicator.
        joints: The joints.
    """
    if scene.static and not everywhere(scene):
        return []
    groups: dict[int, list[tuple[End, float]]] = {}
    for joint in joints:
        for end in joint.ends if joint.joint.mass > 0 else ():
            groups.setdefault(end.needed(0), []).append((end, joint.joint.mass / 2))
    return [PointMasses(scene, comm, items, directors) for directors, items in groups.items()]


def bind(joint: Joint, end: FindEnd, shells: Mapping[str, Meshed], size: float) -> list[BoundJoint]:
    """Find the places of a joint: one item, of a weld along a region one for each of its nodes.

    Args:
        joint: Description.
        end: Gives the place on a body: its name, where on it, and who asks.
        shells: Shells and bodies of the user's own by name.
        size: Size of the scene, m.

    Raises:
        SceneError: If there is no such place, or a joint along a region has a mass.
    """
    where = joint.second_at
    if joint.of_regions and isinstance(where, str) and joint.second in shells:
        body = shells[joint.second]
        if where in body.domain.regions:
            return _bind_region(joint, where, body, end)
    return [bind_joint(joint, end, size)]


def _bind_region(joint: Joint, region: str, body: Meshed, find: FindEnd) -> list[BoundJoint]:
    if joint.mass:
        raise SceneError(
            f"{joint.said}: mass is {joint.mass:g}; it must be 0 along an edge or an area, where "
            "the masses of bolts are part of a rigid body or of the shell"
        )
    frame = find(joint.first, joint.at, joint.said)
    nodes = shared_nodes(body, region, joint.said)
    found: list[BoundJoint] = []
    for k, (x, director) in enumerate(zip(nodes.x, nodes.directors, strict=True)):
        ends = (replace(frame, point=x), nodes.end(k, body.name))
        axes = np.array([frame_about(director[0]) if len(director) else np.eye(3)] * 2)
        kind = "shell revolute" if len(director) else "fixed point"
        found.append(BoundJoint(joint, kind, ends, axes, about=frame.point))
    return found
