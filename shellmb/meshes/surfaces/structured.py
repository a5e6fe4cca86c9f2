"""Meshes and normals of surfaces that are given by a map of the unit square."""

from collections.abc import Callable

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.meshes.raw import Cell, RawMesh, boundary_facets, cell_cross, vertex_count
from shellmb.meshes.surfaces.layout import Layout, distorted, globe, polar, square
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


def structured_mesh(shell: Shell) -> RawMesh:
    """Mesh the unit square and move the nodes by the surface's map.

    Args:
        shell: A shell whose surface has a map.
    """
    surface = shell.surface
    cell: Cell = shell.cell or "quad"
    order = shell.geometry_order or (1 if surface.flat else 2)
    if surface.pole and not surface.edges:
        layout = globe(shell.mesh, cell, order)
    elif surface.pole:
        layout = polar(shell.mesh, cell, order, surface.sweep)
    else:
        layout = square(shell.mesh, cell, order, surface.closed)
    xi, eta = layout.parameters(distorted(layout, shell.distortion)).T
    x = surface.position(xi, eta).T
    corners = x[layout.cells[:, : vertex_count(cell)]]
    normals = surface.normal(corners.mean(axis=1).T)
    return RawMesh(
        x=x,
        cells=layout.cells,
        cell=cell,
        order=order,
        normals=cell_cross(corners) if normals is None else normals.T,
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
    boundary, _ = boundary_facets(layout.cells, layout.cell)
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
    values = []
    for k in (-1, 0, 1):
        moved = uv.copy()
        moved[axis] = middle + k * STEP
        values.append(surface.position(moved[0], moved[1]))
    low, centre, high = values
    curvature = (high - 2 * centre + low) / STEP**2
    return np.asarray((high - low) / (2 * STEP) + (uv[axis] - middle) * curvature)
