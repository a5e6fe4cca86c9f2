"""Modes of rigid bodies on joints under loads: what joints carry is part of the stiffness.

The kind: multipliers of an equilibrium, which have the unit of forces in statics, in the model of a
motion, which has another one. Pendulums by closed forms, in twins of units, steps and loads.
"""

from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    FollowerForce,
    Gravity,
    JointSpring,
    PointForce,
    Revolute,
    RigidBody,
    Scene,
)

UNITS = [(1.0, 1.0, 1.0), (1e6, 10.0, 1e3), (1e-6, 1e-3, 1e-3)]


def ziegler(load: Any, k: float = 1.0, m: float = 1.0, L: float = 1.0, dt: float = 0.5) -> Scene:
    """Two rods on springs, masses `2 m` and `m` at their ends (H. Ziegler, 1952)."""
    small = (1e-9 * m * L**2,) * 3
    bodies = [
        RigidBody("one", 2 * m, small, com=(0, 0, L)),
        RigidBody("two", m, small, com=(0, 0, 2 * L)),
    ]
    joints = [
        Revolute("a", "ground", "one", at=(0, 0, 0), axis=(0, 1, 0)),
        Revolute("b", "one", "two", at=(0, 0, L), axis=(0, 1, 0)),
    ]
    springs = [JointSpring("ka", "a", stiffness=k), JointSpring("kb", "b", stiffness=k)]
    return Scene(
        "ziegler",
        rigid_bodies=bodies,
        joints=joints,
        force_elements=springs,
        loads=load,
        scheme="static",
        dt=dt,
        t_end=1.0,
    )


def exact(P: float, follows: bool) -> Any:
    """Squares of the frequencies times `m L^2/k`, of a force `P k/L`."""
    M = np.array([[3.0, 1.0], [1.0, 1.0]])
    K = np.array([[2 - P, P - 1], [-1, 1]]) if follows else np.array([[2 - P, -1], [-1, 1 - P]])
    return np.sort_complex(np.linalg.eigvals(np.linalg.solve(M, K)))


@pytest.mark.parametrize(("k", "m", "L"), UNITS)
@pytest.mark.parametrize("dt", [0.25, 1.0])
def test_a_force_that_follows_a_rigid_body(k: float, m: float, L: float, dt: float) -> None:
    """It flutters from `(7/2 - sqrt 2) k/L`, 2.086, on; before and after as the closed form."""
    for P, grows in ((1.0, False), (2.05, False), (2.12, True), (4.0, True)):
        load = FollowerForce((0, 0, 2 * L), (0, 0, -P * k / L), body="two")
        modes = natural_modes(ziegler(load, k, m, L, dt), count=2, loaded=True)
        found = np.sort_complex(modes.omega2 + 1j * modes.imaginary) * m * L**2 / k
        # small inertia of the rods, and two squares that are near one another
        np.testing.assert_allclose(found, exact(P, True), atol=1e-6)  # not round-off
        assert any("flutter" in said for said in modes.warnings) is grows


@pytest.mark.parametrize(("k", "m", "L"), UNITS)
def test_a_force_that_keeps_its_direction(k: float, m: float, L: float) -> None:
    """It diverges from `(3 - sqrt 5)/2 k/L`, 0.382, on."""
    for P, grows in ((-2.0, False), (0.3, False), (0.5, True)):
        load = PointForce((0, 0, 2 * L), (0, 0, -P * k / L), body="two")
        modes = natural_modes(ziegler(load, k, m, L), count=2, loaded=True)
        np.testing.assert_allclose(
            modes.omega2 * m * L**2 / k, exact(P, False).real, atol=1e-6
        )  # not round-off
        assert any("divergence" in said for said in modes.warnings) is grows


@pytest.mark.parametrize("dt", [0.2, 1.0])
def test_a_pendulum_swings_by_its_weight(dt: float) -> None:
    """`omega^2 = (m g L + k)/(J + m L^2)` with a soft spring, whatever steps lead there."""
    bob = RigidBody("bob", 2.0, (0.5, 0.5, 0.5), com=(0, 0, -1.0))
    scene = Scene(
        "pendulum",
        rigid_bodies=bob,
        joints=Revolute("pin", "ground", "bob", at=(0, 0, 0), axis=(0, 1, 0)),
        force_elements=JointSpring("spring", "pin", stiffness=0.1),
        loads=Gravity((0, 0, -10.0)),
        scheme="static",
        dt=dt,
        t_end=1.0,
    )
    (square,) = natural_modes(scene, count=1, loaded=True).omega2
    assert square == pytest.approx(20.1 / 2.5, rel=1e-8)


