"""Closed forms and integrations of rotating rigid bodies against each other."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj

from shellmb.demos.references import rigid
from shellmb.demos.references.inertia import MassProperties, box, rod
from tests.analytic import solutions

# two integrations at 1e-13 per step over some hundred steps
INTEGRATED = 1e-10

MOMENTS = (1.0, 2.0, 2.7)


@pytest.mark.parametrize("inertia", list(itertools.permutations(MOMENTS)))
@pytest.mark.parametrize(
    "omega", [(0.1, 3.0, 0.2), (-2.0, 0.3, 1.0), (1.0, -0.5, -3.0), (0.5, 0.0, 2.0)]
)
def test_free_top_solves_eulers_equations(
    inertia: tuple[float, ...], omega: tuple[float, ...]
) -> None:
    moments, t = np.array(inertia), np.linspace(0.0, 5.0, 11)
    solution = solve_ivp(
        lambda _, w: np.cross(moments * w, w) / moments,
        (0.0, 5.0),
        omega,
        method="DOP853",
        t_eval=t,
        rtol=1e-13,
        atol=1e-13,
    )
    found = rigid.free_top_omega(inertia, omega, t)
    np.testing.assert_allclose(found, solution.y.T, atol=INTEGRATED)
    period = solutions.free_top_period(inertia, omega)
    np.testing.assert_allclose(
        rigid.free_top_omega(inertia, omega, [period, 2 * period]), [omega] * 2, atol=1e-12
    )


@pytest.mark.parametrize("inertia", [(2.0, 2.0, 1.0), (1.0, 2.0, 2.0), (1.0, 3.0, 1.0)])
def test_symmetric_free_top_precesses_uniformly(inertia: tuple[float, ...]) -> None:
    """In body axes the vector turns about the figure axis at (C - A) / A times the spin."""
    axis = {(2.0, 2.0, 1.0): 2, (1.0, 2.0, 2.0): 0, (1.0, 3.0, 1.0): 1}[inertia]
    across = inertia[(axis + 1) % 3]
    omega, t = np.array([0.7, 1.1, -0.4]), np.linspace(0.0, 9.0, 7)
    turn = (inertia[axis] - across) / across * omega[axis] * t
    found = rigid.free_top_omega(inertia, omega, t)
    first, second = omega[(axis + 1) % 3], omega[(axis + 2) % 3]
    expected = np.empty_like(found)
    expected[:, axis] = omega[axis]
    expected[:, (axis + 1) % 3] = first * np.cos(turn) - second * np.sin(turn)
    expected[:, (axis + 2) % 3] = first * np.sin(turn) + second * np.cos(turn)
    np.testing.assert_allclose(found, expected, atol=1e-13)


@pytest.mark.parametrize("omega", [(2.0, 0.0, 0.0), (0.0, -2.0, 0.0), (0.0, 0.0, 0.0)])
def test_steady_rotations_stay(omega: tuple[float, ...]) -> None:
    np.testing.assert_array_equal(rigid.free_top_omega(MOMENTS, omega, [0.0, 7.0]), [omega] * 2)
    assert solutions.free_top_period(MOMENTS, omega) == math.inf


def test_free_top_keeps_momentum_and_energy() -> None:
    inertia = np.diag(MOMENTS)
    motion = rigid.free_top(MOMENTS, (0.1, 3.0, 0.2), np.linspace(0.0, 20.0, 41))
    momentum = motion.angular_momentum(inertia)
    np.testing.assert_allclose(momentum, np.tile(momentum[0], (41, 1)), atol=INTEGRATED)
    energy = motion.kinetic_energy(inertia)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-13)
    # nearly about the middle axis: it turns over
    assert motion.omega[:, 1].min() < -2.9


def test_heavy_top_without_weight_is_free() -> None:
    t = np.linspace(0.0, 10.0, 11)
    free = rigid.free_top(MOMENTS, (0.1, 3.0, 0.2), t)
    heavy = rigid.heavy_top(np.diag(MOMENTS), (0.0, 0.0, 0.0), (0.1, 3.0, 0.2), t)
    np.testing.assert_allclose(heavy.rotation, free.rotation, atol=INTEGRATED)
    np.testing.assert_allclose(heavy.omega, free.omega, atol=INTEGRATED)


# the top of docs/reference/literature.md: mass 15 kg at (0, 1, 0), its own moments of inertia,
# and the angular velocity about the fixed point
TOP = MassProperties(15.0, np.array([0.0, 1.0, 0.0]), np.diag([0.234375, 0.46875, 0.234375]))
TOP_OMEGA = np.array([0.0, 150.0, -4.61538])


def test_heavy_top_conserves() -> None:
    about, t = TOP.about((0, 0, 0)), np.linspace(0.0, 2.0, 101)
    top = rigid.heavy_top(about, TOP.mass * TOP.center, TOP_OMEGA, t)
    height = top.position(TOP.center)[:, 2]
    kinetic = top.kinetic_energy(about)
    # of the energy of the spin, 5274 J; two thousand radians of it accumulate
    np.testing.assert_allclose(kinetic + 15.0 * 9.81 * height, kinetic[0], rtol=1e-8)
    vertical = top.angular_momentum(about)[:, 2]
    np.testing.assert_allclose(vertical, vertical[0], atol=1e-8 * 0.46875 * 150)
    np.testing.assert_allclose(top.omega[:, 1], 150.0, rtol=1e-9)


def test_heavy_top_nutates_as_the_elliptic_function() -> None:
    """Lagrange's top: the square of the rate of the height u is a cubic in u, so that u is sn^2.

    Landau & Lifshitz sec. 35: A^2 u'^2 = (2 A (E' - m g l u))(1 - u^2) - (M_z - M_3 u)^2.
    """
    A, C, lever = 15.234375, 0.46875, 15.0 * 9.81
    M3, Mz, E = C * 150.0, A * TOP_OMEGA[2], 0.5 * A * TOP_OMEGA[2] ** 2
    u = np.polynomial.Polynomial([0.0, 1.0])
    cubic = (2 * (E - lever * u) * (1 - u**2) / A) - ((Mz - M3 * u) / A) ** 2
    low, high, far = np.sort(cubic.roots().real)
    np.testing.assert_allclose(high, 0.0, atol=1e-14)  # the motion begins on top of its nutation
    k2 = (high - low) / (far - low)
    pace = math.sqrt(lever * (far - low) / (2 * A))
    t = np.linspace(0.0, 2.0, 101)
    _, cn, dn, _ = ellipj(pace * t, k2)
    # from the upper turning point: sn shifted by a quarter of a period is cn / dn
    expected = low + (high - low) * (cn / dn) ** 2
    top = rigid.heavy_top(TOP.about((0, 0, 0)), TOP.mass * TOP.center, TOP_OMEGA, t)
    # 300 rad of spin at 1e-13 per step
    np.testing.assert_allclose(top.position(TOP.center)[:, 2], expected, atol=1e-9)


@pytest.mark.parametrize("which", [0, 1])
def test_steady_precession(which: int) -> None:
    A, C, lever, spin, tilt = 2.0, 0.7, 1.5, 60.0, 1.1
    rate = solutions.steady_precession(A, C, lever, spin, tilt)[which]
    figure = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    # the body begins upright in its own axes: tilt gravity instead of the body
    up = np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
    omega = rate * up + np.array([0.0, 0.0, spin - rate * math.cos(tilt)])
    t = np.linspace(0.0, 2.0, 9)
    top = rigid.heavy_top(np.diag([A, A, C]), (0, 0, lever), omega, t, gravity=-9.81 * up)
    height = top.position((0, 0, 1)) @ up
    np.testing.assert_allclose(height, figure[2], atol=INTEGRATED)
    # after a full turn of the precession the axis is where it was
    once = rigid.heavy_top(
        np.diag([A, A, C]), (0, 0, lever), omega, [0.0, 2 * math.pi / rate], gravity=-9.81 * up
    )
    np.testing.assert_allclose(once.position((0, 0, 1))[-1], (0, 0, 1), atol=3e-9)


def test_slow_tops_do_not_precess_steadily() -> None:
    with pytest.raises(ValueError, match="too slow"):
        solutions.steady_precession(2.0, 0.7, 1.5, 1.0, 0.3)
    assert solutions.steady_precession(2.0, 0.7, 1.5, 60.0, math.pi / 2) == pytest.approx(
        (1.5 * 9.81 / (0.7 * 60), math.inf)
    )


@pytest.mark.parametrize("amplitude", [1e-4, 1.0, 3.0])
def test_pendulum_is_a_heavy_body_about_an_axis(amplitude: float) -> None:
    bar = rod(3.0, (0, 0, 0), (0, 0, -1.2), radius=0.05)
    inertia = bar.about((0, 0, 0))
    frequency = math.sqrt(3.0 * 9.81 * 0.6 / inertia[1, 1])
    period = solutions.pendulum_period(amplitude, frequency)
    t = np.linspace(0.0, period, 9)
    angle, rate = solutions.pendulum(amplitude, frequency, t)
    # let go at its amplitude: gravity is tilted instead of the bar; + about y
    down = 9.81 * np.array([math.sin(amplitude), 0.0, -math.cos(amplitude)])
    body = rigid.heavy_top(inertia, 3.0 * bar.center, (0, 0, 0), t, gravity=down)
    turned = np.arctan2(body.rotation[:, 0, 2], body.rotation[:, 2, 2])
    back = np.angle(np.exp(1j * (turned + amplitude)))
    np.testing.assert_allclose(angle, back, atol=1e-9)
    np.testing.assert_allclose(rate, body.omega[:, 1], atol=1e-9)
    np.testing.assert_allclose([angle[0], angle[-1]], amplitude, rtol=1e-11)


def test_small_swings() -> None:
    assert solutions.pendulum_period(1e-6, 2.0) == pytest.approx(math.pi, rel=1e-12)


def test_mass_properties() -> None:
    """A cube from two halves, a cylinder by its textbook values, and the same turned."""
    cube = box(4.0, (1, 1, 1))
    halves = box(2.0, (0.5, 1, 1), (-0.25, 0, 0)) + box(2.0, (0.5, 1, 1), (0.25, 0, 0))
    np.testing.assert_allclose(halves.inertia, cube.inertia, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(halves.center, 0.0, atol=1e-15)
    cylinder = rod(3.0, (0, 0, -1), (0, 0, 1), radius=0.5)
    np.testing.assert_allclose(
        cylinder.inertia, np.diag([3 * (0.75 + 4) / 12, 3 * (0.75 + 4) / 12, 0.375])
    )
    # thin rod about its end: m L^2 / 3
    assert rod(3.0, (0, 0, 0), (2, 0, 0)).about((0, 0, 0))[2, 2] == pytest.approx(4.0)
    axes = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    slender = box(3.0, (2, 1e-9, 1e-9), frame=axes)
    np.testing.assert_allclose(
        slender.inertia, rod(3.0, (-0.6, -0.8, 0), (0.6, 0.8, 0)).inertia, atol=1e-14
    )
