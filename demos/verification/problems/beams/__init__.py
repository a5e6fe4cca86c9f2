"""Verification of beams: exact solutions, published motions, and what tension holds."""

# before dolfinx and petsc4py, whichever module of this package is imported first
from mpi4py import MPI as _MPI  # noqa: F401
