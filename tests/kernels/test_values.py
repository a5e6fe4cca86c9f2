"""Kernels do not depend on the values of a scene.

The kind: a number of the scene that a form holds as it is, or a form that is another one where two
numbers coincide. Each value would be read anew, and derivatives by it twice more.
"""

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

import pytest

import shellmb as sm
from shellmb.native.kernels import watched
from shellmb.running.execute import execute
from tests.bench.effects.rows import CASES
from tests.sensitivity import scenes

# all lengths by the same: what coincides or is parallel stays so, within the tolerances of meshes
OTHER = 1 - 1e-9
MESH = (2, 1)
QUICK = ("enclosed_volume", "joint_stop", "contact")
MADE = (scenes.balloon, scenes.heated, scenes.mechanism, scenes.meeting, scenes.panels)


def changed(item: Any) -> Any:
    """A description with all of its numbers a little changed."""
    if isinstance(item, float):
        return item * OTHER
    if type(item) is tuple:
        return tuple(changed(part) for part in item)
    if isinstance(item, dict):
        return {key: changed(part) for key, part in item.items()}
    if is_dataclass(item) and not isinstance(item, type):
        return replace(item, **{f.name: changed(getattr(item, f.name)) for f in fields(item)})
    return item


def kernels(scene: sm.Scene) -> set[str]:
    """Names of all kernels of a run of one step."""
    with watched() as found:
        execute(replace(scene, t_end=scene.dt))
    return found


def assert_kernels_stay(scene: sm.Scene) -> None:
    assert kernels(changed(scene)) == kernels(scene)


@pytest.mark.parametrize("name", QUICK)
def test_values_are_in_no_kernel(name: str) -> None:
    assert_kernels_stay(CASES[name].pair("ep", MESH)[0])


def test_kernels_stay_where_the_scene_is_of_length_one() -> None:
    # forces of joints and their moments are numerically alike there, and only there
    assert_kernels_stay(scenes.mechanism())


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if name not in QUICK])
def test_values_of_no_effect_are_in_a_kernel(name: str) -> None:
    assert_kernels_stay(CASES[name].pair("ep", MESH)[0])


@pytest.mark.slow
@pytest.mark.parametrize("scheme", scenes.DAMPED)
@pytest.mark.parametrize("make", MADE)
def test_values_are_in_no_kernel_of_any_scheme(make: Callable[..., sm.Scene], scheme: str) -> None:
    assert_kernels_stay(make(scheme=scheme))
