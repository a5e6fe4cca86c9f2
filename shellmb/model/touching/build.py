"""Contacts of a scene with faces of shells."""

from __future__ import annotations

from collections.abc import Mapping

from mpi4py import MPI

from shellmb.errors import SceneError
from shellmb.model.potentials.points import MeshedBody, points_on
from shellmb.model.shells.shell import ShellModel
from shellmb.model.touching.faces import FacesContact
from shellmb.scene import Scene
from shellmb.scene.loads.contacts import Faces
from shellmb.scene.lookup import said


def faces_contacts(
    scene: Scene,
    comm: MPI.Comm,
    meshed: Mapping[str, MeshedBody],
    shells: Mapping[str, ShellModel],
    length: float,
) -> list[FacesContact]:
    """All contacts with faces of shells; in one process.

    Args:
        scene: The scene.
        comm: Communicator.
        meshed: Shells and beams.
        shells: The shells among them.
        length: Size of the scene, m.

    Raises:
        SceneError: If there is no such place, points touch at the start, or there are several
            ranks.
    """
    found = []
    for item in scene.contacts:
        if not isinstance(item.obstacle, Faces):
            continue
        if comm.size > 1:
            raise SceneError(
                f"{said(item)}: there are {comm.size} ranks; contact with the faces of a shell "
                "runs on one, so start without mpiexec"
            )
        (body,) = scene.bodies_of(item)
        one = meshed[body.name]
        points = points_on(one, item.at, said(item))
        contact = FacesContact(item, points, one, shells[item.obstacle.shell], length)
        contact.check_start()
        found.append(contact)
    return found
