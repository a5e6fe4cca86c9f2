"""Meshes of surfaces that are given by a map of the unit square."""

from __future__ import annotations

import numpy as np

from shellmb.arrays import Ints
from shellmb.meshes.raw import Cell, RawMesh, boundary_facets, cell_cross, vertex_count
from shellmb.meshes.surfaces.layout import Layout, distorted, globe, polar, square
from shellmb.scene import Shell, Surface

__all__ = ["structured_mesh"]

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
    boundary = boundary_facets(layout.cells, layout.cell)
    return {name: boundary[on[name][boundary].all(axis=1)] for name in names}
