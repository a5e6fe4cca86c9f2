"""Supports of bodies in modes: edges that stay rigid, and those that only their modes know."""

from typing import Any

import numpy as np
import pytest

from shellmb.demos.references.plates import Plate
from shellmb.errors import SceneError
from shellmb.native.kernels import watched
from shellmb.running.execute import RunResult, execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Beam,
    Clamped,
    Driven,
    Fixed,
    Gravity,
    HardSupport,
    Hinged,
    Isotropic,
    Line,
    LineForce,
    Modal,
    PointForce,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
    SoftSupport,
    SurfaceForce,
    SymmetryPlane,
    Weld,
)
from tests.analytic.solutions import rectangle_frequencies

PLATE = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
MODAL = Modal(modes=8)
ALL = ("left", "right", "bottom", "top")
SLOW = pytest.mark.slow


def plate(model: Any = MODAL, mesh: tuple[int, int] = (8, 4)) -> Shell:
    return Shell("plate", Rectangle(1.0, 0.4), PLATE, mesh=mesh, model=model)


SIMPLE = (HardSupport(ALL), Fixed((0.0, 0.0, 0.0), (0, 0, None)), Fixed((1, 0, 0), (None, 0, None)))
# with the number of rigid motions that are left
SUPPORTS = {
    "hinged around": (0, Hinged(ALL)),
    "hinged at an edge": (1, Hinged("left")),
    "two edges that are apart": (0, Clamped(("left", "right"))),
    "edges that meet": (0, Clamped(ALL)),
    "clamped and hinged": (0, (Clamped("left"), Hinged("right"))),
    "half of a plate": (0, (SymmetryPlane("left", (1, 0, 0)), Hinged("right"))),
    "simply supported": (0, SIMPLE),
}
QUICK = ("hinged around", "hinged at an edge")


def frequencies(model: Any, supports: Any, mesh: tuple[int, int] = (8, 4), count: int = 6) -> Any:
    scene = Scene("modes", plate(model, mesh), supports=supports, scheme="ep", dt=1, t_end=1)
    return natural_modes(scene, count=count)


@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=SLOW) for n in SUPPORTS]
)
def test_modes_are_those_of_the_supported_body(name) -> None:
    """Of as many as are asked for, to the tolerance of the eigenvalues; clamped edges that are
    apart are frames, and modes with these held are the body's own."""
    rigid, supports = SUPPORTS[name]
    exact, modal = (frequencies(model, supports) for model in ("exact", MODAL))
    assert exact.rigid == modal.rigid == rigid
    assert np.allclose(modal.omega[rigid:], exact.omega[rigid:], rtol=1e-6, atol=0)


def test_multipliers_are_no_modes() -> None:
    """Where there are few modes the eigensolver finds what is infinite, too, as -1e16."""
    scene = Scene("modes", plate(mesh=(4, 2)), supports=Hinged("left"), scheme="ep", dt=1, t_end=1)
    found = natural_modes(scene, count=5)
    assert found.rigid == 1
    assert (found.omega > -1.0).all()


@SLOW
def test_a_plate_on_simple_supports_has_the_frequencies_of_the_books() -> None:
    theory = Plate(70e9, 0.3, 5e-3, 2700.0)
    known = rectangle_frequencies(theory, 1.0, 0.4, [(1, 1), (2, 1), (3, 1), (4, 1), (1, 2)])
    found = frequencies(MODAL, SIMPLE, (20, 8), 5).omega
    # of the mesh, whose error falls with its square
    assert np.allclose(found, np.sort(known), rtol=1e-2, atol=0)


def pressed(t: float) -> float:
    """Over after 0.01 s, the period of the lowest mode."""
    return float(np.sin(np.pi * t / 0.01) ** 2) if t < 0.01 else 0.0


def shaken(name: str, model: Any, scheme: str) -> RunResult:
    load = SurfaceForce((0, 0, 20.0), time=pressed)
    times = {"scheme": scheme, "dt": 5e-4, "t_end": 0.02}
    probe = Probe("middle", (0.5, 0.2, 0.0), component=2)
    scene = Scene("s", plate(model), supports=SUPPORTS[name][1], loads=load, probes=probe, **times)
    return execute(scene)


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=SLOW)])
@pytest.mark.parametrize("name", ["hinged around", "two edges that are apart"])
def test_moves_as_the_full_body_does(name, scheme) -> None:
    """By 10 and 40 um, small beside its thickness; off by the square of that, and truncation."""
    exact, modal = (shaken(name, model, scheme) for model in ("exact", MODAL))
    assert modal.summary["energy_balance_error"] < 1e-12
    assert modal.summary["constraint_max"] < 1e-12
    one, other = (run.history["middle"].to_numpy() for run in (exact, modal))
    assert np.abs(one - other).max() < 5e-4 * np.abs(one).max()


@SLOW
def test_a_hinged_plate_swings_as_the_full_body_does() -> None:
    """A pendulum from the horizontal to the other side, within what small strains are off by: a
    rigid one is off by 1.1 mm, and centrifugal forces stiffen it by (5.4/114)^2."""

    def swung(model: Any) -> tuple[RunResult, Any]:
        probes = [Probe(f"x{k}", (1.0, 0.4, 0.0), "position", k) for k in range(3)]
        times = {"scheme": "ep4", "dt": 0.01, "t_end": 1.0, "probes": probes}
        supports = Hinged("left") if model != "rigid" else ()
        scene = Scene("p", plate(model), supports=supports, loads=Gravity(), **times)
        run = execute(scene)
        return run, run.history[["x0", "x1", "x2"]].to_numpy()

    (_, exact), (_, linear), (modal, found) = (
        swung(model) for model in ("exact", "floating-frame", MODAL)
    )
    assert exact[:, 0].min() < -0.99
    assert modal.summary["energy_balance_error"] < 1e-12
    assert np.abs(found - exact).max() < 5e-4
    # what truncation costs: eight of the modes
    assert np.abs(found - linear).max() < 5e-5


