"""Beams hold tension, however thin, long and coarse; the strain of the line in large deformations.

With interpolated directors `d1 . x' - 1` sees next to nothing of the stretch between neighbours
that point in opposite directions. Where `T h^2/EI` is above 20 to 100 that state has less energy,
and any push leads to it. So these are tests of a kind: a bar has the axial stiffness `EA` whatever
`T h^2/EI`, in every scheme; and what measures the stretch in its place is right in any
deformation, about any line that describes the beam.
"""

import math
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest
from scipy.optimize import brentq

from shellmb.demos.verification.cantilever import exact_cantilever
from shellmb.running.execute import RunResult, execute
from shellmb.scene import (
    GROUND,
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
    Probe,
    Ramp,
    RectangularSection,
    Revolute,
    Scene,
)
from shellmb.schemes.registry import SCHEMES, make_scheme
from shellmb.simulate.simulation import Simulation

PULL, EA = 10.0, 1e5


def thin(EI: float) -> GeneralSection:
    return GeneralSection(
        (EA, EA, EA, EI, EI, EI), mass_per_length=1.0, second_moments=(1e-6, 0.0, 1e-6)
    )


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("scheme", list(SCHEMES))
def test_a_pulled_bar_has_its_axial_stiffness(scheme: str, degree: int) -> None:
    """`T h^2/EI` of 4 and 4e4; pushed to the side."""
    for EI in (0.1, 1e-5):
        bar = Beam("bar", Line((0, 0, 0), (1, 0, 0)), thin(EI), elements=5, degree=degree)
        dynamic = make_scheme(scheme, 1.0).dynamic
        scene = Scene(
            "bar",
            beams=bar,
            supports=Clamped("start"),
            loads=(
                PointForce("end", (PULL, 0, 0), time=Ramp(0.05) if dynamic else None),
                PointForce("end", (0, 0, 1e-3 if dynamic else 0.0)),
            ),
            probes=Probe("u", "end", component=0),
            scheme=scheme,
            dt=5e-3 if dynamic else 1.0,
            t_end=0.15 if dynamic else 1.0,
        )
        u = execute(scene).history["u"]
        right = PULL / EA
        if dynamic:
            # the ramp takes four periods; what is left of the vibration is a third of it at most
            assert u.abs().max() < 1.5 * right
            assert u.iloc[-1] > 0.6 * right
        else:
            # the law is of second order in the strain, 1e-4
            assert u.iloc[-1] == pytest.approx(right, rel=1e-3)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.02, -0.01)], ids=["axis", "offset"])
@pytest.mark.parametrize("stretch", [0.8, 1.02, 1.5])
def test_large_tension_and_compression(stretch: float, offset: tuple[float, float]) -> None:
    """`F = EA lambda (lambda^2 - 1)/2`, which is what the probe of the force reads, too."""
    E, width, height = 1e5, 0.1, 0.1
    section = RectangularSection(E, 0.3, width=width, height=height, offset=offset)
    F = E * width * height * stretch * (stretch**2 - 1) / 2
    # a force at the line turns an offset beam: the moment about the tension centre is taken off
    y2, y3 = offset
    loads = (PointForce("end", (F, 0, 0)), PointMoment("end", (0, y3 * F, -y2 * F)))
    probes = (
        *(Probe(f"u{k}", "end", component=k) for k in range(3)),
        Probe("F", "end", quantity="force", component=0),
        *(Probe(f"M{k}", "end", quantity="moment", component=k) for k in (1, 2)),
    )
    scene = Scene(
        "bar",
        beams=Beam("bar", Line((0, 0, 0), (1, 0, 0)), section, elements=2),
        supports=Clamped("start"),
        loads=loads,
        probes=probes,
        scheme="static",
        dt=0.25,
    )
    last = execute(scene).history.iloc[-1]
    assert last["u0"] == pytest.approx(stretch - 1, rel=1e-8)
    # displacements of a tenth of the bar or more by 1e-9 of Newton's tolerance
    assert abs(last["u1"]) + abs(last["u2"]) < 1e-8
    assert last["F"] == pytest.approx(F, rel=1e-7)
    assert last["M1"] == pytest.approx(y3 * F, rel=1e-6, abs=1e-7 * abs(F))
    assert last["M2"] == pytest.approx(-y2 * F, rel=1e-6, abs=1e-7 * abs(F))


