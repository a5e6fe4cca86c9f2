"""Rotations of joints count whole turns, up to the longest steps that a scheme follows.

The kind: what is known of an angle modulo whole turns, and Newton's method, which may get to any of
them. So angles are compared with those that the bodies turn by, step by step.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from shellmb.errors import ConvergenceError
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.forces.joints import JointForces
from shellmb.scene import (
    GROUND,
    InitialVelocity,
    JointDamper,
    JointSpring,
    Motor,
    Revolute,
    RigidBody,
    Scene,
    Screw,
    StepControl,
)
from shellmb.simulate.simulation import BaseObserver, Simulation

TURN = 2 * np.pi
STEP = 0.01
SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
RIVALS = [("generalized-alpha", 0.1), ("ed-printed", 0.5)]
# acts by next to nothing, but has the coordinate
NOTHING = JointDamper("nothing", "hub", 1e-12)


class Turned(BaseObserver):
    """Angles of the joint's column, and of its second body's directors to its first's, about z."""

    def __init__(self) -> None:
        self.column, self.directors = [0.0], [0.0]
        self._joints = JointForces()

    def start(self, simulation: Simulation) -> None:
        self._joints.start(simulation)

    def solved(self, simulation: Simulation) -> None:
        self._joints.solved(simulation)

    def accepted(self, simulation: Simulation) -> None:
        self._joints.accepted(simulation)
        self.column.append(self._joints.measure()["hub.rotation"])
        rigid, (hub,) = simulation.model.rigid, simulation.scene.joints
        assert rigid is not None
        w = simulation.problem.state(rigid.name).x.array[rigid.mixed.dofs["w"]].reshape(-1, 3, 3)
        w = w[[rigid.index[name] for name in (hub.first, hub.second)], 0]
        first, second = np.arctan2(w[:, 1], 1 + w[:, 0])
        self.directors.append(second - first)


def wheel(scheme: str, alpha: float, spin: float, steps: int = 25, **more: Any) -> Scene:
    """A wheel that spins by an angle a step."""
    return Scene(
        "wheel",
        rigid_bodies=[RigidBody("wheel", 1.0, (0.03, 0.03, 0.05)), *more.pop("others", ())],
        joints=more.pop("joints", Revolute("hub", GROUND, "wheel", at=(0, 0, 0), axis=(0, 0, 1))),
        force_elements=more.pop("force_elements", NOTHING),
        initial=more.pop("initial", InitialVelocity(spin=(0, 0, spin / STEP))),
        scheme=scheme,
        alpha=alpha,
        dt=STEP,
        t_end=steps * STEP,
        **more,
    )


def check(scene: Scene, *observers: Any) -> np.ndarray:
    """Runs it; the column turns as the directors do, and the account is closed."""
    turned, energy = Turned(), EnergyAccount()
    Simulation(scene).run([energy, turned, *observers])
    column = np.array(turned.column)
    directors = np.diff(turned.directors)
    # by less than half a turn in each step
    np.testing.assert_allclose(
        np.diff(column), (directors + np.pi) % TURN - np.pi, rtol=0, atol=1e-9
    )
    if scene.scheme not in [name for name, _ in RIVALS]:
        # far above round-off, far below the energy of a turn
        assert energy.error < 1e-7
    return column


@pytest.mark.parametrize("angle", [0.9, -1.4, 2.5])
@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES + RIVALS)
def test_free_wheel(scheme: str, alpha: float, angle: float) -> None:
    """It turns as fast as the scheme has it: EP by `2 atan(w dt/2)`, EP4 nearly by `w dt`."""
    column = check(wheel(scheme, alpha, angle))
    if scheme == "ep":
        np.testing.assert_allclose(np.diff(column), 2 * np.arctan(angle / 2), rtol=1e-6)
    if scheme == "ep4":
        # 0.3 per cent at 1.2 rad, by the fourth power
        np.testing.assert_allclose(np.diff(column), angle, rtol=2e-3 * angle**4)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
