"""Analyses of a model before its run: bodies reduced to modes, constraints that can be solved."""

# before dolfinx and petsc4py, whichever module of this package is imported first
from mpi4py import MPI as _MPI  # noqa: F401
