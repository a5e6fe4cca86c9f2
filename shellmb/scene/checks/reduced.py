"""What bodies that are reduced to modes cannot have."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from shellmb.errors import SceneError
from shellmb.scene.loads.body_loads import FollowerForce, FollowerMoment, PointMoment
from shellmb.scene.loads.loads import Gravity, PointForce
from shellmb.scene.lookup import bodies_of, said
from shellmb.scene.multibody.rolling import Contact
from shellmb.scene.probes import MOTIONS
from shellmb.scene.values.models import Modal

if TYPE_CHECKING:
    from shellmb.scene.description import Description

__all__ = ["check", "groups_of"]

AT_POINTS = (PointForce, PointMoment, FollowerForce, FollowerMoment)


def check(scene: Description) -> None:
    """Check what concerns bodies in modes.

    Raises:
        SceneError: At the first thing that they cannot have.
    """
    groups = list(groups_of(scene))
    if not groups:
        return
    _alike(scene)
    modal = {name: group for group in groups for name in group}
    for body in scene.meshed:
        if body.name in modal and body.terms:
            raise SceneError(
                f"{said(body)} is reduced to modes and has terms; they must be left out, or the "
                "model must be 'exact'"
            )
        if body.name in modal and (any(body.section.damping_times) or body.section.mass_damping):
            raise SceneError(
                f"{said(body)} is reduced to modes, and its section has damping; it must have none "
                "(joints may have dampers), or the model must be 'exact'"
            )
    acting: list[Any] = [*scene.potentials, *scene.contacts]
    for item in acting:
        (target,) = bodies_of(scene, item)
        if target.name in modal:
            raise SceneError(
                f"{said(item)}: {said(target)} is reduced to modes; what touches must be a rigid "
                "body, perhaps one that is welded to it, or the model must be 'exact'"
            )
    for support in scene.supports:
        for target in bodies_of(scene, support):
            if target.name in modal:
                raise SceneError(
                    f"{support.label}: {said(target)} is reduced to modes; it must be held by "
                    "joints to the ground, as by a Weld along an edge"
                )
    _loads(scene, modal)
    for joint in scene.joints:
        if isinstance(joint, Contact) and {joint.first, joint.second} & modal.keys():
            raise SceneError(
                f"{joint.said}: one of its bodies is reduced to modes; what rolls must be a rigid "
                "body or a beam with model='exact'"
            )
    for probe in scene.probes:
        (target,) = bodies_of(scene, probe)
        if target.name in modal and probe.quantity not in MOTIONS:
            raise SceneError(
                f"{said(probe)}: {said(target)} is reduced to modes, and quantity is "
                f"'{probe.quantity}'; it must be a motion, or the model 'exact'"
            )


def _alike(scene: Description) -> None:
    """What is joined along edges is reduced together; beams follow the shell they are glued to."""
    named = {body.name: body for body in scene.meshed}
    pairs = [(join.first, join.second, "join") for join in scene.joins]
    pairs += [(glue.shell, glue.beam, "glue") for glue in scene.glues]
    for first, second, what in pairs:
        one, other = (named[n].model for n in (first, second))
        wrong = isinstance(one, Modal) != isinstance(other, Modal)
        if what == "glue":
            wrong = wrong and not isinstance(one, Modal)
            wrong = wrong or (isinstance(one, Modal) and other == "rigid")
        if wrong or (isinstance(one, Modal) and isinstance(other, Modal) and one != other):
            raise SceneError(
                f"{what} of '{first}' and '{second}': their models are {_word(one)} and "
                f"{_word(other)}; what is reduced to modes and shares an edge is one body: both "
                "must have the same Modal(...), or be connected by joints"
            )


def _word(model: object) -> str:
    return f"Modal({model.modes})" if isinstance(model, Modal) else repr(model)


def _loads(scene: Description, modal: dict[str, tuple[str, ...]]) -> None:
    for load in scene.loads:
        for target in bodies_of(scene, load):
            group = modal.get(target.name, ())
            if not group or isinstance(load, AT_POINTS):
                continue
            if not isinstance(load, Gravity):
                raise SceneError(
                    f"{load.label}: {said(target)} is reduced to modes; its loads must be gravity, "
                    "or forces and moments at points"
                )
            if load.body is not None and len(group) > 1:
                raise SceneError(
                    f"{load.label}: '{target.name}' is one reduced body with "
                    f"{', '.join(repr(n) for n in group if n != target.name)}; gravity must act on "
                    "all of them: leave its body out"
                )


def groups_of(scene: Description) -> Iterator[tuple[str, ...]]:
    """Names of the shells and beams that make up each reduced body, in the order of the scene."""
    group = {b.name: b.name for b in scene.meshed if isinstance(b.model, Modal)}
    group |= {glue.beam: glue.beam for glue in scene.glues if glue.shell in group}
    pairs = [(join.first, join.second) for join in scene.joins]
    pairs += [(glue.shell, glue.beam) for glue in scene.glues]
    for first, second in pairs:
        if first in group and second in group:
            old, new = group[second], group[first]
            group = {name: new if g == old else g for name, g in group.items()}
    names = [b.name for b in scene.meshed if b.name in group]
    for head in dict.fromkeys(group[name] for name in names):
        yield tuple(name for name in names if group[name] == head)
