"""Everything that files and pictures show: shells, beams, rigid bodies, joints, obstacles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.frames.beam import BeamModel
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.model import Model
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.modal import ModalNodes, modal_members
from shellmb.observers.fields.nodal import NodalValues, Nodes, nodal_values, state
from shellmb.observers.files.gridfiles import Gatherer, Grid
from shellmb.observers.files.solids import Solid, body_solid, joined, obstacle_solid
from shellmb.observers.forces.joints import joints_of
from shellmb.observers.forces.locations import Places
from shellmb.simulate.simulation import Simulation

# types of cells in VTK
VERTEX, LINE, TRIANGLE = 1, 3, 5

# points closer than this part of the scene are one
SAME = 1e-9

JOINTS, SOLIDS, OBSTACLES = "joints", "solids", "obstacles"


class Drawn:
    """Something that is shown.

    Attributes:
        grid: Its grid on rank 0, None elsewhere.
    """

    grid: Grid | None

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Values at the nodes of the grid on rank 0, nothing elsewhere; collective."""
        raise NotImplementedError

    def cell_data(self) -> dict[str, Floats]:
        """Values of the cells of the grid."""
        return {}


class DrawnMesh(Drawn):
    """A shell or a beam, or a body of the user's own.

    Args:
        body: The body; the call is collective.
        nodes: Its nodes, where they are no unknowns; None: they are.
    """

    def __init__(self, body: Any, nodes: ModalNodes | FixedPoints | None = None) -> None:
        self._body, self._gatherer, self._nodes = body, Gatherer(body), nodes or Nodes(body)
        self.grid = self._gatherer.grid

    def shape(self, displacement: Floats) -> Floats | None:
        """Displacements at all nodes on rank 0 from those of this rank, shape (n, 3)."""
        return self._gatherer.gather(displacement)

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacement, directors and velocity."""
        values = self._nodes.now(simulation)
        gathered = {key: self.shape(v) for key, v in _named(values, simulation).items()}
        return {key: v for key, v in gathered.items() if v is not None}

    def cell_data(self) -> dict[str, Floats]:
        """The thickness of a shell, the size of a beam's cross-section, m."""
        assert self.grid is not None
        if self._body.sizes_at is None:
            return {}
        ones = np.ones(len(self.grid.vtk_types))
        width = 1 + self.grid.vtk_cells[0]
        nodes = self.grid.vtk_cells.reshape(-1, width)[:, 1:]
        # at the middle of each cell: what jumps between cells has no value at their nodes
        middle = self.grid.nodes[nodes].mean(axis=1)
        return {name: size * ones for name, size in self._body.sizes_at(middle.T).items()}


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
        self._D = np.array([*(b.directors for b in bodies), np.eye(3)])
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


class DrawnRigid(Drawn):
    """All rigid bodies: lines from the centre of mass to the points of each.

    Args:
        model: The model.
        rigid: Its rigid bodies.
    """

    def __init__(self, model: Model, rigid: RigidBodies) -> None:
        self._rigid, self._comm = rigid, model.comm
        named = {b.name: [b.place(p) for p in b.point_names] for b in model.scene.rigid_bodies}
        for joint in model.mechanism.joints.values():
            for end in joint.ends:
                if end.owner in named:
                    named[end.owner].append(end.point)
        nodes: list[Floats] = []
        names: list[str] = []
        lines: list[tuple[int, int]] = []
        centers: list[int] = []
        for name, points in named.items():
            first, center = len(nodes), rigid.bodies[rigid.index[name]].center
            own = _different([center, *points], SAME * model.length)
            nodes += own
            names += [name] * len(own)
            centers.append(first)
            lines += [(first, first + n) for n in range(1, len(own))]
        bodies = [rigid.index[name] for name in names]
        self._points = FixedPoints(model, np.array(nodes), bodies)
        self._cells = np.array([bodies[k] for k in (*centers, *(b for _, b in lines))], float)
        self.grid = _line_grid(model, rigid.name, np.array(nodes), lines, centers, names)

    def shape(self, change: Floats) -> Floats | None:
        """Displacements of the nodes of the grid from `u` and `w` of the bodies of this rank.

        Args:
            change: Both, shape (n, 12).
        """
        X, D = self._rigid.node_positions(), self._rigid.node_directors()
        zero, still = np.zeros_like(X), np.zeros_like(D)
        turned = D + change[:, 3:].reshape(-1, 3, 3)
        values = self._points.at(NodalValues(X, change[:, :3], D, turned, zero, still))
        return values.displacement if self._comm.rank == 0 else None

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacement, directors and velocity."""
        values = self._points.now(simulation)
        return _named(values, simulation) if self._comm.rank == 0 else {}

    def cell_data(self) -> dict[str, Floats]:
        """Number of the body in the scene."""
        return {"body": self._cells}


class DrawnRigidMesh(DrawnMesh):
    """A shell or a beam that is declared rigid: its mesh moves with the rigid body.

    Args:
        model: The model.
        body: The shell or beam; the call is collective.
    """

    def __init__(self, model: Model, body: ShellModel | BeamModel) -> None:
        assert model.rigid is not None
        X = body.mixed.nodes("u")
        super().__init__(body, FixedPoints(model, X, [model.rigid.index[body.name]] * len(X)))


class DrawnSolids(Drawn):
    """Surfaces that move with rigid bodies, or stay where they are.

    Args:
        model: The model; the call is collective.
        name: Name of the grid.
        solids: The surfaces, at least one.
    """

    def __init__(self, model: Model, name: str, solids: Sequence[Solid]) -> None:
        x, triangles = joined(solids)
        counts = [len(s.points) for s in solids]
        index = {None: -1} | ({} if model.rigid is None else dict(model.rigid.index))
        owners = np.repeat([index[s.body] for s in solids], counts).tolist()
        self._points, self._rest = FixedPoints(model, x, owners), np.zeros_like(x)
        self._moves = max(owners) >= 0
        cells = np.insert(triangles, 0, 3, axis=1).ravel()
        labels = np.repeat([s.label for s in solids], counts).tolist()
        types = np.full(len(triangles), TRIANGLE, dtype=np.uint8)
        self.grid = Grid(name, x, cells, types, tuple(labels)) if model.comm.rank == 0 else None

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacement."""
        u = self._points.now(simulation).displacement if self._moves else self._rest
        return {"displacement": u} if self.grid is not None else {}


