"""Everything that files and pictures show: shells, beams, rigid bodies, joints, obstacles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.frames.beam import BeamModel
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.model import Model
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.modal import ModalNodes, modal_members
from shellmb.observers.fields.nodal import NodalValues, Nodes, nodal_values, reference_nodes
from shellmb.observers.files.grid import Gatherer, Grid
from shellmb.observers.files.solids import Solid, body_solid, joined, obstacle_solid
from shellmb.scene import Contact, LinearSection
from shellmb.simulate.simulation import Simulation

# types of cells in VTK
VERTEX, LINE, TRIANGLE = 1, 3, 5

# points closer than this part of the scene are one
SAME = 1e-9

JOINTS, SOLIDS, OBSTACLES = "joints", "solids", "obstacles"


class Drawn(Protocol):
    """Something that is shown.

    Attributes:
        grid: Its grid on rank 0, None elsewhere.
    """

    grid: Grid | None

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Values at the nodes of the grid on rank 0, nothing elsewhere; collective."""
        ...

    def cell_data(self) -> dict[str, Floats]:
        """Values of the cells of the grid."""
        ...


class DrawnMesh:
    """A shell or a beam.

    Args:
        body: The body; the call is collective.
        nodes: Its nodes, where they are no unknowns; None: they are.
    """

    def __init__(self, body: Any, nodes: ModalNodes | None = None) -> None:
        self._body, self._gatherer, self._nodes = body, Gatherer(body), nodes or Nodes(body)
        self.grid = self._gatherer.grid

    def shape(self, displacement: Floats) -> Floats | None:
        """Displacements at all nodes on rank 0 from those of this rank, shape (n, 3)."""
        return self._gatherer.gather(displacement)

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacement, directors and velocity."""
        return _given(_named(self._nodes.now(simulation, self._body.name), simulation), self.shape)

    def cell_data(self) -> dict[str, Floats]:
        """The thickness of a shell, the size of a beam's cross-section, m."""
        assert self.grid is not None
        ones = np.ones(len(self.grid.vtk_types))
        if isinstance(self._body, BeamModel):
            return {"size": self._body.beam.section.size * ones}
        width = 1 + self.grid.vtk_cells[0]
        nodes = self.grid.vtk_cells.reshape(-1, width)[:, 1:]
        # at the middle of each cell: what jumps between cells has no value at their nodes
        middle = self.grid.nodes[nodes].mean(axis=1)
        section = self._body.shell.section
        if isinstance(section, LinearSection) and section.functions:
            return {"thickness": np.asarray(section.at(middle.T).thickness) * ones}
        return {"thickness": self._body.section.sizes.thickness * ones}


class DrawnField(DrawnMesh):
    """A body of the user's own."""

    def cell_data(self) -> dict[str, Floats]:
        """Nothing: it has no section."""
        return {}


class DrawnRigid:
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
        bodies: list[int] = []
        lines: list[tuple[int, int]] = []
        centers: list[int] = []
        for name, points in named.items():
            k = rigid.index[name]
            first = len(nodes)
            own = _different([rigid.bodies[k].center, *points], SAME * model.length)
            nodes += own
            bodies += [k] * len(own)
            centers.append(first)
            lines += [(first, first + n) for n in range(1, len(own))]
        self._bodies = np.array(bodies, dtype=np.int32)
        arms = np.array(nodes) - np.array([rigid.bodies[k].center for k in bodies])
        axes = np.array([rigid.bodies[k].directors for k in bodies])
        self._offsets = np.einsum("nki,ni->nk", axes, arms)
        self._cell_bodies = np.array(
            [*(bodies[c] for c in centers), *(bodies[b] for _, b in lines)]
        )
        self.grid: Grid | None = None
        if model.comm.rank == 0:
            self.grid = _line_grid(rigid.name, np.array(nodes), lines, centers)
            names = {rigid.index[name]: name for name in named}
            self.grid = replace(self.grid, labels=tuple(names[k] for k in bodies))

    def everywhere(self, values: NodalValues) -> NodalValues:
        """Values at the nodes of all bodies on every rank; collective."""
        count, item = len(self._rigid.bodies), self._rigid.node_mesh.item
        X, D = (
            np.array([getattr(b, k) for b in self._rigid.bodies]) for k in ("center", "directors")
        )
        sums = np.zeros((2, count, 12))
        sums[0][item] = _rows(values.displacement, values.directors - values.reference_directors)
        sums[1][item] = _rows(values.velocity, values.director_velocity)
        self._comm.Allreduce(MPI.IN_PLACE, sums)
        (u, w), (v, dw) = ((s[:, :3], s[:, 3:].reshape(-1, 3, 3)) for s in sums)
        return NodalValues(X, u, D, D + w, v, dw)

    def points(self, values: NodalValues) -> NodalValues:
        """Values at the nodes of the grid from those at the bodies of this rank; collective."""
        return self.everywhere(values).take(self._bodies).at(self._offsets)

    def shape(self, change: Floats) -> Floats | None:
        """Displacements of the nodes of the grid from `u` and `w` of the bodies of this rank.

        Args:
            change: Both, shape (n, 12).
        """
        X, D = reference_nodes(self._rigid)
        zero, still = np.zeros_like(X), np.zeros_like(D)
        turned = D + change[:, 3:].reshape(-1, 3, 3)
        values = self.points(NodalValues(X, change[:, :3], D, turned, zero, still))
        return values.displacement if self._comm.rank == 0 else None

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacement, directors and velocity."""
        values = self.points(nodal_values(simulation, self._rigid.name))
        return _named(values, simulation) if self._comm.rank == 0 else {}

    def cell_data(self) -> dict[str, Floats]:
        """Number of the body in the scene."""
        return {"body": self._cell_bodies.astype(float)}


class DrawnRigidMesh:
    """A shell or a beam that is declared rigid: its mesh moves with the rigid body.

    Args:
        bodies: The rigid bodies.
        rigid: The same as unknowns.
        body: The shell or beam; the call is collective.
    """

    def __init__(
        self, bodies: DrawnRigid, rigid: RigidBodies, body: ShellModel | BeamModel
    ) -> None:
        self._bodies, self._rigid, self._mesh = bodies, rigid, DrawnMesh(body)
        self.grid = self._mesh.grid
        number = rigid.index[body.name]
        node, X = rigid.bodies[number], body.mixed.nodes("u")
        self._offsets = (X - node.center) @ node.directors.T
        self._numbers = np.full(len(X), number, dtype=np.int32)

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacement, directors of the body, and velocity."""
        everywhere = self._bodies.everywhere(nodal_values(simulation, self._rigid.name))
        values = everywhere.take(self._numbers).at(self._offsets)
        return _given(_named(values, simulation), self._mesh.shape)

    def cell_data(self) -> dict[str, Floats]:
        """The thickness of a shell, the size of a beam's cross-section, m."""
        return self._mesh.cell_data()


