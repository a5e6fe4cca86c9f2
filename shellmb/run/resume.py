"""Go on with a run where it stopped."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mpi4py import MPI

from shellmb.observers.checkpoint import read_checkpoint
from shellmb.run.execute import RunResult, execute
from shellmb.run.loader import SceneModule
from shellmb.run.request import Request, read_request
from shellmb.run.standard import STATE
from shellmb.scene import Scene
from shellmb.simulate.simulation import Observer


def resume(
    out: Path | str,
    observers: Sequence[Observer] = (),
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
    scene: Scene | None = None,
) -> RunResult:
    """Go on with a run from its last state; serially it ends bit for bit as if never stopped.

    Args:
        out: The run directory.
        observers: The same additional observers as in the run.
        comm: Communicator, of as many ranks as the run's.
        pictures: Whether pictures are drawn.
        scene: The scene, for runs that were not started by `shellmb run`.

    Raises:
        SceneError: If the directory holds no run, or a state that does not fit.
        ConvergenceError: If the run fails again.
    """
    module: SceneModule | None = None
    request: Request | None = None
    if scene is None:
        request = read_request(out)
        scene, module = request.build()
    # killed before its first state a run has computed nothing: it begins again
    begun = comm.bcast((Path(out) / STATE / "state.json").is_file()) or request is None
    saved = read_checkpoint(Path(out) / STATE, comm) if begun else None
    results = module.results if module is not None else None
    return execute(
        scene,
        out,
        observers,
        comm=comm,
        pictures=pictures,
        request=request,
        results=results,
        saved=saved,
        again=not begun,
    )
