"""Compiled forms: one place that says how DOLFINx compiles."""

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

from dolfinx import fem
from ufl import Form

# Two processes that need the same kernel compile it once: the second waits for the first. DOLFINx
# gives up after ten seconds, less than a large form takes on a busy machine.
JIT_OPTIONS = {"timeout": 600}


def compiled(form: Form) -> fem.Form:
    """A form compiled, or found in the cache.

    Args:
        form: Any form; its parameters are Constants, so that their values do not matter here.
    """
    return fem.form(form, jit_options=JIT_OPTIONS)
