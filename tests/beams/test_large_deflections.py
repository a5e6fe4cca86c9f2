"""Cantilevers under all loads against the exact solution, and sections that only look different."""

import math

import numpy as np
import pytest

from shellmb.demos.verification.cantilever import exact_cantilever
from shellmb.scene import (
    Beam,
    CircularArc,
    Clamped,
    GeneralSection,
    Gravity,
    Line,
    LineForce,
    LineMoment,
    ParametricCurve,
    PointForce,
    PointMoment,
    RectangularSection,
)

RADIUS, ANGLE = 1.0, 1.2
# towards +y from the x axis: curvature 1/R about d3 = z
ARC = CircularArc((0, RADIUS, 0), (0, 0, 0), (0, 0, 1), ANGLE)
FORCE, MOMENT, LOAD = (0.4, -0.6, 0.8), (0.2, 0.4, -0.3), (0.2, 0.6, -0.4)


@pytest.mark.parametrize(("degree", "elements", "error"), [(2, 8, 2e-4), (3, 4, 5e-5)])
def test_curved_coupled_beam_under_all_loads(solve, last, coupled, degree, elements, error) -> None:
    """Force and moment at the end and a line load on an arc of a section with all couplings."""
    beam = Beam("b", ARC, GeneralSection(coupled), elements=elements, degree=degree)
    loads = (PointForce("end", FORCE), PointMoment("end", MOMENT), LineForce(LOAD))
    run = solve(beam, "rotation", supports=Clamped("start"), loads=loads)
    exact = exact_cantilever(
        coupled,
        RADIUS * ANGLE,
        force=FORCE,
        moment=MOMENT,
        load=LOAD,
        curvature=(0, 0, 1 / RADIUS),
        stretch_of_line=True,
    )
    size = np.linalg.norm(exact.tip)
    assert size > 0.25
    np.testing.assert_allclose(last(run), exact.tip, atol=error * size)
    # d1, d2, d3 at the end began as the tangent there, turned by ANGLE
    c, s = math.cos(ANGLE), math.sin(ANGLE)
    turn = exact.rotation[-1] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    v = last(run, quantity="rotation")
    angle = np.linalg.norm(v)
    assert angle == pytest.approx(math.acos((np.trace(turn) - 1) / 2), abs=10 * error)
    np.testing.assert_allclose(turn @ v, v, atol=10 * error * angle)


def rate(solve, last, degree: int, counts: tuple[int, ...]) -> float:
    exact = exact_cantilever(
        np.diag([1e3, 5e2, 5e2, 1.0, 1.0, 1.0]),
        RADIUS * ANGLE,
        force=(0.0, 0.0, 0.8),
        curvature=(0, 0, 1 / RADIUS),
        stretch_of_line=True,
    ).tip
    section = GeneralSection((1e3, 5e2, 5e2, 1.0, 1.0, 1.0))
    errors = []
    for n in counts:
        beam = Beam("b", ARC, section, elements=n, degree=degree)
        loads = PointForce("end", (0, 0, 0.8))
        tip = last(solve(beam, supports=Clamped("start"), loads=loads))
        errors.append(float(np.linalg.norm(tip - exact)))
    return float(-np.polyfit(np.log(counts), np.log(errors), 1)[0])


@pytest.mark.parametrize(("degree", "counts"), [(2, (2, 4, 8)), (3, (1, 2, 4))])
def test_rate_of_convergence(solve, last, degree, counts) -> None:
    """Displacement of an end node in large rotations: `h^(2 k)`."""
    assert rate(solve, last, degree, counts) > 2 * degree - 0.3


