"""Parts of a scene that an effect is about: chosen, changed, left out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from shellmb.demos.effects.effect import Change, Use, names
from shellmb.errors import SceneError
from shellmb.scene import Beam, Scene, Shell
from shellmb.scene.lookup import listed, said

Flexible = Shell | Beam
Fits = Callable[[Flexible], bool]


def flexible(scene: Scene) -> list[Flexible]:
    """Shells and beams that are not rigid."""
    return [body for body in scene.meshed if not body.rigid]


def chosen(items: Iterable[Any], part: str | None, what: str) -> list[Any]:
    """The item of that name, or all.

    Args:
        items: All that the effect can be changed of.
        part: A name, or None.
        what: What they are, for the error.

    Raises:
        SceneError: If there are none, or none of that name.
    """
    found = list(items)
    if not found:
        raise SceneError(f"the scene has no {what}")
    if part is None:
        return found
    fitting = [item for item in found if item.name == part]
    if not fitting:
        known = listed(item.name for item in found)
        raise SceneError(f"there is no {what} named '{part}'; it must be {known}")
    return fitting


def replaced(scene: Scene, bodies: Iterable[Any], **changes: Any) -> Scene:
    """The scene with some shells and beams changed."""
    some = {body.name for body in bodies}

    def changed(body: Any) -> Any:
        return replace(body, **changes) if body.name in some else body

    shells = tuple(map(changed, scene.shells))
    return replace(scene, shells=shells, beams=tuple(map(changed, scene.beams)))


def switches(field: str, fits: Fits, what: str, wanted: str | None = None) -> tuple[Change, Change]:
    """A field of shells and beams is False to leave an effect out, True to take it in.

    Args:
        field: Its name.
        fits: Which of the bodies can have it.
        what: What these are, for the error.
        wanted: The same where there is none to take it in; None: `what`.

    Returns:
        Both changes, as `Effect` takes them.
    """

    def switch(value: bool, called: str) -> Change:
        def change(scene: Scene, part: str | None) -> Scene:
            able = [b for b in scene.meshed if fits(b)]
            return replaced(scene, chosen(able, part, called), **{field: value})

        return change

    return switch(False, what), switch(True, wanted or what)


def use_of_field(field: str, fits: Fits, lacking: str) -> Callable[[Scene], Use]:
    """Decide whether any shell or beam that can have an effect has it.

    Args:
        field: Field by which it is switched.
        fits: Which of the bodies can have it.
        lacking: Why a scene cannot have it.
    """

    def use(scene: Scene) -> Use:
        able = [b for b in flexible(scene) if fits(b)]
        on = [b for b in able if getattr(b, field)]
        if not able:
            return Use(False, lacking)
        if not on:
            return Use(False, f"{field}=False of {names(able)}")
        off = [b for b in able if not getattr(b, field)]
        but = f", not of {names(off)}" if off else ""
        return Use(True, f"{field}=True of {names(on)}{but}")

    return use


def drop(where: str, kinds: tuple[type, ...], what: str) -> Change:
    """Leaves out parts of certain kinds.

    Args:
        where: Field of the scene that lists them.
        kinds: Their classes.
        what: What they are, for the error.
    """

    def change(scene: Scene, part: str | None) -> Scene:
        mine = [item for item in getattr(scene, where) if isinstance(item, kinds)]
        if part is not None and not all(hasattr(item, "name") for item in mine):
            raise SceneError(f"'{part}' is no choice here: a {what} has no name")
        gone = chosen(mine, part, what)
        kept = tuple(item for item in getattr(scene, where) if not any(item is g for g in gone))
        changes: dict[str, Any] = {where: kept}
        return replace(scene, **changes)

    return change


def use_of_parts(where: str, kinds: tuple[type, ...], lacking: str) -> Callable[[Scene], Use]:
    """Decide whether a scene lists parts of certain kinds.

    Args:
        where: Field of the scene that lists them.
        kinds: Their classes.
        lacking: What the scene does not have.
    """

    def use(scene: Scene) -> Use:
        found = [item for item in getattr(scene, where) if isinstance(item, kinds)]
        if not found:
            return Use(False, f"{where} has no {lacking}")
        some = ", ".join(dict.fromkeys(said(item) for item in found[:3]))
        more = f" and {len(found) - 3} more" if len(found) > 3 else ""
        return Use(True, f"{where}: {some}{more}")

    return use
