"""Probes in the frame of a body: nothing moves rigidly there, and what bends is what is left."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shellmb.errors import SceneError
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Beam,
    Driver,
    InitialVelocity,
    Isotropic,
    Line,
    Offset,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    ShellRevolute,
    Weld,
)

TILT = (0.3, -0.2, 0.5)
HUB = RigidBody("hub", 5.0, (1.0, 1.0, 1.0), rotation=TILT, points={"rim": (0.1, 0.0, 0.0)})
STIFF = RectangularSection(E=2e15, nu=0.3, width=0.05, height=0.02, density=2700.0)
BLADE = Beam("blade", Line((0.1, 0, 0), (1.1, 0, 0)), STIFF, elements=2)
QUANTITIES = ("displacement", "velocity", "rotation", "angular_velocity")


def probes(quantities: Any, point: Any = "end", **more: Any) -> list[Probe]:
    return [Probe(f"{q}_{'xyz'[k]}", point, q, k, **more) for q in quantities for k in range(3)]


def read(row: Any, quantity: str) -> np.ndarray:
    return np.array([row[f"{quantity}_{c}"] for c in "xyz"])


@pytest.mark.parametrize(("frame", "frame_at"), [("hub", None), ("hub", "rim"), ("blade", "start")])
@pytest.mark.parametrize("scheme", ["ep", pytest.param("ed", marks=pytest.mark.slow), "ep4"])
def test_what_turns_with_the_frame_is_at_rest_in_it(scheme, frame, frame_at) -> None:
    """Free flight of a stiff blade on a hub, several turns about an axis that is no axis of it."""
    spin = 3.0 * np.array([0.1, 0.3, 1.0])
    point = Offset("end", (0.0, 0.1, 0.2))
    more = {"body": "blade", "frame": frame, "frame_at": frame_at}
    scene = Scene(
        "rotor",
        beams=BLADE,
        rigid_bodies=HUB,
        joints=Weld("root", "hub", "blade", at=(0.1, 0, 0)),
        initial=InitialVelocity(linear=(1, 2, 3), spin=tuple(spin)),
        probes=[
            *probes((*QUANTITIES, "position"), point, **more),
            Probe("moved", "end", body="blade"),
        ],
        scheme=scheme,
        dt=0.05,
        t_end=1.0,
    )  # fmt: skip
    rows = execute(scene).history
    assert np.ptp(rows["moved"]) > 1.0
    last = rows.iloc[-1]
    # it bends by what its own inertia does to it: 1e-8 of its length; rates of what is that stiff
    # are means over a step with EP and ED, and at its end with ep4
    for quantity in QUANTITIES if scheme == "ep4" else ("displacement", "rotation"):
        assert np.abs(read(last, quantity)).max() < 1e-5
    # the blade's own frame has its first axis along it; the hub's is tilted
    axes = np.eye(3) if frame == "blade" else Rotation.from_rotvec(TILT).as_matrix()
    at = {None: np.zeros(3), "rim": axes @ (0.1, 0, 0), "start": np.array([0.1, 0, 0])}[frame_at]
    # (of a beam along x the second axis is y)
    assert np.allclose(read(last, "position"), axes.T @ ((1.1, 0.1, 0.2) - at), atol=1e-6)


def test_rates_are_those_of_the_values() -> None:
    """Velocity and angular velocity in a frame that turns faster and faster, by differences."""
    scene = Scene(
        "arms",
        rigid_bodies=[HUB, RigidBody("arm", 1.0, (0.1, 0.2, 0.3), position=(0.1, 0, 0))],
        joints=[
            Revolute("shaft", GROUND, "hub", at=(0, 0, 0), axis=(0, 0, 1)),
            Revolute("elbow", "hub", "arm", at=(0.1, 0, 0), axis=(0, 0, 1)),
        ],
        drivers=[
            Driver("d", "shaft", rotation=lambda t: 2 * t**2),
            Driver("e", "elbow", rotation=lambda t: -3 * t**2),
        ],
        probes=[
            *probes(("position", *QUANTITIES[1:]), (0.6, 0.2, 0.1), body="arm", frame="hub"),
            Probe("out", (0.6, 0.2, 0.1), "velocity", "norm", body="arm"),
        ],
        scheme="ep4",
        dt=0.01,
        t_end=0.5,
    )  # fmt: skip
    rows = execute(scene).history
    t = rows["t"].to_numpy()
    R = Rotation.from_rotvec(TILT).as_matrix()
    angle = -3 * t**2
    arm = np.array([0.5, 0.2, 0.1])
    for k, row in rows.iloc[1:].iterrows():
        turn = Rotation.from_rotvec([0, 0, angle[k]]).as_matrix()
        rate = np.cross((0, 0, -6 * t[k]), turn @ arm)
        assert np.allclose(read(row, "position"), R.T @ (turn @ arm + (0.1, 0, 0)), atol=1e-9)
        assert np.allclose(read(row, "velocity"), R.T @ rate, atol=1e-6)
        assert np.allclose(read(row, "rotation"), R.T @ (0, 0, angle[k]), atol=1e-9)
        assert np.allclose(read(row, "angular_velocity"), R.T @ (0, 0, -6 * t[k]), atol=1e-6)


def test_blade_of_a_rotor_stretches_as_its_hub_sees() -> None:
    """Steady rotation: `E u' = rho w^2 ((r + L)^2 - (r + x)^2) / 2`, a bar with its root at `r`."""
    E, rho, r, L, w = 1e9, 1000.0, 0.5, 1.0, 20.0
    section = RectangularSection(E=E, nu=0.0, width=0.1, height=0.1, density=rho)
    stretch = rho * w**2 / (2 * E) * ((r + L) ** 2 * L - ((r + L) ** 3 - r**3) / 3)
    scene = Scene(
        "rotor",
        beams=Beam("blade", Line((r, 0, 0), (r + L, 0, 0)), section, elements=4),
        rigid_bodies=RigidBody("hub", 5.0, (1.0, 1.0, 1.0)),
        joints=[
            Revolute("shaft", GROUND, "hub", at=(0, 0, 0), axis=(0, 0, 1)),
            Weld("root", "hub", "blade", at=(r, 0, 0)),
        ],
        # slowly enough that it does not ring
        drivers=Driver("motor", "shaft", rotation=Turns(w)),
        probes=[
            Probe("tip", "end", component=0, body="blade", frame="hub"),
            Probe("lag", "end", component=1, body="blade", frame="hub"),
            Probe("speed", "end", "velocity", "norm", body="blade", frame="hub"),
        ],
        scheme="ed3",
        alpha=0.5,
        dt=0.01,
        t_end=1.4,
    )
    last = execute(scene).history.iloc[-1]
    assert last["tip"] == pytest.approx(stretch, rel=2e-3)
    # what still rings across the blade, whose tip has moved by some 30 m
    assert abs(last["lag"]) < 0.1 * stretch and abs(last["speed"]) < 1e-2


class Turns:
    """The angle of a shaft that gets its speed smoothly within a second."""

    def __init__(self, speed: float) -> None:
        self.speed = speed

    def __call__(self, t: float) -> float:
        s = min(t, 1.0)
        # speed * (10 s^3 - 15 s^4 + 6 s^5), integrated
        return self.speed * (2.5 * s**4 - 3 * s**5 + s**6 + max(t - 1.0, 0.0))


SKIN = Isotropic(E=2e9, nu=0.3, thickness=0.01, density=1000.0)


def test_director_of_a_shell_in_the_frame_of_its_hub() -> None:
    """A stiff panel on a hub that turns: its director, in the axes of the hub, stays as it was."""
    scene = Scene(
        "panel",
        Shell("panel", Rectangle(0.4, 0.2), SKIN, mesh=(1, 1)),
        rigid_bodies=RigidBody("hub", 1.0, (0.1, 0.1, 0.1), rotation=TILT),
        joints=[ShellRevolute("a", "hub", "panel", at=(0, 0, 0)),
                ShellRevolute("b", "hub", "panel", at=(0, 0.2, 0))],
        redundant="drop",
        initial=InitialVelocity(spin=(0.5, 1.0, 2.0)),
        probes=probes(("director", "displacement"), "right-top", body="panel", frame="hub"),
        scheme="ep",
        dt=0.05,
        t_end=1.0,
    )  # fmt: skip
    last = execute(scene).history.iloc[-1]
    R = Rotation.from_rotvec(TILT).as_matrix()
    assert np.allclose(read(last, "director"), R.T @ (0, 0, 1), atol=2e-3)
    assert np.abs(read(last, "displacement")).max() < 2e-3


def rotor(**more: Any) -> Scene:
    return Scene(
        "s",
        Shell("panel", Rectangle(1.0, 1.0), SKIN, mesh=(1, 1)),
        beams=BLADE,
        rigid_bodies=HUB,
        scheme="ep",
        dt=0.1,
        t_end=1.0,
        **more,
    )


WRONG = {
    "probe 'p': frame_at is 'rim' and frame is missing; it must be the body": {"frame_at": "rim"},
    "probe 'p': frame: there is no body 'axle'; the scene has 'panel', 'blade', 'hub'": {
        "frame": "axle"
    },
    "probe 'p': frame is shell 'panel', whose nodes have a director only; it must be a rigid body, "
    "or a beam with frame_at": {"frame": "panel"},
    "probe 'p': frame_at is missing; it must be the node of beam 'blade' whose frame it is": {
        "frame": "blade"
    },
    "probe 'p': frame_at: rigid body 'hub' has no point 'tip'": {"frame": "hub", "frame_at": "tip"},
    "probe 'p': frame is 'hub' and quantity 'force', which has the axes of its own body; frame "
    "must be left out": {"frame": "hub", "quantity": "force"},
}


@pytest.mark.parametrize("message", WRONG)
def test_what_is_no_frame_is_refused(message) -> None:
    with pytest.raises(SceneError) as caught:
        rotor(probes=Probe("p", "end", body="blade", **WRONG[message]))
    assert message in str(caught.value)