RADIUS, ANGLE = 0.8, 1.1
ARC = CircularArc((0, RADIUS, 0), (0, 0, 0), (0, 0, 1), ANGLE)


def soft(offset: tuple[float, float]) -> np.ndarray:
    """A section that is stretched and sheared by some per cent, with couplings and an offset."""
    root = np.random.default_rng(11).normal(size=(6, 6))
    size = np.diag([4.0, 3.0, 3.0, 1.0, 1.0, 1.2])
    C = size @ (np.eye(6) + 0.1 * (root + root.T) / 2) @ size
    y2, y3 = offset
    Hc = np.array([[0.0, y3, -y2], [-y3, 0.0, 0.0], [y2, 0.0, 0.0]])
    lever = np.block([[np.eye(3), Hc], [np.zeros((3, 3)), np.eye(3)]])
    return np.asarray(lever.T @ C @ lever)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.15, -0.1)], ids=["couplings", "offset"])
def test_soft_curved_beam_in_large_strains(solve, last, offset: tuple[float, float]) -> None:
    """All strains, couplings, a tension centre off the line: against a solution by shooting."""
    C, loads = soft(offset), ((0.9, -1.1, 1.3), (0.2, 0.4, -0.3), (0.3, 0.6, -0.4))
    force, moment, load = loads
    exact = exact_cantilever(
        C,
        RADIUS * ANGLE,
        force=force,
        moment=moment,
        load=load,
        curvature=(0, 0, 1 / RADIUS),
        stretch_of_line=True,
    )
    simo = exact_cantilever(
        C,
        RADIUS * ANGLE,
        force=force,
        moment=moment,
        load=load,
        curvature=(0, 0, 1 / RADIUS),
    )
    # strains so large that their squares count
    assert np.linalg.norm(simo.tip - exact.tip) > 0.01 * np.linalg.norm(exact.tip)
    beam = Beam("b", ARC, GeneralSection(C, size=0.1), elements=8, degree=3)
    run = solve(
        beam,
        "force",
        "moment",
        steps=2,
        supports=Clamped("start"),
        loads=(PointForce("end", force), PointMoment("end", moment), LineForce(load)),
    )
    np.testing.assert_allclose(last(run), exact.tip, atol=1e-6 * np.linalg.norm(exact.tip))
    # what the probes read balances the loads; they are continued from Gauss points
    R = exact.rotation
    for k, where in ((0, "start"), (-1, "end")):
        for quantity, vector in (("force", exact.force[k]), ("moment", exact.moment[k])):
            found = last(run, where, quantity)
            np.testing.assert_allclose(found, R[k].T @ vector, atol=2e-3 * np.linalg.norm(force))


KINDS: dict[str, dict[str, Any]] = {
    "exact": {},
    "linear": {"model": "floating-frame"},
    "no stretching": {"stretching": False},
    "no shear": {"transverse_shear": False},
    "no strains": {"stretching": False, "transverse_shear": False},
}


def twin(offset: tuple[float, float], scheme: str, degree: int, kind: dict[str, Any]) -> np.ndarray:
    """Positions of the nodes of a beam's centroid, which is described by a line beside it."""
    y2, y3 = offset
    data = {"E": 1e5, "nu": 0.3, "width": 0.05, "height": 0.08, "density": 1000.0}
    section = RectangularSection(**data, offset=offset)
    # small rotations are small: of a tenth
    size = 0.15 if kind.get("model") == "floating-frame" else 1.0
    # d2 = y, d3 = z
    line = Line((0, -y2, -y3), (1, -y2, -y3))
    beam = Beam("b", line, section, elements=3, degree=degree, **kind)
    dynamic = make_scheme(scheme, 1.0).dynamic
    scene = Scene(
        "twin",
        beams=beam,
        supports=Clamped("start"),
        loads=(Gravity((0.06 * size, 0.1 * size, -0.3 * size)), LineMoment((0.02 * size,) * 3)),
        scheme=scheme,
        dt=0.02 if dynamic else 0.5,
        t_end=0.2 if dynamic else 1.0,
    )
    simulation = Simulation(scene)
    simulation.run()
    body = simulation.model.beams["b"]
    q = simulation.problem.levels["b"].q.x.array
    x = body.mixed.nodes("u") + q[body.mixed.dofs["u"]].reshape(-1, 3)
    d = body.frames_at(q)
    return np.asarray(x + y2 * d[:, 1] + y3 * d[:, 2])


