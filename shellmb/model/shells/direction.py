"""The material 1-direction of a shell where the user gives none."""

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx import fem

from shellmb.errors import SceneError
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.shells.positions import interpolated
from shellmb.scene import Shell

# cosine of the angle to the normal beyond which a direction has no useful projection on the surface
ALMOST_NORMAL = 1 - 1e-9
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

    Raises:
        SceneError: If the user's is normal to the surface somewhere.
    """
    if not callable(shell.direction):
        return fem.Constant(surface_mesh.mesh, _vector(shell, surface_mesh, director))
    field = interpolated(shell.direction, mixed, 3, f"shell '{shell.name}': direction")
    v, d = field.x.array.reshape(-1, 3), director.x.array.reshape(-1, 3)
    size = np.linalg.norm(v, axis=1)
    steep = np.abs((v * d).sum(axis=1)) > ALMOST_NORMAL * size
    if surface_mesh.mesh.comm.allreduce(int(steep.sum())):
        raise SceneError(
            f"shell '{shell.name}': direction gives a vector that is normal to the surface at some "
            "node; it must have a part along the surface everywhere"
        )
    return field


def _vector(
    shell: Shell, surface_mesh: SurfaceMesh, director: fem.Function
) -> npt.NDArray[np.float64]:
    """One vector for the whole shell."""
    directors = director.x.array.reshape(-1, 3)
    comm = surface_mesh.mesh.comm

    def steepness(v: npt.NDArray[np.float64]) -> float:
        largest = float(np.max(np.abs(directors @ v), initial=0.0))
        return float(comm.allreduce(largest, op=MPI.MAX))

    if shell.direction is not None:
        v = np.asarray(shell.direction, dtype=float)
        if steepness(v / np.linalg.norm(v)) > ALMOST_NORMAL:
            raise SceneError(
                f"shell '{shell.name}': the material direction {tuple(map(float, v))} is normal "
                "to the surface at some node; give one that is not, or split the shell"
            )
        return v
    axes = np.eye(3)
    steep = [steepness(v) for v in axes]
    for v, s in zip(axes, steep, strict=True):
        if s < NEARLY_NORMAL:
            return v
    return axes[int(np.argmin(steep))]
