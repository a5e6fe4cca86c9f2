"""Relaxation: closed forms, orders, exact balance in large motion, restart, bad input.

Kind: memory of strains beside the state, in sections of shells and beams, in every scheme.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.errors import ConvergenceError, SceneError
from shellmb.forms.steps.damping import Branch
from shellmb.model.sections.branches import means
from shellmb.observers.account.energy import EnergyAccount
from shellmb.running.execute import execute
from shellmb.running.resume import resume
from shellmb.simulate.simulation import BaseObserver, Simulation

E, NU, RHO = 2e9, 0.3, 1000.0
SERIES = ((0.3, 0.05), (0.2, 0.5))
SCHEMES = ("ep", "ed", "ep4", "ed3")
SLOW = pytest.mark.slow


def strip(
    kind: str,
    series: sm.Prony | None,
    nu: float = NU,
    rho: float = RHO,
    stiffness: float = E,
    elements: int = 4,
    thickness: float = 0.02,
) -> dict[str, Any]:
    """A cantilever strip of 1 m, clamped at its start."""
    own = {"density": rho, "relaxation": series}
    if kind == "beam":
        bar = sm.RectangularSection(stiffness, nu, width=0.2, height=thickness, **own)
        body: dict[str, Any] = {
            "beams": sm.Beam("strip", sm.Line((0, 0, 0), (1, 0, 0)), bar, elements)
        }
        return body | {"supports": sm.Clamped("start")}
    section = sm.Isotropic(stiffness, nu, thickness=thickness, **own)
    if kind == "laminate":
        plies = [sm.PlyMaterial(E, E, nu12=nu, G12=G, G13=G, G23=G, density=rho) for G in [E / 2.6]]
        soft = replace(plies[0], relaxation=series)
        other = replace(plies[0], relaxation=sm.Prony(((0.5, 0.2),), "long-term"))
        section = sm.Laminate([sm.Ply(m, 0.005) for m in (soft, plies[0], other)], offset=0.003)
    cell: Any = "tri" if kind == "tri" else "quad"
    shell = sm.Shell("strip", sm.Rectangle(1.0, 0.2), section, mesh=(elements, 1), cell=cell)
    return {"shells": shell, "supports": sm.Clamped("left")}


def alpha(scheme: str, value: float = 0.5) -> dict[str, float]:
    return {"alpha": value} if scheme in ("ed", "ed3") else {}


class Rows(BaseObserver):
    def __init__(self, account: EnergyAccount) -> None:
        self._account, self.rows = account, list[dict[str, float]]()

    def accepted(self, simulation: Simulation) -> None:
        self.rows.append(dict(self._account.values))


@pytest.mark.parametrize(
    ("kind", "schemes"),
    [("beam", SCHEMES), ("quad", ("ep", "ep4"))]
    + [pytest.param(k, SCHEMES, marks=SLOW) for k in ("quad", "tri", "laminate")],
)
def test_the_balance_closes_in_large_motion(kind: str, schemes: tuple[str, ...]) -> None:
    """What goes in is stored or dissipated, by the scheme and by the branches; these only take."""
    for scheme in schemes:
        load = sm.Gravity((0, 5, -60.0))
        more = {"dt": 0.01, "t_end": 0.15, "solver": sm.Solver(tolerance=1e-12), **alpha(scheme)}
        bodies = strip(kind, sm.Prony(SERIES))
        run = Simulation(sm.Scene("s", **bodies, loads=load, scheme=scheme, **more))
        account = EnergyAccount()
        rows = Rows(account)
        run.run([account, rows])
        loss = [row["strip.relaxation.loss"] for row in rows.rows]
        assert np.all(np.diff(loss) > 0), scheme
        assert loss[-1] > 0.05 * account.exchanged
        assert account.relative_error < 1e-13, scheme


def test_the_law_of_a_branch_is_written_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Motion, energy, loss, and damped modes follow an edit of `Branch.stress`; all stays exact."""

    def found() -> tuple[float, float, complex]:
        load, more = sm.Gravity((0, 5, -60.0)), {"dt": 0.01, "t_end": 0.05, **alpha("ed3")}
        more |= {"solver": sm.Solver(tolerance=1e-12), "scheme": "ed3"}
        scene = sm.Scene("s", **strip("beam", sm.Prony(SERIES), elements=1), loads=load, **more)
        account = EnergyAccount()
        Simulation(scene).run([account])
        assert account.relative_error < 1e-13
        (modes,) = sm.modes(scene, rates=[0.0], count=1).computed.modes
        energy = account.values["strip.relaxation.energy"]
        return energy, account.values["strip.relaxation.loss"], complex(modes.values[0])

    stress, before = Branch.stress, found()
    monkeypatch.setattr(
        Branch, "stress", lambda self, *of: tuple(1.2 * s for s in stress(self, *of))
    )
    ratios = [abs(b / a) for a, b in zip(before, found(), strict=True)]
    assert ratios[0] > 1.1 and ratios[1] > 1.1 and ratios[2] > 1.001


