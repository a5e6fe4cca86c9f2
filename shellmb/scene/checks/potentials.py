"""Checks of potentials and contacts: where they act, and under which schemes."""

from collections.abc import Callable
from itertools import takewhile
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.checks.names import ANY, check_place
from shellmb.scene.description import Description
from shellmb.scene.loads.contacts import Contact, EnclosedVolume
from shellmb.scene.multibody.elements import JointStop
from shellmb.scene.schemes import COMPLETE
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.validate import Sentences, as_names, listed, said, show


def named_rules(scene: Description, item: Any) -> Sentences:
    """Refuse names that something else has, and small displacements."""
    others = ("potentials", "contacts", "volumes", "joints", "drivers", "force_elements")
    if sum(other.name == item.name for what in others for other in getattr(scene, what)) > 1:
        yield (
            "another potential, contact, joint, element or volume is named "
            f"'{item.name}'; each must have a name of its own, which its columns begin with"
        )
    if scene.linear:
        yield (
            f"with scheme '{scene.scheme_name}' displacements are small; the scheme must be one "
            "for large ones, as 'static' or 'ep' (of a foundation, terms are linearised)"
        )


def place_rules(scene: Description, item: Any) -> Sentences:
    """Refuse places of potentials and contacts that are not there, or of several kinds."""
    (body,) = scene.bodies_of(item)
    check_place(body, item.at, said(item), ANY)
    points, places = body.point_names or (), as_names(item.at or ())
    if len({name in points for name in places}) > 1 and isinstance(places[0], str):
        yield "at", "it must be edges and areas, or points, and not both"


def volume_rules(scene: Description, volume: EnclosedVolume) -> Sentences:
    """Refuse what encloses no volume, and bodies that do not deform as their meshes do."""
    if not volume.shells and len(scene.shells) != 1:
        many = f"shells is empty and the scene has {len(scene.shells)} shells"
        yield f"{many}; name those that enclose the volume"
    own = _shells_of(scene, volume)
    for name in own:
        shell = scene.shell(name, said(volume))
        if not shell.nodal:
            yield (
                f"the model of shell '{name}' is {show(shell.model)}; it must be 'exact' or "
                "'floating-frame'"
            )
    for other in takewhile(lambda one: one is not volume, scene.volumes):
        same = _shells_of(scene, other)
        if {*own} == {*same}:
            raise SceneError(
                f"{said(other)} and {said(volume)}: both are enclosed by {listed(same)}; give each "
                "volume once: pressures would add up"
            )


def _shells_of(scene: Description, volume: EnclosedVolume) -> tuple[str, ...]:
    return volume.shells or (scene.shells[0].name,)


def contact_rules(scene: Description, contact: Contact) -> Sentences:
    """Refuse what contact with faces of a shell, or with an obstacle on a body, cannot have."""
    if contact.obstacle.deforms:
        return _faces(scene, contact, contact.obstacle)
    return _carrier(scene, contact)


def _faces(scene: Description, contact: Contact, faces: Any) -> Sentences:
    (body,), who = scene.bodies_of(contact), said(contact)
    scene.body(faces.shell, f"{who}: shell of the faces", (Shell,))
    with_faces = "with the faces of a shell"
    for name, models in ((body.name, ("exact", "rigid")), (faces.shell, ("exact",))):
        touching = scene.body(name, who)
        own, model = touching.model, scene.model_of(touching)
        # a beam that is glued to what is rigid has no points of its own
        if model not in (models if model == own else ("exact",)):
            yield (
                f"the model of '{name}' is {show(model)}; {with_faces} it must be "
                f"{' or '.join(map(show, models))} (what is rigid has points that touch, or "
                "carries a Box, see obstacle_body)"
            )
    if scene.scheme_name not in COMPLETE:
        known = listed(COMPLETE)
        yield f"the scheme is '{scene.scheme_name}'; {with_faces} it must be one of {known}"
    if scene.path is not None:
        steps = f"{with_faces} there must be load steps (path=None)"
        yield f"the scene follows a static path; {steps}"
    if contact.smoothing == 0:
        yield (
            f"smoothing is 0; {with_faces} it must be greater, a tenth of the penetration that is "
            "expected: nodes above the edges of elements touch and part at once, and Newton's "
            "method does not converge where forces jump"
        )
    if contact.preloaded or contact.obstacle_body is not None:
        yield (
            "preloaded" if contact.preloaded else "obstacle_body",
            f"{with_faces} it must be left out, because they move with the shell and nothing may "
            "touch at the start",
        )


def _carrier(scene: Description, contact: Contact) -> Sentences:
    name = contact.obstacle_body
    if name is None:
        return
    (body,), carrier = scene.bodies_of(contact), scene.body(name, f"{said(contact)}: obstacle_body")
    if not carrier.rigid:
        yield (
            f"obstacle_body '{name}' is a {carrier.label} that deforms; it must be a rigid "
            "body, or a shell or beam with model='rigid'"
        )
    if name == body.name:
        yield f"body and obstacle_body are both '{name}'; they must be two bodies"
    if body.modes:
        yield (
            f"'{body.name}' is reduced to modes; with obstacle_body its model must be 'exact', "
            "'floating-frame' or 'rigid'"
        )


def penalty_rules(scene: Description, item: Any) -> Sentences:
    """Refuse stops with small displacements, and what needs velocities without them."""
    if scene.linear and isinstance(item, JointStop):
        yield (
            f"with scheme '{scene.scheme_name}' displacements are small; the scheme must be one "
            "for large ones, as 'static' or 'ep'"
        )
    for what in ("relative_damping", "friction"):
        size = getattr(item, what, 0)
        if scene.static and size > 0:
            yield (
                f"{what} is {size:g}; it must be 0, because scheme {show(scene.scheme_name)} has "
                "no velocities as 'ep' and 'ed' have"
            )


RULES: tuple[tuple[str, Callable[[Description, Any], Sentences | None]], ...] = (
    ("potentials contacts volumes", named_rules),
    ("potentials contacts", place_rules),
    ("volumes", volume_rules),
    ("contacts", contact_rules),
    ("force_elements contacts", penalty_rules),
)
