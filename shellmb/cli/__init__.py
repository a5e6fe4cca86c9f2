"""The command line: `shellmb`."""

import os

# one thread unless the user says otherwise, before NumPy loads its BLAS: the matrices are small,
# and under mpiexec threads of several ranks would fight for the cores
os.environ.setdefault("OMP_NUM_THREADS", "1")

from shellmb.cli.main import app

__all__ = ["app"]