@pytest.mark.parametrize("sense", [-1, 1])
def test_wheels_that_turn_against_each_other(scheme: str, alpha: float, sense: int) -> None:
    """Each by 1.2 rad a step, one relative to the other by twice that."""
    shaft = Revolute("hub", "wheel", "other", at=(0, 0, 0), axis=(0, 0, 1))
    other = RigidBody("other", 0.5, (0.03, 0.03, 0.02))
    spins = [
        InitialVelocity(spin=(0, 0, angle / STEP), body=body)
        for body, angle in (("wheel", -1.2 * sense), ("other", 1.2 * sense))
    ]
    column = check(wheel(scheme, alpha, 0, 10, joints=shaft, others=[other], initial=spins))
    assert np.all(np.diff(column) * sense > (1.5 if scheme in ("ep", "ep4") else 0))


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
@pytest.mark.parametrize("sense", [-1, 1])
def test_motor_and_spring_to_their_energy(scheme: str, alpha: float, sense: int) -> None:
    """A torque works over all turns, a spring of 1 N m winds up by 20: their sum is what moves."""
    inertia, torque, spring = 0.05, 100.0 * sense, 1.0
    elements = (
        Motor("motor", "hub", law=lambda x, rate, t: torque + 0 * t),
        JointSpring("spring", "hub", spring),
    )
    scene = wheel(scheme, alpha, 0.8 * sense, 20, force_elements=elements)
    energies = Energies()
    column = check(scene, energies)
    moved = inertia * (0.8 / STEP) ** 2 / 2 + torque * column - spring * column**2 / 2
    assert abs(column[-1]) > 3 * TURN
    assert max(abs(np.diff(column))) > 1.05
    lost = np.array(energies.lost)
    np.testing.assert_allclose(energies.kinetic, moved - lost, rtol=1e-9)


class Energies(BaseObserver):
    """Kinetic energy and what the scheme has dissipated, after each step, from the account."""

    def __init__(self) -> None:
        self._account = EnergyAccount()
        self.kinetic, self.lost = list[float](), list[float]()

    def start(self, simulation: Simulation) -> None:
        self._account.start(simulation)
        self._take()

    def solved(self, simulation: Simulation) -> None:
        self._account.solved(simulation)

    def accepted(self, simulation: Simulation) -> None:
        self._account.accepted(simulation)
        self._take()

    def _take(self) -> None:
        values = self._account.values
        self.kinetic.append(values["kinetic_energy"])
        self.lost.append(values["dissipation"])


@pytest.mark.parametrize(("scheme", "alpha"), [("ep", 0.0), ("ep4", 0.0), ("ed3", 0.5)])
def test_screw_goes_on_turn_by_turn(scheme: str, alpha: float) -> None:
    pitch = -0.02
    screw = Screw("hub", GROUND, "wheel", at=(0, 0, 0), axis=(0, 0, 1), pitch=pitch)
    spin = 1.3 / STEP
    moving = InitialVelocity(spin=(0, 0, spin), linear=(0, 0, spin * pitch / TURN))
    scene = wheel(scheme, alpha, 1.3, joints=screw, force_elements=(), initial=moving)
    height = []

    class Height(BaseObserver):
        def accepted(self, simulation: Simulation) -> None:
            rigid = simulation.model.rigid
            assert rigid is not None
            u = simulation.problem.state(rigid.name).x.array[rigid.mixed.dofs["u"]]
            height.append(u.reshape(-1, 3)[rigid.index["wheel"], 2])

    column = check(scene, Height())
    np.testing.assert_allclose(height, pitch / TURN * column[1:], rtol=0, atol=1e-9)
    assert column[-1] > 2 * TURN


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_half_a_turn_a_step_is_cut(scheme: str, alpha: float) -> None:
    """Three turns a step: steps are cut to what they can tell, or the run says why it stops."""
    scene = wheel(scheme, alpha, 6 * np.pi, 3)
    column = check(scene)
    assert len(column) > 3 * 6
    if scheme == "ep4":
        # as far as it follows steps of up to half a turn, 0.94 of 3 rad
        assert column[-1] > 0.9 * 3 * 6 * np.pi
    held = replace(scene, step_control=StepControl(min_dt=STEP))
    with pytest.raises(ConvergenceError, match=r"joint 'hub' turns by 18.85 rad in a step .* pi"):
        Simulation(held).run([])
