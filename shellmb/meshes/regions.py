"""Edges and areas of a mesh by where they lie, and its uniform refinement.

Refined parents keep their shape, and groups their places.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.errors import SceneError, warn
from shellmb.meshes.raw import (
    Part,
    RawMesh,
    boundary_facets,
    box,
    cell_cross,
    divided,
    shape_functions,
    uniform,
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
