"""Chains and the slider-crank against energies, closed forms and Newton's laws."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from shellmb.demos.references.slider_crank import SliderCrank
from shellmb.demos.verification.chains import Link, chain
from tests.analytic import solutions


def test_one_link_is_the_pendulum() -> None:
    link = Link(2.0, 1.0, 0.3, 0.4)
    frequency = math.sqrt(2 * 9.81 * 0.3 / (0.4 + 2 * 0.3**2))
    t = np.linspace(0.0, 3.0, 13)
    motion = chain([link], [2.0], [0.0], t)
    angle, rate = solutions.pendulum(2.0, frequency, t)
    # integration at 1e-13 per step
    np.testing.assert_allclose(motion.angle[:, 0], angle, atol=1e-10)
    np.testing.assert_allclose(motion.rate[:, 0], rate, atol=1e-10)


LINKS = (Link(2.0, 1.0, 0.3, 0.4), Link(1.0, 0.7, 0.6, 0.2))


def test_double_pendulum_against_its_textbook_equations() -> None:
    """Lagrange's equations of two links written out, and solved by another method."""
    first, second = LINKS
    l1, c1, c2, g = first.length, first.center, second.center, 9.81
    a = first.inertia + first.mass * c1**2 + second.mass * l1**2
    b = second.inertia + second.mass * c2**2
    h = second.mass * l1 * c2

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        p, q, dp, dq = y
        s, c = math.sin(p - q), math.cos(p - q)
        top = -h * s * dq**2 - (first.mass * c1 + second.mass * l1) * g * math.sin(p)
        bottom = h * s * dp**2 - second.mass * c2 * g * math.sin(q)
        det = a * b - (h * c) ** 2
        return np.array(
            [dp, dq, (b * top - h * c * bottom) / det, (a * bottom - h * c * top) / det]
        )

    t = np.linspace(0.0, 4.0, 17)
    other = solve_ivp(rates, (0, 4), [1.2, 2.0, 0.5, -1.0], "Radau", t, rtol=1e-10, atol=1e-12)
    motion = chain(LINKS, [1.2, 2.0], [0.5, -1.0], t)
    # Radau at 1e-10 per step
    found = np.hstack([motion.angle, motion.rate])
    np.testing.assert_allclose(found, other.y.T, atol=1e-6)


def test_chain_keeps_energy_and_obeys_newton() -> None:
    links = (*LINKS, Link.rod(0.5, 0.4))
    h = 1e-3
    motion = chain(links, [1.2, 2.0, -0.4], [0.5, -1.0, 3.0], np.arange(0.0, 2.0, h))
    kinetic, potential = motion.energy()
    np.testing.assert_allclose(kinetic + potential, (kinetic + potential)[0], atol=1e-9)
    # accelerations by fourth-order differences: h^4 times the sixth derivative
    x = motion.centers()
    a = (-x[4:] + 16 * x[3:-1] - 30 * x[2:-2] + 16 * x[1:-3] - x[:-4]) / (12 * h**2)
    force = motion.hinge_forces()[2:-2]
    below = np.concatenate([force[:, 1:], np.zeros_like(force[:, :1])], axis=1)
    m = np.array([link.mass for link in links])[:, None]
    weight = m * np.array([0.0, -9.81])
    np.testing.assert_allclose(force - below + weight, m * a, atol=1e-4)
    # the links hang together
    np.testing.assert_allclose(
        motion.hinges()[:, 2] - motion.hinges()[:, 1],
        0.4 * np.stack([np.sin(motion.angle[:, 2]), -np.cos(motion.angle[:, 2])], axis=1),
        atol=1e-14,
    )


def test_hanging_chain_rests() -> None:
    motion = chain(LINKS, [0.0, 0.0], [0.0, 0.0], np.array([0.0, 1.0]))
    np.testing.assert_allclose(motion.angle, 0.0)
    np.testing.assert_allclose(motion.hinge_forces()[0], [[0, 3 * 9.81], [0, 9.81]])


