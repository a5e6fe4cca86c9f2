"""Checks of a run that warn of unreliable results: one file per idea, all of them in `registry`."""

# before dolfinx and petsc4py, whichever module of this package is imported first
from mpi4py import MPI as _MPI  # noqa: F401