@pytest.mark.slow
@pytest.mark.parametrize("series", [None, sm.Prony(SERIES)])
@pytest.mark.parametrize("kind", ["beam", "quad"])
def test_orders_are_kept_in_large_motion(kind: str, series: sm.Prony | None) -> None:
    """Orders 2, 2, 4, 3, with relaxation as without; by regression.

    One soft element, whose vibrations the steps resolve, and a load that grows from zero smoothly:
    where steps do not resolve all vibrations, EP4 has 3.3 to 3.5 with relaxation and without.
    """

    def end(scheme: str, n: int) -> Any:
        load = sm.Gravity((0, 0, -60.0), time=lambda t: np.sin(5 * np.pi * t) ** 6)
        more = {"dt": 0.2 / n, "t_end": 0.2, "solver": sm.Solver(tolerance=1e-13), **alpha(scheme)}
        # steps resolve transverse shear of a shell only where it is thick and soft
        E1, h = (E / 100, 0.02) if kind == "beam" else (E / 1e4, 0.2)
        bodies = strip(kind, series, stiffness=E1, elements=1, thickness=h)
        run = Simulation(sm.Scene("s", **bodies, loads=load, scheme=scheme, **more))
        run.run([])
        body = run.model.meshed["strip"]
        return run.problem.levels["strip"].q.x.array[body.mixed.dofs["u"].ravel()].copy()

    exact = end("ep4", 320)
    for scheme, order in zip(SCHEMES, (2, 2, 4, 3), strict=True):
        steps = np.array([40, 80, 160] if order < 4 else [20, 40, 80])
        errors = [np.abs(end(scheme, n) - exact).max() for n in steps]
        assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] > order - 0.3, scheme


def test_a_branch_that_hardly_relaxes_is_a_spring() -> None:
    """In ED its mean less its first moment has no share of the change: it is below round-off."""
    more = {"dt": 1e-6, "t_end": 2e-6, "loads": sm.Gravity((0, 0, -9.81)), "scheme": "ed"}
    ends = []
    for series in (None, sm.Prony(((0.3, 1e10),))):
        run = Simulation(sm.Scene("s", **strip("beam", series, elements=1), **more))
        run.advance()
        ends.append(run.problem.levels["strip"].q.x.array.copy())
    assert np.abs(ends[0]).max() > 0 and ends[1] == pytest.approx(ends[0], rel=1e-6, abs=1e-15)


@pytest.mark.parametrize(
    ("damping", "bows", "order"), [(0.0, False, 2), (0.0, True, 4), (0.5, True, 3), (1.0, True, 3)]
)
def test_a_branch_has_the_order_of_the_scheme(damping: float, bows: bool, order: int) -> None:
    """The stress of a branch by a strain sin(3 t): order by regression, exact solution."""
    tau, w, end = 0.3, 3.0, 1.0
    a = w * tau
    exact = a * (np.cos(w * end) + a * np.sin(w * end) - np.exp(-end / tau)) / (1 + a**2)
    steps, errors = np.array([40, 80, 160]), list[float]()
    for n in steps:
        h, X = end / n, 0.0
        for k in range(n):
            t0, t1 = k * h, (k + 1) * h
            first, last = np.sin(w * t0), np.sin(w * t1)
            mean = (np.cos(w * t0) - np.cos(w * t1)) / (w * h)
            given = np.array([X, last - first, first + last - 2 * mean if bows else 0.0])
            X += last - first - h / tau * (means(h / tau, damping, bows) @ given)[0]
        errors.append(abs(X - exact))
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order, abs=0.15)


def creep(t: Any, g: float, tau: float) -> Any:
    """Compliance over the long-term one of a standard linear solid, g of the instantaneous."""
    return 1 - g * np.exp(-(1 - g) * t / tau)


