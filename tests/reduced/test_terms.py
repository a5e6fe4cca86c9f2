"""Terms that users add to bodies in modes, beside those of the exact body."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import ufl

from shellmb.errors import SceneError
from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    Clamped,
    Cylinder,
    Hinged,
    InitialVelocity,
    Isotropic,
    Line,
    Modal,
    PointForce,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
    ShellDamping,
    SurfaceForce,
)
from tests.reduced.conftest import Kept, kept

E, NU, THICKNESS, TAU = 70e9, 0.3, 5e-3, 1e-3
BENDING = E * THICKNESS**3 / 12 / (1 - NU**2)
MODAL, CORNER = Modal(modes=8), (1.0, 0.4, 0.0)
SLOW = pytest.mark.slow


def drag(point: Any) -> Any:
    """The square of the velocity across the surface, as it is deformed."""
    across = ufl.dot(point.v, point.normal)
    return -60.0 * abs(across) * across * ufl.dot(point.normal, point.du)


def held_back(point: Any) -> Any:
    """A soft bed and a pull on directors, which know positions, directors and time."""
    pull = 20.0 * ufl.sin(30.0 * point.time) * point.dw[0]
    return -2e3 * point.x[2] * point.du[2] + pull - 5.0 * point.d[1] * point.dw[1]


def bed_across(point: Any) -> Any:
    """A bed that holds what moves across it, and not along."""
    return -1e4 * point.x[2] * point.du[2]


def bed_at_an_end(point: Any) -> Any:
    """A bed that holds most of what is near x = 0."""
    held = ufl.exp(-((6.0 * (point.x[0] - point.u[0])) ** 2))
    return -4e5 * held * ufl.dot(point.u, point.du)


def growing(point: Any) -> Any:
    """A pressure that grows with the time, and along the plate."""
    return 4.0 * point.time * point.x[0] ** 2 * point.du[2]


def pushed_up(point: Any) -> Any:
    """A pressure that keeps its direction."""
    return 3.0 * point.du[2]


def viscous(point: Any) -> Any:
    """Kelvin and Voigt's damping of bending."""
    rate, change = point.strain_rate.kap, point.dstrain.kap
    moments = rate[0] + NU * rate[1], rate[1] + NU * rate[0], (1 - NU) / 2 * rate[2]
    return -TAU * BENDING * sum(m * change[k] for k, m in enumerate(moments))


def pushed(t: float) -> float:
    return float(np.sin(np.pi * t / 0.05) ** 2) if t < 0.05 else 0.0


@cache
def tumbling(model: Any, terms: tuple[Callable[[Any], Any], ...], scheme: str = "ep") -> Kept:
    section = Isotropic(E=E, nu=NU, thickness=THICKNESS, density=2700.0)
    plate = Shell("plate", Rectangle(1.0, 0.4), section, mesh=(4, 2), model=model, terms=terms)
    return thrown(scheme, CORNER, shells=plate)


def thrown(scheme: str, end: Any, **bodies: Any) -> Kept:
    """A body in flight that is pushed at an end."""
    probes = [Probe(f"x{k}", end, "position", k) for k in range(3)]
    push = PointForce(end, (0.0, 0.0, 20.0), time=pushed)
    motion = {"initial": InitialVelocity(spin=(1.0, 0.3, 0.6)), "loads": push, "probes": probes}
    return kept(Scene("thrown", **bodies, **motion, scheme=scheme, dt=2.5e-3, t_end=0.1))


def apart(one: Kept, other: Kept) -> float:
    first, second = (run.history[["x0", "x1", "x2"]].to_numpy() for run in (one, other))
    return float(np.abs(first - second).max())


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=SLOW)])
@pytest.mark.parametrize("term", [drag, pytest.param(held_back, marks=SLOW)])
def test_terms_act_as_on_the_exact_body(term, scheme) -> None:
    """Within what bodies in modes are off by without: 10 um of motions by a decimetre."""
    exact, modal = (tumbling(model, (term,), scheme) for model in ("exact", MODAL))
    assert modal.summary["energy_balance_error"] < 1e-12
    assert apart(exact, modal) < 2e-5
    assert apart(tumbling(MODAL, (), scheme), modal) > 50 * apart(exact, modal)
    work = [run.history["work_terms"].to_numpy() for run in (exact, modal)]
    assert np.abs(work[1] - work[0]).max() < 5e-3 * np.abs(work[0]).max()


