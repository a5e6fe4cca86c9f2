"""Former names of parameters and choices, for the error of a scene that still uses one.

`docs/reference/vocabulary.md` lists them, and the rules that the names of today follow.
"""

from collections.abc import Collection, Mapping
from typing import Any

from shellmb.errors import warn

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
    "viscosity": ("damping",),
    "tolerance": ("step_error",),
    "damping": ("stiffness_damping", "relative_damping"),
}

# parameter and former choice -> the choice of today
CHOICES = {("model", "linear"): "floating-frame"}

# fields of scenes as runs have stored them, by their paths
STORED = {"step_control.tolerance": "step_control.step_error"}

# what scenes were written with longest: read as before, with a warning
STILL_READ = {("scene", "elements"): "force_elements"}
STILL_CHOSEN = {("scene", "scheme", "linear"): "linear-statics"}


def still_read(label: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments by their names of today, where a former name is still read; it warns of each.

    Args:
        label: What a user calls an object of the class.
        given: The arguments that have names.
    """
    found = {}
    for name, value in given.items():
        today = STILL_READ.get((label, name), name)
        chosen = value
        if isinstance(value, str):
            chosen = STILL_CHOSEN.get((label, name, value), value)
        if (today, chosen) != (name, value):
            said = name if today != name else f"{name}={value!r}"
            now = today if today != name else f"{name}={chosen!r}"
            text = f"{label}: {said} is now called {now}; a later version will not read it"
            warn(text, FutureWarning)
        found[today] = chosen
    return found


def choice_of_today(name: str, choice: object) -> str:
    """Addition to an error about a choice that has a new name.

    Args:
        name: The parameter.
        choice: What it was given.
    """
    today = CHOICES.get((name, choice)) if isinstance(choice, str) else None
    return f"; {choice!r} is now called {today!r}" if today else ""


def name_of_today(former: str, names: Collection[str]) -> str | None:
    """The name that a parameter has today; None if it never had another one.

    Args:
        former: The name that was given.
        names: Names of the parameters of the class.
    """
    return next((name for name in RENAMED.get(former, ()) if name in names), None)
