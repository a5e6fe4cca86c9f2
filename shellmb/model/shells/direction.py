"""The material 1-direction of a shell: a vector or a function, or an axis that fits."""

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx import fem

from shellmb.errors import SceneError
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.shells.positions import interpolated
from shellmb.scene import Hyperelastic, Isotropic, Shell

Floats = npt.NDArray[np.float64]

# angle to the normal below which a direction has no useful projection on the surface, degrees: the
# projection is short, and turns ten times as fast as the surface does
STEEPEST = 5.0
# cosine of the angle to the normal from which on another axis is looked for
NEARLY_NORMAL = 0.95


def direction_1(
    shell: Shell, surface_mesh: SurfaceMesh, mixed: MixedSpace, director: fem.Function
) -> fem.Constant | fem.Function:
    """Material 1-direction: the user's, or the first axis that is nowhere nearly normal.

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
    if callable(given):
        who = f"shell '{shell.name}': direction"
        field = interpolated(given, mixed, 3, who)
        _check(comm, who, field.x.array.reshape(-1, 3), directors, x)
        return field
    if given is not None:
        vector = np.asarray(given, dtype=float)
        who = f"shell '{shell.name}': direction {tuple(vector.tolist())}"
    else:
        vector = _axis(comm, directors)
        who = (
            f"shell '{shell.name}': direction is None, and {'xyz'[int(np.argmax(vector))]}, the "
            "axis that would be taken for it,"
        )
    # of an energy of the user's nobody knows whether it tells directions apart
    blind = isinstance(shell.section, Isotropic | Hyperelastic)
    if given is not None or not blind:
        _check(comm, who, np.broadcast_to(vector, directors.shape), directors, x)
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
