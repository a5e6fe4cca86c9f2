"""Read-only observers of a run: energies, momenta, probes, files, pictures."""

# before dolfinx and petsc4py, whichever module of this package is imported first
from mpi4py import MPI as _MPI  # noqa: F401
