"""Former names of parameters, for the error of a scene that still uses one.

`docs/reference/vocabulary.md` lists them, and the rules that the names of today follow.
"""

from __future__ import annotations

from collections.abc import Collection

__all__ = ["RENAMED", "name_of_today"]

# former name -> the names that it may have today; a class has one of them at most
RENAMED: dict[str, tuple[str, ...]] = {
    "edge": ("at",),
    "point": ("at",),
    "where": ("at",),
    "on": ("at",),
    "node": ("at",),
    "first_edge": ("at",),
    "second_edge": ("second_at",),
    "windows": ("active",),
    "function": ("time",),
    "origin": ("about",),
    "angle": ("angle_rad", "rotation"),
    "turn": ("turn_deg",),
    "control": ("step_control",),
}


def name_of_today(former: str, names: Collection[str]) -> str | None:
    """The name that a parameter has today; None if it never had another one.

    Args:
        former: The name that was given.
        names: Names of the parameters of the class.
    """
    return next((name for name in RENAMED.get(former, ()) if name in names), None)
