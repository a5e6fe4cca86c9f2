"""Names that become names of files, and columns of the history."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from shellmb.errors import SceneError
from shellmb.scene.lookup import said

if TYPE_CHECKING:
    from shellmb.scene.description import Description

# what separates folders, columns and texts
SEPARATORS = "/\\,;\"'"
# file systems take 255 bytes, endings included
LONGEST = 200
# files of all rigid bodies, of their shapes, of all joints, and of all obstacles
RESERVED = ("rigid_bodies", "solids", "joints", "obstacles")
# columns that every history has
COLUMNS = ("step", "t", "dt", "iterations", "rejected", "jump", "wall_s")


def check_names(scene: Description) -> None:
    """Refuse names that cannot be those of files and columns.

    Raises:
        SceneError: At the first.
    """
    named: tuple[Any, ...] = (
        *scene.bodies,
        *scene.joints,
        *scene.drivers,
        *scene.force_elements,
        *scene.couplings,
        *scene.potentials,
        *scene.contacts,
        *scene.volumes,
        *scene.probes,
        *scene.reserves,
        *scene.controllers,
        *scene.events,
    )
    for item in (scene, *named):
        wrong = _wrong(item.name)
        if wrong:
            raise SceneError(
                f"{item.label}: name is {item.name[:60]!r}, {wrong}; it must be possible as the "
                "name of a file and of a column: letters, digits, spaces, and signs such as "
                "_ - + . ( )"
            )
    files: dict[str, str] = {}
    for body in scene.meshed:
        stem = body.name.replace(" ", "_")
        if stem in RESERVED or stem in files:
            other = f"that of '{files[stem]}'" if stem in files else "that of all of them"
            raise SceneError(
                f"{said(body)}: its files would be called '{stem}', as {other}; it must have "
                "another name"
            )
        files[stem] = body.name
    columns: tuple[Any, ...] = (*scene.probes, *scene.reserves)
    for item in columns:
        if item.name in COLUMNS:
            raise SceneError(
                f"{said(item)}: every history has a column '{item.name}'; it must have another name"
            )


def _wrong(name: str) -> str:
    """Say what is wrong with a name, if anything is."""
    separators = [sign for sign in SEPARATORS if sign in name]
    if separators:
        return f"with {separators[0]} in it"
    if not name.isprintable():
        return "with a sign in it that cannot be printed"
    if name != name.strip():
        return "with a space at its end" if name.strip() else "of spaces only"
    if name.startswith("."):
        return "with a dot at its beginning"
    length = len(name.encode())
    return f"of {length} bytes (at most {LONGEST})" if length > LONGEST else ""
