"""Uniform refinement of a mesh as it came: parents keep their shape, groups their places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shellmb.arrays import Ints
from shellmb.meshes.raw import Cell, RawMesh, geometry_element, shape_functions, vertex_count


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