@pytest.mark.parametrize("kind", ["beam", "quad", pytest.param("tri", marks=SLOW)])
@pytest.mark.parametrize("shift", [1.0, sm.WLF(8.0, 100.0, 20.0, 40.0)])
def test_a_strip_creeps_as_theory_says(kind: str, shift: Any) -> None:
    """A tip force at once, no inertia to speak of; a shift with temperature is one of the times."""
    g, tau, dt = 0.4, 1.0, 0.02
    factor = 1.0 if isinstance(shift, float) else 10 ** (-8.0 * 20 / 120)
    bodies = strip(kind, sm.Prony(((g, tau / factor),), shift=shift), nu=0.0, rho=1e-4)
    force = (
        sm.PointForce("end", (0, 0, 1e-3), body="strip")
        if kind == "beam"
        else sm.EdgeForce("right", (0, 0, 1e-3 / 0.2))
    )
    at = "end" if kind == "beam" else "right-top"
    tip = sm.Probe("tip", at, component=2, body="strip")
    scene = sm.Scene(
        "s", **bodies, loads=force, probes=tip, scheme="ed3", alpha=1.0, dt=dt, t_end=2
    )
    found = sm.run(scene).history
    static = sm.run(replace(scene, scheme="static", alpha=None, dt=1.0, t_end=1.0)).history
    fast = replace(scene.meshed[0].section.relaxation, relaxed=False)
    section = replace(scene.meshed[0].section, relaxation=fast)
    given = {"beams" if kind == "beam" else "shells": replace(scene.meshed[0], section=section)}
    at_once = sm.run(
        replace(scene, **given, scheme="static", alpha=None, dt=1.0, t_end=1.0)
    ).history
    long_term, instantaneous = (h["tip"].iloc[-1] for h in (static, at_once))
    assert instantaneous == pytest.approx((1 - g) * long_term, rel=1e-6)
    assert long_term == pytest.approx(1e-3 / (3 * (1 - g) * E * 0.2 * 0.02**3 / 12), rel=2e-3)
    wanted = long_term * creep(found["t"], g, tau)
    np.testing.assert_allclose(found["tip"][10:], wanted[10:], rtol=2e-5)


class Stops(BaseObserver):
    """Ends a run in the middle."""

    def accepted(self, simulation: Simulation) -> None:
        if simulation.step == 5:
            raise ConvergenceError("in the middle")


@pytest.mark.parametrize("kind", ["beam", pytest.param("quad", marks=SLOW)])
def test_a_run_resumes_bit_for_bit(kind: str, tmp_path: Path) -> None:
    bodies, load = strip(kind, sm.Prony(SERIES, relaxed=False)), sm.Gravity((0, 0, -9.81))
    full = sm.Solver(newton="full")
    scene = sm.Scene("s", **bodies, loads=load, scheme="ed", dt=0.01, t_end=0.1, solver=full)
    whole = execute(scene, tmp_path / "whole", pictures=False).history
    with pytest.raises(ConvergenceError):
        execute(scene, tmp_path / "half", [Stops()], pictures=False)
    found = resume(tmp_path / "half", scene=scene, pictures=False).history
    for name in set(whole) - {"wall_s"}:
        np.testing.assert_array_equal(found[name], whole[name], err_msg=name)


BAD: dict[str, Callable[[], Any]] = {
    "share 1 is -0.1; each share must be positive": lambda: sm.Prony(((0.1, 1.0), (-0.1, 2.0))),
    "time 0 is 0.0; each time must be positive": lambda: sm.Prony(((0.1, 0),)),
    "at least one pair": lambda: sm.Prony(()),
    "must be pairs": lambda: sm.Prony((0.1, 1.0)),
    "add up to 1.1, so the long-term modulus": lambda: sm.Prony(((0.6, 1.0), (0.5, 2.0))),
    "moduli is 'secant'": lambda: sm.Prony(((0.6, 1.0),), "secant"),  # type: ignore[arg-type]
    "is inf s; each shifted time must be": lambda: sm.Prony(((0.6, 1e300),), shift=1e300),
    "must be a positive factor on the times": lambda: sm.Prony(((0.6, 1.0),), shift=-1.0),
    "temperature is -90.0; it must be above": lambda: sm.WLF(8.0, 100.0, 20.0, -90.0),
}


def refused(kind: str = "beam", series: Any = None, **more: Any) -> sm.Scene:
    bodies = strip(kind, series or sm.Prony(SERIES)) | more
    return sm.Scene(
        "s", **{"loads": sm.Gravity(), "dt": 0.1, "t_end": 0.1, "scheme": "ep"} | bodies
    )


def bodies_with(kind: str, **changed: Any) -> Any:
    (body,) = [b for b in strip(kind, sm.Prony(SERIES)).values() if hasattr(b, "section")]
    return replace(body, **changed)


