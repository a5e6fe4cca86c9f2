"""MPI, PETSc and DOLFINx, loaded in their order before any module that uses them.

PETSc would read options from the current folder, which may hold somebody else's run: libraries to
be loaded, files to be written. It gets what is in the user's home and in `PETSC_OPTIONS`.
"""

from pathlib import Path

from shellmb.errors import RunError, warn
from shellmb.guarding import held

# what this code is written for and tested with
DOLFINX = "0.11"


def _petsc_options() -> list[str]:
    """Arguments of PETSc: no files but the user's, and signals are ours (`shellmb.stopping`)."""
    home = Path("~/.petscrc").expanduser()
    of_home = ["-options_file", str(home)] if home.is_file() else []
    return ["shellmb", "-skip_petscrc", "-no_signal_handler", *of_home]


with held():
    try:
        import petsc4py

        # it loads the MPI library that the others need
        from mpi4py import MPI as _MPI  # noqa: F401

        petsc4py.init(_petsc_options())

        import dolfinx
    except ModuleNotFoundError as missing:
        raise RunError(
            f"{missing.name} is not installed: shellmb needs DOLFINx {DOLFINX} with petsc4py and "
            "slepc4py; install `shellmb[wheel]` from the package registry, `fenics-dolfinx` from "
            "conda-forge, or `python3-dolfinx` of the distribution"
        ) from missing
if not dolfinx.__version__.startswith(DOLFINX):
    warn(f"DOLFINx is {dolfinx.__version__}; shellmb is written for {DOLFINX}")
