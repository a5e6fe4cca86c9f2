"""Edges of a mesh by where they lie."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.errors import SceneError
from shellmb.meshes.raw import RawMesh, boundary_facets, box
from shellmb.scene.values.validate import in_words

__all__ = ["true_at", "with_edges"]


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
