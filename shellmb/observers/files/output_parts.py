"""Everything that files and pictures show: shells, beams, rigid bodies, joints, and solids.

Those are shapes of rigid bodies and of obstacles as surfaces.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.files.meshio_files import read_meshio
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.locations.ends import frame_about
from shellmb.model.model import Model
from shellmb.observers.fields.modal import ModalNodes, modal_members
from shellmb.observers.fields.nodal import NodalValues, Nodes, nodal_values, state
from shellmb.observers.files.gridfiles import Gatherer, Grid
from shellmb.observers.forces.joints import joints_of
from shellmb.observers.forces.locations import Places
from shellmb.scene import Ball, Box, Contact, Plane, RigidBody, Rod
from shellmb.scene.lookup import by_kind, said
from shellmb.simulate.simulation import Simulation

# types of cells in VTK
VERTEX, LINE, TRIANGLE = 1, 3, 5

# points closer than this part of the scene are one
SAME = 1e-9

JOINTS, SOLIDS, OBSTACLES = "joints", "solids", "obstacles"

# the nodes of a mark, or of a line
type Cell = tuple[int, ...]


@dataclass(frozen=True)
class Drawn:
    """Something that is shown.

    Args:
        grid: Its grid on rank 0, None elsewhere.
        fields: Values at the nodes of the grid on rank 0, nothing elsewhere; collective.
        cells: Values of the cells of the grid.
        gather: Brings values at the nodes of this rank to those of the grid on rank 0; of rigid
            bodies `u` and `w`, shape (n, 12), of which it makes displacements.
    """

    grid: Grid | None
    fields: Callable[[Simulation], dict[str, Floats]]
    cells: dict[str, Floats] = field(default_factory=dict)
    gather: Callable[[Floats], Floats | None] = np.asarray


def drawn_mesh(body: Any, nodes: ModalNodes | FixedPoints | None = None) -> Drawn:
    """A shell or a beam, or a body of the user's own: displacement, directors and velocity.

    Args:
        body: The body; the call is collective.
        nodes: Its nodes, where they are no unknowns; None: they are.
    """
    gatherer, own = Gatherer(body), nodes or Nodes(body)

    def fields(simulation: Simulation) -> dict[str, Floats]:
        values = _named(own.now(simulation), simulation)
        gathered = {key: gatherer.gather(v) for key, v in values.items()}
        return {key: v for key, v in gathered.items() if v is not None}

    return Drawn(gatherer.grid, fields, _sizes(body, gatherer.grid), gatherer.gather)


def _sizes(body: Any, grid: Grid | None) -> dict[str, Floats]:
    """The thickness of a shell, the size of a beam's cross-section, m."""
    if grid is None or body.sizes_at is None:
        return {}
    ones = np.ones(len(grid.vtk_types))
    nodes = grid.vtk_cells.reshape(len(ones), -1)[:, 1:]
    # at the middle of each cell: what jumps between cells has no value at their nodes
    middle = grid.nodes[nodes].mean(axis=1)
    return {name: size * ones for name, size in body.sizes_at(middle.T).items()}


class FixedPoints:
    """Points that move with rigid bodies, or stay where they are.

    Args:
        model: The model.
        x: Reference positions, shape (n, 3), m.
        owners: Numbers of their bodies, shape (n,); -1: none.
    """

    def __init__(self, model: Model, x: Floats, owners: Sequence[int]) -> None:
        self._model, self._owners = model, np.array(owners, dtype=np.int32)
        bodies = [] if model.rigid is None else model.rigid.bodies
        # behind all bodies one that stays
        self._X = np.array([*(b.center for b in bodies), np.zeros(3)])
        self._D = np.array([*(b.axes.T for b in bodies), np.eye(3)])
        arms = x - self._X[self._owners]
        self._offsets = np.einsum("nki,ni->nk", self._D[self._owners], arms)

    def at(self, values: NodalValues) -> NodalValues:
        """Values at the points from those at the bodies of this rank; collective."""
        assert self._model.rigid is not None
        item = self._model.rigid.node_mesh.item
        # of states and of velocities: of each body a place, and its directors
        changes = np.zeros((2, len(self._D), 4, 3))
        changes[0, item, 0] = values.displacement
        changes[0, item, 1:] = values.directors - values.reference_directors
        changes[1, item, 0], changes[1, item, 1:] = values.velocity, values.director_velocity
        self._model.comm.Allreduce(MPI.IN_PLACE, changes)
        (u, w), (v, dw) = ((c[:, 0], c[:, 1:]) for c in changes)
        every = NodalValues(self._X, u, self._D, self._D + w, v, dw)
        return every.take(self._owners).at(self._offsets)

    def now(self, simulation: Simulation) -> NodalValues:
        """Values at the points between two steps; collective."""
        assert self._model.rigid is not None
        return self.at(nodal_values(simulation, self._model.rigid.name))


