"""Distances are of places, not of their names: these may be equal, and places may be one."""

from collections.abc import Callable
from typing import Any

import pytest

import shellmb as sm

BODIES = "a", "b"
ENDS: dict[str, Callable[..., dict[str, Any]]] = {
    "distance joint": lambda *at: {"joints": sm.Distance("d", *BODIES, at=at[0], second_at=at[1])},
    "distance joint of a length": lambda *at: {
        "joints": sm.Distance("d", *BODIES, at=at[0], second_at=at[1], length=1.0)
    },
    "distance joint over time": lambda *at: {
        "joints": sm.Distance("d", *BODIES, at=at[0], second_at=at[1], length=lambda t: 1 + t)
    },
    "spring": lambda *at: {"force_elements": sm.Spring("d", *BODIES, *at, stiffness=1.0)},
    "damper": lambda *at: {"force_elements": sm.Damper("d", *BODIES, *at, damping=1.0)},
}


def two(apart: float, **more: Any) -> sm.Scene:
    """Two rigid bodies along x."""
    bodies = [
        sm.RigidBody(name, 1.0, (1.0,) * 3, position=(k * apart, 0, 0), points={"lug": (0, 0, 0)})
        for k, name in enumerate(BODIES)
    ]
    return sm.Scene("two", rigid_bodies=bodies, dt=1e-2, t_end=2e-2, scheme="ep4", **more)


@pytest.mark.parametrize("kind", ENDS)
@pytest.mark.parametrize("name", ["origin", "center"])
def test_points_of_two_bodies_may_have_one_name(kind: str, name: str) -> None:
    """Each body has a point of that name, 1 m from that of the other."""
    run = sm.run(two(1.0, **ENDS[kind](name, name)), pictures=False)
    assert len(run.history) == 3


@pytest.mark.parametrize("kind", ENDS)
@pytest.mark.parametrize(
    "at", [("origin", "center"), ((0.0,) * 3,) * 2, ((0.1 + 0.2, 0, 0), (0.3, 0, 0))]
)
def test_points_at_one_place_are_refused(kind: str, at: Any) -> None:
    """Whatever the points are called, and where round-off alone is between them: no direction."""
    label = kind.split(" of")[0].split(" over")[0]
    says = f"{label} 'd': its ends are at the same point; they must be apart"
    with pytest.raises(sm.SceneError, match=says):
        sm.run(two(0.0, **ENDS[kind](*at)), pictures=False)


def test_lengths_over_time_do_not_become_negative() -> None:
    """The equation is that of the squares: the bodies would move apart again, without a word."""
    rope = sm.Distance(
        "rope", *BODIES, at="origin", second_at="origin", length=lambda t: 1 - t / 5e-3
    )
    says = r"'rope': value over time gives .* at t = 0.01; it must give a number greater than 0"
    with pytest.raises(sm.SceneError, match=says):
        sm.run(two(1.0, joints=rope), pictures=False)
