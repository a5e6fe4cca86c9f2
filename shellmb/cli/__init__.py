"""The command line: `shellmb`."""

import os

# one thread unless the user says otherwise, before NumPy loads its BLAS: the matrices are small,
# and under mpiexec threads of several ranks would fight for the cores
os.environ.setdefault("OMP_NUM_THREADS", "1")
# plugins of pydantic are no part of it, and looking for them reads what is installed: 0.1 s
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

from shellmb.guarding.streams import open_closed

open_closed()

from shellmb.cli.main import app  # noqa: E402

__all__ = ["app"]
