"""All rigid bodies of a scene, and ground, as one body of the system: a frame node each."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats, Int32s
from shellmb.forms.frame import PAIRS, FrameMass
from shellmb.forms.loads import dead_force
from shellmb.meshes.nodes import NodeMesh, constant_vector, node_mesh, node_space
from shellmb.model.body import FixedDofs, LoadFactors, PartScale
from shellmb.model.frames.frame import FrameBody
from shellmb.model.locations.ends import End
from shellmb.model.massless import Scale, numbers_of, timed_loads
from shellmb.scene import Scene
from shellmb.scene.loads.loads import Gravity
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.multibody.rigid import RigidBody

NAME = "rigid bodies"

_ADVICE = "a smaller step, or check the joints and the mass of the body"


# a frame at the origin that stays there
GROUND_FRAME = RigidBody(GROUND, 0.0, (0.0, 0.0, 0.0))


class RigidBodies(FrameBody):
    """The rigid bodies, each as a frame at its centre of mass.

    Args:
        scene: The scene.
        scale: Communicator and sizes.
        bodies: The bodies, the same on all ranks; ground is held.
    """

    def __init__(self, scene: Scene, scale: Scale, bodies: Sequence[RigidBody]) -> None:
        self.bodies, self._scene = list(bodies), scene
        self.node_mesh: NodeMesh = node_mesh(scale.comm, len(self.bodies))
        super().__init__(NAME, node_space(self.node_mesh, {"u": 3, "w": 9, "lam": 6}))
        self.frames = self._constant([b.axes.T for b in bodies], "D")
        self.order = self.frames.function_space.dofmap.list[:, 0]
        self.reference = self._constant([b.center for b in bodies], "X")
        self.nodes = ufl.dx(self.node_mesh.mesh)
        # its multipliers are moments, whatever the unit of length
        self.force = fem.Constant(self.node_mesh.mesh, scale.couple)
        self.parts = (
            PartScale("u", "displacement of the rigid bodies", scale.length, _ADVICE),
            PartScale("w", "directors of the rigid bodies", 1.0, _ADVICE),
            PartScale("lam", "director multipliers of the rigid bodies", 1e-3, _ADVICE, idle=True),
        )
        self.index = {b.name: k for k, b in enumerate(self.bodies)}
        if not scene.static:
            euler = self._constant([[b.euler_tensor[pair] for pair in PAIRS] for b in bodies], "J")
            mass = self._constant([b.mass for b in bodies], "m")
            self.masses = ((FrameMass(mass, J=tuple(euler[k] for k in range(6))), self.nodes),)
        if not scene.static and any(b.mass_damping for b in bodies):
            self.slowing = self._constant([b.mass_damping for b in bodies], "slowing")
        if GROUND in self.index:
            dofs = np.concatenate([self.local(GROUND, part) for part in ("u", "w", "lam")])
            self.fixed.append(FixedDofs(dofs))

    def _constant(self, rows: Any, name: str) -> fem.Function:
        values = np.array(rows, dtype=float).reshape(len(self.bodies), -1)
        return constant_vector(self.node_mesh, values, name)

    def pieces(self) -> Iterator[Bools]:
        """The node of each body."""
        for item in range(len(self.bodies)):
            yield (self.node_mesh.item == item)[:, None, None]

    def local(self, body: str, part: str) -> Int32s:
        """Local dofs (owned and ghost) of a part of a rigid body."""
        here = self.node_mesh.item == self.index[body]
        return self.mixed.dofs[part].reshape(-1, self.mixed.parts[part][1])[here].ravel()

    def node_positions(self) -> Floats:
        """Centres of mass of the bodies of the local nodes (owned and ghost), shape (n, 3), m."""
        return np.array([b.center for b in self.bodies]).reshape(-1, 3)[self.node_mesh.item]

    def node_directors(self) -> Floats:
        """Their directors, shape (n, 3, 3)."""
        return np.array([b.axes.T for b in self.bodies]).reshape(-1, 3, 3)[self.node_mesh.item]

    def ends(self) -> dict[str, End]:
        """The centres of mass as places; collective."""
        found = {part: numbers_of(self.node_mesh, self.mixed, part) for part in ("u", "w")}
        return {
            b.name: End(NAME, b.name, {p: n[k] for p, n in found.items()}, x, b.axes.T, x)
            for k, b in enumerate(self.bodies)
            for x in (b.center,)
        }

    def loads(self) -> LoadFactors | None:
        """The weight of the bodies."""
        loads = [(load.time, self._weights(load)) for load in self._scene.weights]
        return timed_loads(self.node_mesh.mesh, loads, self._work) if loads else None

    def _weights(self, load: Gravity) -> fem.Function:
        names = {body.name for body in self._scene.bodies_of(load)}
        masses = [body.mass if body.name in names else 0.0 for body in self.bodies]
        return self._constant(np.outer(masses, load.acceleration), "weight")

    def _work(self, weight: Expr, mid: Expr, dq: Expr) -> Form:
        return dead_force(weight, self.layout.part(dq, "u")) * self.nodes
