"""Rotations in the history are continuous: those of probes, and those of all joints."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shellmb.observers.probes import WholeTurns
from shellmb.running.execute import execute
from shellmb.running.resume import resume
from shellmb.scene import (
    GROUND,
    Beam,
    Cylindrical,
    Event,
    InitialVelocity,
    JointDamper,
    Line,
    Offset,
    Planar,
    Probe,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Sensor,
    Solver,
    Weld,
)
from shellmb.simulate.simulation import BaseObserver, Simulation

TURN = 2 * np.pi


def followed(rotations: list[Rotation]) -> np.ndarray:
    """Continuous rotation vectors of a series of rotations."""
    turns = WholeTurns()
    found = []
    for rotation in rotations:
        found.append(turns.count(rotation.as_rotvec()))
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
    """The vector is one of the rotation, always; it counts on behind whole turns that tell no axis.

    Of what is left of a whole turn and a wobble no vector of the rotation is near `2 pi` times the
    axis before: there, and only there, it jumps.
    """
    angles = np.arange(0, 4 * TURN, 0.05)
    wobble = [
        Rotation.from_rotvec(0.02 * np.array([np.cos(7 * a), np.sin(5 * a), 0])) for a in angles
    ]
    rotations = [Rotation.from_rotvec((0, 0, a)) * w for a, w in zip(angles, wobble, strict=True)]
    found = followed(rotations)
    away = Rotation.from_rotvec(found) * Rotation.concatenate(rotations).inv()
    assert away.magnitude().max() < 1e-13
    tells = np.abs(np.angle(np.exp(1j * angles))) > np.pi / 2
    assert np.abs(found[tells, 2] - angles[tells]).max() < 0.03


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


def tumbling(scheme: str, turned: tuple[float, float, float]) -> Scene:
    """Two bodies on a hinge, one with a beam, that fly and tumble; all rotations, three points."""
    points = {"o": (0.0, 0, 0), "x": (1.0, 0, 0), "y": (0, 1.0, 0), "z": (0, 0, 1.0)}
    section = RectangularSection(E=2e11, nu=0.3, width=0.05, height=0.03, density=1.0)
    ends = {name: Offset("end", at) for name, at in points.items()}
    places = {"first": points, "other": points, "beam": ends}
    at: dict[str, Any] = {"first": "o", "other": "o", "beam": "end"}
    return Scene(
        "tumbling",
        rigid_bodies=[
            RigidBody("first", 1.0, (1e-2, 2e-2, 2.5e-2), rotation=turned, points=points),
            RigidBody("other", 1.0, (1e-2, 2e-2, 2.5e-2), position=(0.3, 0, 0), points=points),
        ],
        beams=Beam("beam", Line((0, 0, 0), (0.1, 0.2, 0)), section, elements=1),
        joints=[
            Revolute("hinge", "first", "other", at=(0.1, 0.05, 0), axis=(0, 1, 1)),
            Weld("root", "first", "beam", at=(0, 0, 0)),
        ],
        initial=InitialVelocity(spin=(0.3, 4.0, 0.3)),
        probes=[
            Probe(f"{b}_{name}{k}", to if b == "beam" else name, "position", k, body=b)
            for b, each in places.items()
            for name, to in each.items()
            for k in range(3)
        ]
        + [Probe(f"{b}_r{k}", at[b], "rotation", k, body=b) for b in places for k in range(3)]
        + [Probe(f"rel{k}", "o", "rotation", k, body="other", frame="first") for k in range(3)],
        scheme=scheme,
        dt=0.04,
        t_end=6.0,
    )  # fmt: skip


@pytest.mark.parametrize("turned", [(0.0, 0.0, 0.0), (1.0, 2.0, -0.5)])
@pytest.mark.parametrize(
    "scheme", ["ep4", *(pytest.param(s, marks=pytest.mark.slow) for s in ("ep", "ed", "ed3"))]
)
def test_a_rotation_vector_is_that_of_three_points(scheme: str, turned: Any) -> None:
    """Kind: rotations of what tumbles: bodies, nodes of beams, seen from others, and of joints."""
    rows = execute(tumbling(scheme, turned)).history

    def columns(name: str) -> np.ndarray:
        return rows[[f"{name}{k}" for k in range(3)]].to_numpy()

    def frames(body: str) -> np.ndarray:
        arms = [columns(f"{body}_{p}") - columns(f"{body}_o") for p in "xyz"]
        return np.stack(arms, axis=-1)

    first, other, beam = frames("first"), frames("other"), frames("beam")
    turns = first @ first[0].T, other @ other[0].T, beam @ beam[0].T
    seen = first.transpose(0, 2, 1) @ other @ (first[0].T @ other[0]).T
    for name, matrices in zip(("first_r", "other_r", "beam_r", "rel"), (*turns, seen), strict=True):
        vectors = columns(name)
        assert np.abs(Rotation.from_rotvec(vectors).as_matrix() - matrices).max() < 1e-11
        # some of it is beyond half a turn, where what is counted matters
        assert name == "rel" or np.linalg.norm(vectors, axis=1).max() > 1.5 * np.pi
    hinge = rows["hinge.rotation"].to_numpy()[:, None] * (first[0].T @ (0, 1, 1)) / np.sqrt(2)
    assert np.abs(Rotation.from_rotvec(hinge).as_matrix() - seen).max() < 1e-11


class Stop(BaseObserver):
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
