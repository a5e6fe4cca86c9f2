"""Reference directors at the nodes of a shell: unit normals, consistently oriented."""

import itertools
from typing import Any

import basix
import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.meshes.raw import shown
from shellmb.meshes.shared import sums_at_nodes
from shellmb.meshes.tying import tangents_at

# angle between the director of a fold and the normals beside it beyond which it is refused,
# degrees: the end of a bracket of two squares of 8x8 quadrilaterals moves by 1.002 of what it
# should at 45, 1.005 at 47.5, 1.016 at 50 and 1.25 at 60 (that of `tests/meshes/test_folds.py`)
STEEPEST = 47.5
# and at single nodes, where three and more faces meet: 54.7 at the corner of a box
STEEPEST_CORNER = 60.0


def reference_director(surface: SurfaceMesh, nodal: fem.FunctionSpace) -> fem.Function:
    """Unit director at every node: the exact normal, or else the mean of the cells' normals.

    The mean is weighted by the angle of each cell at the node, so that it does not depend on how
    the surface is cut into cells.

    Args:
        surface: Meshed surface.
        nodal: Vector-valued Lagrange space of the director.

    Raises:
        SceneError: If the normals around a node cancel (the surface is not orientable or folded),
            an element is turned over, or the surface is folded by more than its director can
            follow.
    """
    director, cells = fem.Function(nodal, name="D"), _Cells(surface, nodal)
    if surface.normal is not None:
        values = surface.normal(cells.places.T).T
    else:
        values = cells.mean_normals()
    length = np.linalg.norm(values, axis=1)
    cancelled = surface.mesh.comm.allreduce(int(np.sum(length < 1e-3)))
    if cancelled:
        raise SceneError(
            f"shell '{surface.name}': the normals of its cells cancel at {cancelled} nodes; "
            "the surface must be smooth and orientable, split it at folds and join the parts"
        )
    values = values / length[:, None]
    if surface.normal is None:
        cells.refuse_folded(values)
    cells.refuse_turned(values)
    director.x.array[:] = values.ravel()
    director.x.scatter_forward()
    return director


class _Cells:
    """Own cells of a surface with their normals at its nodes.

    Args:
        surface: Meshed surface.
        nodal: Vector-valued Lagrange space of the director.
    """

    def __init__(self, surface: SurfaceMesh, nodal: fem.FunctionSpace) -> None:
        self._surface, self._nodal = surface, nodal
        self._element: Any = nodal.element.basix_element
        owned = surface.mesh.topology.index_map(2).size_local
        tangents = tangents_at(surface.mesh, np.asarray(self._element.points))
        self._tangents = np.stack(tangents)[:, :owned]
        self._normals = np.cross(*self._tangents)
        self._normals *= surface.cell_normal_sign[:owned, None, None]
        self._size = np.linalg.norm(self._normals, axis=2)
        self._nodes, self.places = nodal.dofmap.list[:owned], nodal.tabulate_dof_coordinates()

    def refuse_folded(self, directors: Floats) -> None:
        """Refuse folds at which a director leans so far from normals that it carries too little."""
        nodes, surface = self._nodes, self._surface
        with np.errstate(invalid="ignore", divide="ignore"):
            lean = np.vecdot(self._normals, directors[nodes]) / self._size
        limits = np.full(lean.shape[1], STEEPEST)
        limits[[dofs[0] for dofs in self._element.entity_dofs[0]]] = STEEPEST_CORNER
        sharp = lean < np.cos(np.radians(limits))
        # with their ends
        sharp = sharp.any(axis=1)[:, None] & (lean < np.cos(np.radians(STEEPEST)))
        here = [(float(lean[c, p]), self.places[nodes[c, p]]) for c, p in np.argwhere(sharp)]
        found = list(itertools.chain(*surface.mesh.comm.allgather(here)))
        if not found:
            return
        points = np.unique(np.array([place for _, place in found]), axis=0)
        # the fold's ends: those of its nodes that are farthest along its longest direction
        along = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]
        order = np.argsort((points - points.mean(axis=0)) @ along)
        first, last = (shown(points[k], surface.length) for k in (order[0], order[-1]))
        where = f"at {first}" if first == last else f"between {first} and {last}"
        worst = np.degrees(np.arccos(max(-1.0, min(lean for lean, _ in found))))
        raise SceneError(
            f"shell '{surface.name}': its mesh is folded {where}, so that elements lean by up to "
            f"{worst:.0f} degrees from the director they share; it must be less than {STEEPEST:g} "
            f"degrees (a fold of {2 * STEEPEST:g}), as it would be too soft there: make the parts "
            "shells, by group or where, and join them"
        )

    def refuse_turned(self, directors: Floats) -> None:
        """Refuse elements that are turned over: directors are on the positive side of all around.

        Corners where an element has no normal (poles) are left out.
        """
        size, around = self._size, directors[self._nodes]
        # beside the directors, which at an edge may be the normals of turned corners, the mean one
        mean = self._normals.sum(axis=1)[:, None]
        along = np.minimum(*(np.vecdot(self._normals, v) for v in (around, mean)))
        turned = (along <= 0) & (size > 1e-6 * size.max(axis=1, initial=0.0)[:, None])
        # where the map has no normal, a director is not a number
        turned |= ~np.isfinite(around).all(axis=2)
        places = self.places[np.unique(self._nodes[turned])]
        found = np.concatenate(self._surface.mesh.comm.allgather(places))
        if len(found):
            at = ", ".join(f"{v:.4g}" for v in found[0])
            raise SceneError(
                f"shell '{self._surface.name}': an element is turned over, or the surface has no "
                f"normal, at ({at}); use a map with independent derivatives everywhere, more "
                "elements, or geometry_order=1"
            )

    def mean_normals(self) -> Floats:
        """Sum of the unit normals of the cells around each node by their angles, (nodes, 3)."""
        unit = self._normals / np.where(self._size > 0, self._size, np.inf)[..., None]
        return sums_at_nodes(self._nodal, self._angles()[..., None] * unit)

    def _angles(self) -> Floats:
        """Angle of the cells at their nodes: at vertices their own, half a turn beside them."""
        angles = np.full(self._size.shape, np.pi)
        cell = self._element.cell_type
        corners, pairs = np.asarray(basix.geometry(cell)), basix.topology(cell)[1]
        for vertex, (node, *_) in enumerate(self._element.entity_dofs[0]):
            # both vertices that this one has a side to
            others = [w for pair in pairs if vertex in pair for w in pair if w != vertex]
            a, b = (
                np.tensordot(corners[w] - corners[vertex], self._tangents[:, :, node], axes=1)
                for w in others
            )
            cross = np.linalg.norm(np.cross(a, b), axis=1)
            angles[:, node] = np.arctan2(cross, np.vecdot(a, b))
        return angles