ENGINE = SliderCrank(
    crank=0.15,
    coupler=0.4,
    coupler_mass=2.0,
    coupler_center=0.17,
    coupler_inertia=0.03,
    slider_mass=3.0,
    crank_mass=1.5,
    crank_center=0.05,
    crank_inertia=0.02,
    offset=0.04,
    gravity=9.81,
)
# an uneven turn: angle, rate and acceleration
T = np.linspace(0.0, 2.0, 4001)
PHI, W, DW = 5 * T + 0.3 * np.sin(3 * T), 5 + 0.9 * np.cos(3 * T), -2.7 * np.sin(3 * T)


def derivative(values: np.ndarray) -> np.ndarray:
    """Fourth-order differences along the instants, without the two at both ends."""
    h = T[1] - T[0]
    return (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * h)


# differences of fourth order with h = 5e-4: (5 h)^4 of the values and 1e-16 / h of round-off
DIFFERENCED = 1e-7


def test_slider_crank_kinematics() -> None:
    motion = ENGINE.motion(PHI, W, DW)
    end = np.stack([motion.slider, np.full_like(T, 0.04)], axis=1)
    np.testing.assert_allclose(np.linalg.norm(end - motion.pin, axis=1), 0.4, rtol=1e-14)
    inner = slice(2, -2)
    for values, rates in (
        (motion.slider, motion.slider_velocity),
        (motion.slider_velocity, motion.slider_acceleration),
        (motion.coupler_angle, motion.coupler_rate),
        (motion.coupler_rate, motion.coupler_acceleration),
    ):
        np.testing.assert_allclose(derivative(values), rates[inner], atol=DIFFERENCED)


def test_slider_crank_torque_is_the_power() -> None:
    motion = ENGINE.motion(PHI, W, DW)
    power = derivative(motion.kinetic_energy + motion.potential_energy)
    np.testing.assert_allclose((motion.torque * W)[2:-2], power, atol=1e-5)


def test_slider_crank_forces() -> None:
    """The crank's moments give the torque from the force at the pin, not used to find it."""
    motion = ENGINE.motion(PHI, W, DW)
    pin, force = motion.pin, motion.pin_force
    by_pin = pin[:, 0] * force[:, 1] - pin[:, 1] * force[:, 0]
    by_crank = 0.02 * DW + 1.5 * 0.05 * 9.81 * np.cos(PHI)
    np.testing.assert_allclose(motion.torque, by_pin + by_crank, atol=1e-12)
    # all forces on the mechanism move its centre
    outer = motion.bearing_force[:, 1] + motion.guide_force - (1.5 + 2.0 + 3.0) * 9.81
    crank_center = 0.05 / 0.15 * motion.pin
    momentum = 1.5 * derivative(crank_center[:, 1]) + 2.0 * derivative(motion.coupler_center[:, 1])
    h = T[1] - T[0]
    rate = (momentum[:-4] - 8 * momentum[1:-3] + 8 * momentum[3:-1] - momentum[4:]) / (12 * h)
    # differences of differences: round-off 1e-16 / h^2
    np.testing.assert_allclose(outer[4:-4], rate, atol=1e-6)


def test_slider_crank_at_rest() -> None:
    """Crank up, coupler aslant: the torque is zero and the guide carries its share."""
    level = SliderCrank(crank=0.3, coupler=0.5, slider_mass=2.0, gravity=9.81)
    motion = level.motion([math.pi / 2], [0.0], [0.0])
    assert motion.slider[0] == pytest.approx(0.4)
    assert motion.torque[0] == pytest.approx(0.0, abs=1e-14)
    assert motion.guide_force[0] == pytest.approx(2 * 9.81)


def test_short_couplers_are_refused() -> None:
    with pytest.raises(ValueError, match="too short"):
        SliderCrank(crank=0.3, coupler=0.3)