class DrawnJoints(Drawn):
    """All joints: a ring at each end, and a line between ends that are apart.

    Args:
        model: The model, with at least one joint.
        name: Name of the grid.
    """

    def __init__(self, model: Model, name: str) -> None:
        self._comm, known = model.comm, model.mechanism.joints
        number = {joint: k for k, joint in enumerate(known)}
        # a weld to a shell has its ends the other way round; here the second body's end is second
        swapped = [j.ends[0].owner == j.joint.second for j in known.values()]
        ends = zip(known.values(), swapped, strict=True)
        nodes = np.array([e.point for j, s in ends for e in (j.ends[::-1] if s else j.ends)])
        apart = np.linalg.norm(nodes[0::2] - nodes[1::2], axis=1) > SAME * model.length
        lines = [(2 * k, 2 * k + 1) for k in np.flatnonzero(apart).tolist()]
        self._count, dots = len(nodes), list(range(len(nodes)))
        self._cells = np.array([k // 2 for k in (*dots, *(k for k, _ in lines))], dtype=float)
        names = [name for name in known for _ in range(2)]
        self.grid = _line_grid(model, name, nodes, lines, dots, names)
        # nodes of the grid, and what they are of a group
        self._places: list[tuple[str, list[int], Places]] = []
        for group in model.mechanism.groups:
            # a weld along a region is shown at its first node
            here = [(c, j) for c, j in joints_of(group) if j is known[j.joint.name]]
            shown = [number[j.joint.name] for _, j in here]
            for which in range(2) if here else ():
                rows = [2 * k + (1 - which if swapped[k] else which) for k in shown]
                place = Places(group, which, *zip(*here, strict=True))
                self._places.append((group.name, rows, place))

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacements of both ends of each joint."""
        found = np.zeros((self._count, 3))
        for group, rows, place in self._places:
            # ends of joints at changes of states are changes of ends
            found[rows] = place.points(state(simulation, group), 0.0)
        self._comm.Allreduce(MPI.IN_PLACE, found)
        return {"displacement": found} if self._comm.rank == 0 else {}

    def cell_data(self) -> dict[str, Floats]:
        """Number of the joint in the scene."""
        return {"joint": self._cells}


def drawn_bodies(model: Model) -> dict[str, DrawnMesh | DrawnRigid]:
    """Shells, beams and rigid bodies as they are shown; collective."""
    bodies = {**model.meshed, **model.own}
    found: dict[str, DrawnMesh | DrawnRigid] = {n: DrawnMesh(b) for n, b in bodies.items()}
    for name, data in modal_members(model).items():
        found[name] = DrawnMesh(data.members[name].body, ModalNodes(model, name))
    if model.rigid is not None and model.scene.rigid_bodies:
        found[model.rigid.name] = DrawnRigid(model, model.rigid)
    return found


def drawn_parts(model: Model) -> dict[str, Drawn]:
    """Everything that is shown of a model, by name; collective."""
    found: dict[str, Drawn] = {**drawn_bodies(model)}
    # those of the scene are gone where a shell or beam is rigid
    contacts = [group.item for group in model.contacts]
    middle, size = _middle(model, found) if contacts else (np.zeros(3), 0.0)
    if model.rigid is not None:
        found |= {name: DrawnRigidMesh(model, mesh) for name, mesh in model.rigid_meshes.items()}
    if solids := [body_solid(b) for b in model.scene.rigid_bodies if b.shape is not None]:
        found[SOLIDS] = DrawnSolids(model, SOLIDS, solids)
    if model.mechanism.joints:
        found[JOINTS] = DrawnJoints(model, JOINTS)
    near = [obstacle_solid(c, middle, size) for c in contacts]
    if shown := [solid for solid in near if solid is not None]:
        found[OBSTACLES] = DrawnSolids(model, OBSTACLES, shown)
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
    model: Model,
    name: str,
    nodes: Floats,
    lines: Sequence[tuple[int, int]],
    dots: Sequence[int],
    labels: Sequence[str],
) -> Grid | None:
    """A grid of marked nodes and segments, on rank 0."""
    if model.comm.rank:
        return None
    cells = np.array([n for cell in (*([d] for d in dots), *lines) for n in (len(cell), *cell)])
    types = np.array([VERTEX] * len(dots) + [LINE] * len(lines), dtype=np.uint8)
    return Grid(name, nodes, cells.astype(np.int64), types, tuple(labels))