@pytest.mark.parametrize(
    ("scheme", "degree", "kind"),
    [
        *(("static", degree, kind) for degree in (2, 3) for kind in KINDS if kind != "linear"),
        *((scheme, 2, kind) for scheme in ("ep", "ep4") for kind in ("exact", "no stretching")),
        ("ed", 2, "exact"),
        pytest.param("ep", 2, "linear", marks=pytest.mark.slow),
    ],
)
def test_offsets_are_exact_twins(scheme: str, degree: int, kind: str) -> None:
    """The strains are those of the tension centre, whose line is interpolated as any line is."""
    on, off = (twin(offset, scheme, degree, KINDS[kind]) for offset in ((0.0, 0.0), (0.07, -0.05)))
    moved = np.abs(on - np.linspace([0, 0, 0], [1, 0, 0], len(on))).max()
    assert moved > 0.01
    # Newton's tolerance of 1e-9, and ten times that over ten steps
    np.testing.assert_allclose(off, on, atol=1e-8)


def cable(sag: float, degree: int, EI: float, elements: int, dt: float) -> tuple[RunResult, float]:
    """A cable that is a parabola at rest under its weight, in statics; the catenary's sag."""
    weight = 9.81
    curve = ParametricCurve(lambda xi: np.array([xi, 0 * xi, -4 * sag * xi * (1 - xi)]))
    xi = np.linspace(0, 1, 10001)
    length = float(np.hypot(np.diff(xi), np.diff(4 * sag * xi * (1 - xi))).sum())

    def span(H: float) -> float:
        return 2 * (H / weight * math.asinh(weight * length / 2 / H) + H * length / 2 / EA)

    H = float(brentq(lambda H: span(H) - 1, 0.1, 1e4))
    V = weight * length / 2
    exact = H / weight * (math.hypot(1, V / H) - 1) + weight * length**2 / 8 / EA
    # ends turn about y: clamped ones would be of 5e-4 where the cable is slack
    scene = Scene(
        "cable",
        beams=Beam("c", curve, thin(EI), elements=elements, degree=degree),
        joints=tuple(
            Revolute(name, GROUND, "c", at=(x, 0, 0), axis=(0, 1, 0))
            for name, x in (("left", 0), ("right", 1))
        ),
        redundant="drop",
        loads=Gravity((0, 0, -weight)),
        probes=Probe("z", (0.5, 0, -sag), component=2),
        scheme="static",
        dt=dt,
    )
    return execute(scene), exact


# next to no stiffness: a step of a thousandth of the load is too large at first
@pytest.mark.parametrize(("degree", "EI"), [(2, 1e-4), (3, 1e-4), (2, 1e-9)])
def test_a_cable_without_bending_stiffness(degree: int, EI: float) -> None:
    """Statics of a slack and of a taut cable, in a single load step: the elastic catenary."""
    for sag in (0.0, 0.2):
        run, exact = cable(sag, degree, EI, 16, 1.0)
        assert sag - run.history["z"].iloc[-1] == pytest.approx(exact, rel=1e-3)


def test_a_load_step_that_folds_a_cable_is_told_with_what_helps() -> None:
    """Kind: a step that jumps to an equilibrium of the elements, not of the cable."""
    run, exact = cable(0.4, 2, 1e-6, 8, 1.0)
    assert abs(0.4 - run.history["z"].iloc[-1] - exact) > 0.1 * exact
    (said,) = (caution.says for caution in run.warnings if caution.watch == "folded")
    assert "smaller load steps (dt)" in said
    run, exact = cable(0.4, 2, 1e-6, 8, 0.1)
    # 2.6e-5 off
    assert 0.4 - run.history["z"].iloc[-1] == pytest.approx(exact, rel=1e-3)
    assert not run.warnings
