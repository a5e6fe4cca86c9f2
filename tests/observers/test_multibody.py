"""Observers of beams, rigid bodies and joints, against statics and rigid-body dynamics by hand."""

import json

import numpy as np
import pytest
import pyvista
from scipy.spatial.transform import Rotation

from shellmb.observers.account.constraints import Constraints
from shellmb.observers.fields.nodal import rotation_vectors
from shellmb.running.execute import execute
from shellmb.running.resume import resume
from shellmb.scene import (
    Beam,
    Clamped,
    Driver,
    Gravity,
    InitialVelocity,
    Line,
    PointForce,
    PointMoment,
    Probe,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Solver,
    Spherical,
    Weld,
)
from shellmb.simulate.simulation import BaseObserver, Simulation

G = 9.81
# ED dissipates; EP takes no alpha
ALPHA = {"ep": None, "ed": 0.5}
MASS, ARM, TURN = 2.0, 0.5, 0.2
INERTIA = TURN + MASS * ARM**2
BODY = RigidBody("arm", MASS, (0.01, TURN, TURN), com=(ARM, 0, 0), points={"tip": (1, 0, 0)})
PIN = Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0))
WEIGHT = Gravity((0, 0, -G))
BEAM = Beam(
    "bar",
    Line((0, 0, 0), (1, 0, 0)),
    RectangularSection(E=2e8, nu=0.3, width=0.05, height=0.03, density=1000.0),
    elements=4,
)


def pendulum(**options):
    given = {"joints": PIN, "loads": WEIGHT, "scheme": "ep", "dt": 0.01, "t_end": 0.1} | options
    return Scene("pendulum", rigid_bodies=BODY, **given)


def test_rotation_vectors_at_all_angles():
    axis = np.array([2.0, -1.0, 2.0]) / 3
    angles = [0.0, 1e-9, 0.3, 2.0, np.pi - 1e-9, np.pi - 1e-3, 3.1]
    vectors = np.concatenate([np.outer(angles, v) for v in (axis, -axis, *np.eye(3))])
    reference = np.tile(Rotation.from_rotvec([0.3, -0.7, 1.1]).as_matrix().T, (len(vectors), 1, 1))
    turned = np.einsum("nij,nkj->nki", Rotation.from_rotvec(vectors).as_matrix(), reference)
    # the last digits of an angle close to pi are those of the matrix
    assert np.allclose(rotation_vectors(reference, turned), vectors, rtol=0, atol=2e-14)
    half = Rotation.from_rotvec(np.pi * axis).as_matrix()
    found = rotation_vectors(np.eye(3)[None], half.T[None])[0]
    assert np.allclose(np.abs(found @ axis), np.pi) and np.linalg.norm(found) <= np.pi


@pytest.mark.parametrize("order", [("ground", "arm"), ("arm", "ground")])
def test_weld_carries_what_acts_on_the_body(order):
    """The reaction on the second body, whichever that is, by statics."""
    joint = Weld("weld", *order, at=(0.2, 0, 0))
    loads = (
        PointForce("tip", (1.0, 2.0, 3.0), body="arm"),
        PointMoment("tip", (4.0, 5.0, 6.0), body="arm"),
    )
    scene = Scene("weld", rigid_bodies=BODY, joints=joint, loads=loads, scheme="static", dt=1.0)
    last = execute(scene).history.iloc[-1]
    force = np.array([1.0, 2.0, 3.0])
    moment = np.array([4.0, 5.0, 6.0]) + np.cross((0.8, 0, 0), force)
    sign = -1 if order[1] == "arm" else 1
    assert np.allclose([last[f"weld.F{k}"] for k in (1, 2, 3)], sign * force, atol=1e-9)
    assert np.allclose([last[f"weld.M{k}"] for k in (1, 2, 3)], sign * moment, atol=1e-9)


