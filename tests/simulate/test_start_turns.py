"""Starts from another run keep whole turns of joints, which do not show in where bodies are.

The kind: what a state has besides positions. Springs, stops and columns of a second run lost the
turns that the first one counted wherever its unknowns were others than those of the first: a spring
where there was none, one more spring on another joint, a frame, a screw.
"""

import math
from pathlib import Path
from typing import Any

import pytest

import shellmb as sm

RATE, TIME, STIFFNESS, PITCH = 40.0, 0.5, 0.05, 0.1
INERTIA = 0.05
ENERGY = INERTIA * RATE**2 / 2
# nothing acts in the first run: three whole turns and more
ANGLE = RATE * TIME


def wheels(springs: str = "", joint: Any = sm.Revolute, **more: Any) -> sm.Scene:
    """Two wheels that spin one against the other on hinges a and b, with springs on some."""
    hinges = [
        joint(name, sm.GROUND, f"wheel_{name}", at=at, axis=(0, 0, 1), **_pitch(joint))
        for name, at in (("a", (0, 0, 0)), ("b", (1, 0, 0)))
    ]
    return sm.Scene(
        "wheels",
        rigid_bodies=[
            sm.RigidBody(f"wheel_{hinge.name}", 1.0, (0.03, 0.03, INERTIA), position=hinge.at)
            for hinge in hinges
        ],
        joints=hinges,
        force_elements=[
            sm.JointSpring(f"spring_{name}", name, STIFFNESS, coordinate="rotation")
            for name in springs
        ],
        scheme="ep4",
        dt=0.01,
        **{"t_end": TIME} | more,
    )


def _pitch(joint: Any) -> dict[str, float]:
    return {"pitch": PITCH} if joint is sm.Screw else {}


def spinning(folder: Path, springs: str = "", joint: Any = sm.Revolute, **more: Any) -> str:
    """Directory of a first run."""
    forward = PITCH * RATE / (2 * math.pi) if joint is sm.Screw else 0.0
    initial = [
        sm.InitialVelocity(
            (0, 0, sign * forward), (0, 0, sign * RATE), about=about, body=f"wheel_{name}"
        )
        for name, sign, about in (("a", 1, (0, 0, 0)), ("b", -1, (1, 0, 0)))
    ]
    sm.run(wheels(springs, joint, initial=initial, **more), folder, pictures=False)
    return str(folder)


# ep4 is 4e-5 behind at 0.4 rad in a step
NEAR = 1e-4


@pytest.mark.parametrize(
    ("springs", "joint"),
    [
        pytest.param("ab", sm.Revolute, id="hinges"),
        pytest.param("", sm.Revolute, id="columns"),
        pytest.param("ab", sm.Screw, id="screws", marks=pytest.mark.slow),
    ],
)
def test_what_was_counted_goes_on(springs: str, joint: Any, tmp_path: Path) -> None:
    """The energy of the wound springs is there, and no coordinate begins modulo a turn."""
    first = spinning(tmp_path / "first", joint=joint)
    history = sm.run(wheels(springs, joint, start=sm.FromRun(first))).history
    begin = history.iloc[0]
    assert abs(begin["a.rotation"] - ANGLE) < NEAR * ANGLE
    assert abs(begin["b.rotation"] + ANGLE) < NEAR * ANGLE
    if joint is sm.Screw:
        assert abs(begin["a.translation"] - PITCH * ANGLE / (2 * math.pi)) < NEAR
    kinetic = begin["kinetic_energy"]
    assert kinetic > 2 * ENERGY * (1 - NEAR)
    wound = len(springs) * STIFFNESS * ANGLE**2 / 2
    assert abs(begin["total_energy"] - kinetic - wound) < NEAR * (kinetic + wound)
    # round-off of some fifty steps
    assert abs(history["total_energy"].iloc[-1] / begin["total_energy"] - 1) < 1e-10


def test_one_more_spring_leaves_the_other_wound(tmp_path: Path) -> None:
    """`J x'' = -k x` with `k = J`: the first spring has the sine of the time, the second none."""
    first = spinning(tmp_path / "first", springs="a")
    history = sm.run(wheels("ab", start=sm.FromRun(first))).history
    right = RATE * math.sin(TIME)
    assert abs(history["a.rotation"].iloc[0] / right - 1) < NEAR
    assert abs(history["a.rotation"].iloc[-1] / (RATE * math.sin(2 * TIME)) - 1) < NEAR
    wound = STIFFNESS * ANGLE**2 / 2
    assert abs(history["total_energy"].iloc[0] / (2 * ENERGY + wound) - 1) < NEAR


def test_a_frame_has_the_turns_of_its_time(tmp_path: Path) -> None:
    """Of the row of the history at that time, not of the last one."""
    fields = ("director", "velocity", "director_velocity")
    first = spinning(tmp_path / "first", output=sm.Output(frames=5, fields=fields))
    at = sm.load(first).history["t"].iloc[25]
    begin = sm.run(wheels("ab", start=sm.FromRun(first, at=at))).history.iloc[0]
    assert abs(begin["a.rotation"] / (RATE * at) - 1) < NEAR


def test_a_driver_says_its_turns_itself(tmp_path: Path) -> None:
    """One that begins modulo a turn goes on from there."""
    first = spinning(tmp_path / "first")
    angle = sm.load(first).history["a.rotation"].iloc[-1] - 6 * math.pi
    driver = sm.Driver("motor", "a", rotation=lambda t: angle + RATE * t)
    scene = wheels(drivers=driver, start=sm.FromRun(first), assemble=True)
    history = sm.run(scene).history
    assert abs(history["a.rotation"].iloc[0] - angle) < 1e-9
    # nothing has to be pushed: round-off of 2 N m s
    assert abs(history["motor.torque"]).max() < 1e-5


@pytest.mark.parametrize("content", [None, "t,a.rotation\n0,x\n"], ids=["missing", "damaged"])
def test_turns_that_nobody_knows_are_told(content: str | None, tmp_path: Path) -> None:
    """Without the first run's history springs unwind by whole turns, and the run says so."""
    first = spinning(tmp_path / "first")
    history = Path(first) / "history.csv"
    history.unlink()
    if content is not None:
        history.write_text(content)
    with pytest.warns(
        sm.ShellmbWarning, match=r"whole turns of joints, is missing .* within half a turn"
    ):
        begin = sm.run(wheels("ab", start=sm.FromRun(first), t_end=0.02)).history.iloc[0]
    assert abs(begin["a.rotation"] - (ANGLE - 6 * math.pi)) < NEAR * ANGLE
