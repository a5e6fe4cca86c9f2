"""Bodies of a user's own whose field is a displacement: places in a scene like any others."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

from mpi4py import MPI

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Int32s
from shellmb.errors import SceneError
from shellmb.model.body import LoadFactors
from shellmb.model.locations.nodes import ON_NODE, shown
from shellmb.model.massless import timed_loads
from shellmb.model.user_bodies.body import OwnBody
from shellmb.scene import Scene
from shellmb.scene.loads.loads import Gravity


@dataclass(frozen=True)
class FieldMesh:
    """Mesh of a user's body with its names.

    Args:
        name: Name of the body.
        mesh: The mesh.
        points: Position of each named point, shape (3,), m.
        regions: Marks what is in each named region, of coordinates, shape (3, n).
        length: Diagonal of the box around it, m.
    """

    name: str
    mesh: dolfinx.mesh.Mesh
    points: dict[str, Floats]
    regions: Mapping[str, Callable[[Floats], Floats]]
    length: float

    kind: ClassVar[str] = "own body"

    @cached_property
    def vertices(self) -> dict[str, Int32s]:
        """Local index of the vertex at each named point; none on ranks that do not hold it.

        Raises:
            SceneError: If there is none.
        """
        found = {}
        for name, x in self.points.items():

            def marks(at: Floats, x: Floats = x) -> Floats:
                apart = np.linalg.norm(at - x[:, None], axis=0)
                return np.asarray(apart <= ON_NODE * self.length)

            found[name] = dolfinx.mesh.locate_entities(self.mesh, 0, marks)
            if not self.mesh.comm.allreduce(len(found[name])):
                raise SceneError(
                    f"own body '{self.name}': point '{name}' is at {shown(x)}, where its mesh has "
                    "no vertex; it must have one there"
                )
        return found

    def entities(self, names: str | tuple[str, ...], who: str) -> list[tuple[int, Int32s]]:
        """Cells, facets, edges and vertices of regions: dimension and local indices of each.

        Args:
            names: Name or names.
            who: Who asks, for the error.

        Raises:
            SceneError: If a region has nothing in it.
        """
        found = []
        for name in (names,) if isinstance(names, str) else names:
            dim = self.mesh.topology.dim

            def marks(at: Floats, name: str = name) -> Any:
                marked = np.asarray(self.regions[name](at))
                if marked.shape != at.shape[1:]:
                    raise SceneError(
                        f"own body '{self.name}': region '{name}' marks an array of shape "
                        f"{marked.shape} at {at.shape[1]} points; it must mark each of them"
                    )
                return marked.astype(bool)

            here = [(d, dolfinx.mesh.locate_entities(self.mesh, d, marks)) for d in range(dim + 1)]
            if not self.mesh.comm.allreduce(sum(len(which) for _, which in here)):
                raise SceneError(
                    f"{who}: region '{name}' of own body '{self.name}' has no vertex in it; its "
                    "function must mark some"
                )
            found += here
        return found


class PlacedBody(OwnBody):
    """A body of a model whose field is a displacement; made as `OwnBody` is."""

    gravity: tuple[Gravity, ...] = ()

    def __init__(self, name: str, **given: Any) -> None:
        super().__init__(name, **given)
        # its nodes have directors, but none of them
        none: dict[str, Int32s] = {p: np.zeros(0, dtype=np.int32) for p in ("w", "lam")}
        parts = {**self.mixed.parts, **dict.fromkeys(none, (self.mixed.space.value_size, 0))}
        self.mixed = replace(self.mixed, parts=parts, dofs={**self.mixed.dofs, **none})
        self.jump_parts |= none.keys()

    @cached_property
    def domain(self) -> FieldMesh:
        """Mesh with names."""
        x, comm = self.space.mesh.geometry.x, self.space.mesh.comm
        # the lower ends of the box, and those of its opposite
        ends = np.hstack([x, -x]).min(axis=0, initial=np.inf)
        comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
        points = {name: np.asarray(p, dtype=float) for name, p in self.points.items()}
        length = float(np.linalg.norm(ends[:3] + ends[3:]))
        topology = self.space.mesh.topology
        for dim in range(topology.dim + 1):
            topology.create_connectivity(dim, topology.dim)
        return FieldMesh(self.name, self.space.mesh, points, self.regions, length)

    def node_positions(self) -> Floats:
        """Reference positions of the local nodes, shape (n, 3), m."""
        return self.mixed.nodes("u")

    def node_directors(self) -> Floats:
        """There are none, shape (n, 0, 3)."""
        return np.zeros((len(self.mixed.nodes("u")), 0, 3))

    # unit of forces in statics; multipliers are solved for whatever it is
    force_size = 1.0

    @cached_property
    def total_mass(self) -> float:
        """Mass, kg; collective."""
        along = fem.Constant(self.space.mesh, np.eye(3)[0])
        density = None if self._mass is None else self._scalar("mass", self._mass, along, along)
        if density is None:
            return 0.0
        form = fem.form(self._one * density * self.dx)
        return float(self.space.mesh.comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM))

    def momentum(self, v: Expr, axis: Expr) -> Form | None:
        """Component of the linear momentum along `axis`, kg m/s."""
        return self.momentum_along(v, axis)

    def angular_momentum(self, q: Expr, v: Expr, axis: Expr) -> Form | None:
        """Component along `axis` of the angular momentum about the origin, kg m^2/s."""
        x = ufl.SpatialCoordinate(self.space.mesh)
        place = ufl.as_vector([x[k] if k < len(x) else 0 for k in range(3)])
        return self.momentum_along(v, ufl.cross(axis, place + self.field(q)))

    def loads(self) -> LoadFactors | None:
        """Weight of the body."""
        if not self.gravity or self._mass is None:
            return None
        domain, given = self.space.mesh, self.gravity
        loads = [(g.time, fem.Constant(domain, np.array(g.acceleration, float))) for g in given]
        return timed_loads(domain, loads, self._weight)

    def _weight(self, acceleration: fem.Constant, mid: Expr, dq: Expr) -> Form:
        return self.momentum_along(dq, acceleration)  # type: ignore[return-value]


def build_own_bodies(scene: Scene, comm: MPI.Comm) -> tuple[list[OwnBody], dict[str, PlacedBody]]:
    """The bodies of the user's own of a scene, and those with places by name; collective.

    Args:
        scene: The scene.
        comm: Communicator of the model.
    """
    found: list[OwnBody] = []
    placed: dict[str, PlacedBody] = {}
    for described in scene.own_bodies:
        if described.placed:
            body = placed[described.name] = described.again(comm, PlacedBody)
            body.gravity = tuple(w for w in scene.weights if described in scene.bodies_of(w))
        found.append(placed.get(described.name) or described.again(comm, OwnBody))
    return found, placed
