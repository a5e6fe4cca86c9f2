"""Meshes and normals of surfaces that are given by a map of arranged cells in a plane.

Plane arrangements of cells: the unit square, and blocks around a pole.

A node has coordinates in a plane: (xi, eta) itself for the square, eta (cos, sin)(angle) around a
pole, where blocks of quadrilaterals avoid cells that collapse into the pole.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shellmb.arrays import Floats, Ints
from shellmb.meshes import raw
from shellmb.scene import Shell, Surface

CORNERS = {
    "left-bottom": (0.0, 0.0),
    "right-bottom": (1.0, 0.0),
    "left-top": (0.0, 1.0),
    "right-top": (1.0, 1.0),
    "pole": (0.0, 0.0),
    "antipole": (0.0, 1.0),
}


# edge of a surface with a map -> parameters (xi, eta) at its beginning, and the one that grows
EDGES = {
    "left": ((0.0, 0.0), 1),
    "right": ((1.0, 0.0), 1),
    "bottom": ((0.0, 0.0), 0),
    "top": ((0.0, 1.0), 0),
}

# of the radius: what is nearer to the rim is on it
ON_RIM = 1e-9


@dataclass(frozen=True)
class Layout:
    """Nodes in a plane and cells between them.

    Args:
        plane: Coordinates of the nodes in the plane, shape (n, 2).
        cells: Nodes of each cell in the order of DOLFINx, shape (c, k).
        cell: Cell type.
        size: Size of the elements around each node along both coordinates, shape (n, 2).
        parameters: From coordinates (n, 2) to (xi, eta), shape (n, 2).
    """

    plane: Floats
    cells: Ints
    cell: raw.Cell
    size: Floats
    parameters: Callable[[Floats], Floats]


def square(mesh: tuple[int, int], cell: raw.Cell, order: int, closed: bool) -> Layout:
    """A regular grid on the unit square.

    Args:
        mesh: Numbers of elements along xi and eta.
        cell: Cell type.
        order: Order of the geometry.
        closed: Whether xi = 0 and xi = 1 are the same line.
    """
    n, m = mesh
    shape = (n * order + 1, m * order + 1)
    number = np.arange(shape[0] * shape[1]).reshape(shape)
    if closed:
        number[-1] = number[0]
    xi, eta = np.meshgrid(*(np.linspace(0, 1, k) for k in shape), indexing="ij")
    plane = np.stack([xi.ravel(), eta.ravel()], axis=1)
    keep = shape[0] * shape[1] - (shape[1] if closed else 0)
    size = np.broadcast_to([1 / n, 1 / m], (keep, 2))
    return Layout(plane[:keep], _cells(number, cell, order), cell, size, lambda w: w)


def polar(mesh: tuple[int, int], cell: raw.Cell, order: int, sweep: float) -> Layout:
    """Blocks around a pole: a central quadrilateral and two outer ones for each quarter turn.

    Args:
        mesh: Numbers of elements along a quarter of the rim (rounded up to an even number) and
            from the pole to the rim.
        cell: Cell type.
        order: Order of the geometry.
        sweep: Angle around the pole [degrees].
    """
    central = (mesh[0] + 1) // 2
    outer = max(1, mesh[1] - central)
    wedges = max(1, round(sweep / 90))
    angle = np.radians(sweep)
    grids = [
        _turn(grid, wedge, angle / wedges)
        for wedge in range(wedges)
        for grid in _quarter(central, outer, order)
    ]
    plane, numbers = _merged(grids)
    cells = np.concatenate([_cells(number, cell, order) for number in numbers])

    def parameters(w: Floats) -> Floats:
        turned = np.arctan2(w[:, 1], w[:, 0])
        # the boundary at the angle 0 may lie a rounding error below it
        turned = np.where(turned < -1e-9, turned + 2 * np.pi, turned)
        return np.stack([np.maximum(turned, 0.0) / angle, np.linalg.norm(w, axis=1)], axis=1)

    return Layout(plane, cells, cell, _shortest(plane, cells, cell), parameters)


def _globe(mesh: tuple[int, int], cell: raw.Cell, order: int) -> Layout:
    """Blocks around two poles that share a rim: distances from the first pole go from 0 to 2.

    Args:
        mesh: Numbers of elements along a quarter of the rim, and from a pole to the rim.
        cell: Cell type.
        order: Order of the geometry.
    """
    half = polar(mesh, cell, order, 360.0)
    radius = np.linalg.norm(half.plane, axis=1)
    inner = np.flatnonzero(radius < 1 - ON_RIM)
    number = np.arange(len(radius))
    number[inner] = len(radius) + np.arange(len(inner))
    # at the second pole every direction is as good as another
    w, r = half.plane[inner], radius[inner][:, None]
    far = np.where(r > 0, w * (2 - r) / np.where(r > 0, r, 1.0), [2.0, 0.0])
    return Layout(
        np.concatenate([half.plane, far]),
        np.concatenate([half.cells, number[half.cells]]),
        cell,
        np.concatenate([half.size, half.size[inner]]),
        lambda w: half.parameters(w) / [1.0, 2.0],
    )


def _quarter(central: int, outer: int, order: int) -> list[Floats]:
    """Grids of the three blocks of the quarter disc, each of shape (rows, columns, 2)."""
    a = central / (central + outer)
    o, p, q, m = (np.array(v) for v in ((0.0, 0.0), (a, 0.0), (0.0, a), (0.8 * a, 0.8 * a)))
    s = np.linspace(0, 1, central * order + 1)
    r = np.linspace(0, 1, outer * order + 1)

    def between(first: Floats, last: Floats, t: Floats) -> Floats:
        """Points on the straight line between two, or on those between partners of two lines."""
        return np.asarray(first + np.multiply.outer(t, last - first))

    def rim(turn: Floats) -> Floats:
        return np.stack([np.cos(turn), np.sin(turn)], axis=1)

    return [
        between(between(o, q, s), between(p, m, s), s),
        between(between(p, m, s), rim(np.pi / 4 * s), r),
        between(between(m, q, s), rim(np.pi / 4 * (1 + s)), r),
    ]


def _turn(grid: Floats, wedge: int, angle: float) -> Floats:
    """A grid of the quarter disc stretched over one of the wedges."""
    turned = (np.arctan2(grid[..., 1], grid[..., 0]) / (np.pi / 2) + wedge) * angle
    radius = np.linalg.norm(grid, axis=-1)
    return np.stack([radius * np.cos(turned), radius * np.sin(turned)], axis=-1)


def _merged(grids: list[Floats]) -> tuple[Floats, list[Ints]]:
    """Nodes with those that coincide taken together, and their numbers in each grid."""
    every = np.concatenate([g.reshape(-1, 2) for g in grids])
    # the odd shift keeps round coordinates away from where rounding turns
    keys = np.rint(every * 1e9 + 0.318309886).astype(np.int64)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    ends = np.cumsum([g.shape[0] * g.shape[1] for g in grids])
    parts = np.split(number.ravel(), ends[:-1])
    return every[first], [p.reshape(g.shape[:2]) for p, g in zip(parts, grids, strict=True)]


def _cells(number: NDArray[np.integer], cell: raw.Cell, order: int) -> Ints:
    """Cells of a grid of nodes, in the order of DOLFINx.

    Triangles halve the quadrilaterals so that the pattern is symmetric about both middle lines
    and no triangle has two facets in a corner.
    """
    rows, columns = ((k - 1) // order for k in number.shape)
    i, j = np.indices((rows, columns)).reshape(2, -1, 1)
    nodes = np.rint(order * np.asarray(raw.geometry_element("quad", order).points)).astype(int)
    quads = number[order * i + nodes[:, 0], order * j + nodes[:, 1]].astype(np.int64)
    if cell == "quad":
        return quads
    rising = ((2 * i + 1 <= rows) == (2 * j + 1 <= columns))[:, 0]
    place = {(a, b): k for k, (a, b) in enumerate(nodes.tolist())}
    parts = []
    for some, pattern in ((rising, raw.HALVES[0]), (~rising, raw.HALVES[1])):
        for each in np.rint(order * raw.nodes_of(pattern, "tri", order)).astype(int).tolist():
            parts.append(quads[some][:, [place[a, b] for a, b in each]])
    return np.concatenate(parts)


def _shortest(plane: Floats, cells: Ints, cell: raw.Cell) -> Floats:
    """Length of the shortest facet at each vertex, infinite at other nodes, shape (n, 2)."""
    pairs = raw.facets(cells, cell).reshape(-1, 2)
    length = np.linalg.norm(plane[pairs[:, 0]] - plane[pairs[:, 1]], axis=1)
    size = np.full(len(plane), np.inf)
    for column in (0, 1):
        np.minimum.at(size, pairs[:, column], length)
    return np.stack([size, size], axis=1)


def distorted(layout: Layout, fraction: float) -> Floats:
    """Coordinates of the nodes with the interior vertices moved, shape (n, 2).

    The k-th vertex moves by ``fraction`` of the element size at the angle k times the golden angle:
    a fixed pattern without a preferred direction. Other nodes follow their cell's vertices.

    Args:
        layout: The arrangement.
        fraction: Fraction of the element size.
    """
    if fraction == 0:
        return layout.plane
    corners = layout.cells[:, : raw.vertex_count(layout.cell)]
    moved = np.zeros(len(layout.plane), dtype=bool)
    moved[np.unique(corners)] = True
    moved[raw.boundary_facets(layout.cells, layout.cell)[0]] = False
    k = np.arange(int(moved.sum()))
    angle = np.pi * (3 - np.sqrt(5)) * k
    shift = np.zeros_like(layout.plane)
    pattern = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    shift[moved] = fraction * layout.size[moved] * pattern
    order = 1 if corners.shape == layout.cells.shape else 2
    points = np.asarray(raw.geometry_element(layout.cell, order).points)
    shift[layout.cells] = raw.shape_functions(layout.cell, 1, points) @ shift[corners]
    return np.asarray(layout.plane + shift)


def structured_mesh(shell: Shell) -> raw.RawMesh:
    """Mesh the unit square and move the nodes by the surface's map.

    Args:
        shell: A shell whose surface has a map.
    """
    surface = shell.surface
    cell: raw.Cell = shell.cell or "quad"
    order = shell.geometry_order or (1 if surface.flat else 2)
    if surface.pole and not surface.edges:
        layout = _globe(shell.mesh, cell, order)
    elif surface.pole:
        layout = polar(shell.mesh, cell, order, surface.sweep)
    else:
        layout = square(shell.mesh, cell, order, surface.closed)
    xi, eta = layout.parameters(distorted(layout, shell.distortion)).T
    x = surface.position(xi, eta).T
    corners = x[layout.cells[:, : raw.vertex_count(cell)]]
    normals = surface.normal(corners.mean(axis=1).T)
    return raw.RawMesh(
        x=x,
        cells=layout.cells,
        cell=cell,
        order=order,
        normals=raw.cell_cross(corners) if normals is None else normals.T,
        edges=_edges(layout, surface.edges or (), surface.pole),
        points={name: _corner(layout, surface, name) for name in surface.points or ()},
    )


def _corner(layout: Layout, surface: Surface, name: str) -> int:
    """The node at the parameters of a corner."""
    xi, eta = layout.parameters(layout.plane).T
    away = np.abs(xi - CORNERS[name][0])
    if surface.closed:
        # one line has both parameters
        away = np.minimum(away, 1 - away)
    if surface.pole and CORNERS[name][1] == 0.0:
        # where every xi is as good as another
        away = np.zeros_like(xi)
    return int(np.argmin(away + np.abs(eta - CORNERS[name][1])))


def _edges(layout: Layout, names: tuple[str, ...], pole: bool) -> dict[str, Ints]:
    """Boundary facets both of whose vertices have the parameter that makes an edge."""
    xi, eta = layout.parameters(layout.plane).T
    on = {
        name: np.abs((eta, xi)[grows] - begin[1 - grows]) < 1e-9
        for name, (begin, grows) in EDGES.items()
    }
    if pole:  # where every xi is as good as another
        on["left"] |= on["bottom"]
        on["right"] |= on["bottom"]
    boundary, _ = raw.boundary_facets(layout.cells, layout.cell)
    return {name: boundary[on[name][boundary].all(axis=1)] for name in names}


# of exact normals: step of differences, and samples along each parameter
STEP = 1e-5
SAMPLES = 101


def map_normals(surface: Surface) -> Callable[[Floats], Floats]:
    """Unit normals ``X_,xi x X_,eta`` at positions near a surface, by its map.

    The parameters of a position come from the nearest of a grid of samples and a few Gauss-Newton
    steps; derivatives from second-order differences that stay within the unit square.

    Args:
        surface: A surface with a map.

    Returns:
        Function from positions (3, n) to unit normals (3, n).
    """
    # loaded where there are such surfaces only
    from scipy.spatial import cKDTree

    s = np.linspace(0, 1, SAMPLES)
    grid = np.stack([g.ravel() for g in np.meshgrid(s, s, indexing="ij")])
    tree = cKDTree(surface.position(grid[0], grid[1]).T)

    def normal(x: Floats) -> Floats:
        if x.shape[1] == 0:
            return np.zeros((3, 0))
        uv = grid[:, tree.query(x.T)[1]].copy()
        for _ in range(8):
            rest = x - surface.position(uv[0], uv[1])
            t1, t2 = _tangents(surface, uv)
            a, b, c = ((p * q).sum(0) for p, q in ((t1, t1), (t1, t2), (t2, t2)))
            first, second = ((t * rest).sum(0) for t in (t1, t2))
            det = a * c - b**2
            step = np.array([c * first - b * second, a * second - b * first])
            step /= np.where(det > 0, det, np.inf)
            uv = np.clip(uv + step, 0.0, 1.0)
        n = np.cross(*_tangents(surface, uv), axis=0)
        # where there is none it is not a number, which who asks refuses by name
        with np.errstate(invalid="ignore"):
            return np.asarray(n / np.linalg.norm(n, axis=0))

    return normal


def _tangents(surface: Surface, uv: Floats) -> tuple[Floats, Floats]:
    """Derivatives of the map by xi and by eta, shape (3, n) each."""
    return _difference(surface, uv, 0), _difference(surface, uv, 1)


def _difference(surface: Surface, uv: Floats, axis: int) -> Floats:
    """Derivative of the parabola through three points around, or at the border beside, a point."""
    middle = np.clip(uv[axis], STEP, 1 - STEP)
    at = [np.insert(uv[[1 - axis]], axis, middle + k * STEP, axis=0) for k in (-1, 0, 1)]
    low, centre, high = (surface.position(*moved) for moved in at)
    curvature = (high - 2 * centre + low) / STEP**2
    return np.asarray((high - low) / (2 * STEP) + (uv[axis] - middle) * curvature)