def drawn_rigid(model: Model, rigid: RigidBodies) -> Drawn:
    """All rigid bodies: lines from the centre of mass to the points of each, with their numbers.

    Args:
        model: The model.
        rigid: Its rigid bodies.
    """
    named = {b.name: [b.place(p) for p in b.point_names] for b in model.scene.rigid_bodies}
    for joint in model.mechanism.joints.values():
        for end in joint.ends:
            if end.owner in named:
                named[end.owner].append(end.point)
    nodes, names, dots, lines = list[Floats](), list[str](), list[Cell](), list[Cell]()
    for name, points in named.items():
        first, center = len(nodes), rigid.bodies[rigid.index[name]].center
        own = _different([center, *points], SAME * model.length)
        nodes += own
        names += [name] * len(own)
        dots.append((first,))
        lines += [(first, first + n) for n in range(1, len(own))]
    bodies = [rigid.index[name] for name in names]
    moving, first_rank = FixedPoints(model, np.array(nodes), bodies), model.comm.rank == 0

    def displaced(change: Floats) -> Floats | None:
        X, D = rigid.node_positions(), rigid.node_directors()
        zero, still = np.zeros_like(X), np.zeros_like(D)
        turned = D + change[:, 3:].reshape(-1, 3, 3)
        values = moving.at(NodalValues(X, change[:, :3], D, turned, zero, still))
        return values.displacement if first_rank else None

    def fields(simulation: Simulation) -> dict[str, Floats]:
        values = moving.now(simulation)
        return _named(values, simulation) if first_rank else {}

    cells = dots + lines
    grid = _line_grid(model, rigid.name, np.array(nodes), cells, names)
    return Drawn(grid, fields, {"body": np.array([bodies[c[-1]] for c in cells], float)}, displaced)


def drawn_solids(model: Model, name: str, solids: Sequence[Solid]) -> Drawn:
    """Surfaces that move with rigid bodies, or stay where they are.

    Args:
        model: The model; the call is collective.
        name: Name of the grid.
        solids: The surfaces, at least one.
    """
    x, triangles = joined(solids)
    counts = [len(s.points) for s in solids]
    index = {None: -1} | ({} if model.rigid is None else dict(model.rigid.index))
    owners = np.repeat([index[s.body] for s in solids], counts).tolist()
    points, first_rank = FixedPoints(model, x, owners), model.comm.rank == 0
    moves = max(owners) >= 0
    cells = np.insert(triangles, 0, 3, axis=1).ravel()
    labels = np.repeat([s.label for s in solids], counts).tolist()
    types = np.full(len(triangles), TRIANGLE, dtype=np.uint8)

    def fields(simulation: Simulation) -> dict[str, Floats]:
        u = points.now(simulation).displacement if moves else np.zeros_like(x)
        return {"displacement": u} if first_rank else {}

    return Drawn(Grid(name, x, cells, types, tuple(labels)) if first_rank else None, fields)


