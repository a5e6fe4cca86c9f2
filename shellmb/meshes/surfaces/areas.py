"""Areas of a mesh by where they lie: the elements that are more inside than outside."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError, warn
from shellmb.meshes.edges_where import true_at
from shellmb.meshes.raw import RawMesh, box, cell_cross, shape_functions, vertex_count

__all__ = ["with_areas"]

# points along a side of an element at which it is looked whether they are inside
ALONG = 4


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
    sizes = np.linalg.norm(cell_cross(raw.x[raw.cells[:, : vertex_count(raw.cell)]]), axis=1)
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
