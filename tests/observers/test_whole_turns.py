"""Rotations in the history are continuous: those of probes, and those of all joints."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shellmb.observers.whole_rotations import WholeTurns
from shellmb.running.execute import execute
from shellmb.running.resuming.resume import resume
from shellmb.scene import (
    GROUND,
    Beam,
    Cylindrical,
    Event,
    InitialVelocity,
    JointDamper,
    Line,
    Planar,
    Probe,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Sensor,
    Solver,
)
from shellmb.simulate.simulation import Silent, Simulation

TURN = 2 * np.pi


def followed(rotations: list[Rotation]) -> np.ndarray:
    """Continuous rotation vectors of a series of rotations."""
    turns = WholeTurns()
    found = []
    for rotation in rotations:
        (vector,) = turns.nearest(rotation.as_rotvec()[None])
        found.append(turns.count(vector))
        # a restart in between changes nothing
        again = WholeTurns()
        again.restore(turns.state())
        turns = again
    return np.array(found)


@pytest.mark.parametrize("step", [0.01, -0.7, 3.0])
def test_turns_about_an_axis_that_stays(step: float) -> None:
    axis = np.array([1.0, -2.0, 2.0]) / 3
    angles = step * np.arange(40)
    # there and back again
    angles = np.concatenate([angles, angles[::-1]])
    found = followed([Rotation.from_rotvec(angle * axis) for angle in angles])
    # at half a turn a rotation vector has half the digits of a rotation
    np.testing.assert_allclose(found, angles[:, None] * axis, rtol=0, atol=1e-6)


def test_turns_of_what_wobbles() -> None:
    """Nothing jumps, at half turns and at whole ones; it is a rotation vector where that tells."""
    angles = np.arange(0, 4 * TURN, 0.05)
    wobble = [
        Rotation.from_rotvec(0.02 * np.array([np.cos(7 * a), np.sin(5 * a), 0])) for a in angles
    ]
    rotations = [Rotation.from_rotvec((0, 0, a)) * w for a, w in zip(angles, wobble, strict=True)]
    found = followed(rotations)
    # a step turns by 0.05, and tilts by a fifth of it; the axis of whole turns does not fluctuate
    assert np.abs(np.diff(found[:, 2])).max() < 0.06
    assert np.abs(found[:, 2] - angles).max() < 0.03
    tells = [abs(np.angle(np.exp(1j * a))) > np.pi / 2 + 0.1 for a in angles]
    away = Rotation.from_rotvec(found[tells]) * Rotation.concatenate(rotations)[tells].inv()
    assert away.magnitude().max() < 1e-7


def test_many_nodes_pass_half_a_turn_one_by_one() -> None:
    turns = WholeTurns()
    for angle in np.arange(0, 3 * TURN, 0.1):
        spread = angle + np.array([-0.3, 0.0, 0.2])
        vectors = Rotation.from_rotvec(spread[:, None] * [0, 1.0, 0]).as_rotvec()
        found = turns.count(turns.nearest(vectors).mean(axis=0))
        np.testing.assert_allclose(found, [0, spread.mean(), 0], rtol=0, atol=1e-6)


AXIS = (0.0, 0.6, 0.8)
RATE, SINK = -3.0, 0.1


def wheels(scheme: str = "ep4", **more: Any) -> Scene:
    """A wheel that turns and slides freely, and a beam that turns with it."""
    section = RectangularSection(E=2e11, nu=0.3, width=0.05, height=0.05, density=7800.0)
    axis = np.array(AXIS)
    return Scene(
        "wheels",
        rigid_bodies=RigidBody("wheel", 1.0, (1.0, 1.0, 1.0)),
        beams=Beam("beam", Line((0, 0, 0), tuple(0.2 * axis)), section, elements=1),
        joints=[
            Cylindrical("hub", GROUND, "wheel", at=(0, 0, 0), axis=AXIS),
            Revolute("pin", "wheel", "beam", at=(0, 0, 0), axis=AXIS),
        ],
        initial=[
            InitialVelocity(linear=tuple(SINK * axis), spin=tuple(RATE * axis)),
        ],
        probes=[
            *(Probe(f"turn_{k}", "origin", "rotation", k, body="wheel") for k in range(3)),
            Probe("beam", "end", "rotation", "norm", body="beam"),
            Probe("against", "end", "rotation", "norm", body="beam", frame="wheel"),
        ],
        scheme=scheme,
        dt=0.1,
        t_end=5.0,
        **more,
    )


def test_a_puck_on_a_table_counts_its_turns() -> None:
    """Kind: joints that turn about one axis; nothing can act on this one."""
    slides = np.cross(AXIS, (1.0, 0.0, 0.0))
    scene = Scene(
        "puck",
        rigid_bodies=RigidBody("puck", mass=1.0, inertia=(1.0, 1.0, 1.0)),
        joints=Planar("table", GROUND, "puck", at=(0, 0, 0), normal=AXIS),
        initial=InitialVelocity(linear=tuple(slides), spin=tuple(RATE * np.array(AXIS))),
        scheme="ep",
        dt=0.1,
        t_end=5.0,
    )
    rows = execute(scene).history
    # a step of the mid-point rule
    step = 2 * np.arctan(RATE * 0.1 / 2)
    np.testing.assert_allclose(rows["table.rotation"], step * rows["step"], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=pytest.mark.slow)])
def test_probes_and_joints_of_a_wheel(scheme: str) -> None:
    """Two turns and more; with and without something on the joint its columns are the same."""
    rows = execute(wheels(scheme)).history
    rate = RATE if scheme == "ep4" else -2 * np.arctan(-RATE * 0.1 / 2) / 0.1
    angle = rate * rows["t"].to_numpy()
    # the error of ep4 itself
    near = {"rtol": 1e-4, "atol": 1e-6}
    for k in range(3):
        np.testing.assert_allclose(rows[f"turn_{k}"], angle * AXIS[k], **near)
    np.testing.assert_allclose(rows["beam"], np.abs(angle), **near)
    np.testing.assert_allclose(rows["against"], 0, atol=1e-5)
    np.testing.assert_allclose(rows["hub.rotation"], angle, **near)
    np.testing.assert_allclose(rows["hub.translation"], SINK * rows["t"], **near)
    np.testing.assert_allclose(rows["pin.rotation"], 0, atol=1e-6)
    kinds = ("rotation", "translation")
    damped = [JointDamper(f"none {kind}", "hub", 1e-12, coordinate=kind) for kind in kinds]
    twin = execute(wheels(scheme, force_elements=damped)).history
    for kind in kinds:
        np.testing.assert_allclose(twin[f"hub.{kind}"], rows[f"hub.{kind}"], rtol=0, atol=1e-7)


class Stop(Silent):
    """Stops behind a step."""

    def accepted(self, simulation: Simulation) -> None:
        if simulation.step == 20:
            raise KeyboardInterrupt


def test_event_on_a_probe_and_a_restart(tmp_path: Path) -> None:
    """An event beyond half a turn goes off; a run that is resumed at a whole one counts on."""
    event = Event("far", when=Sensor("turn_2") <= 4.0 * RATE * AXIS[2])
    scene = wheels(events=event, solver=Solver(newton="full"))
    whole = execute(scene)
    # the error of ep4 itself
    assert whole.summary["events"]["far"]["times"] == [pytest.approx(4.0, abs=1e-3)]
    with pytest.raises(KeyboardInterrupt):
        execute(scene, tmp_path, [Stop()], pictures=False)
    resumed = resume(tmp_path, scene=scene, pictures=False).history
    for name in ("turn_0", "turn_2", "beam", "against", "hub.rotation", "pin.rotation"):
        np.testing.assert_array_equal(resumed[name], whole.history[name])
