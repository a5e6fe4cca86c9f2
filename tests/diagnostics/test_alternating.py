"""Forces that alternate are named; those that move, vibrate or jump are not."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.diagnostics.base import RunWarning
from shellmb.diagnostics.unknown_forces import Alternating
from shellmb.observers.summary import Sources
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Contact,
    Cylindrical,
    Driver,
    Gravity,
    InitialVelocity,
    JointSpring,
    JointStop,
    Output,
    Plane,
    Prismatic,
    Revolute,
    RigidBody,
    Scene,
    Spring,
    Universal,
)
from shellmb.schemes.ed import EnergyDecaying
from shellmb.schemes.ep import EnergyPreserving
from shellmb.simulate.simulation import Simulation
from tests.mechanisms.test_rolling import DISC, Z, disc_scene, inclined

SPEED, RISE = 4.0, 0.2


def said(scene: Scene) -> list[RunWarning]:
    return [c for c in execute(scene).warnings if c.watch == "alternation"]


def run_up(t: float) -> float:
    """Angle of a motor that has its speed after 0.2 s."""
    if t > RISE:
        return SPEED * (t - RISE / 2)
    return SPEED / 2 * (t - RISE / math.pi * math.sin(math.pi * t / RISE))


def rotor(scheme: str, **more: Any) -> Scene:
    """An arm that a motor brings to its speed: then the torque should vanish."""
    return Scene(
        "rotor",
        rigid_bodies=RigidBody("arm", 2.0, (0.1, 0.1, 0.1), position=(0.5, 0, 0)),
        joints=Revolute("shaft", GROUND, "arm", at=(0, 0, 0), axis=(0, 0, 1)),
        drivers=Driver("motor", "shaft", rotation=run_up),
        scheme=scheme,
        **{"dt": 0.02, "t_end": 2.0} | more,
    )


def test_velocities_that_violate_constraints() -> None:
    (caution,) = said(rotor("ep"))
    assert "'motor.torque'" in caution.says and "--end-forces" in caution.says
    assert caution.value > 0.3
    for scheme in ("ed", "ep4", "ed3"):
        assert not said(rotor(scheme))
    # what is asked for at the ends of steps is there
    assert not said(rotor("ep", output=Output(end_forces=True)))


@pytest.mark.parametrize("scheme", [EnergyPreserving(), EnergyDecaying(1.0)])
def test_what_is_advised(scheme: Any) -> None:
    """No scheme of ours is known to do it with dissipation: the watch by itself."""
    rows = [{"motor.torque": (-1.0) ** k} for k in range(60)]
    watch = Alternating(cast(Sources, SimpleNamespace(history=SimpleNamespace(rows=rows))))
    output, mechanism = SimpleNamespace(end_forces=False), SimpleNamespace(joints={})
    scene, model = SimpleNamespace(output=output), SimpleNamespace(mechanism=mechanism, length=1.0)
    run = SimpleNamespace(scheme=scheme, scene=scene, model=model)
    (caution,) = watch.cautions(cast(Simulation, run))
    assert ("--scheme" in caution.says) == (scheme.dissipation()[0] == 0)
    assert "a smaller step, or --end-forces" in caution.says


@pytest.mark.parametrize(("dt", "count"), [(0.02, 1), (5e-4, 0)])
def test_what_vibrates_faster_than_steps(dt: float, count: int) -> None:
    spring = JointSpring("spring", "rail", stiffness=1e6)
    scene = Scene(
        "mass",
        rigid_bodies=RigidBody("mass", 2.0, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", GROUND, "mass", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=spring,
        initial=InitialVelocity(linear=(0.1, 0, 0)),
        scheme="ep",
        dt=dt,
        t_end=100 * dt,
    )
    found = said(scene)
    assert len(found) == count and all("'spring" in c.says for c in found)


def test_an_impact_does_not_alternate() -> None:
    """Forces of single steps among those of many, and forces that are round-off."""
    scene = Scene(
        "stop",
        rigid_bodies=RigidBody("mass", 2.0, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", GROUND, "mass", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=JointStop("end", "rail", lower=-0.1, upper=0.1, stiffness=1e5),
        initial=InitialVelocity(linear=(1.0, 0, 0)),
        scheme="ep",
        dt=2e-3,
        t_end=1.0,
    )
    assert not said(scene)


@pytest.mark.parametrize(("scheme", "scale"), [("ep", 1.0), ("ep", 1e-3), ("ep4", 1.0)])
def test_ends_of_steps_on_a_stiff_spring(scheme: str, scale: float) -> None:
    """A table shakes a mass on a stiff spring: means are right, ends of steps are said to be wrong.

    Those of EP alternate, those of EP4 stay away from the means on the same side, where a start
    with a jump of acceleration makes the spring vibrate.

    Args:
        scheme: Time scheme.
        scale: Unit of length, m.
    """
    w, along, phase = 1.2, (1, 0, 0), 0.0 if scheme == "ep" else math.pi / 2
    inertia = (1e-3 * scale**2,) * 3
    scene = Scene(
        "shaker",
        rigid_bodies=[
            RigidBody("table", 1.0, inertia),
            RigidBody("mass", 1.0, inertia, position=(scale, 0, 0)),
        ],
        joints=[
            Prismatic("rail", GROUND, "table", at=(0, 0, 0), axis=along),
            Prismatic("other", GROUND, "mass", at=(scale, 0, 0), axis=along),
        ],
        force_elements=Spring("spring", "table", "mass", (0, 0, 0), (scale, 0, 0), stiffness=1e7),
        drivers=Driver(
            "drive",
            "rail",
            translation=lambda t: scale * (math.sin(w * t + phase) - math.sin(phase)),
        ),
        initial=InitialVelocity(linear=(w * scale * math.cos(phase), 0, 0), body="mass"),
        output=Output(end_forces=True),
        scheme=scheme,
        dt=0.125,
        t_end=10.0,
    )
    run = execute(scene)
    (caution,) = [c for c in run.warnings if c.watch == "alternation"]
    assert "at the ends of steps" in caution.says and "means over steps" in caution.says
    assert caution.value > 0.5
    rows = run.history.iloc[1:]
    right = scale * w**2 * np.sin(w * (rows["t"] - 0.125 / 2) + phase)
    assert np.abs(rows["spring.force"] - right).max() < 0.05 * w**2 * scale
    assert np.abs(rows["spring.force_end"] - right).max() > w**2 * scale
    # without values at the ends of steps there is nothing to say
    assert not said(replace(scene, output=Output()))


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_friction_of_a_disc_beside_its_weight(scheme: str) -> None:
    """A disc that precesses steadily: along its way (F1) nothing holds it, as F3 does its weight.

    What EP has there is a hundredth of the weight, of one sign and the other.
    """
    tilt, circle = 1.1, 0.5
    rate, turn = DISC.rate(tilt, circle), 2 * math.pi / DISC.rate(tilt, circle)
    spin = rate * np.array(Z) + DISC.spin(tilt, circle) * inclined(tilt)[:, 1]
    found = said(disc_scene(tilt, spin, scheme, 0.0, turn / 80, turn))
    if scheme == "ep":
        (caution,) = found
        assert caution.says.startswith("the force of 'contact.F1' alternates")
        assert caution.value > 1
    else:
        assert not found


@pytest.mark.parametrize(
    ("speed", "tilt", "ends", "count"),
    [(1e-3, 0.0, False, 1), (1e-3, 0.5, True, 1), (1e-6, 0.5, False, 0)],
)
def test_friction_of_a_block_beside_its_weight(
    speed: float, tilt: float, ends: bool, count: int
) -> None:
    """A block that comes to rest, the faster the shorter the steps: EP reverses what slip is left.

    Of a thousandth of the slip nothing is said: its friction is less than that part of the weight.
    """
    mass, gravity, stiffness, slow = 2.0, 9.81, 2e5, 1e-3
    up, along = (math.sin(tilt), 0.0, math.cos(tilt)), (math.cos(tilt), 0.0, -math.sin(tilt))
    scene = Scene(
        "block",
        rigid_bodies=RigidBody(
            "block", mass, (0.01,) * 3, -mass * gravity / stiffness * np.array(up)
        ),
        loads=Gravity(tuple(-gravity * np.array(up))),
        contacts=Contact(
            "floor", Plane(normal=up), stiffness, friction=0.3, slip_speed=slow, preloaded=True
        ),
        initial=InitialVelocity(linear=tuple(speed * np.array(along))),
        output=Output(end_forces=ends),
        scheme="ep",
        dt=5e-3,
        t_end=0.5,
    )
    found = said(scene)
    assert len(found) == count and all("'floor'" in c.says for c in found)


def test_a_component_that_counts_is_compared_with_itself() -> None:
    """Sums hide what alternates in one of them, from a thousandth of the whole on."""
    for part, count in ((1.1e-3, 1), (0.9e-3, 0)):
        rows = [{"hub.F1": part * (-1.0) ** k, "hub.F2": 0.0, "hub.F3": 1.0} for k in range(60)]
        # what a controller reads of it
        rows = [row | {"pid.hub.F3": row["hub.F3"], "pid.hub.F1": 1.0} for row in rows]
        watch = Alternating(cast(Sources, SimpleNamespace(history=SimpleNamespace(rows=rows))))
        scene = SimpleNamespace(output=SimpleNamespace(end_forces=False))
        model = SimpleNamespace(length=1.0)
        run = SimpleNamespace(scheme=EnergyPreserving(), scene=scene, model=model)
        found = [*watch.cautions(cast(Simulation, run))]
        assert [c.says.split("'")[1] for c in found] == ["hub.F1"] * count


def test_forces_that_torques_do_not_need_are_round_off() -> None:
    """A driven cardan shaft has torques alone: the forces of its joints are 1e-14 of these."""
    bend = 0.5
    along = np.array([math.sin(bend), 0.0, math.cos(bend)])
    inertia = (0.01, 0.01, 0.02)
    shaft = Scene(
        "shaft",
        rigid_bodies=[
            RigidBody("in", 1.0, inertia, position=(0, 0, -0.2)),
            RigidBody("out", 1.0, inertia, position=tuple(0.2 * along)),
        ],
        joints=[
            Revolute("front", GROUND, "in", at=(0, 0, -0.2), axis=(0, 0, 1)),
            Universal(
                "cross",
                "in",
                "out",
                at=(0, 0, 0),
                axis=(0, 1, 0),
                second_axis=(math.cos(bend), 0, -math.sin(bend)),
            ),
            Cylindrical("rear", GROUND, "out", at=tuple(0.2 * along), axis=tuple(along)),
        ],
        redundant="drop",
        drivers=Driver("motor", "front", rotation=lambda t: 6 * t * t),
        scheme="ep",
        dt=1e-2,
        t_end=0.6,
    )
    assert not said(shaft)