def hung(com: Any, elements: Any = (), pull: Any = (0, 0, -9.81), **more: Any) -> Scene:
    """A body on a hinge that nothing but its weight holds."""
    return Scene(
        "hung",
        rigid_bodies=RigidBody("bob", 2.0, (0.02, 0.03, 0.04), com=com),
        joints=Revolute("pin", "ground", "bob", at=(0, 0, 0), axis=(0, 1, 0)),
        loads=Gravity(pull, time=more.pop("time", None)),
        force_elements=elements,
        **more,
    )


def squares(modes: Any) -> Any:
    """Squares of the angular frequencies, rad^2/s^2."""
    return modes.table["omega_rad_per_s"].to_numpy() ** 2


# of its mass, inertia and arm
WEIGHT = 2.0 * 9.81 * 0.7 / (0.03 + 2.0 * 0.7**2)


@pytest.mark.parametrize("scheme", ["static", "ep"])
def test_a_body_that_hangs_swings(scheme: str) -> None:
    """`omega^2 = m g l/(J + m l^2)`, also where it begins beside its equilibrium, or is damped."""
    more: dict[str, Any] = {"scheme": scheme, "dt": 0.1, "t_end": 1.0}
    hanging = sm.modes(hung((0, 0, -0.7), **more), loaded=True)
    np.testing.assert_allclose(squares(hanging), [WEIGHT], rtol=1e-9)
    aside = sm.modes(hung((0.7, 0, 0), **more), loaded=True)
    np.testing.assert_allclose(squares(aside), [WEIGHT], rtol=1e-9)
    upright = sm.modes(hung((0, 0, 0.7), **more), loaded=True)
    assert upright.table["growth_per_s"].to_numpy() == pytest.approx([WEIGHT**0.5], rel=1e-9)
    damper = sm.JointDamper("damper", "pin", 0.3)
    (row,) = sm.modes(hung((0, 0, -0.7), damper, **more), loaded=True).table.to_dict("records")
    rate = 0.3 / (0.03 + 2.0 * 0.7**2) / 2
    assert row["growth_per_s"] == pytest.approx(-rate, rel=1e-9)
    assert row["omega_rad_per_s"] == pytest.approx((WEIGHT - rate**2) ** 0.5, rel=1e-9)


def test_loads_of_the_end_hold_it() -> None:
    """A weight that grows with time is that of the last time, as in statics."""
    growing = hung((0, 0, -0.7), time=lambda t: 1.0 + 3.0 * t, scheme="ep", dt=0.1, t_end=1.0)
    np.testing.assert_allclose(squares(sm.modes(growing, loaded=True)), 4 * WEIGHT, rtol=1e-9)


def test_two_rods_that_hang_and_a_cart() -> None:
    """Several motions are held by weights, and one by nothing: it is a free one, at zero."""
    cart = RigidBody("cart", 3.0, (0.1, 0.1, 0.1))
    bob = RigidBody("bob", 2.0, (0.02, 0.03, 0.04), com=(0.3, 0, -0.7))
    scene = Scene(
        "cart",
        rigid_bodies=(cart, bob),
        joints=(
            sm.Prismatic("rail", "ground", "cart", at=(0, 0, 0), axis=(1, 0, 0)),
            Revolute("pin", "cart", "bob", at=(0, 0, 0), axis=(0, 1, 0)),
        ),
        loads=Gravity((0, 0, -9.81)),
    )
    arm = np.hypot(0.3, 0.7)
    M = np.array([[5.0, 2 * arm], [2 * arm, 0.03 + 2 * arm**2]])
    square = 2.0 * 9.81 * arm * M[0, 0] / np.linalg.det(M)
    found = sm.modes(scene, loaded=True)
    assert found.summary["rigid_modes"] == 1
    np.testing.assert_allclose(squares(found)[1], square, rtol=1e-9)


def test_what_falls_has_no_equilibrium() -> None:
    """A body on a steep rail is refused as in statics, by the motion that nothing holds."""
    rail = sm.Prismatic("rail", "ground", "bob", at=(0, 0, 0), axis=(1, 0, -1))
    bob, weight = RigidBody("bob", 1.0, (1.0,) * 3), Gravity((0, 0, -9.81))
    falling = Scene("falling", rigid_bodies=bob, joints=rail, loads=weight)
    with pytest.raises(sm.SceneError, match="nothing holds these motions: rigid body 'bob' can"):
        sm.modes(falling, loaded=True)
