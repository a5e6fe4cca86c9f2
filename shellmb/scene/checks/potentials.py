"""Checks of potentials and contacts: where they act, and under which schemes."""

from collections import Counter
from itertools import combinations
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.checks.locations import ANY, check_place
from shellmb.scene.description import Description
from shellmb.scene.loads.contacts import Contact, EnclosedVolume
from shellmb.scene.multibody.elements import JointStop
from shellmb.scene.schemes import COMPLETE
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.validate import as_names, kind_of, listed, said, show


def check_potentials(scene: Description) -> None:
    """Check that they have names of their own, places, and an effect.

    Raises:
        SceneError: At the first thing that is impossible.
    """
    items: tuple[Any, ...] = (*scene.potentials, *scene.contacts)
    others: tuple[Any, ...] = (*scene.joints, *scene.drivers, *scene.force_elements)
    counts = Counter(item.name for item in (*others, *items, *scene.volumes))
    for item in (*items, *scene.volumes):
        who = said(item)
        if counts[item.name] > 1:
            raise SceneError(
                f"{who}: another potential, contact, joint, element or volume is named "
                f"'{item.name}'; each must have a name of its own, which its columns begin with"
            )
        if scene.linear:
            raise SceneError(
                f"{who}: with scheme '{scene.scheme_name}' displacements are small; the scheme "
                "must be one for large ones, as 'static' or 'ep' (of a foundation, terms are "
                "linearised)"
            )
    for item in items:
        (body,) = scene.bodies_of(item)
        check_place(body, item.at, said(item), ANY)
        points, places = body.point_names or (), as_names(item.at or ())
        if len({name in points for name in places}) > 1 and isinstance(places[0], str):
            raise SceneError(
                f"{said(item)}: at is {show(item.at)}; it must be edges and areas, or points, and "
                "not both"
            )
    for volume in scene.volumes:
        _enclosing(scene, volume)
    for volume, other in combinations(scene.volumes, 2):
        if {*_shells_of(scene, volume)} == {*_shells_of(scene, other)}:
            raise SceneError(
                f"{said(volume)} and {said(other)}: both are enclosed by "
                f"{listed(_shells_of(scene, volume))}; give each volume once: "
                "pressures would add up"
            )
    for contact in scene.contacts:
        if contact.obstacle.deforms:
            _faces(scene, contact, contact.obstacle)
        elif contact.obstacle_body is not None:
            _carrier(scene, contact)
    for stop in scene.force_elements:
        if isinstance(stop, JointStop) and scene.linear:
            raise SceneError(
                f"{said(stop)}: with scheme '{scene.scheme_name}' displacements are small; the "
                "scheme must be one for large ones, as 'static' or 'ep'"
            )
    if not scene.static:
        return
    damped: tuple[Any, ...] = (*scene.contacts, *scene.force_elements)
    for contact in damped:
        for what in ("relative_damping", "friction"):
            if getattr(contact, what, 0) > 0:
                raise SceneError(
                    f"{said(contact)}: {what} is {getattr(contact, what):g}; it must be 0, because "
                    f"scheme {show(scene.scheme_name)} has no velocities as 'ep' and 'ed' have"
                )


def _enclosing(scene: Description, volume: EnclosedVolume) -> None:
    """Refuse what encloses no volume, and bodies that do not deform as their meshes do."""
    who = said(volume)
    if not volume.shells and len(scene.shells) != 1:
        raise SceneError(
            f"{who}: shells is empty and the scene has {len(scene.shells)} shells; name those that "
            "enclose the volume"
        )
    for name in _shells_of(scene, volume):
        shell = scene.shell(name, who)
        if shell.model not in ("exact", "floating-frame"):
            raise SceneError(
                f"{who}: the model of shell '{name}' is {show(shell.model)}; it must be 'exact' or "
                "'floating-frame'"
            )


def _shells_of(scene: Description, volume: EnclosedVolume) -> tuple[str, ...]:
    return volume.shells or (scene.shells[0].name,)


def _faces(scene: Description, contact: Contact, faces: Any) -> None:
    """Refuse what contact with the faces of a shell is not made for."""
    (body,), who = scene.bodies_of(contact), said(contact)
    scene.body(faces.shell, f"{who}: shell of the faces", (Shell,))
    for name, models in ((body.name, ("exact", "rigid")), (faces.shell, ("exact",))):
        touching = scene.body(name, who)
        own, model = touching.model, scene.model_of(touching)
        # a beam that is glued to what is rigid has no points of its own
        if model not in (models if model == own else ("exact",)):
            raise SceneError(
                f"{who}: the model of '{name}' is {show(model)}; with the faces of a shell it must "
                f"be {' or '.join(map(show, models))} (what is rigid has points that touch, or "
                "carries a Box, see obstacle_body)"
            )
    if scene.scheme_name not in COMPLETE:
        raise SceneError(
            f"{who}: the scheme is '{scene.scheme_name}'; with the faces of a shell it must be "
            f"one of {listed(COMPLETE)}"
        )
    if scene.path is not None:
        raise SceneError(
            f"{who}: the scene follows a static path; with the faces of a shell there must be "
            "load steps (path=None)"
        )
    if contact.smoothing == 0:
        raise SceneError(
            f"{who}: smoothing is 0; with the faces of a shell it must be greater, a tenth of the "
            "penetration that is expected: nodes above the edges of elements touch and part at "
            "once, and Newton's method does not converge where forces jump"
        )
    if contact.preloaded or contact.obstacle_body is not None:
        what = "preloaded" if contact.preloaded else "obstacle_body"
        raise SceneError(
            f"{who}: {what} is {show(getattr(contact, what))}; with the faces of a shell it must "
            "be left out, because they move with the shell and nothing may touch at the start"
        )


def _carrier(scene: Description, contact: Contact) -> None:
    """Refuse an obstacle on a body that is not rigid, or on the one that it pushes."""
    (body,), who, name = scene.bodies_of(contact), said(contact), contact.obstacle_body
    carrier = scene.body(name, f"{who}: obstacle_body")
    if not carrier.rigid:
        raise SceneError(
            f"{who}: obstacle_body '{name}' is a {kind_of(carrier)} that deforms; it must be a "
            "rigid body, or a shell or beam with model='rigid'"
        )
    if carrier.name == body.name:
        raise SceneError(
            f"{who}: body and obstacle_body are both '{name}'; they must be two bodies"
        )
    if body.modes:
        raise SceneError(
            f"{who}: '{body.name}' is reduced to modes; with obstacle_body its model must be "
            "'exact', 'floating-frame' or 'rigid'"
        )
