"""The shooting solution against closed forms, another solver, and spectral elements."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from shellmb.demos.references import beams
from shellmb.demos.verification.cantilever import Deformed, exact_cantilever, section_stiffness
from shellmb.errors import ShellmbError
from tests.analytic import solutions

SLENDER = section_stiffness(1e6, 4e5, 4e5, 3.0, 2.0, 5.0)


@pytest.mark.parametrize("turns", [0.1, 0.5, 1.0, 2.0])
def test_roll_up(turns: float) -> None:
    """The moment 2 pi EI / L about d3 closes the circle, towards d2."""
    moment = turns * 2 * math.pi * 5.0 / 3.0
    rolled = exact_cantilever(SLENDER, 3.0, moment=(0, 0, moment))
    along, across = beams.roll_up(moment, 5.0, 3.0)
    # integration at 1e-13 per step
    np.testing.assert_allclose(rolled.tip, (along, across, 0.0), atol=1e-10)


def test_torsion_and_tension() -> None:
    turned = exact_cantilever(SLENDER, 3.0, force=(20.0, 0, 0), moment=(1.5, 0, 0))
    np.testing.assert_allclose(turned.tip, (3.0 * 20 / 1e6, 0, 0), atol=1e-12)
    angle = 1.5 * 3.0 / 3.0
    np.testing.assert_allclose(
        turned.rotation[-1][:, 1], (0, math.cos(angle), math.sin(angle)), atol=1e-10
    )


def test_small_loads_are_linear() -> None:
    shear = section_stiffness(1e6, 30.0, 40.0, 3.0, 2.0, 5.0)
    F = 1e-6
    down = exact_cantilever(shear, 3.0, force=(0, F, 0))
    # the next term of the displacement is of the third order in the load
    linear = beams.cantilever_end_force(F, 5.0, 3.0, shear=30.0)
    assert down.tip[1] == pytest.approx(linear, rel=1e-6)
    side = exact_cantilever(shear, 3.0, load=(0, 0, F))
    linear = solutions.cantilever_uniform(F, 2.0, 3.0, shear=40.0)
    assert side.tip[2] == pytest.approx(linear, rel=1e-6)


def bend(force: float, torsion: float = 1e7 / 12) -> Deformed:
    """Bathe & Bolourchi, Int. J. Numer. Methods Eng. 14 (1979) 961-986: 45 degrees, R = 100."""
    stiffness = section_stiffness(1e7, 5e6 * 5 / 6, 5e6 * 5 / 6, torsion, 1e7 / 12, 1e7 / 12)
    return exact_cantilever(
        stiffness, 25 * math.pi, force=(0, 0, force), curvature=(0, 0, 0.01), points=65
    )


def test_bend_against_the_literature() -> None:
    """The values of 1979 and 1986 are of coarse meshes: within 1 % of the exact ones."""
    tip = bend(600.0).tip
    size = np.linalg.norm(tip)
    # displacements of Bathe & Bolourchi as quoted by OpenFAST's r-test, bd_curved_beam
    np.testing.assert_allclose(tip, (-23.5, -13.4, 53.4), atol=0.01 * size)
    # Simo & Vu-Quoc (1986) as quoted by the tests of billow (TU Delft)
    np.testing.assert_allclose(tip, (-23.48, -13.50, 53.37), atol=0.003 * size)


def test_bend_against_collocation() -> None:
    """The same beam by scipy's collocation, with directors in place of the quaternion."""
    exact = bend(600.0)
    force = np.array([0, 0, 600.0])
    C = 1 / np.array([1e7, 5e6 * 5 / 6, 5e6 * 5 / 6, *[1e7 / 12] * 3])

    def rates(_: np.ndarray, y: np.ndarray) -> np.ndarray:
        # rows: position, d1, d2, d3, moment / 1e4
        d = y[3:12].reshape(3, 3, -1)
        m = 1e4 * y[12:]
        n = np.einsum("kin,i->kn", d, force) * C[:3, None]
        k = np.einsum("kin,in->kn", d, m) * C[3:, None] + np.array([[0], [0], [0.01]])
        tangent = np.einsum("kin,kn->in", d, n) + d[0]
        omega = np.einsum("kin,kn->in", d, k)
        turn = [np.cross(omega, d[i], axis=0) for i in range(3)]
        return np.vstack([tangent, *turn, -np.cross(tangent, force, axisb=0, axisa=0).T / 1e4])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.concatenate([a[:3], a[3:12] - np.eye(3).ravel(), b[12:]])

    guess = np.vstack(
        [exact.start.T, exact.rotation.transpose(2, 1, 0).reshape(9, -1), exact.moment.T / 1e4]
    )
    # a crude guess: the unloaded position, and moments that are half wrong
    guess[12:] *= 0.5
    found = solve_bvp(rates, ends, exact.s, guess, tol=1e-9, max_nodes=5000)
    assert found.success, found.message
    np.testing.assert_allclose(found.sol(exact.s)[:3].T, exact.position, atol=1e-6)
    np.testing.assert_allclose(1e4 * found.sol(exact.s)[12:].T, exact.moment, atol=1e-3)


