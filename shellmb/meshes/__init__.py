"""From a scene to meshes, tags, function spaces and states."""

# before dolfinx and petsc4py, whichever module of this package is imported first
from mpi4py import MPI as _MPI  # noqa: F401

from shellmb.errors import RunError, warn

# what this code is written for and tested with
DOLFINX = "0.11"

try:
    import dolfinx
except ModuleNotFoundError as missing:
    raise RunError(
        f"{missing.name} is not installed: shellmb needs DOLFINx {DOLFINX} with petsc4py and "
        "slepc4py; install `shellmb[wheel]` from the package registry, `fenics-dolfinx` from "
        "conda-forge, or `python3-dolfinx` of the distribution"
    ) from missing
if not dolfinx.__version__.startswith(DOLFINX):
    warn(f"DOLFINx is {dolfinx.__version__}; shellmb is written for {DOLFINX}")
