"""Functions of the position as fields on nodes, and the material 1-direction of a shell."""

from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.errors import SceneError, alike
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.meshes.raw import cell_cross
from shellmb.meshes.shared import space_on
from shellmb.meshes.spaces import MixedSpace
from shellmb.scene import Hyperelastic, Isotropic, Shell, Wrinkling
from shellmb.scene.values.user_functions import values_at


def field_of(value: Any, mixed: MixedSpace, size: int, who: str) -> fem.Constant | fem.Function:
    """A vector or a number: a constant, or a function of positions (3, n) at the nodes.

    Args:
        value: The constant or function.
        mixed: Space of the shell, whose displacement has the nodes.
        size: Number of its components, 3 or 1.
        who: What messages call it.

    Collective.

    Raises:
        SceneError: If it fails, or gives another shape or a number that is not finite.
    """
    if not callable(value):
        return fem.Constant(mixed.space.mesh, np.asarray(value, dtype=float))
    space = mixed.subspaces["u"]
    if size == 1:
        space = space_on(space.mesh, space.ufl_element().sub_elements[0])
    field = fem.Function(space, name=who)
    with alike(space.mesh.comm):
        field.interpolate(lambda x: values_at(value, x, size, who))
    return field


# angle to the normal below which a direction has no useful projection on the surface, degrees: the
# projection is short, and turns ten times as fast as the surface does
STEEPEST = 5.0
# cosine of the angle to the normal from which on another axis is looked for
NEARLY_NORMAL = 0.95
# directions over half a sphere, 7 degrees apart, that are tried where no axis fits
OBLIQUE = 400


def direction_1(
    shell: Shell, surface_mesh: SurfaceMesh, mixed: MixedSpace, director: fem.Function
) -> fem.Constant | fem.Function:
    """Material 1-direction: the user's, or the first axis that is nowhere nearly normal.

    Where each axis is normal to some cell, as at the corner of a box, and stiffness does not depend
    on it, it is an oblique vector.

    Args:
        shell: Description.
        surface_mesh: Its mesh.
        mixed: Its space.
        director: Reference directors.

    Collective.

    Raises:
        SceneError: If it is nearly normal to the surface somewhere, and stiffness depends on it.
    """
    comm, given = surface_mesh.mesh.comm, shell.direction
    directors, x = director.x.array.reshape(-1, 3), mixed.nodes("u")
    normals, middles = _faces(surface_mesh)
    if callable(given):
        who = f"shell '{shell.name}': direction"
        field: Any = field_of(given, mixed, 3, who)
        values = field.x.array.reshape(-1, 3)
        _check(comm, who, values, directors, x)
        of_cells = values[field.function_space.dofmap.list[: len(normals)]].mean(axis=1)
        _check(comm, who, of_cells, normals, middles)
        return field
    if given is not None:
        vector = np.asarray(given, dtype=float)
        who = f"shell '{shell.name}': direction {tuple(vector.tolist())}"
    else:
        vector = _axis(comm, np.concatenate([directors, normals]))
        who = (
            f"shell '{shell.name}': direction is None, and {'xyz'[int(np.argmax(vector))]}, the "
            "axis that would be taken for it,"
        )
    # of an energy of the user's nobody knows whether it tells directions apart
    blind = isinstance(shell.section, Isotropic | Wrinkling | Hyperelastic)
    if given is not None or not blind:
        for of, at in ((directors, x), (normals, middles)):
            _check(comm, who, np.broadcast_to(vector, of.shape), of, at)
    elif not _steepest(comm, vector[None], normals)[0] < np.cos(np.radians(STEEPEST)):
        # stiffness is the same in all directions: any will do that has a projection everywhere
        vector = _oblique(comm, normals)
    return fem.Constant(surface_mesh.mesh, vector)


def _check(comm: MPI.Comm, who: str, v: Floats, d: Floats, x: Floats) -> None:
    """Refuse directions nearly normal to the surface at some node; collective."""
    # of a vector without length no angle: it has no projection either
    size = np.maximum(np.linalg.norm(v, axis=1), np.finfo(float).tiny)
    along = np.linalg.norm(v - (v * d).sum(axis=1)[:, None] * d, axis=1)
    angle = np.degrees(np.arcsin(np.clip(along / size, 0.0, 1.0)))
    worst = int(np.argmin(angle)) if len(angle) else 0
    here = (float(angle[worst]), tuple(x[worst].tolist())) if len(angle) else (90.0, (0.0,) * 3)
    least, place = min(comm.allgather(here))
    if least < STEEPEST:
        at = tuple(float(f"{c:.4g}") for c in place)
        raise SceneError(
            f"{who} is normal to the surface to {least:.2g} degrees at {at}; it must be off the "
            f"normal by {STEEPEST:g} degrees at least everywhere, to be projected on the surface: "
            "give another vector, a function of the position, or split the shell"
        )


def _axis(comm: MPI.Comm, directors: Floats) -> Floats:
    """The first axis that is nowhere nearly normal, or the one that is least so."""
    here = np.max(np.abs(directors), axis=0, initial=0.0)
    steep = np.max(comm.allgather(here), axis=0)
    fit = np.flatnonzero(steep < NEARLY_NORMAL)
    return np.asarray(np.eye(3)[fit[0] if len(fit) else int(np.argmin(steep))])


def _faces(surface_mesh: SurfaceMesh) -> tuple[Floats, Floats]:
    """Unit normals of the owned cells, on either side, and their middles: shape (c, 3) each.

    Nodes may have no normal like them: all those of a triangle may lie on folds.
    """
    domain = surface_mesh.mesh
    owned = domain.topology.index_map(2).size_local
    count = 3 if domain.topology.cell_name() == "triangle" else 4
    corners = domain.geometry.x[domain.geometry.dofmaps[0][:owned, :count]]
    cross = cell_cross(corners)
    size = np.linalg.norm(cross, axis=1, keepdims=True)
    return cross / np.where(size > 0, size, np.inf), corners.mean(axis=1)


def _steepest(comm: MPI.Comm, vectors: Floats, normals: Floats) -> Floats:
    """Largest cosine of the angle of each of some unit vectors to the normals, shape (n,)."""
    here = np.max(np.abs(vectors @ normals.T), axis=1, initial=0.0)
    return np.asarray(np.max(comm.allgather(here), axis=0))


def _oblique(comm: MPI.Comm, normals: Floats) -> Floats:
    """Of directions spread over a sphere the one that is farthest from all normals of cells."""
    k = np.arange(OBLIQUE) + 0.5
    height, turn = 1 - k / OBLIQUE, np.pi * (3 - np.sqrt(5)) * k
    level = np.sqrt(1 - height**2)
    vectors = np.stack([level * np.cos(turn), level * np.sin(turn), height], axis=1)
    return np.asarray(vectors[int(np.argmin(_steepest(comm, vectors, normals)))])