def plated(model: Any, term: Any, force: float, scheme: str, **more: Any) -> Any:
    """How a corner under a force, and one far from it, move."""
    section = Isotropic(E=E, nu=NU, thickness=THICKNESS, density=2700.0)
    plate = Shell("plate", Rectangle(1.0, 0.4), section, mesh=(4, 2), model=model, terms=(term,))
    probes = [Probe(f"w{k}", x, component=2) for k, x in enumerate((CORNER, (0.5, 0.2, 0.0)))]
    loads = PointForce(CORNER, (0.0, 0.0, force), time=more.pop("time", None)) if force else ()
    run = execute(Scene("s", plate, loads=loads, probes=probes, scheme=scheme, **more))
    assert not run.warnings
    return run.history[["w0", "w1"]].to_numpy()


@pytest.mark.parametrize("kind", ["a bed", "a pressure that grows"])
def test_what_terms_do_in_statics_few_modes_have(kind) -> None:
    """Up to squares of rotations, some 1e-4; without modes of terms 0.6 and 3 %."""
    more: dict[str, Any] = {"force": 1.0, "term": bed_at_an_end}
    if kind != "a bed":
        more = {"force": 0.0, "term": growing, "supports": Hinged(("left", "right"))}
    found = [plated(m, scheme="static", dt=1.0, **more)[-1] for m in ("exact", Modal(modes=1))]
    assert found[1] == pytest.approx(found[0], rel=2e-4, abs=1e-12)


def test_a_bed_moves_few_modes_as_the_exact_body() -> None:
    """Four modes are 3 and 1.4 % off, without those of terms 10 and 5 %."""
    more: dict[str, Any] = {"time": lambda t: np.sin(np.pi * t / 0.03) ** 2 * (t < 0.03)}
    more |= {"scheme": "ep", "dt": 1e-3, "t_end": 0.06, "force": 20.0, "term": bed_at_an_end}
    exact, modal = (plated(model, **more) for model in ("exact", Modal(modes=4)))
    off = np.abs(modal - exact).max(axis=0) / np.abs(exact).max(axis=0)
    assert off.max() < 0.08


def cubic_spring(point: Any) -> Any:
    """A spring near a corner, of the third power of the displacement: nothing at rest."""
    x = point.x - point.u
    near = ufl.exp(-((20.0 * (x[0] - 0.9)) ** 2) - (20.0 * (x[1] - 0.1)) ** 2)
    return -1e9 * near * point.u[2] ** 3 * point.du[2]


def test_what_modes_lack_of_terms_that_do_nothing_at_rest_is_said() -> None:
    """One mode is 6 % off at a corner beside the spring, four are 0.1 %."""
    section = Isotropic(E=E, nu=NU, thickness=THICKNESS, density=2700.0)

    def run(model: Any, term: Any = cubic_spring) -> Any:
        plate = Shell("plate", Rectangle(1.0, 0.4), section, (8, 4), model=model, terms=(term,))
        push = SurfaceForce(
            (0, 0, 300.0), time=lambda t: np.sin(np.pi * t / 0.03) ** 2 * (t < 0.03)
        )
        probes = [Probe(f"w{y}", (1.0, y, 0.0), component=2) for y in (0.0, 0.4)]
        motion = {"scheme": "ep", "dt": 1e-3, "t_end": 0.06}
        more = {"supports": Clamped("left"), "loads": push, "probes": probes}
        return execute(Scene("sprung", plate, **more, **motion))

    exact, one, four = (run(m) for m in ("exact", Modal(modes=1), Modal(modes=4)))
    moved = [each.history[["w0.0", "w0.4"]].to_numpy() for each in (exact, one, four)]
    off = [np.abs(each - moved[0]).max() / np.abs(moved[0]).max() for each in moved]
    assert not four.warnings and off[2] < 2e-3
    (warning,) = one.warnings
    # by forces as they are, which fall where the body gives way: it may be so much
    assert warning.watch == "terms on modes" and off[1] < warning.value < 6 * off[1]
    assert "shell 'plate'" in warning.says and f"up to {warning.value:.0%} of" in warning.says


