"""Parameters of shells' sections that are numbers in each element, in a scene."""

import re
from collections.abc import Callable
from dataclasses import fields as fields_of
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene import LinearSection, Scene, Shell


class ElementField(NamedTuple):
    """A parameter of a section that is a number in each element.

    Args:
        body: Name of the shell.
        name: Name of the parameter: "thickness", "angle", "offset", "plies[2].angle".
    """

    body: str
    name: str


def varying(scene: Scene, places: tuple[ElementField, ...]) -> Scene:
    """A scene in which those parameters are functions of the position, as they were.

    Args:
        scene: The scene.
        places: The parameters.

    Raises:
        SceneError: If there is no such shell or parameter, or its derivatives are not known.
    """
    shells = {shell.name: shell for shell in scene.shells}
    for body, name in places:
        shell = shells.get(body)
        if shell is None:
            known = ", ".join(f"'{s}'" for s in shells) or "none"
            raise SceneError(f"adjoint: there is no shell '{body}'; there are {known}")
        _refuse(shell)
        shells[body] = replace(shell, section=changed(shell, name, _as_function))
    return replace(scene, shells=tuple(shells.values())) if places else scene


def _refuse(shell: Shell) -> None:
    """Refuse bodies without elements, and sections not made of coefficients element by element."""
    how, kind = "rigid" if shell.rigid else "reduced to modes", type(shell.section).__name__
    wanting = {
        f"is {how}; fields of numbers need model='exact' or 'floating-frame', or differentiate by "
        "parameters of the scene function": not shell.nodal,
        f"has a {kind}; fields of numbers need a linear section": (
            not isinstance(shell.section, LinearSection)
        ),
        "has strains of its own; fields of numbers need strains=None": shell.strains is not None,
    }
    for said, there in wanting.items():
        if there:
            raise SceneError(f"adjoint: shell '{shell.name}' {said}")


def _as_function(value: Any) -> Callable[[Any], Any]:
    return value if callable(value) else lambda x: np.full(np.shape(x)[1], float(value))


def changed(shell: Shell, name: str, change: Callable[[Any], Any]) -> LinearSection:
    """The section with one of its parameters changed.

    Raises:
        SceneError: If it has no such parameter.
    """
    section: Any = shell.section
    found = re.fullmatch(r"plies\[(\d+)\]\.(thickness|angle)", name)
    plies = getattr(section, "plies", ())
    if found and int(found[1]) < len(plies):
        k, part = int(found[1]), found[2]
        ply = replace(plies[k], **{part: change(getattr(plies[k], part))})
        return replace(section, plies=(*plies[:k], ply, *plies[k + 1 :]))
    own = {f.name for f in fields_of(section)}
    known: list[str] = [n for n in ("thickness", "angle", "offset") if n in own]
    known += [f"plies[{k}].{n}" for k in range(len(plies)) for n in ("thickness", "angle")]
    if name not in known:
        raise SceneError(
            f"adjoint: the section of shell '{shell.name}' has no '{name}' that may vary; it has "
            + ", ".join(known)
        )
    return replace(section, **{name: change(getattr(section, name))})