@SLOW
def test_statics_has_deflections_moments_and_forces_of_all_supports() -> None:
    """A pressure of 0.2 kPa: 80 N, and 75 um, 1.5 % of the thickness."""

    def pressed_by(model: Any) -> Any:
        middle = (0.5, 0.2, 0.0)
        probes = [Probe("w", middle, component=2), Probe("m", middle, "bending", 0)]
        load = SurfaceForce((0, 0, 200.0))
        times = {"scheme": "static", "dt": 1.0, "probes": probes}
        scene = Scene("s", plate(model), supports=Hinged(ALL), loads=load, **times)
        return execute(scene).history.iloc[-1]

    exact, modal = pressed_by("exact"), pressed_by(MODAL)
    # as a plate between hinges is stiffer by the square of deflections over its thickness
    assert np.allclose(modal[["w", "m"]], exact[["w", "m"]], rtol=1e-3, atol=0)
    assert modal["plate.supports.F3"] == pytest.approx(-80.0, rel=1e-9)


REFUSED = {
    "shell 'plate' is reduced to modes, and its supports leave it free to translate along x and y "
    "and turn about z; they must hold it, or be Hinged edges in one straight line, or the model "
    "must be 'exact'": {"supports": SoftSupport(ALL)},
    "point force: shell 'plate' is reduced to modes, and (0.0, 0.0, 0.0) shares nodes with 'left', "
    "which supports hold: attach elsewhere, or the model must be 'exact'": {
        "supports": Hinged("left"),
        "loads": PointForce((0.0, 0.0, 0.0), (0, 0, 1.0)),
    },
    "weld 'w': shell 'plate' is reduced to modes, and 'bottom' shares nodes with 'left', which "
    "supports hold: attach elsewhere, or the model must be 'exact'": {
        "supports": Hinged("left"),
        "joints": Weld("w", "ground", "plate", at=(1.0, 0.0, 0.0), second_at="bottom"),
    },
    "driven edge: shell 'plate' is reduced to modes and would be moved; what moves it must be a "
    "Driver of a joint, and supports must hold it where it is": {
        "supports": Driven("left", rotation=lambda t: t)
    },
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_it_cannot_have_is_refused(message) -> None:
    with watched() as kernels, pytest.raises(SceneError) as caught:
        natural_modes(Scene("bad", plate(), scheme="ep", dt=1, t_end=1, **REFUSED[message]))
    assert str(caught.value) == message
    assert not kernels


def test_what_stretches_between_its_supports_is_said_by_how_much() -> None:
    """A plate on hinges that moves by 0.03 and 0.12 of its thickness, and one with a free end.

    The error is that of the mean deflection, by Simpson's rule: on that the load works.
    """
    held, weights = Hinged(ALL), np.outer((1, 4, 2, 4, 1), (1, 4, 1)).ravel() / 72
    places = [(x / 4, y / 5, 0.0) for x in range(5) for y in range(3)]
    probes = [Probe(f"w{k}", place, component=2) for k, place in enumerate(places)]

    def off(model: Any, pressure: float, supports: Any = held) -> tuple[float, list[float]]:
        more = {"supports": supports, "loads": SurfaceForce((0, 0, pressure)), "probes": probes}
        scenes = (Scene("s", plate(m), scheme="static", dt=1.0, **more) for m in ("exact", model))
        exact, found = map(execute, scenes)
        means = [weights @ run.history[[p.name for p in probes]].iloc[-1] for run in (exact, found)]
        return means[1] / means[0] - 1, [item.value for item in found.warnings]

    assert off(MODAL, 400.0)[1] == off(MODAL, 200.0, Clamped("left"))[1] == []
    for model in (MODAL, "floating-frame"):
        error, (said,) = off(model, 1600.0)
        # 2.5 %; what is of higher order is the square of that
        assert said == pytest.approx(error, rel=0.02)
    # nothing stretches it, but it bends as far as 6 % of its length: 1.5 %, and 1.1 are said
    error, (said,) = off(MODAL, 400.0, Clamped("left"))
    assert said == pytest.approx(error, rel=0.3)


@SLOW
def test_a_beam_between_hinges_may_turn_about_itself() -> None:
    """So nothing but its inertia tells how it moves as a whole; and it is stretched as it bends."""
    bar = RectangularSection(E=70e9, nu=0.3, width=0.01, height=0.02, density=2700.0)
    peaks, said = [], []
    for model in ("exact", Modal(modes=6)):
        beam = Beam("bar", Line((0, 0, 0), (1, 0, 0)), bar, elements=8, model=model)
        load, probe = LineForce((0, 0, 40.0)), Probe("w", (0.5, 0.0, 0.0), component=2)
        times = {"scheme": "ep", "dt": 1e-3, "t_end": 0.03}
        held = Hinged(("start", "end"))
        run = execute(Scene("s", beams=beam, supports=held, loads=load, probes=probe, **times))
        peaks.append(float(np.abs(run.history["w"]).max()))
        said.append([item.value for item in run.warnings])
    assert said[0] == []
    (share,) = said[1]
    # largest deflections under a load that is there at once: of `w + b w^3 / 2 k = 2 p / k`
    assert peaks[1] / peaks[0] - 1 == pytest.approx(share / 2, rel=0.3)