class DrawnSolids:
    """Surfaces that move with rigid bodies, or stay where they are.

    Args:
        model: The model; the call is collective.
        name: Name of the grid.
        solids: The surfaces, at least one.
        bodies: The rigid bodies; None where no surface moves.
    """

    def __init__(
        self, model: Model, name: str, solids: Sequence[Solid], bodies: DrawnRigid | None
    ) -> None:
        self._model, self._bodies = model, bodies
        self._nodes, triangles = joined(solids)
        counts = [len(s.points) for s in solids]
        index = model.rigid.index if model.rigid is not None else {}
        owners = [-1 if s.body is None else index[s.body] for s in solids]
        self._owners = np.repeat(np.array(owners, dtype=np.int32), counts)
        self._moved = self._owners >= 0
        if bodies is not None:
            assert model.rigid is not None
            nodes = [model.rigid.bodies[k] for k in self._owners[self._moved]]
            arms = self._nodes[self._moved] - np.array([n.center for n in nodes]).reshape(-1, 3)
            axes = np.array([n.directors for n in nodes]).reshape(-1, 3, 3)
            self._offsets = np.einsum("nki,ni->nk", axes, arms)
        self.grid: Grid | None = None
        if model.comm.rank == 0:
            cells = np.insert(triangles, 0, 3, axis=1).ravel()
            labels = np.repeat([s.label for s in solids], counts).tolist()
            types = np.full(len(triangles), TRIANGLE, dtype=np.uint8)
            self.grid = Grid(name, self._nodes, cells, types, faces=triangles, labels=tuple(labels))

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacement."""
        displacement = np.zeros_like(self._nodes)
        if self._bodies is not None:
            assert self._model.rigid is not None
            values = nodal_values(simulation, self._model.rigid.name)
            points = self._bodies.everywhere(values).take(self._owners[self._moved])
            displacement[self._moved] = points.at(self._offsets).displacement
        return {"displacement": displacement} if self._model.comm.rank == 0 else {}

    def cell_data(self) -> dict[str, Floats]:
        """Nothing beside the names of the corners."""
        return {}


class DrawnJoints:
    """All joints: a ring at each end, and a line between ends that are apart.

    Args:
        model: The model, with at least one joint.
        name: Name of the grid.
    """

    def __init__(self, model: Model, name: str) -> None:
        self._groups, self._comm = model.mechanism.groups, model.comm
        self._number = {joint: k for k, joint in enumerate(model.mechanism.joints)}
        self._joints = joints = list(model.mechanism.joints.values())
        # a weld to a shell has its ends the other way round; here the second body's end is second
        self._swapped = [j.ends[0].owner == j.joint.second for j in joints]
        ends = [j.ends[::-1] if s else j.ends for j, s in zip(joints, self._swapped, strict=True)]
        nodes = np.array([end.point for pair in ends for end in pair])
        apart = np.linalg.norm(nodes[0::2] - nodes[1::2], axis=1) > SAME * model.length
        lines = [(2 * k, 2 * k + 1) for k in np.flatnonzero(apart).tolist()]
        dots = list(range(len(nodes)))
        self._cells = np.array([*(k // 2 for k in dots), *(k // 2 for k, _ in lines)])
        self._nodes = nodes
        self.grid: Grid | None = None
        if model.comm.rank == 0:
            self.grid = _line_grid(name, nodes, lines, dots)
            names = [each for name in model.mechanism.joints for each in (name, name)]
            self.grid = replace(self.grid, labels=tuple(names))

    def fields(self, simulation: Simulation) -> dict[str, Floats]:
        """Displacements of both ends of each joint."""
        found = np.zeros((len(self._number), 2, 3))
        for group in self._groups:
            q = np.asarray(simulation.problem.state(group.name).x.array)
            for which, place in enumerate(group.ends):
                moved = q[group.mixed.dofs[f"u{place.tag}"]].reshape(-1, 3).copy()
                if place.turns:
                    w = q[group.mixed.dofs[f"w{place.tag}"]].reshape(-1, place.count, 3)
                    offsets = np.array([place.ends[k].offset for k in group.nodes.item])
                    moved += np.einsum("nk,nki->ni", offsets.reshape(-1, place.count), w)
                for row, item in enumerate(group.nodes.item):
                    k = self._number[group.joints[item].joint.name]
                    if group.joints[item] is not self._joints[k]:
                        # a weld along a region is shown at its first node
                        continue
                    found[k, 1 - which if self._swapped[k] else which] = moved[row]
        self._comm.Allreduce(MPI.IN_PLACE, found)
        return {"displacement": found.reshape(-1, 3)} if self._comm.rank == 0 else {}

    def cell_data(self) -> dict[str, Floats]:
        """Number of the joint in the scene."""
        return {"joint": self._cells.astype(float)}


def drawn_bodies(model: Model) -> dict[str, DrawnMesh | DrawnRigid]:
    """Shells, beams and rigid bodies as they are shown; collective."""
    found: dict[str, DrawnMesh | DrawnRigid] = {n: DrawnMesh(b) for n, b in model.meshed.items()}
    found |= {n: DrawnField(b) for n, b in model.own.items()}
    for name, data in modal_members(model).items():
        found[name] = DrawnMesh(data.members[name].body, ModalNodes(model, name))
    if model.rigid is not None and model.scene.rigid_bodies:
        found[model.rigid.name] = DrawnRigid(model, model.rigid)
    return found


def drawn_parts(model: Model) -> dict[str, Drawn]:
    """Everything that is shown of a model, by name; collective."""
    bodies = drawn_bodies(model)
    found: dict[str, Drawn] = {**bodies}
    if model.rigid is not None and model.rigid_meshes:
        own = bodies[model.rigid.name]
        assert isinstance(own, DrawnRigid)
        for name, mesh in model.rigid_meshes.items():
            found[name] = DrawnRigidMesh(own, model.rigid, mesh)
    if solids := [body_solid(b) for b in model.scene.rigid_bodies if b.shape is not None]:
        # bodies of the scene have their nodes among the rigid bodies
        assert model.rigid is not None
        own = bodies[model.rigid.name]
        assert isinstance(own, DrawnRigid)
        found[SOLIDS] = DrawnSolids(model, SOLIDS, solids, own)
    if model.mechanism.joints:
        found[JOINTS] = DrawnJoints(model, JOINTS)
    # those of the scene are gone where a shell or beam is rigid
    contacts = [group.item for group in model.potentials if isinstance(group.item, Contact)]
    middle, size = _middle(model, bodies) if contacts else (np.zeros(3), 0.0)
    near = [obstacle_solid(c, middle, size) for c in contacts]
    if shown := [solid for solid in near if solid is not None]:
        moves = any(solid.body is not None for solid in shown)
        carrier = bodies[model.rigid.name] if moves and model.rigid is not None else None
        assert carrier is None or isinstance(carrier, DrawnRigid)
        found[OBSTACLES] = DrawnSolids(model, OBSTACLES, shown, carrier)
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


def _rows(vectors: Floats, triples: Floats) -> Floats:
    return np.concatenate([vectors, triples.reshape(-1, 9)], axis=1)


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


def _given(fields: dict[str, Floats], gather) -> dict[str, Floats]:  # type: ignore[no-untyped-def]
    """Fields gathered, without those that this rank is not given."""
    gathered = {key: gather(values) for key, values in fields.items()}
    return {key: values for key, values in gathered.items() if values is not None}


def _different(points: Sequence[Floats], tolerance: float) -> list[Floats]:
    """Points without repetitions, in their order."""
    kept: list[Floats] = []
    for point in points:
        if all(float(np.linalg.norm(point - other)) > tolerance for other in kept):
            kept.append(point)
    return kept


def _line_grid(
    name: str,
    nodes: Floats,
    lines: list[tuple[int, int]],
    dots: list[int],
) -> Grid:
    """A grid of marked nodes and segments."""
    pairs = np.array(lines, dtype=np.int64).reshape(-1, 2)
    marks = np.array(dots, dtype=np.int64)
    cells = [*([1, d] for d in dots), *([2, *line] for line in lines)]
    types = [VERTEX] * len(dots) + [LINE] * len(lines)
    return Grid(
        name,
        nodes,
        np.array([n for cell in cells for n in cell], dtype=np.int64),
        np.array(types, dtype=np.uint8),
        lines=pairs,
        dots=marks,
    )