def drawn_joints(model: Model, name: str) -> Drawn:
    """All joints: a ring at each end, and a line between ends that are apart, with their numbers.

    Args:
        model: The model, with at least one joint.
        name: Name of the grid.
    """
    known = model.mechanism.joints
    number = {joint: k for k, joint in enumerate(known)}
    # a weld to a shell has its ends the other way round; here the second body's end is second
    swapped = [j.ends[0].owner == j.joint.second for j in known.values()]
    ends = zip(known.values(), swapped, strict=True)
    nodes = np.array([e.point for j, s in ends for e in (j.ends[::-1] if s else j.ends)])
    apart = np.linalg.norm(nodes[0::2] - nodes[1::2], axis=1) > SAME * model.length
    cells: list[Cell] = [(k,) for k in range(len(nodes))]
    cells += [(2 * k, 2 * k + 1) for k in np.flatnonzero(apart).tolist()]
    # nodes of the grid, and what they are of a group
    places: list[tuple[str, list[int], Places]] = []
    for group in model.mechanism.groups:
        # a weld along a region is shown at its first node
        here = [(c, j) for c, j in joints_of(group) if j is known[j.joint.name]]
        shown = [number[j.joint.name] for _, j in here]
        for which in range(2) if here else ():
            rows = [2 * k + (1 - which if swapped[k] else which) for k in shown]
            places.append((group.name, rows, Places(group, which, *zip(*here, strict=True))))

    def fields(simulation: Simulation) -> dict[str, Floats]:
        found = np.zeros((len(nodes), 3))
        for group, rows, place in places:
            # ends of joints at changes of states are changes of ends
            found[rows] = place.points(state(simulation, group), 0.0)
        model.comm.Allreduce(MPI.IN_PLACE, found)
        return {"displacement": found} if model.comm.rank == 0 else {}

    grid = _line_grid(model, name, nodes, cells, [name for name in known for _ in range(2)])
    return Drawn(grid, fields, {"joint": np.array([cell[0] // 2 for cell in cells], float)})


def drawn_bodies(model: Model) -> dict[str, Drawn]:
    """Shells, beams and rigid bodies as they are shown; collective."""
    found = {name: drawn_mesh(body) for name, body in {**model.meshed, **model.own}.items()}
    for name, data in modal_members(model).items():
        found[name] = drawn_mesh(data.members[name].body, ModalNodes(model, name))
    if model.rigid is not None and model.scene.rigid_bodies:
        found[model.rigid.name] = drawn_rigid(model, model.rigid)
    return found


def drawn_parts(model: Model) -> dict[str, Drawn]:
    """Everything that is shown of a model, by name; collective."""
    found = drawn_bodies(model)
    # those of the scene are gone where a shell or beam is rigid
    contacts = [group.item for group in model.contacts]
    middle, size = _middle(model, found) if contacts else (np.zeros(3), 0.0)
    for name, mesh in model.rigid_meshes.items():
        assert model.rigid is not None
        X = mesh.mixed.nodes("u")
        moving = FixedPoints(model, X, [model.rigid.index[name]] * len(X))
        found[name] = drawn_mesh(mesh, moving)
    if solids := [body_solid(b) for b in model.scene.rigid_bodies if b.shape is not None]:
        found[SOLIDS] = drawn_solids(model, SOLIDS, solids)
    if model.mechanism.joints:
        found[JOINTS] = drawn_joints(model, JOINTS)
    near = [obstacle_solid(c, middle, size) for c in contacts]
    if shown := [solid for solid in near if solid is not None]:
        found[OBSTACLES] = drawn_solids(model, OBSTACLES, shown)
    return found


def _middle(model: Model, parts: Mapping[str, Drawn]) -> tuple[Floats, float]:
    """The middle of all bodies in the reference, shape (3,), and the diagonal around them, m."""
    nodes = [part.grid.nodes for part in parts.values() if part.grid is not None]
    found = None
    if model.comm.rank == 0:
        low, high = np.concatenate(nodes).min(axis=0), np.concatenate(nodes).max(axis=0)
        found = (low + high) / 2, float(np.linalg.norm(high - low)) or model.length
    middle, size = model.comm.bcast(found)
    return middle, size


def _named(values: NodalValues, simulation: Simulation) -> dict[str, Floats]:
    """Values by their names in files."""
    fields = {"displacement": values.displacement}
    if values.directors.shape[1] == 1:
        fields["director"] = values.director
    else:
        fields |= {f"d{k + 1}": d for k, d in enumerate(values.directors.swapaxes(0, 1))}
    if simulation.scheme.dynamic:
        fields["velocity"] = values.velocity
        names = [key for key in fields if key not in ("displacement", "velocity")]
        for k, key in enumerate(names):
            fields[f"{key}_velocity"] = values.director_velocity[:, k]
    return fields


def _different(points: Sequence[Floats], tolerance: float) -> list[Floats]:
    """Points without repetitions, in their order."""
    kept: list[Floats] = []
    for point in points:
        if all(float(np.linalg.norm(point - other)) > tolerance for other in kept):
            kept.append(point)
    return kept


def _line_grid(
    model: Model, name: str, nodes: Floats, cells: Sequence[Cell], labels: Sequence[str]
) -> Grid | None:
    """A grid of marked nodes and segments, on rank 0."""
    if model.comm.rank:
        return None
    flat = np.array([n for cell in cells for n in (len(cell), *cell)], dtype=np.int64)
    types = np.array([VERTEX if len(cell) == 1 else LINE for cell in cells], dtype=np.uint8)
    return Grid(name, nodes, flat, types, tuple(labels))


# pieces around a circle, and along half of it
AROUND = 32
# a side of no length is drawn so thin, parts of the longest one
THIN = 1e-3
# planes and rods reach so far, parts of the scene
REACH = 1.2
# two triangles of four corners
HALVES = ((0, 1, 2), (0, 2, 3))


class Solid(NamedTuple):
    """A surface of triangles in the reference.

    Args:
        label: Name of the body, or of the contact whose obstacle it is.
        points: Corners, shape (n, 3), m.
        triangles: Numbers of corners, shape (f, 3).
        body: Name of the rigid body that it moves with; None: it is fixed in space.
    """

    label: str
    points: Floats
    triangles: Ints
    body: str | None = None


def body_solid(body: RigidBody) -> Solid:
    """The shape of a rigid body.

    Args:
        body: The body, whose `shape` is not None.

    Raises:
        SceneError: If its file is no surface.
    """
    shape = body.shape
    if isinstance(shape, Path):
        found = read_meshio(shape, said(body))
        corners = [nodes for nodes in found.cells if len(nodes) == 3]
        if not corners:
            raise SceneError(f"{said(body)}: {shape} has no triangles; its shape must be a surface")
        # each triangle has corners of its own: edges stay sharp
        local, triangles = _apart(found.x[np.array(corners)])
        return Solid(
            body.name, np.asarray(body.position) + local @ body.axes.T, triangles, body.name
        )
    if isinstance(shape, tuple):
        turned, (local, triangles) = np.eye(3), _box(np.array(shape, dtype=float))
    else:
        # int rho y y^T: of a box m a^2 / 12 along each side, of a rod m r^2 / 4 across
        moments, turned = np.linalg.eigh(body.euler_tensor)
        squares = np.maximum(moments, 0.0) / body.mass
        others = (squares.sum() - squares) / 2
        along = int(np.argmax(np.abs(squares - others)))
        if shape == "box":
            local, triangles = _box(np.sqrt(12 * squares))
        else:
            local, triangles = _rod(2 * np.sqrt(others[along]), np.sqrt(12 * squares[along]))
            turned = turned[:, [(along + 1) % 3, (along + 2) % 3, along]]
        turned = turned * np.sign(np.linalg.det(turned))
    return Solid(body.name, body.center + local @ turned.T @ body.axes.T, triangles, body.name)


def obstacle_solid(contact: Contact, centre: Floats, size: float) -> Solid | None:
    """The obstacle of a contact near the scene; None where it has no shape here.

    Args:
        contact: The contact.
        centre: The middle of the scene, shape (3,), m.
        size: Size of the scene, m.
    """
    shape = by_kind(_OBSTACLES, contact.obstacle)
    if shape is None:
        return None
    corners, triangles = shape(contact.obstacle, centre, REACH * size / 2)
    return Solid(contact.name, corners, triangles, contact.obstacle_body)


def _ball(ball: Ball, *_: Any) -> tuple[Floats, Ints]:
    local, triangles = _revolved(*_arc(ball.radius))
    return np.asarray(ball.center) + local, triangles


def _block(box: Box, *_: Any) -> tuple[Floats, Ints]:
    local, triangles = _box(np.array(box.size))
    return np.asarray(box.center) + local @ box.axes, triangles


def _plane(plane: Plane, centre: Floats, half: float) -> tuple[Floats, Ints]:
    frame = frame_about(plane.normal)
    # the foot of the scene's middle
    foot = centre - np.outer(frame[2], frame[2]) @ (centre - np.asarray(plane.point))
    local = half * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    return foot + local @ frame, np.array(HALVES)


def _shaft(rod: Rod, centre: Floats, half: float) -> tuple[Floats, Ints]:
    frame, point = frame_about(rod.axis), np.asarray(rod.point)
    foot = point + np.outer(frame[2], frame[2]) @ (centre - point)
    local, triangles = _revolved(np.array([rod.radius, rod.radius]), np.array([-half, half]))
    return foot + local @ frame, triangles


_OBSTACLES: dict[type, Any] = {Ball: _ball, Box: _block, Plane: _plane, Rod: _shaft}


def joined(solids: Sequence[Solid]) -> tuple[Floats, Ints]:
    """Corners and triangles of several solids as of one.

    Args:
        solids: They.
    """
    first = np.cumsum([0, *(len(s.points) for s in solids[:-1])])
    triangles = [s.triangles + k for s, k in zip(solids, first, strict=True)]
    return np.concatenate([s.points for s in solids]), np.concatenate(triangles)


def _apart(corners: Floats) -> tuple[Floats, Ints]:
    """Pieces (f, k, 3) with corners of their own, in triangles."""
    numbers: Ints = np.arange(corners.shape[0] * corners.shape[1]).reshape(corners.shape[:2])
    if corners.shape[1] == 4:
        numbers = numbers[:, np.array(HALVES)].reshape(-1, 3)
    return corners.reshape(-1, 3), numbers


def _box(sides: Floats) -> tuple[Floats, Ints]:
    """A box about the origin."""
    sides = np.maximum(sides, THIN * sides.max())
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    # x, z around y goes the other way; all turn about the outward normal
    faces = [np.insert(square[:: s * (-1) ** k], k, s, axis=1) for k in range(3) for s in (-1, 1)]
    return _apart(np.array(faces) * sides / 2)


def _rod(radius: float, length: float) -> tuple[Floats, Ints]:
    """A cylinder about the origin along the third axis, with its ends."""
    longest = max(2 * radius, length)
    r, h = max(radius, THIN * longest), max(length, THIN * longest) / 2
    rings = (([0.0, r], [-h, -h]), ([r, r], [-h, h]), ([r, 0.0], [h, h]))
    parts = [Solid("", *_revolved(np.array(a), np.array(z))) for a, z in rings]
    return joined(parts)


def _arc(radius: float) -> tuple[Floats, Floats]:
    angles = np.linspace(-np.pi / 2, np.pi / 2, AROUND // 2 + 1)
    return radius * np.cos(angles), radius * np.sin(angles)


def _revolved(radii: Floats, heights: Floats) -> tuple[Floats, Ints]:
    """A surface of revolution about the third axis by its profile, shape (k,) each."""
    angles = 2 * np.pi * np.arange(AROUND) / AROUND
    circle = np.stack([np.cos(angles), np.sin(angles), np.zeros(AROUND)], axis=1)
    points = radii[:, None, None] * circle + heights[:, None, None] * np.array([0.0, 0.0, 1.0])
    i, j = np.meshgrid(np.arange(len(radii) - 1), np.arange(AROUND), indexing="ij")
    after = (j + 1) % AROUND
    ring, above = i * AROUND, (i + 1) * AROUND
    corners = np.stack([ring + j, ring + after, above + after, above + j], axis=-1).reshape(-1, 4)
    return points.reshape(-1, 3), corners[:, np.array(HALVES)].reshape(-1, 3)
