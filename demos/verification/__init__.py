"""Verification against analytic and published values."""

# before dolfinx and petsc4py, whichever module of this package is imported first
from mpi4py import MPI as _MPI  # noqa: F401
