"""Drivers, screws, locks, windows, springs, dampers and motors on small mechanisms."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import ufl

from shellmb.demos.references.slider_crank import SliderCrank
from shellmb.errors import ConvergenceError, SceneError
from shellmb.observers.account.constraints import Constraints
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    Cylindrical,
    Driver,
    Gravity,
    InitialVelocity,
    InPlane,
    JointDamper,
    JointSpring,
    Lock,
    Motor,
    Prismatic,
    Revolute,
    RigidBody,
    Scene,
    Screw,
    Spherical,
    Spring,
)
from shellmb.simulate.simulation import BaseObserver, Simulation

G = 9.81
GRAVITY = Gravity((0, -G, 0))
ARM = RigidBody("arm", 2.0, (0.02, 0.3, 0.3), com=(0.5, 0, 0))
HINGE = Revolute("hinge", "ground", "arm", at=(0, 0, 0), axis=(0, 0, 1))
SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 0.5), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]


class Run(BaseObserver):
    """A run with its account and the coordinates after every step."""

    def __init__(self, scene: Scene) -> None:
        self.account, self.constraints, self.rows = EnergyAccount(), Constraints(), []
        self.simulation = Simulation(scene)
        self.simulation.run([self.account, self.constraints, self])

    def accepted(self, simulation: Simulation) -> None:
        mechanism = simulation.model.mechanism
        found = mechanism.coordinates(simulation.problem)
        found |= mechanism.elements(simulation.problem, simulation.t)
        self.rows.append({"t": simulation.t, **found, **self.account.values})

    def __getitem__(self, column: str) -> np.ndarray:
        return np.array([row[column] for row in self.rows])

    def holds(self) -> None:
        """Energy law and constraints; round-off grows with the number of steps."""
        error = self.account.relative_error
        assert error is not None
        assert error < 1e-10
        assert self.constraints.constraint_max is not None
        assert self.constraints.constraint_max < 1e-10


def swinging(**options: Any) -> Scene:
    given = {"joints": HINGE, "dt": 0.02, **options}
    return Scene("swinging", rigid_bodies=ARM, loads=GRAVITY, **given)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_account_with_every_element(scheme: str, alpha: float) -> None:
    c = 0.2
    elements = (
        JointSpring("coil", "hinge", stiffness=5.0, rest=0.3),
        JointSpring("stop", "hinge", potential=lambda x: 2 * (ufl.exp(-3 * x) + x**4)),
        JointDamper("damper", "hinge", damping=c),
        JointDamper("drag", "hinge", law=lambda rate: 0.1 * rate * abs(rate)),
        Spring("tie", "ground", "arm", (0, 1.0, 0), (1.0, 0, 0), stiffness=20.0),
        Spring("band", "ground", "arm", (1, 1, 1), (1, 0, 0), potential=lambda s: 3 * s**3),
        Motor("motor", "hinge", law=lambda x, rate, t: 2 * ufl.sin(8 * t) - 0.1 * rate + 0.3 * x),
    )
    spin = InitialVelocity(body="arm", spin=(0, 0, 6.0))
    options = {"scheme": scheme, "alpha": alpha, "initial": spin, "t_end": 1.0}
    run = Run(swinging(force_elements=elements, **options))
    run.holds()
    # the motion is no small one: springs of all kinds are stretched, the damper works
    assert np.ptp(run["hinge.rotation"]) > 1
    assert np.all(np.diff(run["dissipation"]) >= 0)
    assert (run["dissipation"][-1] > 1e-6) == (alpha > 0)
    angle = run["hinge.rotation"]
    tip = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    length = np.linalg.norm(tip - [0, 1, 0], axis=1)
    assert run["tie.length"] == pytest.approx(length, abs=1e-12)
    assert run["tie.force"] == pytest.approx(20 * (length - np.sqrt(2)), abs=1e-11)
    assert run["coil.torque"] == pytest.approx(5 * (angle - 0.3), abs=1e-12)
    exact = 6 * (-np.exp(-3 * angle)) + 8 * angle**3
    assert run["stop.torque"] == pytest.approx(exact, abs=1e-11)


@pytest.mark.parametrize(("scheme", "alpha"), [("ep", 0.0), ("ed", 1.0)])
def test_damper_takes_out_exactly_its_work(scheme: str, alpha: float) -> None:
    c, dt = 0.7, 0.02
    damper = JointDamper("damper", "hinge", damping=c)
    run = Run(swinging(force_elements=damper, scheme=scheme, alpha=alpha, t_end=0.4))
    steps = np.diff(run["hinge.rotation"], prepend=0.0)
    assert run["work_terms"] == pytest.approx(-np.cumsum(c * steps**2 / dt), rel=1e-12)
    # the mean rate over the whole step, to its accuracy
    assert run["damper.torque"][5:] == pytest.approx(c * (steps / dt)[5:], abs=0.15)


def test_a_potential_linear_in_the_angle_is_a_constant_torque() -> None:
    weight = JointSpring("weight", "hinge", potential=lambda x: 2.0 * x)
    spin = InitialVelocity(body="arm", spin=(0, 0, 1.0))
    scene = swinging(force_elements=weight, initial=spin, scheme="ep4", t_end=0.4)
    run = Run(replace(scene, loads=()))
    run.holds()
    assert run["weight.torque"] == pytest.approx(2.0, rel=1e-12)
    exact = run["t"] - run["t"] ** 2 / (0.3 + 2 * 0.25)
    assert run["hinge.rotation"] == pytest.approx(exact, abs=1e-7)


def test_turns_are_counted() -> None:
    spin = InitialVelocity(body="arm", spin=(0, 0, 20.0))
    scene = Scene(
        "spinning",
        rigid_bodies=ARM,
        joints=HINGE,
        initial=spin,
        force_elements=JointSpring("coil", "hinge", stiffness=0.1),
        scheme="ep",
        dt=0.01,
        t_end=2.0,
    )
    run = Run(scene)
    run.holds()
    w = np.sqrt(0.1 / (0.3 + 2 * 0.25))
    exact = 20 / w * np.sin(w * run["t"])
    assert exact[-1] > 11 * np.pi
    # a step turns by 2 atan(w dt / 2) in place of w dt = 0.2: 0.33 % less
    assert run["hinge.rotation"] == pytest.approx(exact, rel=4e-3)


R, L = 0.3, 1.0


def angle(t: float | np.ndarray) -> Any:
    return 4.5 * t + 0.5 * np.sin(3 * t)


def slider_crank(scheme: str, alpha: float, dt: float) -> Scene:
    crank = RigidBody("crank", 1.0, (0.001, 0.01, 0.01), com=(0.1, 0, 0))
    coupler = RigidBody("coupler", 2.0, (0.001, 0.2, 0.2), position=(R, 0, 0), com=(0.4, 0, 0))
    slider = RigidBody("slider", 1.5, (0.01, 0.01, 0.01), position=(R + L, 0, 0))
    end = (R + L, 0, 0)
    joints = (
        Revolute("bearing", "ground", "crank", at=(0, 0, 0), axis=(0, 0, 1)),
        Revolute("pin", "crank", "coupler", at=(R, 0, 0), axis=(0, 0, 1)),
        # a plane loop: a spherical joint would have one constraint too many
        InPlane("along", "coupler", "slider", at=end, normal=(1, 0, 0)),
        InPlane("across", "coupler", "slider", at=end, normal=(0, 1, 0)),
        Prismatic("guide", "ground", "slider", at=end, axis=(1, 0, 0)),
    )
    return Scene(
        "slider_crank",
        rigid_bodies=(crank, coupler, slider),
        joints=joints,
        loads=GRAVITY,
        drivers=Driver("motor", "bearing", rotation=lambda t: float(angle(t))),
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=1.6,
    )


@pytest.mark.parametrize(
    # EP's torque oscillates from step to step by a part of order dt, ED's is of second order
    ("scheme", "alpha", "tolerance"),
    [("ep", 0.0, 6e-3), ("ed", 0.0, 1e-3), ("ed", 0.5, 1e-3), ("ed", 1.0, 1e-3)],
)
def test_driving_torque(scheme: str, alpha: float, tolerance: float) -> None:
    dt = 0.01
    run = Run(slider_crank(scheme, alpha, dt))
    run.holds()
    assert run["bearing.rotation"] == pytest.approx(angle(run["t"]), abs=1e-12)
    assert run["bearing.rotation"][-1] > 2 * np.pi
    exact = SliderCrank(
        R,
        L,
        coupler_mass=2.0,
        coupler_center=0.4,
        coupler_inertia=0.2,
        slider_mass=1.5,
        crank_mass=1.0,
        crank_center=0.1,
        crank_inertia=0.02,
        gravity=G,
    )
    t = run["t"] - dt / 2
    torque = exact.motion(angle(t), 4.5 + 1.5 * np.cos(3 * t), -4.5 * np.sin(3 * t)).torque
    error = np.abs(run["motor.torque"] - torque) / np.max(np.abs(torque))
    # the first step starts from the exact velocities, which are not those of the scheme
    assert np.max(error[1:]) < tolerance


@pytest.mark.parametrize(("scheme", "alpha"), [("ep", 0.0), ("ed", 1.0)])
def test_screw_turns_as_it_falls(scheme: str, alpha: float) -> None:
    pitch, m, J = 0.5, 2.0, 0.02
    nut = RigidBody("nut", m, (0.3, 0.3, J), com=(0, 0, 0))
    screw = Screw("screw", "ground", "nut", at=(0, 0, 0), axis=(0, 0, 1), pitch=pitch)
    scene = Scene(
        "screw",
        rigid_bodies=nut,
        joints=screw,
        loads=Gravity((0, 0, -G)),
        scheme=scheme,
        alpha=alpha,
        dt=0.01,
        t_end=0.5,
    )
    run = Run(scene)
    run.holds()
    x, turned = run["screw.translation"], run["screw.rotation"]
    assert x == pytest.approx(pitch * turned / (2 * np.pi), abs=1e-13)
    ratio = 2 * np.pi / pitch
    acceleration = -m * G / (m + J * ratio**2)
    # of second order in the angle of a step, 0.3
    assert x[-1] == pytest.approx(acceleration * 0.5**2 / 2, rel=5e-3)


def test_two_coordinates_of_a_cylindrical_joint() -> None:
    collar = RigidBody("collar", 2.0, (0.3, 0.3, 0.5), position=(0, 0, 0.25))
    rod = Cylindrical("rod", "ground", "collar", at=(0, 0, 0), second_at="origin", axis=(0, 0, 1))
    k, J, m = 50.0, 0.5, 2.0
    scene = Scene(
        "collar",
        rigid_bodies=collar,
        joints=rod,
        initial=InitialVelocity(body="collar", spin=(0, 0, 0.02)),
        force_elements=(
            JointSpring("turn", "rod", stiffness=k, coordinate="rotation"),
            JointSpring("slide", "rod", stiffness=k, rest=0.1, coordinate="translation"),
        ),
        scheme="ed",
        alpha=0.0,
        dt=0.01,
        t_end=1.0,
    )
    run = Run(scene)
    run.holds()
    t, w = run["t"], np.sqrt(k / J)
    # fourth order: (w dt)^4/720 per radian; and the smallness of the angle
    assert run["rod.rotation"] == pytest.approx(0.02 / w * np.sin(w * t), abs=1e-6)
    exact = 0.1 * (1 - np.cos(np.sqrt(k / m) * t))
    assert run["rod.translation"] == pytest.approx(exact, abs=1e-6)


def test_lock_holds_and_releases() -> None:
    scene = swinging(locks=Lock("hinge", ((0.105, 0.3),)), scheme="ed", alpha=1.0, t_end=0.5)
    run = Run(scene)
    t, held = run["t"], run["hinge.rotation"]
    assert {0.105, 0.3} <= set(t)
    inside = (t >= 0.105) & (t <= 0.3)
    assert held[inside] == pytest.approx(held[t == 0.105][0], abs=1e-12)
    assert held[t == 0.105][0] < -0.03
    assert np.all(np.diff(held[t >= 0.3]) < 0)
    # a bar at rest: its weight on the lever
    settled = (t > 0.13) & (t <= 0.3)
    exact = 2 * G * 0.5 * np.cos(held[settled])
    assert run["hinge.lock_torque"][settled] == pytest.approx(exact, rel=1e-6)
    assert run["kinetic_energy"][settled] == pytest.approx(0.0, abs=1e-12)
    assert run["hinge.lock_torque"][t < 0.1] == pytest.approx(0.0, abs=1e-12)


def test_joint_lets_go() -> None:
    hook = Spherical("hook", "ground", "arm", at=(0, 0, 0), active=((0, 0.25),))
    scene = swinging(joints=hook, scheme="ep", t_end=0.5)
    run = Run(scene)
    run.holds()
    model, problem = run.simulation.model, run.simulation.problem
    assert 0.25 in run["t"]
    body, node, _, _ = model.nodes_of("arm")
    rates = problem.levels[body.name].rates["v"].x.array
    v = rates[body.mixed.dofs["u"].reshape(-1, 3)[node]]
    # thrown sideways: on the rank that has the body
    assert max(model.comm.allgather(float(np.max(np.abs(v[:, :1]), initial=0.0)))) > 0.1


def test_open_joint_cannot_begin_to_act() -> None:
    windows = ((0, 0.1), (0.2, 0.4))
    hook = Spherical("hook", "ground", "arm", at=(0, 0, 0), active=windows)
    scene = swinging(joints=hook, scheme="ep", t_end=0.5)
    with pytest.raises(ConvergenceError, match=r"joint 'hook' is to act from t = 0\.2 on"):
        Run(scene)


def test_statics() -> None:
    k = 30.0
    spring = JointSpring("coil", "hinge", stiffness=k)
    run = Run(swinging(force_elements=spring, scheme="static", dt=0.25, t_end=1.0))
    angle = run["hinge.rotation"][-1]
    assert k * angle == pytest.approx(-2 * G * 0.5 * np.cos(angle), rel=1e-10)
    driver = Driver("motor", "hinge", rotation=lambda t: 7.0 * t)
    run = Run(swinging(drivers=driver, scheme="static", dt=0.125, t_end=1.0))
    load = run["t"]
    assert run["hinge.rotation"] == pytest.approx(7.0 * load, abs=1e-12)
    exact = load * 2 * G * 0.5 * np.cos(7.0 * load)
    assert run["motor.torque"] == pytest.approx(exact, abs=1e-9)


BAD: dict[str, tuple[Callable[[], Scene], str]] = {
    "driver jumps": (
        lambda: swinging(
            drivers=Driver("motor", "hinge", rotation=lambda t: 0.3), scheme="ep", t_end=1.0
        ),
        "must begin as 0",
    ),
    "no length": (
        lambda: swinging(
            force_elements=Spring("tie", "ground", "arm", (1, 0, 0), (1, 0, 0), stiffness=1.0),
            scheme="ep",
            t_end=1.0,
        ),
        "must be apart",
    ),
    "stressed": (
        lambda: swinging(
            force_elements=JointSpring("coil", "hinge", stiffness=1.0, rest=0.1),
            scheme="linear-statics",
        ),
        "must be at rest",
    ),
    "windows": (
        lambda: swinging(
            joints=replace(HINGE, active=((0, 0.5),)),
            force_elements=JointSpring("coil", "hinge", stiffness=1.0),
            scheme="ep",
            t_end=1.0,
        ),
        "must act always",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_impossible_scenes(name: str) -> None:
    make, said = BAD[name]
    with pytest.raises(SceneError, match=said):
        Simulation(make())