BAD |= {
    "modes do not relax": lambda: refused(beams=bodies_with("beam", model=sm.Modal(3))),
    "must have stretching=True": lambda: refused(
        "quad", shells=bodies_with("quad", transverse_shear=False)
    ),
    "relaxed must be True": lambda: refused(
        series=sm.Prony(SERIES, relaxed=False), start="equilibrium"
    ),
    "has a relaxation; scheme 'generalized-alpha'": lambda: sm.run(
        refused(scheme="generalized-alpha")
    ),
    "are relaxed only: rest, a steady rotation": lambda: sm.linearise(
        refused(series=sm.Prony(SERIES, relaxed=False)), at="equilibrium"
    ),
    "branches do not follow a natural strain": lambda: refused(
        beams=bodies_with("beam", natural=sm.BeamNaturalStrain(1e-3, time=lambda t: t))
    ),
    "or be constant in time, with relaxed=True": lambda: refused(
        series=sm.Prony(SERIES, relaxed=False),
        beams=replace(
            bodies_with("beam", natural=sm.BeamNaturalStrain(1e-3)),
            section=strip("beam", sm.Prony(SERIES, relaxed=False))["beams"].section,
        ),
    ),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_series_get_a_sentence(message: str) -> None:
    with pytest.raises(SceneError, match=message):
        BAD[message]()


@pytest.mark.parametrize("kind", ["beam", "quad"])
@pytest.mark.parametrize("relaxed", [True, False])
def test_what_is_heated_and_free_has_the_natural_strain(kind: str, relaxed: bool) -> None:
    """Kind: a stress of natural strains with another stiffness than that of statics."""
    bodies = strip(kind, sm.Prony(SERIES, relaxed=relaxed), nu=0.0)
    name, beam = ("beams", kind == "beam") if kind == "beam" else ("shells", False)
    hot = sm.BeamNaturalStrain(1e-4) if beam else sm.NaturalStrain((1e-4, 0.0, 0.0))
    bodies[name] = replace(bodies[name], natural=hot)
    tip = sm.Probe("tip", "end" if beam else (1.0, 0.1, 0.0), component=0, body="strip")
    scene = sm.Scene("s", **bodies, probes=tip, scheme="static", dt=1.0, t_end=1.0)
    assert sm.run(scene).history["tip"].iloc[-1] == pytest.approx(1e-4, rel=1e-3)


@pytest.mark.parametrize("kind", ["beam", pytest.param("tri", marks=SLOW)])
def test_resultants_balance_the_load(kind: str) -> None:
    """A strip that is pulled creeps; its force, with the branches, stays that of the load."""
    bodies = strip(kind, sm.Prony(((0.4, 1.0),)), nu=0.0, rho=1e-3)
    load = sm.PointForce("end", (10.0, 0, 0), body="strip")
    pulled = load if kind == "beam" else sm.EdgeForce("right", (50.0, 0, 0))
    at, what = ("start", "force") if kind == "beam" else ((0.5, 0.1, 0), "membrane")
    n = sm.Probe("n", at, what, component=0, body="strip")  # type: ignore[arg-type]
    more = {"scheme": "ed", "alpha": 1.0, "dt": 0.05, "t_end": 1.0}
    more["output"] = sm.Output(end_forces=True)
    found = sm.run(sm.Scene("s", **bodies, loads=pulled, probes=n, **more)).history
    np.testing.assert_allclose(found["n"][1:], 10.0 if kind == "beam" else 50.0, rtol=1e-5)
    # what holds it at the end of a step has the branches, too
    edge = "start" if kind == "beam" else "left"
    np.testing.assert_allclose(found[f"strip.{edge}.Fx_end"][2:], -10.0, rtol=1e-5)


def test_derivatives_are_those_of_runs() -> None:
    """By a share and a time: both are in the branches, which are beside the state."""

    def scene(share: float = 0.3, time: float = 0.05) -> sm.Scene:
        bodies = strip("beam", sm.Prony(((share, time), (0.2, 0.5))))
        tip = sm.Probe("tip", "end", component=2, body="strip")
        more = {"dt": 0.01, "t_end": 0.1, "solver": sm.Solver(tolerance=1e-12)}
        load = sm.Gravity((0, 0, -60.0))
        return sm.Scene("s", **bodies, loads=load, probes=tip, scheme="ep4", **more)

    found = sm.sensitivities(scene, parameters=("share", "time")).history
    for name, value in (("share", 0.3), ("time", 0.05)):
        h = 1e-4 * value
        above, below = (sm.run(scene(**{name: value + d})).history["tip"] for d in (h, -h))
        wanted = (above.iloc[-1] - below.iloc[-1]) / (2 * h)
        assert found[name, "tip"].iloc[-1] == pytest.approx(wanted, rel=1e-5)