@pytest.mark.parametrize("degree", [2, 3])
def test_thin_arcs_do_not_lock(solve, last, degree) -> None:
    """The relative error of a curved beam under bending, torsion and tension at any thinness."""
    errors = []
    for thinness in (1e-1, 1e-3, 1e-5):
        section = RectangularSection(E=1.0, nu=0.3, width=thinness, height=thinness)
        size = float(section.stiffness[5, 5])
        force = (0.0, 0.3 * size, 0.4 * size)
        beam = Beam("b", ARC, section, elements=4, degree=degree)
        found = last(solve(beam, supports=Clamped("start"), loads=PointForce("end", force)))
        exact = exact_cantilever(
            section.stiffness, RADIUS * ANGLE, force=force, curvature=(0, 0, 1 / RADIUS)
        ).tip
        assert np.linalg.norm(exact) > 0.1
        errors.append(float(np.linalg.norm(found - exact) / np.linalg.norm(exact)))
    assert errors[0] < 5e-4
    # thin enough for shear and tension not to count: the same error
    assert errors[1] < 2 * errors[0]
    assert errors[2] == pytest.approx(errors[1], rel=0.05)


def test_an_offset_is_a_matter_of_description(solve, last) -> None:
    """One beam about its centroid and about a line beside it, under gravity and an end force."""
    y2, y3 = 0.04, -0.03
    data = {"E": 1e6, "nu": 0.3, "width": 0.02, "height": 0.03, "density": 1000.0}
    ends = np.array([[0.0, 0, 0], [1, 0, 0]])
    # d2 = y, d3 = z: the line from which the centroid is at (y2, y3) is at (-y2, -y3)
    lines = [Line(*map(tuple, ends)), Line(*map(tuple, ends - (0, y2, y3)))]
    sections = [RectangularSection(**data), RectangularSection(**data, offset=(y2, y3))]
    found = []
    for line, section in zip(lines, sections, strict=True):
        beam = Beam("b", line, section, elements=8, degree=3)
        loads = (Gravity((0, 0, -0.5)), LineMoment((0.03, 0.01, 0.02)))
        run = solve(beam, "rotation", supports=Clamped("start"), loads=loads)
        found.append((last(run), last(run, quantity="rotation")))
    (u, turn), (u_off, turn_off) = found
    assert np.linalg.norm(turn) > 0.2
    # not the same discrete problem, as directors are orthonormal at the nodes only
    np.testing.assert_allclose(turn_off, turn, atol=5e-7)
    angle = np.linalg.norm(turn)
    n, arm = turn / angle, np.array([0, y2, y3])
    cross = np.cross(n, arm)
    moved = math.sin(angle) * cross + (1 - math.cos(angle)) * np.cross(n, cross)
    np.testing.assert_allclose(u_off + moved, u, atol=5e-7)


def test_small_loads(solve, last) -> None:
    """Closed forms of a cantilever: weight, a line load, a line moment and an end moment."""
    section = RectangularSection(E=1e6, nu=0.0, width=0.1, height=0.1, density=10.0)
    C, m, small = section.stiffness, section.mass[0], 1e-6
    EI, GA = C[4, 4], C[2, 2]
    uniform = 1 / (8 * EI) + 1 / (2 * GA)
    beam = Beam("b", Line((0, 0, 0), (1, 0, 0)), section)
    cases = (
        (Gravity((0, 0, -small)), -m * small * uniform),
        (LineForce((0, 0, small)), small * uniform),
        # about -y, which lifts the end: M(x) = small (L - x)
        (LineMoment((0, -small, 0)), small / (3 * EI)),
        (PointMoment("end", (0, -small, 0)), small / (2 * EI)),
    )
    for load, exact in cases:
        u = last(solve(beam, supports=Clamped("start"), loads=load))
        # polynomials of degree 4 by elements of degree 2: exact at the nodes
        assert u[2] == pytest.approx(exact, rel=1e-6)


def test_a_straight_curve_of_any_parameter(solve, last, coupled) -> None:
    """Elements on curves, of unequal length, give what the straight line gives."""
    curve = ParametricCurve(lambda xi: np.array([xi + 0.2 * xi**2, 0 * xi, 0 * xi]) / 1.2)
    tips = [
        last(
            solve(
                Beam("b", line, GeneralSection(coupled), elements=4, degree=3),
                supports=Clamped("start"),
                loads=PointForce("end", FORCE),
            )
        )
        for line in (curve, Line((0, 0, 0), (1, 0, 0)))
    ]
    assert np.linalg.norm(tips[1]) > 0.1
    # both within their own error, which the test of rates bounds by 1e-4 of this
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-5)
