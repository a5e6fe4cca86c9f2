"""Scenes that have no static path, and settings of paths that are refused."""

from typing import Any

import pytest

from shellmb.errors import SceneError
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Fixed,
    Isotropic,
    PathFollowing,
    Rectangle,
    Scene,
    Shell,
)


def strip(**more: Any) -> Scene:
    shell = Shell("strip", Rectangle(1.0, 0.2), Isotropic(1.0, 0.0, thickness=0.1), mesh=(2, 1))
    choices = {"supports": Clamped("left"), "path": PathFollowing()}
    choices |= {"loads": EdgeForce("right", (0.0, 0.0, 1e-4))}
    return Scene("strip", shell, **(choices | more))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scheme": "linear-statics"}, "has scheme 'linear-statics'; it must be 'static'"),
        ({"loads": ()}, "has no load to follow"),
        (
            {"loads": EdgeForce("right", (0.0, 0.0, 1.0), time=lambda t: t)},
            "edge force has a function of time",
        ),
        (
            {"supports": Fixed("left", displacement=(0.0, 0.0, lambda t: 1.0 + t))},
            "fixed components at 'left' is 1 at the load factor 0; it must be 0 there",
        ),
    ],
)
def test_scenes_without_a_path_say_why(change: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        strip(**change)


def test_settings_are_checked() -> None:
    with pytest.raises(SceneError, match="load_end is 0"):
        PathFollowing(load_end=0.0)
    with pytest.raises(SceneError, match=r"load_levels is \(0.5, 0.5\); they must be different"):
        PathFollowing(load_levels=(0.5, 0.5))
    with pytest.raises(SceneError, match=r"load_levels is \(0.5, 0.0\); they must be different"):
        PathFollowing(load_levels=(0.5, 0.0))
    with pytest.raises(
        SceneError, match=r"path following: turn_deg is 120; it must be less than 90"
    ):
        PathFollowing(turn_deg=120)


def test_another_scheme_leaves_the_path_out() -> None:
    assert strip().with_options(scheme="linear-statics").path is None
    assert strip().with_options(scheme="static").path is not None


def test_loads_that_move_nothing_are_an_error() -> None:
    with pytest.raises(SceneError, match="it has no effect at 'left'"):
        execute(strip(loads=EdgeForce("left", (0.0, 0.0, 1.0))))