def test_parabolic_bend_against_spectral_elements() -> None:
    """Kynema's and BeamDyn's bend is a parabola through three points of the arc.

    Tip displacement from github.com/kynema/kynema, test Static_CurvedCompositeBeamBending, which
    says that BeamDyn's is equal: one Legendre element of order 14. Its
    axis is `y = a x + b x^2`, its stiffness as rounded there.
    """
    x, y = np.array([38.2683, 70.7107]), np.array([-7.61205, -29.2893])
    a, b = np.linalg.solve(np.array([x, x**2]).T, y)

    def arc(slope: float) -> float:
        return float(slope * math.hypot(1, slope) + math.asinh(slope)) / (4 * b)

    def curvature(s: float) -> np.ndarray:
        slope = brentq(lambda v: arc(v) - arc(a) - s, a + 1, a + 2 * b * 80, xtol=1e-15)
        return np.array([0.0, 0.0, 2 * b / math.hypot(1, slope) ** 3])

    cos, sin = 1 / math.hypot(1, a), a / math.hypot(1, a)
    loaded = exact_cantilever(
        section_stiffness(1e7, 41.6667e5, 41.6667e5, 8.333e5, 8.333e5, 8.333e5),
        arc(a + 2 * b * x[1]) - arc(a),
        force=(0, 0, 600),
        curvature=curvature,
        frame=np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]]),
        points=2,
    )
    np.testing.assert_allclose(loaded.start[-1], (x[1], y[1], 0), atol=1e-10)
    expected = (-23.6459716009047, 13.7208006040058, 53.5776450626987)
    np.testing.assert_allclose(loaded.tip, expected, atol=1e-10)


def test_moments_balance_and_frames_turn_with_the_load() -> None:
    """Coupled stiffness: the moment at the clamp holds all loads, wherever the clamp points."""
    A = np.random.default_rng(3).normal(size=(6, 6))
    stiffness = 10 * np.eye(6) + A @ A.T
    force, moment, load = (
        np.array([1.0, -2.0, 0.5]),
        np.array([0.3, 1.0, -0.7]),
        np.array([0, 1, 1]),
    )
    loaded = exact_cantilever(
        stiffness,
        1.5,
        force=force,
        moment=moment,
        load=load,
        curvature=(0.4, -0.2, 0.9),
        points=201,
    )
    r = loaded.position
    # trapezoid over 200 intervals: 1.5^2 / 200^2 / 12 times second derivatives of order one
    by_load = np.cross(np.trapezoid(r, loaded.s, axis=0), load)
    expected = moment + np.cross(r[-1], force) + by_load
    np.testing.assert_allclose(loaded.moment[0], expected, atol=1e-4)
    np.testing.assert_allclose(loaded.moment[-1], moment, atol=1e-10)
    Q, _ = np.linalg.qr(A[:3, :3])
    Q *= np.linalg.det(Q)
    turned = exact_cantilever(
        stiffness,
        1.5,
        force=Q @ force,
        moment=Q @ moment,
        load=Q @ load,
        curvature=(0.4, -0.2, 0.9),
        frame=Q,
        root_at=(1, 2, 3),
        points=201,
    )
    np.testing.assert_allclose(turned.position, r @ Q.T + (1, 2, 3), atol=1e-10)
    np.testing.assert_allclose(turned.rotation, Q @ loaded.rotation, atol=1e-10)


def test_lateral_buckling_load_is_felt() -> None:
    """Below the critical load a small side force is magnified by 1 / (1 - (P / P_cr)^2)."""
    stiffness = section_stiffness(1e9, 1e9, 1e9, 1.0, 1e6, 1.0)
    critical = beams.lateral_buckling()

    def side(factor: float) -> float:
        tip = exact_cantilever(stiffness, 1.0, force=(0, 1e-5, factor * critical)).tip
        return float(tip[1] / 1e-5)

    # the deflection runs to infinity as the square of the load nears the critical square: two
    # values near it extrapolate to it; other modes contribute a few percent of (1 - 0.99^2)
    near, nearer = 0.98, 0.995
    ratio = side(near) / side(nearer)
    square = (nearer**2 - ratio * near**2) / (1 - ratio)
    # bending in the stiff plane, 1e6 times stiffer, changes the load by 1e-6
    assert math.sqrt(square) == pytest.approx(1.0, abs=2e-4)


def test_buckled_column_leaves_the_straight_way() -> None:
    """Slightly pushed aside, at 1.5 times Euler's load: the elastica, not the unstable column.

    For a tip angle of 90 degrees, P / P_cr = (2 K(sin 45) / pi)^2 = 1.393 (Timoshenko & Gere 2.7).
    """
    euler = math.pi**2 * 2.0 / (4 * 9.0)
    K = float(ellipk(0.5))
    load = euler * (2 * K / math.pi) ** 2
    # rigid in tension and shear but for 1e-6; the push to the side is of 1e-5 of the load
    bent = exact_cantilever(SLENDER, 3.0, force=(-load, 0, 1e-5 * load))
    # tip position of the elastica: x = L (2 E / K - 1), z = 2 k L / K
    expected = 3.0 * np.array([2 * float(ellipe(0.5)) / K - 1, 0.0, math.sqrt(2) / K])
    np.testing.assert_allclose(bent.position[-1], expected, atol=1e-4 * 3.0)


def test_hopeless_loads_are_said_so() -> None:
    """An ideal column does not know to which side to buckle."""
    with pytest.raises(ShellmbError, match="cannot be followed"):
        exact_cantilever(SLENDER, 3.0, force=(-30.0, 0.0, 0.0))
