"""What tests of reduced bodies keep of their runs."""

from typing import Any, NamedTuple

from mpi4py import MPI  # noqa: F401  (before dolfinx)

from shellmb.running.execute import execute
from shellmb.scene import Scene


class Kept(NamedTuple):
    """Of a run what is asked later: its meshes would hold communicators, which MPI has 2000 of."""

    history: Any
    summary: dict[str, Any]


def kept(scene: Scene) -> Kept:
    """Run a scene."""
    run = execute(scene)
    return Kept(run.history, run.summary)
