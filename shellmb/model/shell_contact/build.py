"""Contacts of a scene with faces of shells."""

from __future__ import annotations

from collections.abc import Mapping

from shellmb.model.locations.finder import Finder
from shellmb.model.potentials.points import MeshedBody, acting_points
from shellmb.model.shell_contact.faces import FacesContact
from shellmb.model.shells.shell import ShellModel
from shellmb.scene import Scene
from shellmb.scene.loads.contacts import Faces
from shellmb.scene.lookup import said


def faces_contacts(
    scene: Scene,
    find: Finder,
    meshed: Mapping[str, MeshedBody],
    rigid_meshes: Mapping[str, MeshedBody],
    shells: Mapping[str, ShellModel],
    length: float,
) -> list[FacesContact]:
    """All contacts with faces of shells; collective.

    Args:
        scene: The scene.
        find: Places on bodies.
        meshed: Shells and beams.
        rigid_meshes: Meshes of those that are rigid.
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
        points = acting_points(body.name, item.at, find, meshed, rigid_meshes, said(item))
        shell = shells[item.obstacle.shell]
        contact = FacesContact(item, points, meshed.get(body.name), shell, length)
        contact.check_start()
        found.append(contact)
    return found
