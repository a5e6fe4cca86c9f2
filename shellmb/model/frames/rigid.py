"""All rigid bodies of a scene, and ground, as one body of the system: a frame node each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats
from shellmb.forms import frame
from shellmb.forms.frame import PAIRS, FrameMass
from shellmb.forms.loads import dead_force
from shellmb.meshes.nodes import NodeMesh, constant_vector, node_mesh, node_space
from shellmb.model.body import Dofs, FixedDofs, LoadFactors, PartScale, Rates
from shellmb.model.frames.frame import FrameBody
from shellmb.model.locations.ends import End
from shellmb.model.massless import Scale, TimedLoads, numbers_of
from shellmb.scene.loads.loads import Gravity
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.multibody.rigid import RigidBody

NAME = "rigid bodies"

_ADVICE = "a smaller step, or check the joints and the mass of the body"


@dataclass(frozen=True)
class RigidNode:
    """A rigid body as a frame at its centre of mass.

    Args:
        name: Name of the body.
        center: Its centre of mass, shape (3,), m.
        directors: Directors as rows, shape (3, 3).
        mass: Mass, kg.
        euler: Euler's inertia tensor `int rho y y dV` about the centre along the directors, kg m^2.
        size: Size of the body, m.
        slowing: Rate of its damping in proportion to the mass, 1/s.
    """

    name: str
    center: Floats
    directors: Floats
    mass: float
    euler: Floats
    size: float
    slowing: float = 0.0


def ground_node() -> RigidNode:
    """Ground: a frame at the origin that stays there."""
    return RigidNode(GROUND, np.zeros(3), np.eye(3), 0.0, np.zeros((3, 3)), 1.0)


def rigid_node(body: RigidBody, length: float) -> RigidNode:
    """A rigid body of a scene of some length, m."""
    slowing = body.mass_damping
    inertia = body.mass, body.euler_tensor
    return RigidNode(body.name, body.center, body.axes.T, *inertia, length, slowing)


class RigidBodies(FrameBody):
    """The rigid bodies.

    Args:
        scale: Communicator and sizes.
        bodies: The bodies, the same on all ranks; ground is held.
        dynamic: Whether they move in time, and so have inertia.
        gravity: Loads of gravity with the names of the bodies each acts on.
    """

    def __init__(
        self,
        scale: Scale,
        bodies: Sequence[RigidNode],
        dynamic: bool,
        gravity: Sequence[tuple[Gravity, frozenset[str]]],
    ) -> None:
        self.bodies = list(bodies)
        self.node_mesh: NodeMesh = node_mesh(scale.comm, len(self.bodies))
        mixed = node_space(self.node_mesh, {"u": 3, "w": 9, "lam": 6})
        frames = self._constant([b.directors.ravel() for b in bodies], "D")
        super().__init__(
            NAME,
            mixed,
            frames,
            frames.function_space.dofmap.list[:, 0],
            self._constant([b.center for b in bodies], "X"),
            ufl.dx(self.node_mesh.mesh),
            # its multipliers are moments, whatever the unit of length
            fem.Constant(self.node_mesh.mesh, scale.couple),
        )
        self.parts = (
            PartScale("u", "displacement of the rigid bodies", scale.length, _ADVICE),
            PartScale("w", "directors of the rigid bodies", 1.0, _ADVICE),
            PartScale("lam", "director multipliers of the rigid bodies", 1e-3, _ADVICE, idle=True),
        )
        self.index = {b.name: k for k, b in enumerate(self.bodies)}
        self._gravity = list(gravity)
        self._mass = self._constant([np.array([b.mass]) for b in bodies], "m")
        if dynamic:
            euler = self._constant(
                [np.array([b.euler[k, m] for k, m in PAIRS]) for b in bodies], "J"
            )
            mass = FrameMass(self._mass, J=tuple(euler[k] for k in range(6)))
            self.masses = ((mass, self.nodes),)
        self._slowing: fem.Function | None = None
        if dynamic and any(b.slowing for b in bodies):
            self._slowing = self._constant([np.array([b.slowing]) for b in bodies], "slowing")
        if GROUND in self.index:
            dofs = np.concatenate([self.local(GROUND, part) for part in ("u", "w", "lam")])
            zeros = np.zeros(len(dofs))
            self.fixed.append(FixedDofs(dofs, lambda t: zeros, False))

    def _constant(self, rows: Sequence[Floats] | Floats, name: str) -> fem.Function:
        return constant_vector(self.node_mesh, np.array(rows, dtype=float), name)

    def pieces(self) -> Iterator[Bools]:
        """The node of each body."""
        for item in range(len(self.bodies)):
            yield (self.node_mesh.item == item)[:, None, None]

    def local(self, body: str, part: str) -> Dofs:
        """Local dofs (owned and ghost) of a part of a rigid body."""
        here = self.node_mesh.item == self.index[body]
        return self.mixed.dofs[part].reshape(-1, self.mixed.parts[part][1])[here].ravel()

    def node_positions(self) -> Floats:
        """Centres of mass of the bodies of the local nodes (owned and ghost), shape (n, 3), m."""
        return np.array([b.center for b in self.bodies]).reshape(-1, 3)[self.node_mesh.item]

    def node_directors(self) -> Floats:
        """Their directors, shape (n, 3, 3)."""
        return np.array([b.directors for b in self.bodies]).reshape(-1, 3, 3)[self.node_mesh.item]

    def ends(self) -> dict[str, End]:
        """The centres of mass as places; collective."""
        found = {part: numbers_of(self.node_mesh, self.mixed, part) for part in ("u", "w")}
        return {
            b.name: End(
                NAME, b.name, {p: n[k] for p, n in found.items()}, b.center, b.directors, b.center
            )
            for k, b in enumerate(self.bodies)
        }

    def loads(self) -> LoadFactors | None:
        """The weight of the bodies."""
        loads = [(load.time, self._weights(load, names)) for load, names in self._gravity]
        return TimedLoads(self.node_mesh.mesh, loads, self._work) if loads else None

    def _weights(self, load: Gravity, names: frozenset[str]) -> fem.Function:
        masses = [body.mass if body.name in names else 0.0 for body in self.bodies]
        return self._constant(np.outer(masses, load.acceleration), "weight")

    def _work(self, weight: Expr, mid: Expr, dq: Expr) -> Form:
        return dead_force(weight, self.layout.part(dq, "u")) * self.nodes

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Damping in proportion to the mass, which bodies in modes have."""
        if self._slowing is None or rates is None:
            return None
        rate, ((mass, measure),) = self._slowing, self.masses
        momentum = self.layout.moved(rates.chord if rates.weighed is None else rates.weighed)
        return -rate * frame.momentum_work(*momentum, mass, *self.layout.moved(dq)) * measure
