"""A model that can be solved: consistent constraints, and in statics nothing that moves freely."""

from collections.abc import Sequence

from mpi4py import MPI

from shellmb.model.model import Model
from shellmb.model.rank_consistency import same_on_all
from shellmb.model.reduced.data import ModalBody, aligned
from shellmb.preprocessing.constraint_analysis.mobility import refuse_mechanisms
from shellmb.preprocessing.constraint_analysis.redundancy import Redundant, look_through
from shellmb.preprocessing.modal.reduce import reduce_bodies
from shellmb.scene import Scene


def checked_model(
    scene: Scene,
    comm: MPI.Comm,
    force: float | None = None,
    length: float | None = None,
    like: Sequence[ModalBody] = (),
) -> tuple[Model, list[Redundant]]:
    """Build the model of a scene and look it through, before anything large is built.

    Args:
        scene: The scene.
        comm: Communicator.
        force: Unit of the multipliers of constraints, N, as of `Model`.
        length: Characteristic length, m, as of `Model`.
        like: Bodies in modes of a scene nearby whose bases this one takes.

    Returns:
        The model, and the constraints that are left out of it because others imply them.

    Raises:
        SceneError: If something the scene names does not exist, constraints are redundant or
            contradict one another, or nothing holds a motion of a static scene.
    """
    same_on_all(scene, comm)
    scene, modal = reduce_bodies(scene, comm)
    if like:
        modal = aligned(modal, like, comm)
    model = Model(scene, comm, modal, force, length)
    redundant = look_through(model)
    if scene.static:
        refuse_mechanisms(model)
    return model, redundant
