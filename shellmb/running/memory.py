"""Check that a run can fit the memory, from its scene before anything of it is made."""

import os

from mpi4py import MPI

from shellmb.errors import SceneError
from shellmb.model.rank_consistency import same_on_all
from shellmb.scene import Scene
from shellmb.scene.values.validate import show

# what an element of a shell takes at least, with its unknowns and rows of the matrix [bytes]: a
# bound from below and no estimate, so that nothing is refused that might fit
ELEMENT = 10e3
# and steps, whose history is kept: more do not fit any memory
STEPS = 1e8


def check_memory(scene: Scene, comm: MPI.Comm) -> None:
    """Refuse meshes and steps that cannot fit, whatever else runs; and ranks with different scenes.

    Args:
        scene: The scene.
        comm: Communicator; each of its ranks may be on a machine of its own.

    Raises:
        SceneError: Names the largest mesh, the steps, or in what the ranks differ.
    """
    same_on_all(scene, comm)
    _check_steps(scene)
    counts = {body.name: float(body.elements) for body in scene.meshed}
    total = sum(counts.values())
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if total * ELEMENT > memory * comm.size:
        largest = max(counts, key=lambda name: counts[name])
        fitting = memory * comm.size / ELEMENT
        raise SceneError(
            f"scene '{scene.name}': its meshes have {total:.2g} elements, {counts[largest]:.2g} of "
            f"them in '{largest}'; the memory ({memory / 1e9:.3g} GB) holds less than "
            f"{fitting:.2g}, so mesh must be coarser"
        )


def _check_steps(scene: Scene) -> None:
    """Refuse steps without end, of runs that nothing but their time ends."""
    free = scene.path is not None or scene.events or scene.step_control.step_error is not None
    if not free and scene.t_end / scene.dt > STEPS:
        raise SceneError(
            f"scene '{scene.name}': dt is {show(scene.dt)} and t_end {show(scene.t_end)}, which "
            f"are {scene.t_end / scene.dt:.1g} steps; they must be at most {STEPS:.0e}, or their "
            "history does not fit the memory"
        )
