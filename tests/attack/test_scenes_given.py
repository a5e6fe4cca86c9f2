"""Functions of the Python interface that take a scene, given something else.

The kind: what is callable but makes no scene, what cannot be called, functions whose parameters
Python does not tell, and functions that raise or lack values.
"""

import inspect
import itertools
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import pytest

import shellmb as sm
from tests.sensitivity import scenes
from tests.sentences import refusal

RECORD = pd.DataFrame({"t": [0.0, 1e-3, 2e-3], "tip": [0.0, 1.0, 2.0]})
# arguments beside the scene, where a function needs some
NEEDED: dict[str, tuple[Any, ...]] = {
    "sweep": ({"E": [2e11]},),
    "sensitivities": (("E",),),
    "adjoint": (lambda history: float(history["tip"][-1]), (), ("E",)),
    "frequency_sensitivities": (("E",),),
    "fit": (RECORD, ("E",)),
    "couple_precice": ("precice-config.xml", "plate"),
}
OPTIONS: dict[str, dict[str, Any]] = {"response": {"frequencies": [1.0]}}
TAKING = [
    name
    for name in sm._modules()
    if not inspect.isclass(getattr(sm, name))
    and next(iter(inspect.signature(getattr(sm, name)).parameters), None) == "scene"
]
NO_SCENES = [int, str, dict, max, print, np.sin, None, 3, [1], sm, scenes.plate().bodies[0]]


def test_which_ones_take_a_scene() -> None:
    assert {"run", "modes", "matrices", "study", "load_scene", *NEEDED} <= set(TAKING)


def test_no_scene() -> None:
    found = {}
    for name, given in itertools.product(TAKING, NO_SCENES):
        function = partial(getattr(sm, name), **OPTIONS.get(name, {}))
        said = refusal(partial(function, given, *NEEDED.get(name, ())))
        if "scene" not in said or len(said.splitlines()) != 1:
            found[name, repr(given)[:20]] = said
    assert not found


def raises(E: float = 2e11) -> sm.Scene:
    """A scene that divides by zero."""
    return scenes.plate(E=E / 0)


def lacks(thickness: float, E: float = 2e11) -> sm.Scene:
    """A scene with a parameter that has no default."""
    return scenes.plate(E=E, thickness=thickness)


def in_order(E: float = 2e11, /) -> sm.Scene:
    """A scene whose parameter cannot be given by its name."""
    return scenes.plate(E=E)


def returns_none(E: float = 2e11) -> None:
    """A scene function without its return."""
    scenes.plate(E=E)


@pytest.mark.parametrize("name", ["sensitivities", "adjoint", "frequency_sensitivities", "fit"])
@pytest.mark.parametrize(
    ("make", "says"),
    [
        (raises, r"scene 'raises': its function fails: test_scenes_given\.py, line .*division"),
        (lacks, "'thickness' has no default; give it one, or a value by values={'thickness'"),
        (in_order, "scene 'in_order' has no parameter 'E'; it has none"),
        (returns_none, "its function returns NoneType; it must return a Scene"),
    ],
)
def test_functions_that_make_no_scene(name: str, make: Any, says: str) -> None:
    with pytest.raises(sm.SceneError, match=says):
        getattr(sm, name)(make, *NEEDED[name])


def test_directories_that_are_none() -> None:
    with pytest.raises(sm.SceneError, match="load: directory is 3; it must be a path"):
        sm.load(3)  # type: ignore[arg-type]
    with pytest.raises(sm.SceneError, match="resume: out is 3; it must be a path"):
        sm.resume(3)  # type: ignore[arg-type]
    with pytest.raises(sm.SceneError, match="resume: scene is a function; it must be the Scene"):
        sm.resume("anywhere", scenes.plate)  # type: ignore[arg-type]
