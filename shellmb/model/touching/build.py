"""Contacts of a scene with faces of shells."""

from __future__ import annotations

from collections.abc import Mapping

from shellmb.model.potentials.points import MeshedBody, points_on
from shellmb.model.shells.shell import ShellModel
from shellmb.model.touching.faces import FacesContact
from shellmb.scene import Scene
from shellmb.scene.loads.contacts import Faces
from shellmb.scene.lookup import said


def faces_contacts(
    scene: Scene,
    meshed: Mapping[str, MeshedBody],
    shells: Mapping[str, ShellModel],
    length: float,
) -> list[FacesContact]:
    """All contacts with faces of shells; collective.

    Args:
        scene: The scene.
        meshed: Shells and beams.
        shells: The shells among them.
        length: Size of the scene, m.

    Raises:
        SceneError: If there is no such place, or points touch at the start.
    """
    found = []
    for item in scene.contacts:
        if not isinstance(item.obstacle, Faces):
            continue
        (body,) = scene.bodies_of(item)
        one = meshed[body.name]
        points = points_on(one, item.at, said(item))
        contact = FacesContact(item, points, one, shells[item.obstacle.shell], length)
        contact.check_start()
        found.append(contact)
    return found
