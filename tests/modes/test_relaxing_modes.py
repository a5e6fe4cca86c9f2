"""Complex modes of sections that relax.

Kind: Maxwell branches in the equations of small motions, of beams and shells, alike or not.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

import shellmb as sm
from shellmb.errors import SceneError

E, NU, RHO = 2e9, 0.3, 1000.0


def poles(scene: sm.Scene, count: int, **options: Any) -> Any:
    found = sm.modes(scene, rates=[0.0], count=count, **options).computed
    assert found is not None
    return found.modes[0].values


def beam(E: float, series: sm.Prony | None, held: bool = True) -> sm.Scene:
    section = sm.RectangularSection(E, NU, width=0.2, height=0.02, density=RHO, relaxation=series)
    strip = sm.Beam("strip", sm.Line((0, 0, 0), (1, 0, 0)), section, elements=4)
    supports = sm.Clamped("start") if held else ()
    return sm.Scene("s", beams=strip, supports=supports, scheme="ep", dt=0.1, t_end=0.1)


@pytest.mark.parametrize(
    "series",
    [
        ((0.4, 0.01),),
        ((0.3, 0.05), (0.2, 0.5)),
        ((0.9, 0.003),),
        ((0.3, 1e4), (0.3, 1e-7)),
    ],
)
def test_poles_of_a_standard_solid_are_in_closed_form(series: Any) -> None:
    """Each mode by itself: s^2 + w^2 (1 + sum_i g_i' s tau_i/(1 + s tau_i)) = 0."""
    left = 1 - sum(g for g, _ in series)
    elastic = np.abs(poles(beam(left * E, None), 4))
    found = poles(beam(E, sm.Prony(series)), 4)
    for w, s in zip(elastic[:4], found, strict=False):
        whole = sum(g / left * s * tau / (1 + s * tau) for g, tau in series)
        assert abs(s**2 + w**2 * (1 + whole)) < 1e-8 * w**2
        assert s.imag > 0 > s.real


def test_rigid_motions_stay_at_zero() -> None:
    """A free beam: six modes at rest, which no branch sees."""
    found = sm.modes(beam(E, sm.Prony(((0.4, 0.01),)), held=False), rates=[0.0], count=8).computed
    assert found is not None
    (modes,) = found.modes
    assert modes.rigid == 6
    assert np.all(np.abs(modes.values[:6]) < modes.neutral)
    assert np.all(modes.values[6:].real < 0)
    assert not modes.unstable


@pytest.mark.parametrize("tau", [10.0, 1e4])
def test_a_column_creeps_into_buckling(tau: float) -> None:
    """A load between both critical ones: a pole that grows, of pairs beside one that oscillates.

    Without inertia `1 + g' s tau/(1 + s tau)` is the load over the critical long-term one.
    """
    g, part = 0.4, 1.2
    critical = np.pi**2 / 4 * (1 - g) * E * 0.2 * 0.02**3 / 12
    load = sm.PointForce("end", (-part * critical, 0, 0), body="strip")
    scene = replace(beam(E, sm.Prony(((g, tau),))), loads=load)
    found = sm.modes(scene, rates=[0.0], count=3, loaded=True)
    assert not found.stable
    values = found.computed.modes[0].values  # type: ignore[union-attr]
    (grows,) = values[values.real > 0]
    wanted = (part - 1) / (tau * (1 + g / (1 - g) - part))
    assert abs(grows.imag) < 1e-9 * grows.real
    assert grows.real == pytest.approx(wanted, rel=2e-2)
    assert np.sum((values.imag > 1) & (values.imag < 30)) == 1


@pytest.mark.parametrize("cell", ["quad", pytest.param("tri", marks=pytest.mark.slow)])
def test_a_plate_with_a_ply_that_relaxes_decays_so(cell: Any) -> None:
    """Against a free motion by ep4 after a smooth pulse, fitted by a decaying wave and creep."""
    stiff = sm.PlyMaterial(E, E, nu12=NU, G12=E / 2.6, G13=E / 2.6, G23=E / 2.6, density=RHO)
    soft = sm.PlyMaterial(
        E,
        E,
        nu12=NU,
        G12=E / 2.6,
        G13=E / 2.6,
        G23=E / 2.6,
        density=RHO,
        relaxation=sm.Prony(((0.5, 0.02),)),
    )
    section = sm.Laminate([sm.Ply(soft, 0.005), sm.Ply(stiff, 0.01)], shear_correction=5 / 6)
    plate = sm.Shell("p", sm.Rectangle(1.0, 0.2), section, mesh=(4, 1), cell=cell)

    def scene(**more: Any) -> sm.Scene:
        held: Any = {"shells": plate, "supports": sm.Clamped("left"), "scheme": "ep4"}
        return sm.Scene("s", **held, **more)

    wanted = poles(scene(dt=0.1, t_end=0.1), 1)[0]
    period = 2 * np.pi / wanted.imag
    pulse = sm.EdgeForce(
        "right",
        (0, 0, 1e-3),
        time=lambda t: np.sin(np.pi * t / period) ** 4 if t < period else 0.0,
    )
    tip = sm.Probe("tip", "right-top", component=2, body="p")
    run = sm.run(scene(loads=pulse, probes=tip, dt=period / 24, t_end=7 * period)).history
    late = run["t"] > 2.5 * period
    t, x = (run[name][late].to_numpy() for name in ("t", "tip"))
    t, x = t - t[0], x / np.abs(x).max()

    def left(p: Any) -> Any:
        wave = np.exp(-p[0] * t)
        shapes = np.c_[wave * np.cos(p[1] * t), wave * np.sin(p[1] * t), np.exp(-p[2] * t)]
        return shapes @ np.linalg.lstsq(shapes, x)[0] - x

    decay, frequency, _ = least_squares(left, [1.0, 18.0, 50.0], x_scale=[1, 10, 50]).x
    assert frequency == pytest.approx(wanted.imag, rel=3e-5)
    assert decay == pytest.approx(-wanted.real, rel=1e-4)


def test_about_states_of_runs_a_sentence_says_what_there_is() -> None:
    scene = beam(E, sm.Prony(((0.4, 0.01),)))
    with pytest.raises(
        SceneError, match="'strip' relaxes, and there are equations about states where"
    ):
        sm.modes(scene, at=0.1)