@SLOW
def test_a_bed_alone_holds_it_in_statics() -> None:
    """4 N on 4 kN/m."""

    def bed(point: Any) -> Any:
        return -1e4 * ufl.dot(point.u, point.du)

    section = Isotropic(E=E, nu=NU, thickness=THICKNESS, density=2700.0)
    plate = Shell("plate", Rectangle(1.0, 0.4), section, mesh=(4, 2), model=MODAL, terms=(bed,))
    load, probe = SurfaceForce((0, 0, 10.0)), Probe("w", CORNER, component=2)
    found = execute(Scene("s", plate, loads=load, probes=probe, scheme="static", dt=1.0))
    assert found.history["w"].iloc[-1] == pytest.approx(1e-3, rel=1e-9)


@SLOW
def test_strain_rates_are_those_of_the_modes() -> None:
    """A viscous term is the section's damping, which is the modes' in their own way.

    That is taken at rest, and off by the square of rotations."""
    section = Isotropic(
        E=E, nu=NU, thickness=THICKNESS, density=2700.0, stiffness_damping=ShellDamping(bending=TAU)
    )
    plate = Shell("plate", Rectangle(1.0, 0.4), section, mesh=(4, 2), model=MODAL)
    damped, written = thrown("ep", CORNER, shells=plate), tumbling(MODAL, (viscous,))
    effect = apart(tumbling(MODAL, ()), written)
    assert effect > 1e-4
    assert apart(damped, written) < 1e-3 * effect


@SLOW
@pytest.mark.parametrize("kind", ["beam", "curved triangles"])
def test_beams_and_triangles_have_them(kind) -> None:
    def run(model: Any, terms: Any) -> Kept:
        if kind == "beam":
            bar = RectangularSection(E=E, nu=NU, width=0.01, height=0.02, density=2700.0)
            line = Line((0, 0, 0), (1, 0, 0))
            rod = Beam("rod", line, bar, elements=4, model=model, terms=terms)
            return thrown("ep", (1.0, 0.0, 0.0), beams=rod)
        section = Isotropic(E=E, nu=NU, thickness=THICKNESS, density=2700.0)
        surface = Cylinder(0.5, 0.4, (0.0, 60.0))
        more = {"mesh": (4, 3), "cell": "tri", "model": model, "terms": terms}
        return thrown("ep", (0.5, 0.0, 0.0), shells=Shell("panel", surface, section, **more))

    def bed(point: Any) -> Any:
        return -2e2 * ufl.dot(point.x, point.du) - 10.0 * ufl.dot(point.v, point.du)

    exact, modal, without = run("exact", (bed,)), run(MODAL, (bed,)), run(MODAL, ())
    assert modal.summary["energy_balance_error"] < 1e-12
    assert apart(without, modal) > 20 * apart(exact, modal)


LEFT_FREE = {
    # a bed across holds three motions, and a push that is always the same none
    "shell 'plate' can translate along x and y and turn about z": ((bed_across,), ()),
    "shell 'plate' can turn about y through (0, 0.2, 0)": ((pushed_up,), Hinged("left")),
}


@pytest.mark.parametrize("said", LEFT_FREE)
def test_statics_names_what_terms_leave_free(said) -> None:
    """As of an exact body, and before Newton's method meets a matrix that is singular."""
    terms, supports = LEFT_FREE[said]
    section = Isotropic(E=E, nu=NU, thickness=THICKNESS, density=2700.0)
    for model in ("exact", MODAL):
        plate = Shell("plate", Rectangle(1.0, 0.4), section, mesh=(4, 2), model=model, terms=terms)
        with pytest.raises(SceneError) as caught:
            execute(Scene("free", plate, supports=supports, scheme="static"))
        assert str(caught.value) == (
            f"statics: nothing holds these motions: {said}; add supports, joints or springs that "
            "do (a load does not), or let it move, as with scheme='ep'"
        )
