"""A surface mesh as plain arrays on one rank: its cells, divided and refined, edges and areas.

Cells divided into others: nodes lie where the cells' maps put them, and those on a side are one.

A pattern has the corners of each part of a cell, in the cell's own coordinates.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import basix
import numpy as np
import numpy.typing as npt

from shellmb.arrays import Bools, Floats, Ints
from shellmb.errors import SceneError, warn
from shellmb.scene.values.user_functions import refusing

type Cell = Literal["quad", "tri"]

CELLS = {"quad": basix.CellType.quadrilateral, "tri": basix.CellType.triangle}
# vertices of the edges of a cell in the order of basix, and so of the nodes in their middles
FACETS = {"quad": ((0, 1), (0, 2), (1, 3), (2, 3)), "tri": ((1, 2), (0, 2), (0, 1))}

# two triangles of a quadrilateral, along one diagonal or the other
HALVES = (
    np.array([[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0)]]),
    np.array([[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]]),
)
# shares of vertices are known as so many parts; the odd shift keeps them away from where rounding
# turns
PARTS, SHIFT = 1e9, 0.318309886
# points along a side of an element at which it is looked whether they are inside
ALONG = 4


@dataclass(frozen=True)
class RawMesh:
    """Nodes and cells of one shell.

    Args:
        x: Positions of the nodes, each used by some cell, shape (n, 3) [m].
        cells: Nodes of each cell in the order of DOLFINx, shape (c, k).
        cell: Cell type.
        order: Order of the geometry, 1 or 2.
        normals: A vector on the positive side of each cell, shape (c, 3).
        edges: The vertices of the facets of each named edge, shape (m, 2).
        points: Node of each named point, a vertex of its cells.
        areas: Numbers of the cells of each named area.
    """

    x: Floats
    cells: Ints
    cell: Cell
    order: int
    normals: Floats
    edges: dict[str, Ints]
    points: dict[str, int]
    areas: dict[str, Ints] = field(default_factory=dict)

    @property
    def vertices(self) -> Ints:
        """Vertices of each cell, shape (c, 3 or 4)."""
        return self.cells[:, : vertex_count(self.cell)]


def vertex_count(cell: Cell) -> int:
    """Number of vertices of a cell; they come first among its nodes."""
    return 4 if cell == "quad" else 3


def facets(cells: Ints, cell: Cell) -> Ints:
    """Vertices of all facets of all cells, smaller number first, shape (c, f, 2)."""
    return np.sort(cells[:, np.array(FACETS[cell])], axis=2)


def ties(pairs: Ints) -> dict[int, set[int]]:
    """Partners of each thing, of pairs of shape (n, 2)."""
    found: dict[int, set[int]] = {}
    for a, b in pairs.tolist():
        found.setdefault(a, set()).add(b)
        found.setdefault(b, set()).add(a)
    return found


def boundary_facets(cells: Ints, cell: Cell) -> tuple[Ints, Ints]:
    """Vertices of the facets that belong to one cell only, shape (m, 2), and these cells."""
    every = facets(cells, cell).reshape(-1, 2)
    unique, first, count = np.unique(every, axis=0, return_index=True, return_counts=True)
    return unique[count == 1], first[count == 1] // len(FACETS[cell])


def cell_cross(corners: Floats) -> Floats:
    """Normal vectors, of any length, in the middle of cells, shape (c, 3).

    Args:
        corners: Positions of the vertices in the order of DOLFINx, shape (c, 3 or 4, 3).
    """
    if corners.shape[1] == 3:
        along = corners[:, 1] - corners[:, 0]
        across = corners[:, 2] - corners[:, 0]
    else:
        along = corners[:, 1] - corners[:, 0] + corners[:, 3] - corners[:, 2]
        across = corners[:, 2] - corners[:, 0] + corners[:, 3] - corners[:, 1]
    return np.cross(along, across)


def geometry_element(cell: Cell, order: int) -> basix.finite_element.FiniteElement:
    """Element of the geometry."""
    variant = basix.LagrangeVariant.equispaced
    return basix.create_element(basix.ElementFamily.P, CELLS[cell], order, variant)


def shape_functions(cell: Cell, order: int, places: Floats) -> Floats:
    """Shape functions of the geometry at places in a cell, shape (places, nodes).

    Args:
        cell: Its type.
        order: Order of the geometry.
        places: Places in the reference cell, shape (places, 2).
    """
    return np.asarray(geometry_element(cell, order).tabulate(0, places))[0, :, :, 0]


def interval_nodes(degree: int) -> Floats:
    """Nodes of lines' elements on [0, 1] from end to end, which are Lobatto's points."""
    variant = basix.LagrangeVariant.gll_warped
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.interval, degree, variant)
    return np.sort(np.asarray(element.points)[:, 0])


def box(x: Floats) -> str:
    """The box around positions, shape (n, 3), as messages have it."""
    ends = zip(x.min(axis=0), x.max(axis=0), strict=True)
    return ", ".join(f"{low:.4g} to {high:.4g}" for low, high in ends)


def shown(point: Floats, size: float) -> str:
    """A position as messages have it, without the round-off of its coordinates.

    Args:
        point: Position, shape (3,).
        size: Size of the mesh.
    """
    return f"({', '.join(f'{v:.4g}' if abs(v) > 1e-9 * size else '0' for v in point)})"


# squares of squares of what lies between have finite reciprocals
SMALLEST, LARGEST = 1e-60, 1e60


def check_extent(sizes: npt.ArrayLike, unit: str, who: str) -> None:
    """Refuse elements whose sizes vanish or overflow when they are multiplied.

    Args:
        sizes: Lengths or areas of elements; zero, of degenerate ones, is for others to judge.
        unit: Their unit.
        who: The body, for the error.

    Raises:
        SceneError: Names the first such size.
    """
    sizes = np.ravel(sizes)
    wrong = sizes[((sizes > 0) & (sizes < SMALLEST)) | (sizes > LARGEST)]
    if len(wrong):
        raise SceneError(
            f"{who}: an element has {wrong[0]:.3g} {unit}; it must have between {SMALLEST:g} and "
            f"{LARGEST:g} {unit}, so give lengths in other units"
        )


class Part(NamedTuple):
    """Cells that are divided alike.

    Attributes:
        rows: Nodes of each cell.
        cell: Their type.
        pattern: Shape (parts, corners, 2).
    """

    rows: Ints
    cell: Cell
    pattern: Floats


def uniform(cell: Cell, times: int) -> Floats:
    """Pattern of equal parts.

    Args:
        cell: Type of the cell and its parts.
        times: So many parts along each side.
    """
    corners = np.asarray(geometry_element(cell, 1).points)
    begin = np.indices((times, times)).reshape(2, -1).T
    if cell == "quad":
        return np.asarray((begin[:, None] + corners) / times)
    level = begin.sum(axis=1)
    # the others are turned by half a turn
    upright, turned = begin[level < times], begin[level < times - 1]
    both = [upright[:, None] + corners, turned[:, None] + 1 - corners]
    return np.asarray(np.concatenate(both) / times)


def nodes_of(pattern: Floats, into: Cell, order: int) -> Floats:
    """Nodes of the parts of a cell, in its own coordinates, shape (parts, nodes, 2).

    Args:
        pattern: The parts, whose sides are straight in these coordinates.
        into: Their type.
        order: Order of the geometry.
    """
    within = shape_functions(into, 1, np.asarray(geometry_element(into, order).points))
    return np.einsum("pk,qkd->qpd", within, pattern)


def divided(
    x: Floats,
    parts: Sequence[Part],
    order: int,
    into: Cell,
    lines: Sequence[tuple[Ints, Floats]] = (),
) -> tuple[Floats, list[Ints], list[Ints]]:
    """Cells of one type in the places of others.

    A node is known by its shares of the vertices around it, the same in all cells that have it.

    Args:
        x: Positions of the nodes.
        parts: The cells.
        order: Order of the geometry.
        into: Type of the new cells.
        lines: Vertices of sides, shape (m, 2), and shares of these in nodes of the new cells along
            each, shape (p, 2).

    Returns:
        Positions, of new nodes behind those of the old ones, of which vertices are used only; the
        new cells of each of the parts, those of one cell after the other; and the nodes of each of
        the lines, shape (m p,).
    """
    keys, places, tables = list[Ints](), [np.zeros((0, 3))], list[Ints]()
    for rows, cell, pattern in parts:
        every = nodes_of(pattern, into, order)
        flat = every.reshape(-1, 2)
        _, first, table = np.unique(flat.round(9), axis=0, return_index=True, return_inverse=True)
        there = flat[first]
        keys.append(_keys(rows[:, : vertex_count(cell)], shape_functions(cell, 1, there)))
        shapes = shape_functions(cell, order, there)
        places.append(np.einsum("pk,ckx->cpx", shapes, x[rows]).reshape(-1, 3))
        tables.append(table.reshape(every.shape[:2]))
    keys += [_keys(*line) for line in lines]
    known, first, number = np.unique(
        np.concatenate(keys), axis=0, return_index=True, return_inverse=True
    )
    # vertices keep their numbers
    names = np.where(known[:, 1] < 0, known[:, 0], len(x) + np.arange(len(known)))
    numbers = np.split(names[number.ravel()], np.cumsum([len(k) for k in keys])[:-1])
    cells = [
        own.reshape(-1, table.max() + 1)[:, table].reshape(-1, table.shape[1])
        for own, table in zip(numbers, tables, strict=False)
    ]
    return np.concatenate([x, np.concatenate(places)[first]]), cells, numbers[len(parts) :]


def _keys(vertices: Ints, shares: Floats) -> Ints:
    """Vertices with a share, the largest number first, and their shares in whole numbers.

    Args:
        vertices: Vertices of cells or sides, shape (c, v).
        shares: Shape (p, v).

    Returns:
        Shape (c p, 8), for up to four vertices.
    """
    room = ((0, 0), (0, 4 - vertices.shape[1]))
    parts = np.rint(PARTS * np.pad(shares, room) + SHIFT).astype(np.int64)
    who = np.where(parts > 0, np.pad(vertices, room)[:, None], -1)
    order = np.argsort(-who, axis=2)
    both = [np.take_along_axis(a, order, axis=2) for a in (who, np.broadcast_to(parts, who.shape))]
    return np.concatenate(both, axis=2).reshape(-1, 8)


def with_edges(raw: RawMesh, where: Mapping[str, Callable[[Any], Any]], shell: str) -> RawMesh:
    """A mesh with further edges: the facets on its boundary where a function is true.

    Args:
        raw: The mesh.
        where: Functions of positions (3, n) by the names of the edges.
        shell: Name of the shell, for messages.

    Raises:
        SceneError: If there is an edge of that name, or a function fails or is true on no facet.
    """
    if not where:
        return raw
    facets, _ = boundary_facets(raw.cells, raw.cell)
    ends = raw.x[facets]
    places = np.concatenate([ends, ends.mean(axis=1, keepdims=True)], axis=1)
    edges = dict(raw.edges)
    for name, function in where.items():
        who = f"shell '{shell}': edges_where['{name}']"
        if name in edges:
            raise SceneError(f"{who}: the mesh has an edge of this name; it must be another one")
        on = true_at(function, places, who).all(axis=1)
        if not on.any():
            raise SceneError(
                f"{who} is true on no edge of an element of the boundary, which lies in "
                f"{box(ends.reshape(-1, 3))}; it must be true at both ends of some"
            )
        edges[name] = facets[on]
    return replace(raw, edges=edges)


def with_areas(raw: RawMesh, where: Mapping[str, Callable[[Any], Any]], shell: str) -> RawMesh:
    """A mesh with further areas: the elements of which most is where a function is true.

    Elements are looked at in their inside, so that round-off on their sides does not matter.

    Args:
        raw: The mesh.
        where: Functions of positions (3, n) by the names of the areas.
        shell: Name of the shell, for messages.

    Raises:
        SceneError: If there is an edge, point or area of that name, or a function fails or takes
            no element.
    """
    if not where:
        return raw
    x = np.einsum("pk,cki->cpi", _inside(raw), raw.x[raw.cells])
    sizes = np.linalg.norm(cell_cross(raw.x[raw.vertices]), axis=1)
    sizes = sizes / (4 if raw.cell == "quad" else 2)
    areas = dict(raw.areas)
    for name, function in where.items():
        who = f"shell '{shell}': areas['{name}']"
        for kind in ("edges", "points", "areas"):
            if name in getattr(raw, kind):
                raise SceneError(
                    f"{who}: the mesh has one of its {kind} of this name; it must be another name"
                )
        share = true_at(function, x, who).mean(axis=1)
        taken = share > 0.5
        if not taken.any():
            raise SceneError(
                f"{who} is true on no element of the mesh, which lies in {box(raw.x)}; it must be "
                "true on most of one at least"
            )
        cut = int(np.sum((share > 0) & (share < 1)))
        if cut:
            warn(
                f"{who}: its boundary runs through {cut} elements; it is those that are more than "
                f"half inside, {sizes[taken].sum():.4g} in place of about "
                f"{(share * sizes).sum():.4g} of area; a finer mesh, or one with a line there, "
                "brings them together",
            )
        areas[name] = np.flatnonzero(taken)
    return replace(raw, areas=areas)


def _inside(raw: RawMesh) -> Floats:
    """Shape functions of the geometry at points inside an element, shape (points, nodes)."""
    quad = raw.cell == "quad"
    ticks = (np.arange(ALONG) + (1 / 2 if quad else 1 / 3)) / ALONG
    points = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    inside = points if quad else points[points.sum(axis=1) < 1]
    return shape_functions(raw.cell, raw.order, inside)


def true_at(function: Callable[[Any], Any], places: Floats, who: str) -> Bools:
    """Find where a function of the position is true.

    Args:
        function: A function of positions (3, n) that gives (n,) truth values.
        places: Positions, shape (c, p, 3).
        who: What messages call it.

    Returns:
        Shape (c, p).

    Raises:
        SceneError: If it fails.
    """
    with refusing(f"{who} fails", "it must give (n,) truth values for positions (3, n)"):
        return np.asarray(function(places.reshape(-1, 3).T), dtype=bool).reshape(places.shape[:2])


def refined(raw: RawMesh, times: int) -> RawMesh:
    """The mesh with more elements in each of its own, in whose maps the new nodes lie.

    Args:
        raw: The mesh.
        times: So many elements along each side of one.
    """
    if times == 1:
        return raw
    pattern = uniform(raw.cell, times)
    count = len(pattern)
    along = np.arange(times + 1) / times
    lines = [(pairs, np.stack([1 - along, along], axis=1)) for pairs in raw.edges.values()]
    part = Part(raw.cells, raw.cell, pattern)
    x, (cells,), on_lines = divided(raw.x, [part], raw.order, raw.cell, lines)
    used = np.unique(cells)
    row = np.zeros(len(x), dtype=np.int64)
    row[used] = np.arange(len(used))
    chains = [row[nodes].reshape(-1, times + 1) for nodes in on_lines]
    edges = {
        name: np.stack([chain[:, :-1], chain[:, 1:]], axis=2).reshape(-1, 2)
        for name, chain in zip(raw.edges, chains, strict=True)
    }
    areas = {
        name: (of[:, None] * count + np.arange(count)).reshape(-1) for name, of in raw.areas.items()
    }
    return replace(
        raw,
        x=x[used],
        cells=row[cells],
        normals=np.repeat(raw.normals, count, axis=0),
        edges=edges,
        points={name: int(row[node]) for name, node in raw.points.items()},
        areas=areas,
    )