@pytest.mark.parametrize("scheme", ["ep", "ed"])
def test_pin_of_a_pendulum(scheme):
    """In components along e1 = z and e2 = x of the ground: `F = m (a - g)`."""
    result = execute(pendulum(scheme=scheme, alpha=ALPHA[scheme], dt=1e-3, t_end=0.2))
    first, last = result.history.iloc[0], result.history.iloc[-1]
    assert np.isnan(first["pin.F1"])
    angle = result.simulation.problem.levels["rigid bodies"].q
    w = angle.x.array[result.simulation.model.rigid.local("arm", "w")]
    phi = np.arctan2(-w[2], 1 + w[0])
    spin2 = 2 * MASS * G * ARM * np.sin(phi) / INERTIA
    turn = MASS * G * ARM * np.cos(phi) / INERTIA
    along, across = np.array([np.cos(phi), -np.sin(phi)]), np.array([-np.sin(phi), -np.cos(phi)])
    x, z = MASS * ARM * (turn * across - spin2 * along) + (0, MASS * G)
    # the forces are those half a step earlier: first order
    assert np.allclose([last["pin.F1"], last["pin.F2"]], [z, x], atol=0.1)
    assert np.allclose([last["pin.F3"], last["pin.M1"], last["pin.M2"], last["pin.M3"]], 0)
    assert result.summary["joints"]["pin"] <= result.summary["constraint_max"] < 1e-14
    assert (result.summary["bodies"], result.summary["joint_count"]) == (1, 1)


def test_driver_reports_its_torque_and_angle():
    driver = Driver("motor", "pin", rotation=lambda t: 5 * t**2)
    result = execute(pendulum(drivers=driver, dt=1e-2))
    last = result.history.iloc[-1]
    assert np.isnan(result.history["motor.torque"].iloc[0])
    assert last["pin.rotation"] == pytest.approx(0.05, rel=1e-12)
    exact = 10 * INERTIA - MASS * G * ARM * np.cos(5 * 0.095**2)
    # at the middle of the step, to second order: (dt/T)^2 with T of the motion
    assert last["motor.torque"] == pytest.approx(exact, rel=1e-3)


def test_rigid_motion_is_measured_as_such():
    spin = InitialVelocity(linear=(1, 0, 0), spin=(0, 0, 3), about=(0, 0, 0))
    probes = (
        Probe("x", "tip", "position", 0),
        Probe("vx", "tip", "velocity", 0),
        Probe("vy", (1.0, 0.5, 0.0), "velocity", 1),
        Probe("vx2", (1.0, 0.5, 0.0), "velocity", 0),
        Probe("turn", "tip", "rotation", 2),
        Probe("spin", "tip", "angular_velocity", 2),
        Probe("u", "origin", "displacement", 1),
    )
    scene = pendulum(joints=(), loads=(), initial=spin, probes=probes, t_end=0.5)
    history = execute(scene).history
    first, last = history.iloc[0], history.iloc[-1]
    assert (first["x"], first["vx"], first["vy"]) == pytest.approx((1, 1, 3))
    assert (first["vx2"], first["spin"], first["turn"]) == pytest.approx((1 - 1.5, 3, 0))
    assert first["angular_momentum_z"] == pytest.approx(3 * INERTIA)
    # tan(phi/2) moves on by 3 dt/2 in each step of EP: the angle is off by (3 dt)^2/12
    assert last["turn"] == pytest.approx(1.5, rel=1e-4)
    assert last["spin"] == pytest.approx(3, rel=1e-4)
    # the centre moves on evenly, with 1.5 across its arm
    exact = 1.5 * 0.5 - 0.5 * np.sin(last["turn"])
    assert last["u"] == pytest.approx(exact, abs=1e-9)


def test_beam_resultants_at_nodes():
    """A cantilever: force and moment by statics, components along d1, d2, d3."""
    probes = tuple(
        Probe(f"{quantity} {name} {k}", point, quantity, k)
        for quantity in ("force", "moment")
        for name, point in (("start", "start"), ("middle", (0.5, 0.0, 0.0)), ("end", "end"))
        for k in (0, 1, 2)
    )
    force = np.array([3e-3, 2e-3, 1e-3])
    load = PointForce("end", tuple(force), body="bar")
    scene = Scene(
        "cantilever", beams=BEAM, supports=Clamped("start"), loads=load, probes=probes, dt=1.0
    )
    last = execute(scene).history.iloc[-1]
    for point, x in (("start", 0.0), ("middle", 0.5), ("end", 1.0)):
        found = [[last[f"{q} {point} {k}"] for k in (0, 1, 2)] for q in ("force", "moment")]
        # small loads: the beam turns by 1e-5
        assert np.allclose(found[0], force, atol=1e-6)
        assert np.allclose(found[1], np.cross((1 - x, 0, 0), force), atol=1e-6)


