"""Check that all ranks have the same scene: what is random, or requested otherwise, may differ."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

from shellmb.errors import SceneError
from shellmb.scene import Scene
from shellmb.scene.fingerprint import differences, fingerprint

# so many differences are named
NAMED = 3


def same_on_all(scene: Scene, comm: MPI.Comm) -> None:
    """Refuse scenes that differ from rank to rank, before anything is built of them; collective.

    Each rank would build its part of another scene: a mixture, or ranks that wait for one another
    for ever.

    Args:
        scene: The scene of this rank.
        comm: The ranks.

    Raises:
        SceneError: On all ranks, if they differ; says in what.
    """
    if comm.size == 1:
        return
    own = fingerprint(scene, whole=True)
    first: dict[str, Any] = comm.bcast(own)
    found = differences(first, own)
    wrong = None
    if found:
        said = ", ".join(
            f"{path} is {was} on rank 0 and {now} on rank {comm.rank}"
            for path, was, now in found[:NAMED]
        )
        more = f", and {len(found) - NAMED} more" if len(found) > NAMED else ""
        wrong = f"{said}{more}"
    wrong = next((w for w in comm.allgather(wrong) if w is not None), None)
    if wrong is not None:
        raise SceneError(
            f"scene '{scene.name}' differs from rank to rank: {wrong}; all ranks must describe the "
            "same scene: give random numbers a seed, and all ranks the same options"
        )
