"""Checks of bodies that are reduced to modes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from shellmb.errors import SceneError
from shellmb.scene.checks.multibody import mass_of
from shellmb.scene.loads.supports import at_rest
from shellmb.scene.lookup import bodies_of, said
from shellmb.scene.multibody.rolling import Contact
from shellmb.scene.values.models import Modal
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from shellmb.scene.description import Description


def check(scene: Description) -> None:
    """Check what concerns bodies in modes.

    Raises:
        SceneError: At the first thing that they cannot have.
    """
    groups = list(groups_of(scene))
    if not groups:
        return
    _alike(scene)
    for group in groups:
        _slowed_alike(scene, group)
        for body in scene.meshed:
            if body.name in group and not mass_of(body) > 0:
                raise SceneError(
                    f"{said(body)} is reduced to modes and has no mass, by which these are found, "
                    "in statics too; give its section a density"
                )
    modal = {name: group for group in groups for name in group}
    for support in scene.supports:
        for target in bodies_of(scene, support):
            if target.name in modal and not at_rest(support):
                raise SceneError(
                    f"{support.label}: {said(target)} is reduced to modes and would be moved; what "
                    "moves it must be a Driver of a joint, and supports must hold it where it is"
                )
    for joint in scene.joints:
        if isinstance(joint, Contact) and {joint.first, joint.second} & modal.keys():
            raise SceneError(
                f"{joint.said}: one of its bodies is reduced to modes; what rolls must be a rigid "
                "body or a beam with model='exact'"
            )


def _alike(scene: Description) -> None:
    """Check that shells with joined edges are reduced together, and glued beams with theirs."""
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


def _slowed_alike(scene: Description, group: tuple[str, ...]) -> None:
    """Modes know one mass matrix: what damps in proportion to it has one rate."""
    bodies = [body for body in scene.meshed if body.name in group]
    first = bodies[0]
    for body in bodies[1:]:
        if body.section.mass_damping != first.section.mass_damping:
            raise SceneError(
                f"{said(first)} and {said(body)} are one body in modes, and mass_damping of their "
                f"sections is {show(first.section.mass_damping)} and "
                f"{show(body.section.mass_damping)}; it must be the same, or the model 'exact'"
            )


def _word(model: object) -> str:
    return f"Modal({model.modes})" if isinstance(model, Modal) else repr(model)


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
