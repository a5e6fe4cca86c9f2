"""Edges and areas of a mesh by where they lie, and its uniform refinement.

Refined parents keep their shape, and groups their places.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.arrays import Bools, Floats, Ints
from shellmb.errors import SceneError, warn
from shellmb.meshes.raw import (
    Cell,
    RawMesh,
    boundary_facets,
    box,
    cell_cross,
    geometry_element,
    shape_functions,
    vertex_count,
)
from shellmb.scene.values.validate import in_words

# points along a side of an element at which it is looked whether they are inside
ALONG = 4


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
    facets = boundary_facets(raw.cells, raw.cell)
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
    try:
        return np.asarray(function(places.reshape(-1, 3).T), dtype=bool).reshape(places.shape[:2])
    except (Exception, SystemExit) as error:
        raise SceneError(
            f"{who} fails ({in_words(error)}); it must give (n,) truth values for positions (3, n)"
        ) from error


def refined(raw: RawMesh, times: int) -> RawMesh:
    """The mesh with more elements in each of its own, in whose maps the new nodes lie.

    Args:
        raw: The mesh.
        times: So many elements along each side of one.
    """
    if times == 1:
        return raw
    fine, corners = times * raw.order, vertex_count(raw.cell)
    lattice = _lattice(raw.cell, fine)
    shares = _shares(raw.cell, lattice, fine)
    line = np.stack([raw.order * np.arange(times + 1), np.zeros(times + 1, dtype=np.int64)], axis=1)
    along = _shares(raw.cell, line, fine)[:, :2]
    whole = int(shares.max())
    # a node is known by its shares of the vertices around it, the same in all elements that have it
    keys = [_keys(raw.cells[:, :corners], shares)]
    keys += [_keys(pairs, along, corners) for pairs in raw.edges.values()]
    named = np.array(list(raw.points.values()), dtype=np.int64)[:, None]
    keys.append(_keys(named, np.array([[whole]]), corners))
    _, first, number = np.unique(
        np.concatenate(keys), axis=0, return_index=True, return_inverse=True
    )
    number = number.reshape(-1)
    values = shape_functions(raw.cell, raw.order, lattice / fine)
    places = np.einsum("pk,ckx->cpx", values, raw.x[raw.cells]).reshape(-1, 3)
    parts = np.split(number, np.cumsum([len(k) for k in keys])[:-1])
    own = parts[0].reshape(len(raw.cells), -1)[:, _children(raw, times, lattice)]
    count = own.shape[1]
    cells = own.reshape(-1, own.shape[2])
    edges = {
        name: np.stack([line[:, :-1], line[:, 1:]], axis=2).reshape(-1, 2)
        for name, line in zip(
            raw.edges, (p.reshape(-1, times + 1) for p in parts[1:-1]), strict=True
        )
    }
    areas = {
        name: (of[:, None] * count + np.arange(count)).reshape(-1) for name, of in raw.areas.items()
    }
    return replace(
        raw,
        x=places[first],
        cells=cells,
        normals=np.repeat(raw.normals, count, axis=0),
        edges=edges,
        points=dict(zip(raw.points, parts[-1].tolist(), strict=True)),
        areas=areas,
    )


def _lattice(cell: Cell, fine: int) -> Ints:
    """Places in the reference element, whole numbers from 0 to `fine`, shape (p, 2)."""
    i, j = (a.reshape(-1) for a in np.meshgrid(*2 * [np.arange(fine + 1)], indexing="ij"))
    found = np.stack([i, j], axis=1)
    return found if cell == "quad" else found[i + j <= fine]


def _shares(cell: Cell, lattice: Ints, fine: int) -> Ints:
    """Shares of the vertices in places of the lattice, whole numbers, shape (p, 3 or 4)."""
    i, j = lattice.T
    if cell == "tri":
        return np.stack([fine - i - j, i, j], axis=1)
    return np.stack([(fine - i) * (fine - j), i * (fine - j), (fine - i) * j, i * j], axis=1)


def _keys(vertices: Ints, shares: Ints, width: int = 0) -> Ints:
    """Vertices and their shares, in the order of vertices, those without a share left out.

    Args:
        vertices: Vertices of cells, of facets, or single ones, shape (c, v).
        shares: Shape (p, v).
        width: So many of both are there at least.

    Returns:
        Shape (c p, 2 max(v, width)).
    """
    size = (len(vertices), len(shares), vertices.shape[1])
    who = np.broadcast_to(vertices[:, None], size).reshape(-1, size[2])
    share = np.broadcast_to(shares[None], size).reshape(-1, size[2])
    who = np.where(share > 0, who, -1)
    order = np.argsort(-who, axis=1)
    both = [np.take_along_axis(a, order, axis=1) for a in (who, share)]
    room = ((0, 0), (0, max(width - size[2], 0)))
    return np.concatenate(
        [np.pad(both[0], room, constant_values=-1), np.pad(both[1], room)], axis=1
    )


def _children(raw: RawMesh, times: int, lattice: Ints) -> Ints:
    """Rows of the lattice that are the nodes of each new element, shape (children, k)."""
    order = raw.order
    points = np.asarray(geometry_element(raw.cell, order).points)
    nodes = np.rint(points * order).astype(np.int64)
    row = {tuple(place): k for k, place in enumerate(lattice.tolist())}
    found = []
    for a in range(times):
        for b in range(times if raw.cell == "quad" else times - a):
            corner = order * np.array([a, b])
            found.append(corner + nodes)
            if raw.cell == "tri" and a + b < times - 1:
                # turned by half a turn
                found.append(corner + order - nodes)
    return np.array([[row[tuple(place)] for place in child.tolist()] for child in found])
