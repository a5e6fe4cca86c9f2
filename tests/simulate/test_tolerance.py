"""Steps that follow their error: what the tolerance brings, where steps land, what is kept."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.demos.verification.problems.mechanisms import (
    RigidPath,
    double_pendulum,
    pendulum_centers,
)
from shellmb.diagnostics.steps import ADDED
from shellmb.errors import SceneError
from shellmb.options.run import Options
from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    CircularSection,
    Clamped,
    EdgeForce,
    InitialVelocity,
    Isotropic,
    Line,
    PointForce,
    Ramp,
    Rectangle,
    Scene,
    Shell,
    StepControl,
    Table,
)
from shellmb.scene.schemes import DISSIPATIVE
from shellmb.schemes.registry import SCHEMES
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.stepping import difference
from shellmb.simulate.stepsize import AIM, ErrorSize

# with the most dissipation, where there is one
# rivals are there to be compared with steps that are fixed
DYNAMIC = [
    (name, 1.0 if name in DISSIPATIVE else 0.0)
    for name, make in SCHEMES.items()
    if make(1.0).dynamic
    and not make(1.0).linear
    and not make(1.0).title.startswith("for comparison")
]
SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.1, density=1.0)
STRIP = Shell("strip", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1))


class Steps(BaseObserver):
    """Begins, lengths and errors of the accepted steps."""

    def __init__(self) -> None:
        self.t: list[float] = []
        self.dt: list[float] = []
        self.error: list[float] = []

    def solved(self, simulation: Simulation) -> None:
        last = simulation.last
        assert last is not None and last.error is not None
        self.t.append(last.t)
        self.dt.append(last.dt)
        self.error.append(last.error)


def falling(scheme: str, alpha: float, tolerance: float, **more: Any) -> Scene:
    """The rigid double pendulum; its first step is too short, and there is no longest one."""
    scene = double_pendulum(scheme, alpha, 400, t_end=1.0)
    return replace(scene, step_control=StepControl(step_error=tolerance, max_dt=1.0, **more))


def strip(scheme: str = "ep", **more: Any) -> Scene:
    alpha = 1.0 if scheme in DISSIPATIVE else None
    choices = {"alpha": alpha, "dt": 0.05, "t_end": 1.0, "supports": Clamped("left")}
    choices |= {"loads": EdgeForce("right", (0.0, 0.0, 5e-3)), "scheme": scheme}
    return Scene("strip", STRIP, **(choices | more))


def slope(x: Any, y: Any) -> float:
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


@pytest.mark.parametrize("confluent", [False, True])
@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_differences_are_derivatives_of_polynomials(degree: int, confluent: bool) -> None:
    """Of one of that degree, at any times, with or without the rate at the oldest one."""
    times = -np.array([0.0, 1.0, 1.3, 2.8, 3.0, 4.5])[: degree + 1 - confluent]
    polynomial = np.poly1d(np.arange(1.0, degree + 2))
    data = [*polynomial(times)] + ([polynomial.deriv()(times[-1])] if confluent else [])
    exact = polynomial.deriv(degree)(0.0)
    # round-off of a Vandermonde matrix with powers up to the fifth of 4.5
    assert difference(times, degree, confluent) @ data == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize(("scheme", "alpha"), DYNAMIC)
def test_the_error_is_proportional_to_the_tolerance(scheme: str, alpha: float) -> None:
    """A rigid double pendulum in a large fall, against its equations of motion."""
    order = SCHEMES[scheme](alpha).order
    tolerances = (1e-2, 1e-3, 1e-4) if order < 3 or scheme == "ed" else (1e-4, 1e-5, 1e-6)
    errors = []
    for tolerance in tolerances:
        path, simulation = RigidPath("b"), Simulation(falling(scheme, alpha, tolerance))
        simulation.run([path])
        exact = pendulum_centers(np.array(path.time))[:, 1]
        gaps = [a[:2] - b for a, b in zip(path.positions, exact, strict=True)]
        errors.append(float(np.max(np.linalg.norm(gaps, axis=1))))
    # found 0.95 to 1.02: the steps are as many as twenty only where the tolerance is largest
    assert slope(tolerances, errors) == pytest.approx(1.0, abs=0.12)
    # it falls over two and a half radians; in `ep4` what it is off by on the way cancels
    assert all(0.02 * t < e < 3 * t for t, e in zip(tolerances, errors, strict=True))


# a quarter of a minute each: one scheme that is linear in a step, and one that is quadratic
QUICK = ("ep", "ed3")


@pytest.mark.parametrize(
    ("scheme", "alpha"),
    [pytest.param(*s, marks=[] if s[0] in QUICK else pytest.mark.slow) for s in DYNAMIC],
)
def test_the_error_follows_the_tolerance_in_an_elastic_body(scheme: str, alpha: float) -> None:
    """A soft cantilever that swings up under a smooth load, against a run with a fine step."""
    section = CircularSection(E=1e4, nu=0.3, radius=0.05, density=100.0)
    beam = Beam("arm", Line((0, 0, 0), (1, 0, 0)), section, elements=2)

    def end(dt: float, tolerance: float | None, name: str = scheme) -> np.ndarray:
        scene = Scene(
            "arm",
            beams=beam,
            supports=Clamped("start"),
            loads=PointForce("end", (0, 0, 0.5), time=lambda t: float(np.sin(np.pi * t) ** 2)),
            scheme=name,
            alpha=alpha if name in DISSIPATIVE else None,
            dt=dt,
            t_end=1.0,
            step_control=StepControl(
                step_error=tolerance, max_dt=None if tolerance is None else 1.0
            ),
        )
        simulation = Simulation(scene)
        simulation.run()
        body = simulation.model.beams["arm"]
        return simulation.problem.levels["arm"].q.x.array[body.mixed.dofs["u"]].copy()

    # with twice the step it is the same to 2e-8
    exact = end(5e-3, None, "ep4")
    # far enough for rotations to be large
    assert np.max(np.abs(exact)) > 0.3
    # where a run has a dozen steps only they still grow from the first one on
    tolerances = (1e-2, 1e-3, 1e-4) if scheme in ("ep", "ed") else (1e-4, 1e-5, 1e-6)
    errors = [float(np.max(np.abs(end(0.01, t) - exact))) for t in tolerances]
    # found 0.80 (ep4) to 0.92: the load is no motion of one frequency
    assert slope(tolerances, errors) == pytest.approx(1.0, abs=0.3)
    assert all(0.1 * t < e < 4 * t for t, e in zip(tolerances, errors, strict=True))


@pytest.mark.parametrize("scheme", ["ep", "ed3"])
def test_steps_are_short_in_fast_phases_and_long_in_slow_ones(scheme: str) -> None:
    """The strip is pushed slowly, then quickly, then slowly; nothing tells when."""

    def push(t: float) -> float:
        return 0.02 * t + float(1 / (1 + np.exp(-(t - 5) / 0.03)))

    stiff = replace(STRIP, section=replace(SOFT, E=1e4))
    steps = Steps()
    moved = replace(strip(scheme, dt=0.01, t_end=5.5), shells=(stiff,))
    force = EdgeForce("right", (0, 0, 3.0), time=push)
    control = StepControl(step_error=1e-3, max_dt=1.0)
    Simulation(replace(moved, loads=(force,), step_control=control)).run([steps])
    t, dt = np.array(steps.t), np.array(steps.dt)
    fast, slow = dt[(t > 4.95) & (t < 5.3)], dt[(t > 2) & (t < 4.5)]
    assert slow.min() > 2 * fast.min()
    assert slow.max() > 3 * dt[0]


def test_a_rejected_step_leaves_no_trace() -> None:
    """From a first step that is rejected, and from the one that it is cut to."""
    first = falling("ep", 0.0, 1e-4)
    cut = Simulation(replace(first, dt=0.2))
    steps = Steps()
    cut.run([steps])
    assert cut.size.rejected > 0
    whole = Simulation(replace(first, dt=steps.dt[0]))
    whole.size.after_rejection = True
    again = Steps()
    whole.run([again])
    # powers of errors, which are differences of states that are known to 1e-15
    np.testing.assert_allclose(again.dt, steps.dt, rtol=1e-6)
    places = cut.model.rigid.local("b", "u")
    a, b = (s.problem.levels[s.model.rigid.name].q.x.array[places] for s in (cut, whole))
    # by these changes of steps of 1e-3 s
    np.testing.assert_allclose(a, b, atol=1e-8)


@pytest.mark.parametrize(("scheme", "alpha"), DYNAMIC)
def test_laws_hold_for_steps_that_change(scheme: str, alpha: float) -> None:
    """Energy account and momentum of a chain and of a plate, the step changing all the time."""
    result = execute(falling(scheme, alpha, 1e-3))
    assert len(set(np.round(result.column("dt")[1:], 12))) > 4
    made = SCHEMES[scheme](alpha)
    # round-off of some fifty steps, relative to what is exchanged
    lawful = "energy" in made.conserves or made.dissipation()[0] > 0
    if lawful:
        assert result.summary["energy_balance_error"] < 1e-12
    free = Scene(
        "plate",
        STRIP,
        scheme=scheme,
        alpha=alpha,
        dt=0.05,
        t_end=3.0,
        initial=InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(0.4, 0.6, -0.3)),
        step_control=StepControl(step_error=1e-3),
    )
    thrown = execute(free)
    assert len(set(np.round(thrown.column("dt")[1:], 12))) > 4
    if lawful:
        assert thrown.summary["energy_balance_error"] < 1e-12
    assert thrown.summary["linear_momentum_drift"] < 1e-12
    if "angular momentum" in made.conserves:
        assert thrown.summary["angular_momentum_drift"] < 1e-12


def test_steps_end_where_loads_have_corners_and_at_named_times() -> None:
    steps = Steps()
    loads = (
        EdgeForce("right", (0, 0, 1e-3), time=Table((0.31, 0.32, 0.33), (0.0, 1.0, 0.0))),
        EdgeForce("right", (0, 0, 1e-4), time=Ramp(0.5)),
    )
    control = StepControl(step_error=1e-2, times=(0.123, 0.77), max_dt=1.0)
    simulation = Simulation(strip(loads=loads, step_control=control))
    simulation.run([steps])
    ends = {*steps.t[1:], simulation.t}
    assert {0.123, 0.31, 0.32, 0.33, 0.5, 0.77, 1.0} <= ends
    # fixed steps end at named times only
    fixed = Simulation(strip(loads=loads, dt=0.3, step_control=StepControl(times=(0.123,))))
    seen = []
    while fixed.t < 0.9:
        fixed.advance()
        seen.append(fixed.t)
    assert seen[0] == 0.123 and 0.31 not in seen


def test_a_run_goes_on_with_its_step_and_its_memory() -> None:
    """Saved in the middle and taken up by another simulation."""
    scene = falling("ep4", 0.0, 1e-5)
    whole, steps = Simulation(scene), Steps()
    for _ in range(9):
        whole.advance()
    arrays, state = whole.arrays(), whole.state()
    whole.run([steps])
    second, rest = Simulation(scene), Steps()
    second.restore(arrays, state)
    second.run([rest])
    # the fifth difference of states that are equal to 1e-15 (with another factorisation)
    np.testing.assert_allclose(rest.error, steps.error, rtol=1e-5)
    np.testing.assert_allclose(rest.dt, steps.dt, rtol=1e-5)
    assert second.size.state() == pytest.approx(whole.size.state(), rel=1e-5)


def test_the_controller_settles_at_its_aim() -> None:
    """Errors `(h/h0)^p`, h0 changing at once: few rejections, then the step that is wanted."""
    size = ErrorSize(StepControl(step_error=1e-3, max_dt=10.0), 1.0, t_end=100.0, order=2)
    for h0 in (1.0, 0.1, 1.0):
        for _ in range(40):
            error = 1e-3 * (size.dt / h0) ** 2
            if size.too_large(error, size.dt):
                assert size.reject(size.dt, error)
            else:
                size.accept(error, size.dt)
        assert 0.8 * AIM**0.5 < size.dt / h0 < 1.2 * AIM**0.5
    assert size.rejected <= 4


def test_a_run_says_what_its_control_did(tmp_path) -> None:
    result = execute(falling("ep", 0.0, 1e-3), tmp_path / "run", pictures=False)
    said = result.summary["step_control"]
    errors = result.column("error_estimate")[1:]
    assert said["accepted"] == result.simulation.step == len(errors)
    assert said["rejected"] == result.summary["rejected_steps"]
    assert said["largest_error"] == errors.max() <= said["step_error"] == 1e-3
    assert said["above_step_error"] == 0
    # the arms turn by a few radians, which is said, and nothing else
    assert ADDED * 1e-3 < said["accumulated_error"] < 0.01
    assert ["may add up to" in warning.says for warning in result.warnings] == [True]
    fixed = execute(double_pendulum("ep", 0.0, 20, t_end=0.1))
    assert fixed.summary["step_control"] is None
    assert "error_estimate" not in fixed.rows[0]


def test_a_run_warns_where_it_cannot_keep_to_the_tolerance() -> None:
    scene = double_pendulum("ep", 0.0, 50, t_end=0.5)
    coarse = execute(replace(scene, step_control=StepControl(step_error=1e-5, min_dt=5e-3)))
    said = [w.says for w in coarse.warnings if w.watch == "step error"]
    assert any("no step may be below min_dt = 0.005 s" in each for each in said)
    tiny = strip(loads=EdgeForce("right", (0, 0, 1e-7)), step_control=StepControl(step_error=1e-2))
    (warning,) = [w for w in execute(tiny).warnings if w.watch == "step error"]
    assert "says little about their motion" in warning.says


def test_options_choose_between_fixed_steps_and_a_tolerance() -> None:
    """A step alone is fixed, also of a scene with a tolerance; with one it is the first one."""
    scene = strip(step_control=StepControl(step_error=1e-2))
    assert Options(dt=0.01).apply(scene).step_control.step_error is None
    assert Options().apply(scene).step_control.step_error == 1e-2
    assert Options(dt=0.01, step_error=1e-4).apply(scene).step_control.step_error == 1e-4
    assert Options(scheme="static").apply(scene).step_control.step_error is None
    assert scene.with_options(scheme="static").step_control.step_error is None


BAD = {
    "step control: step_error is 0; it must be greater than 0": lambda: StepControl(step_error=0),
    "step control: step_error is -0.1; it must be greater than 0": lambda: StepControl(
        step_error=-0.1
    ),
    "step control: step_error is 1.5; it must be less than 1": lambda: StepControl(step_error=1.5),
    "step_error is 0.1 and jump_tolerance is 0.2; one of them": lambda: StepControl(
        step_error=0.1, jump_tolerance=0.2
    ),
    "a step that cannot change must have none": lambda: StepControl(
        step_error=0.1, min_dt=0.2, max_dt=0.2
    ),
    "step control: time 1 follows 2; times must increase": lambda: StepControl(times=(2.0, 1.0)),
    "it must be left out, because scheme 'static' has no motion": lambda: strip(
        "static", step_control=StepControl(step_error=0.1)
    ),
    "max_dt is 0.01; dt, the first step, is 0.05 and must be within": lambda: strip(
        step_control=StepControl(step_error=0.1, max_dt=0.01)
    ),
    "the step control has the time 2.0; it must be at most t_end, which is 1.0": lambda: strip(
        step_control=StepControl(times=(2.0,))
    ),
}


@pytest.mark.parametrize("sentence", BAD)
def test_what_cannot_be_controlled_is_refused(sentence: str) -> None:
    with pytest.raises(SceneError) as caught:
        BAD[sentence]()
    assert sentence in str(caught.value)
