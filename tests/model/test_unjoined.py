"""Shells that touch where nothing connects them are warned of, and no others.

The kind: an edge on another shell, by any mesh, model, angle, curve and extent.
"""

import warnings
from typing import Any

from mpi4py import MPI

import pytest

import shellmb as sm
from shellmb.model.model import Model

STEEL = sm.Isotropic(210e9, 0.3, 2e-3, 7800.0)


def plate(
    name: str = "q",
    origin: Any = (0.5, 0, 0),
    axis: Any = (1, 0, 0),
    mesh: tuple[int, int] = (2, 1),
    width: float = 0.1,
    **more: Any,
) -> sm.Shell:
    return sm.Shell(name, sm.Rectangle(0.5, width, origin, axis1=axis), STEEL, mesh=mesh, **more)


def arc(name: str, angles: tuple[float, float], rings: int = 3, z: float = 0.0) -> sm.Shell:
    return sm.Shell(name, sm.Cylinder(0.2, 0.5, angles, (0, 0, z)), STEEL, mesh=(rings, 1))


def wall(name: str, origin: Any, axis: Any, other: Any = (0, 0, 1)) -> sm.Shell:
    return sm.Shell(name, sm.Rectangle(1, 1, origin, axis1=axis, axis2=other), STEEL, mesh=(1, 1))


WALLS = [
    wall("1", (0, 0, 0), (1, 0, 0)),
    wall("2", (1, 0, 0), (0, 1, 0)),
    wall("3", (1, 1, 0), (-1, 0, 0)),
    wall("4", (0, 1, 0), (0, -1, 0)),
]
LID = wall("lid", (0, 0, 1), (1, 0, 0), (0, 1, 0))
ROUND = [sm.Join(a, b, "right", "left") for a, b in ("12", "23", "34", "41")]
P = plate("p", (0, 0, 0))
HALVES = [arc("a", (0, 180)), arc("b", (180, 360))]
RING = arc("a", (0, 360), 8)

TOUCH: dict[str, tuple[list[sm.Shell], Any]] = {
    "in a plane": ([P, plate()], "'p' and 'q' touch along 'right' and 'left'"),
    "at an angle": ([P, plate(axis=(0, 0, 1))], "as by Join.'p', 'q', 'right', 'left'."),
    "of other elements": ([P, plate(mesh=(2, 3))], "touch"),
    "triangles": ([P, plate(mesh=(2, 2), cell="tri")], "touch"),
    "rigid": ([P, plate(model="rigid")], "touch"),
    "in modes": ([P, plate(model=sm.Modal(modes=2))], "touch"),
    "floating": ([P, plate(model="floating-frame")], "touch"),
    "on a part of an edge": ([P, plate(width=0.05)], "'q' and 'p' touch along 'left'"),
    "on a line inside": (
        [plate("p", (0, 0, 0), mesh=(2, 2)), plate(origin=(0.25, 0, 0), axis=(0, 0, 1))],
        "along 'left' of 'q'.*'p' must be split there",
    ),
    "curved": ([arc("a", (0, 90)), arc("b", (0, 90), 4, z=0.5)], "touch along 'top'"),
    "rings": ([RING, arc("b", (0, 360), 12, z=0.5)], "touch along 'top' and 'bottom'"),
    "halves": (HALVES, "touch"),
}
NOT: dict[str, dict[str, Any]] = {
    "a gap": {"shells": [P, plate(origin=(0.501, 0, 0))]},
    "a gap of rings": {"shells": [RING, arc("b", (0, 360), 12, z=0.501)]},
    "a corner": {"shells": [P, plate(origin=(0.5, 0.1, 0))]},
    "copies": {"shells": [P, plate(origin=(0, 0, 0), mesh=(4, 3))]},
    "joined": {"shells": [P, plate()], "joins": sm.Join("p", "q", "right", "left")},
    "joined by a third": {
        "shells": [P, plate(), plate("r")],
        "joins": [
            sm.Join("p", "r", "right", "left"),
            sm.Join("r", "q", "left", "left", kind="smooth"),
        ],
    },
    "a hinge": {
        "shells": [P, plate()],
        "joints": sm.EdgeHinge("h", "p", "q", at="right", second_at="left"),
    },
    "a spring at corners": {
        "shells": [P, plate()],
        "force_elements": sm.Spring(
            "s", "p", "q", at="right-top", second_at="right-top", stiffness=1e3
        ),
    },
    "points on a rigid body": {
        "shells": [P, plate()],
        "rigid_bodies": sm.RigidBody("hub", 1.0, (1, 1, 1), position=(0.5, 0, 0)),
        "joints": [
            sm.ShellRevolute(f"{name} hub", "hub", name, axis=(0, 0, 1), second_at=at)
            for name, at in (("p", "right-bottom"), ("q", "left-bottom"))
        ],
    },
    "contact": {
        "shells": [P, plate()],
        "contacts": sm.Contact(
            "c", sm.Faces("p", thickness=1e-3), stiffness=1e5, body="q", at="right", smoothing=1e-4
        ),
    },
    "both supported": {
        "shells": [P, plate()],
        "supports": [sm.Clamped("right", body="p"), sm.Clamped("left", body="q")],
    },
    "halves joined twice": {
        "shells": HALVES,
        "joins": [sm.Join("a", "b", "right", "left"), sm.Join("b", "a", "right", "left")],
    },
    "a tube": {"shells": WALLS, "joins": ROUND},
    "a box with a lid": {
        "shells": [*WALLS, LID],
        "joins": ROUND,
        "joints": sm.EdgeHinge("h", "1", "lid", at="top", second_at="bottom"),
    },
}


def built(**more: Any) -> list[str]:
    """Warnings of a model that is built."""
    scene = sm.Scene("two", **{"scheme": "ep", "dt": 0.1, "t_end": 1.0} | more)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        Model(scene, MPI.COMM_WORLD)
    return [str(w.message) for w in found]


@pytest.mark.parametrize("case", TOUCH)
def test_shells_that_touch_are_warned_of(case: str) -> None:
    shells, message = TOUCH[case]
    with pytest.warns(sm.ShellmbWarning, match=message):
        scene = sm.Scene("two", shells, scheme="ep", dt=0.1, t_end=1.0)
        Model(scene, MPI.COMM_WORLD)


@pytest.mark.parametrize("case", NOT)
def test_others_are_not(case: str) -> None:
    assert built(**NOT[case]) == []


def test_a_join_that_is_forgotten_is_named() -> None:
    """Of two halves one, of four walls one: both shells are joined elsewhere."""
    (said,) = built(shells=HALVES, joins=sm.Join("a", "b", "right", "left"))
    assert "'a' and 'b' touch along 'left' and 'right'" in said
    (said,) = built(shells=WALLS, joins=ROUND[:3])
    assert "'1' and '4' touch along 'left' and 'right'" in said
    assert len(built(shells=[*WALLS, LID], joins=ROUND)) == 4