@pytest.mark.parametrize("scheme", ["ep", "ed"])
def test_momenta_of_a_free_chain(scheme):
    """A beam and a rigid body on a joint: weight and a force at a point explain the momenta."""
    hub = RigidBody(
        "hub", 0.7, (1e-3, 2e-3, 2e-3), position=(1.1, 0, 0), points={"out": (0.2, 0, 0)}
    )
    loads = (WEIGHT, PointForce("out", (1, 2, 0), body="hub"))
    joint = Spherical("ball", "bar", "hub", at="end")
    scene = Scene(
        "chain",
        beams=BEAM,
        rigid_bodies=hub,
        joints=joint,
        loads=loads,
        scheme=scheme,
        alpha=ALPHA[scheme],
        dt=2e-3,
        t_end=1e-2,
    )
    result = execute(scene)
    assert result.summary["linear_momentum_drift"] < 1e-12
    angular = result.summary["angular_momentum_drift"]
    # ED does not conserve it: the error of the scheme, and that is reported
    assert 1e-12 < angular < 1e-2 if scheme == "ed" else angular < 1e-12
    mass = 0.7 + 1000.0 * 0.05 * 0.03
    last = result.history.iloc[-1]
    impulse = np.array([1, 2, -mass * G]) * 1e-2
    assert np.allclose([last[f"momentum_{a}"] for a in "xyz"], impulse, rtol=1e-12)
    assert last["angular_momentum_y"] == pytest.approx(
        (0.7 * 1.1 + 1000.0 * 0.05 * 0.03 * 0.5) * G * 1e-2, rel=1e-3
    )


def test_violations_are_told_joint_by_joint():
    second = RigidBody("second", 1.0, (0.1, 0.1, 0.1), position=(1, 0, 0))
    joints = (PIN, Revolute("elbow", "arm", "second", at="tip", axis=(0, 1, 0)))
    scene = Scene(
        "double", rigid_bodies=(BODY, second), joints=joints, scheme="ep", dt=0.01, t_end=0.01
    )
    simulation = Simulation(scene)
    constraints = Constraints()
    constraints.start(simulation)
    assert constraints.joints == {"pin": 0.0, "elbow": 0.0}
    (group,) = simulation.model.mechanism.groups
    q = simulation.problem.levels[group.name].q
    row = int(np.flatnonzero(group.nodes.item == 1)[0])
    q.x.array[group.mixed.dofs["u2"].reshape(-1, 3)[row, 2]] = 1e-3
    constraints.accepted(simulation)
    assert constraints.joints["pin"] == 0.0
    assert constraints.joints["elbow"] == pytest.approx(1e-3 / simulation.model.length)
    assert constraints.constraint_max == constraints.joints["elbow"]


class Stop(BaseObserver):
    """Stops a run after three steps."""

    def accepted(self, simulation):
        if simulation.step == 3:
            raise KeyboardInterrupt


def test_directory_of_a_mechanism_and_its_resumption(tmp_path):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    # bit for bit with factorisations in each iteration: older ones are not saved
    scene = pendulum(probes=Probe("tip", "tip"), solver=Solver(newton="full"))
    expected = execute(scene, whole)
    names = {path.name for path in whole.iterdir()}
    assert names >= {"shape.png", "probes.png", "energy.png", "steps.png", "animation.gif"}

    series = json.loads((whole / "fields" / "rigid_bodies.vtu.series").read_text())["files"]
    last = pyvista.read(whole / "fields" / series[-1]["name"])
    # the centre, the origin, and the tip, with lines to the two
    assert (last.n_points, last.n_cells) == (3, 3)
    lengths = np.linalg.norm(last.points - last.points[0], axis=1)
    assert np.allclose(lengths, [0, ARM, 1 - ARM], atol=1e-7)
    assert last.points[2][2] == pytest.approx(expected.history["tip"].iloc[-1], rel=1e-6)
    joints = pyvista.read(whole / "fields" / "joints_0000.vtu")
    assert np.allclose(joints.points, 0) and joints.n_points == 2

    with pytest.raises(KeyboardInterrupt):
        execute(scene, parts, [Stop()], pictures=False)
    resumed = resume(parts, scene=scene, pictures=False)
    for name, array in expected.simulation.arrays().items():
        assert np.array_equal(array, resumed.simulation.arrays()[name])
    left, right = (r.history.drop(columns="wall_s") for r in (expected, resumed))
    assert np.array_equal(left.to_numpy(), right.to_numpy(), equal_nan=True)
    assert resumed.summary["joints"] == expected.summary["joints"]
