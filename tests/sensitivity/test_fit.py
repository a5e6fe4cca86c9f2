"""Fits find what data were made with, say how well, and doubt what they should doubt."""

import tracemalloc
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import shellmb as sm
from shellmb.api.fitting.band import Band
from shellmb.api.fitting.data import data_of
from shellmb.api.fitting.fit import _Search
from shellmb.api.fitting.fitted import Fit
from shellmb.api.sensitivity.record import Sensitivities
from shellmb.demos import identify_plate
from shellmb.sensitivity.parameters import Parameter
from tests.sensitivity import scenes

NOISE = 1e-5


def strip(first: float = 1.0, second: float = 1.0, E: float = 210e9) -> sm.Scene:
    """A load that is the product of two parameters, of which data can tell the product only."""
    return scenes.plate(force=400.0 * first * second, E=E, steps=6)


def record(scene: sm.Scene, seed: int, noise: float = NOISE) -> pd.DataFrame:
    table = sm.run(scene, pictures=False).history[["t", "tip"]].iloc[1:]
    return table.assign(tip=table.tip + noise * np.random.default_rng(seed).normal(size=len(table)))


def test_a_fit_finds_what_the_data_were_made_with() -> None:
    data = record(strip(first=1.2), seed=3)
    fitted = sm.fit(strip, data, ("first",), noise=NOISE)
    assert fitted.converged and not fitted.warnings
    # five deviations, and the noise of the deflection of 0.03 m over all values
    assert abs(fitted.values["first"] - 1.2) < 5 * fitted.deviations["first"] < 5e-2
    assert fitted.runs <= 5
    band = fitted.band()
    slope = fitted.sensitivities.history["first"]["tip"]
    np.testing.assert_allclose(band.history["tip"], np.abs(slope) * fitted.deviations["first"])
    assert len(band.plot().axes) == 2
    assert len(fitted.plot().axes) == 2
    ranking = sm.rank(fitted.sensitivities, of=["tip"])
    assert 0.1 < ranking.table.loc["tip", "first"] < 1.0
    assert ranking.plot().axes


def made(
    parameters: list[float],
    jacobian: np.ndarray,
    left: np.ndarray,
    noise: float | None,
    impossible: str | None = None,
) -> Fit:
    """A fit of a linear model, without a run."""
    found = [Parameter(f"p{k}", v, 1e-5) for k, v in enumerate(parameters)]
    t = np.linspace(0.0, 1.0, len(left))
    table = pd.DataFrame({"y": np.ones(len(left))}, index=t)
    scene = SimpleNamespace(t_end=1.0)
    data = data_of(table, noise, scene, len(found))  # type: ignore[arg-type]
    run = SimpleNamespace(parameters=found, warnings=())
    more = {"runs": 1, "converged": True, "impossible": impossible}
    return Fit(run, data, left, jacobian, **more)  # type: ignore[arg-type]


def test_covariance_is_that_of_linear_regression() -> None:
    random = np.random.default_rng(0)
    A, left = random.normal(size=(400, 2)) * [10.0, 1e-3], random.normal(size=400)
    known = made([0.1, 5e4], A, left, 1.0)
    np.testing.assert_allclose(known.covariance, np.linalg.inv(A.T @ A), rtol=1e-10)
    # noise that is not known is found from what is left
    unknown = made([0.1, 5e4], A, 3 * left, None)
    ratio = 9 * (left @ left) / 398
    np.testing.assert_allclose(unknown.covariance, ratio * known.covariance, rtol=1e-10)
    assert not known.warnings and not unknown.warnings


def strike(speed: float = 2.0) -> sm.Scene:
    """A ball that touches the ground at the end of its fifth step."""
    return sm.Scene(
        "strike",
        rigid_bodies=sm.RigidBody("ball", 1.0, (0.1, 0.1, 0.1), position=(0, 0, 0.01)),
        contacts=sm.Contact("ground", sm.Plane(normal=(0, 0, 1)), 1e6, body="ball", at="center"),
        initial=sm.InitialVelocity((0, 0, -speed)),
        probes=sm.Probe("height", "center", body="ball", component=2),
        scheme="generalized-alpha",
        dt=1e-3,
        t_end=6e-3,
    )


def test_what_derivatives_say_is_said() -> None:
    """Forces jump in slope where only one of both sides touches the ground: a kink."""
    data = pd.DataFrame({"t": [0.0, 5e-3], "height": [0.0, -0.01]})
    known = sm.sensitivities(strike, ("speed",), columns="probes").warnings
    assert len(known) == 1 and "the motion has a kink in 'speed' at t = 0.004" in known[0]
    assert sm.fit(strike, data, ("speed",), noise=1.0, runs=1).warnings[-1:] == known
    # a step later it does not matter which one it is
    later = sm.sensitivities(strike, ("speed",), values={"speed": 2.2}, columns="probes")
    assert not later.warnings


def test_what_data_do_not_see_is_named() -> None:
    x = np.random.default_rng(1).normal(size=300)
    fitted = made([2.0, 3.0], 50 * np.stack([3 * x, 2 * x], axis=1), np.zeros(300) + x, 1.0)
    (said,) = fitted.warnings
    # relative changes of the same size and other sign cancel
    assert "p0^+0.71 p1^-0.71 (not at all)" in said or "p0^-0.71 p1^+0.71 (not at all)" in said


def test_residuals_that_are_no_noise_are_doubted() -> None:
    t = np.linspace(0, 10, 300)
    x = np.random.default_rng(2).normal(size=(300, 1))
    fitted = made([1.0], 30 * x, 2 * np.sin(t), 1.0)
    assert any("residuals of 'y' are not white" in said for said in fitted.warnings)
    fitted = made([1.0], 30 * x, 3 * x[:, 0][::-1], 1.0)
    assert any("larger than the noise by a factor of" in said for said in fitted.warnings)


def test_what_is_determined_beside_what_is_not() -> None:
    """Kind: zero times infinity; the deviation of a value was NaN beside one that nothing sees.

    So was the mass of a block, where the place at which an event happens is never reached.
    """
    x = np.random.default_rng(1).normal(size=300)
    fitted = made([2.0, 3.0], np.stack([0 * x, 20 * x], axis=1), x, 1.0)
    assert fitted.deviations["p0"] == np.inf
    assert fitted.deviations["p1"] == pytest.approx(1 / np.sqrt(400 * x @ x))
    assert fitted.covariance.loc["p0", "p1"] == 0.0
    (said,) = fitted.warnings
    assert "combination p0^+1 (not at all)" in said


@pytest.mark.parametrize("period", [4, 25])
@pytest.mark.parametrize("count", [25, 300])
def test_motions_in_residuals_are_seen(period: int, count: int) -> None:
    """Kind: residuals that are no noise and pass as such.

    25 values could not correlate by more than the bound, and neighbours in a vibration of four rows
    to a period do not correlate at all.
    """
    random = np.random.default_rng(5)
    left = np.sin(2 * np.pi * np.arange(count) / period + 0.3) + 0.2 * random.normal(size=count)
    fitted = made([1.0], 30 * random.normal(size=(count, 1)), left, None)
    assert any("residuals of 'y' are not white" in said for said in fitted.warnings)


@pytest.mark.parametrize(("size", "doubted"), [(1e-12, False), (1e-6, True)])
def test_round_off_is_not_doubted(size: float, doubted: bool) -> None:
    """Fits to runs without noise were told that their model lacks something."""
    t = np.linspace(0, 10, 300)
    x = np.random.default_rng(2).normal(size=(300, 1))
    fitted = made([1.0], 30 * x, size * np.sin(t), None)
    assert any("not white" in said for said in fitted.warnings) == doubted


@pytest.mark.parametrize("count", [3, 12, 25, 200])
def test_noise_is_not_doubted(count: int) -> None:
    """Noise of the given size, in few values and in many: less than one warning in a thousand."""
    random = np.random.default_rng(6)
    for _ in range(60):
        said = made([1.0], 30 * random.normal(size=(count, 1)), random.normal(size=count), 1.0)
        assert not said.warnings


def test_a_value_near_zero_is_determined_by_its_size() -> None:
    """Kind: what is small against a value; friction that is found to be none is found.

    It began at 0.2 and is 1e-4 now, with a deviation of 3e-3.
    """
    random = np.random.default_rng(7)
    found = [Parameter("friction", 1e-4, 0.2e-5)]
    assert found[0].size == pytest.approx(0.2)
    table = pd.DataFrame({"y": np.ones(300)}, index=np.linspace(0.0, 1.0, 300))
    data = data_of(table, 1.0, SimpleNamespace(t_end=1.0), 1)  # type: ignore[arg-type]
    run = SimpleNamespace(parameters=found, warnings=())
    more = {"runs": 1, "converged": True}
    J = np.full((300, 1), 20.0)
    assert not Fit(run, data, random.normal(size=300), J, **more).warnings  # type: ignore[arg-type]
    (said,) = Fit(run, data, random.normal(size=300), J / 400, **more).warnings  # type: ignore[arg-type]
    assert "friction^+1 (only to" in said


def test_noise_of_each_row() -> None:
    """Values with their own noise are weighted by it, in the order in which rows are given."""
    t = np.array([0.3, 0.1, 0.2])
    table = pd.DataFrame({"t": t, "y": 10 * t})
    data = data_of(table, {"y": t}, SimpleNamespace(t_end=1.0), 1)  # type: ignore[arg-type]
    np.testing.assert_allclose(data.noise["y"], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(data.weighted({"y": np.zeros(3)}, measured=True), -10)
    run = SimpleNamespace(parameters=[Parameter("p", 1.0, 1e-5)], warnings=())
    left = np.array([1.0, -1.0, 2.0])
    fitted = Fit(run, data, left, np.ones((3, 1)), runs=1, converged=True)  # type: ignore[arg-type]
    np.testing.assert_allclose(fitted.residuals["y"], [0.1, -0.2, 0.6])


def test_rows_that_were_not_measured_need_no_noise() -> None:
    """Kind: what is left out afterwards; the derivative there was divided by a noise of zero."""
    table = pd.DataFrame({"y": [1.0, np.nan, 3.0]}, index=[0.1, 0.2, 0.3])
    data = data_of(table, {"y": [0.5, 0.0, 0.5]}, SimpleNamespace(t_end=1.0), 1)  # type: ignore[arg-type]
    np.testing.assert_allclose(data.weighted({"y": np.ones(3)}, measured=False), [2.0, 2.0])


def test_rows_in_any_order_are_the_same_data() -> None:
    """Neighbours in time tell whether residuals are noise: rows in another order hid a motion."""
    t = np.linspace(0, 1, 40)
    table = pd.DataFrame({"t": t, "y": np.sin(t)}).sample(frac=1.0, random_state=3)
    data = data_of(table, 1.0, SimpleNamespace(t_end=1.0), 1)  # type: ignore[arg-type]
    np.testing.assert_array_equal(data.times, t)
    np.testing.assert_array_equal(data.values["y"], np.sin(t))


GOOD = pd.DataFrame({"t": [0.0, 2e-3, 4e-3], "tip": [0.0, 0.1, 0.2]})


def test_the_search_turns_where_a_scene_is_impossible() -> None:
    """A combination that data do not determine leads it anywhere; the start must be possible."""

    def run(x: np.ndarray) -> sm.Sensitivities:
        raise sm.SceneError(f"E is {x[0]:g}")

    data = data_of(GOOD, 1.0, SimpleNamespace(t_end=1.0), 1)  # type: ignore[arg-type]
    search = _Search(run, data, [Parameter("E", 1.0, 1e-5)], np.ones(1), None)
    with pytest.raises(sm.SceneError, match="E is -1"):
        search.residual(np.array([-1.0]))
    # as after a run
    search._kept = [(np.ones(1), (None, np.zeros(3), np.zeros((3, 1))))]  # type: ignore[list-item]
    search.count = 1
    # from which SciPy's trust region goes back
    assert np.isnan(search.residual(np.array([-1.0]))).tolist() == 3 * [True]
    assert search.impossible == "run 2 with E = -1 is impossible: E is -1"


def test_a_search_that_stops_beside_impossible_scenes_says_so() -> None:
    """Kind: a fit that ends by itself, short of the least misfit; its deviations looked good.

    Residuals have two deviations left in the value, or none.
    """
    J, noise = np.full((300, 1), 20.0), np.random.default_rng(5).normal(size=300)
    noise -= noise.mean()
    ends = made([1.0], J, noise, 1.0, impossible="it is too large")
    assert not ends.warnings
    short = made([1.0], J, noise + 2.0 / np.sqrt(300), 1.0, impossible="it is too large")
    assert "beside values that are impossible" in short.warnings[0]
    assert not made([1.0], J, noise + 2.0 / np.sqrt(300), 1.0).warnings
    # data that the model made itself leave round-off, of any direction
    assert not made([1.0], J, np.full(300, 1e-15), None, impossible="it is too large").warnings


def test_long_records_take_no_square_of_their_length() -> None:
    """A record of a minute at a kilohertz would take 29 GB."""
    tracemalloc.start()
    try:
        made([1.0], np.ones((2000, 1)), np.zeros(2000), 1.0)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 0.1 * 8 * 2000**2


def test_the_search_turns_where_steps_fail() -> None:
    """Kind: a trial that is no run ended the fit, and the runs before it were lost.

    A push of which each run above 1.5 fails; the values are those without it.
    """

    def linear(x: np.ndarray) -> sm.Sensitivities:
        if x[0] > 1.5:
            raise sm.ConvergenceError("the step at t = 1 failed")
        t = np.linspace(0.0, 1.0, 5)
        columns = pd.DataFrame({"t": t, "tip": x[0] * t})
        return SimpleNamespace(  # type: ignore[return-value]
            run=SimpleNamespace(history=columns),
            history={"push": pd.DataFrame({"tip": t})},
            events=pd.DataFrame({"time": []}),
        )

    close = GOOD.assign(tip=GOOD.t)
    data = data_of(close, 1.0, SimpleNamespace(t_end=1.0), 1)  # type: ignore[arg-type]
    search = _Search(linear, data, [Parameter("push", 1.0, 1e-5)], np.ones(1), None)
    assert np.isfinite(search.residual(np.array([1.0]))).all()
    assert np.isnan(search.residual(np.array([2.0]))).all()
    assert search.impossible == "run 2 with push = 2 is impossible: the step at t = 1 failed"
    # the best run is kept over steps that are worse
    for x in (1.2, 1.3):
        search.residual(np.array([x]))
    assert search.count == 3 and search.at(np.array([1.0])) and search.count == 3


@pytest.mark.parametrize(("E", "said"), [(2.0, 1.0), (0.0, 0.01), (-2.0, 1.0)])
def test_rankings_of_parameters_of_any_sign(E: float, said: float) -> None:
    """Kind: values that are zero or negative: they had no effect, or a change of a mean below zero.

    A result is E, and a history 3 E over all times; of zero, one per cent of its size 2 counts.
    """
    found = Sensitivities.__new__(Sensitivities)
    found.parameters = (Parameter("E", E, 2e-5),)
    value = E or 2.0 * 100
    t = np.ones(4)
    table = pd.concat({"E": pd.DataFrame({"y": 3 * t})}, axis=1)
    found.__dict__ |= {
        "history": table,
        "results": pd.DataFrame({"E": {"end": 1.0}}),
        "run": SimpleNamespace(
            results={"end": value}, history=pd.DataFrame({"y": 3 * value * t}), described=None
        ),
    }
    table = sm.rank(found, of=("end", "y")).table
    np.testing.assert_allclose(table["E"], [said, said])


@pytest.mark.parametrize(
    ("data", "names", "more", "said"),
    [
        (GOOD.assign(t=[0, 1, 2]), ("E",), {}, "data has the time t = 1, and the run lasts"),
        (GOOD.iloc[:1], ("E", "first"), {"noise": 1.0}, "data has 1 values for 2 parameters"),
        (GOOD[["t"]], ("E",), {}, "data has no column"),
        ([1, 2], ("E",), {}, "data is no table of numbers"),
        (GOOD, ("E",), {"noise": {"end": 1.0}}, "noise has no value for 'tip'"),
        (GOOD, ("E",), {"noise": 0.0}, "noise of 'tip' is 0.0; it must be positive"),
        (GOOD, ("E",), {"noise": {"tip": "low"}}, "noise of 'tip' is low; it must be positive"),
        (GOOD, ("E",), {"noise": {"tip": None}}, "noise of 'tip' is None; it must be positive"),
        (GOOD, ("E",), {"noise": {"tip": [1, 2]}}, r"has the shape \(2,\), and data have 3 rows"),
        (GOOD, ("E",), {"noise": {"tip": [1, 0, 2]}}, "noise of 'tip' is 0.0; it must be positive"),
        (GOOD.assign(wall_s=1.0), ("E",), {}, "the column 'wall_s', which says how a step was"),
        (GOOD, ("E",), {"bounds": {"E": (2, 1)}}, "the least value must be below the largest"),
        (GOOD, ("E",), {"bounds": {"E": (1, 2)}}, r"'E' begins at 2.1e\+11; it must be between"),
        (GOOD, ("E",), {"bounds": {"first": (1, 2)}}, "bounds of 'first', which is not fitted"),
        (GOOD, ("E",), {"bounds": {"E": 3}}, "bounds of 'E' are 3; they must be two numbers"),
        (GOOD, ("E",), {"bounds": {"E": ("a", 1)}}, "bounds of 'E' are .* must be two numbers"),
        (GOOD.assign(tip=[0, np.inf, 0]), ("E",), {}, "'tip' of data has an infinite value"),
        (GOOD.assign(tip=[0, 1j, 0]), ("E",), {}, "column 'tip' has complex numbers"),
        (GOOD, ("E",), {"noise": {"tip": np.ones(3) * 1j}}, "noise of 'tip' is .* be positive"),
        (pd.concat([GOOD, GOOD[["tip"]]], axis=1), ("E",), {}, "has the column 'tip' twice"),
        (GOOD.assign(end=np.nan), ("E",), {}, "column 'end' of data has no value; leave it out"),
        (GOOD, ("width",), {}, "has no parameter 'width'"),
    ],
)
def test_bad_input_before_anything_runs(data, names, more, said) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(sm.SceneError, match=said):
        sm.fit(strip, data, names, **more)


def test_a_column_that_there_is_not() -> None:
    with pytest.raises(sm.SceneError, match="the column 'nose', which the run does not find"):
        sm.fit(strip, GOOD.rename(columns={"tip": "nose"}), ("E",))


@pytest.mark.parametrize(
    ("covariance", "said"),
    [
        ({"E": 1.0}, "covariance is of 'E'; it must be of the parameters 'a', 'b'"),
        (np.eye(3), r"covariance has the shape \(3, 3\)"),
        ([[1.0, 2.0], [2.0, 1.0]], "not symmetric and positive"),
        ({"a": -1.0, "b": 1.0}, "must be finite numbers.* which are not negative"),
        ({"a": "wide", "b": 1.0}, "must be finite numbers"),
        ("a", "covariance is 'a'; it must be finite numbers"),
        (np.diag([np.inf, 1.0]), "must be finite numbers"),
        (np.diag([1.0, 1.0 + 1j]), "must be finite numbers"),
    ],
)
def test_bad_covariance(covariance, said: str) -> None:  # type: ignore[no-untyped-def]
    from shellmb.api.fitting.band import covariance_of

    with pytest.raises(sm.SceneError, match=said):
        covariance_of(["a", "b"], covariance)


def test_deviations_are_squared_and_may_be_zero() -> None:
    """The kind: a parameter that is known exactly, beside one that is not, in any order."""
    from shellmb.api.fitting.band import covariance_of

    found = covariance_of(["a", "b"], {"b": 3.0, "a": 0.0})
    np.testing.assert_array_equal(found, [[0.0, 0.0], [0.0, 9.0]])


def test_ranks_of_histories_are_by_root_mean_squares_of_what_is_known() -> None:
    """`p rms(dy/dp)/rms(y)` of `y = 3, -4, nan` and `dy/dp = -12, 16, nan` is `4 p`."""
    found = Sensitivities.__new__(Sensitivities)
    found.parameters = (Parameter("E", 5.0, 2e-5),)
    history = pd.DataFrame({"y": [3.0, -4.0, np.nan]})
    found.__dict__ |= {
        "history": pd.concat({"E": -4.0 * history}, axis=1),
        "results": pd.DataFrame({"E": {}}),
        "run": SimpleNamespace(results={}, history=history, described=None),
    }
    assert sm.rank(found, of="y").table.loc["y", "E"] == pytest.approx(20.0, rel=1e-14)


def test_a_band_of_a_run_without_probes() -> None:
    """Kind: nothing to draw, which matplotlib said of its own rows."""
    t = pd.DataFrame({"t": [0.0, 1.0]})
    found = SimpleNamespace(
        parameters=[Parameter("a", 1.0, 1e-5)],
        run=SimpleNamespace(history=t, described=SimpleNamespace(probes=[])),
        history=pd.concat({"a": pd.DataFrame({"energy": [0.0, 1.0]})}, axis=1),
    )
    with pytest.raises(sm.SceneError, match="the run has no probes; name columns"):
        Band(found, {"a": 1.0}).plot()  # type: ignore[arg-type]


@pytest.mark.slow
def test_values_are_as_far_off_as_deviations_say() -> None:
    """Over 20 records with other noise: spread, coverage and distribution are as predicted."""
    identify_plate.check_study(identify_plate.study(range(20)))


def test_judgement_of_deviations_sees_wrong_ones() -> None:
    """Kind: covariances that are too small, too large, or of another distribution.

    What is right passes; deviations that are wrong by 1.6 do not. 60 values, as of 20 records.
    """
    right = np.random.default_rng(0).normal(size=(20, 3))
    identify_plate.check_study(identify_plate.judge(right, right))
    for wrong in (1.6 * right, right / 1.6, right + 0.8):
        with pytest.raises(AssertionError):
            identify_plate.check_study(identify_plate.judge(wrong, wrong))
    far = right.copy()
    far[0, 0] = 5.1
    with pytest.raises(AssertionError):
        identify_plate.check_study(identify_plate.judge(far, right))


def test_deviations_of_a_linear_fit_are_as_far_off_as_they_say() -> None:
    """The judgement of 20 records, with correlated values of a model that takes no run."""
    random = np.random.default_rng(4)
    A = np.linalg.qr(random.normal(size=(80, 3)))[0] @ np.array(
        [[1, 0.9, 0], [0, 1, 0.5], [0, 0, 1]]
    )
    A = 1e3 * A / np.array(list(identify_plate.TRUTH.values()))
    far, normal = [], []
    for _ in range(20):
        noise = random.normal(size=80)
        found = np.array(list(identify_plate.TRUTH.values())) + np.linalg.lstsq(A, noise)[0]
        covariance = np.linalg.inv(A.T @ A)
        names = list(identify_plate.TRUTH)
        fitted = SimpleNamespace(
            values=dict(zip(names, found, strict=True)),
            covariance=pd.DataFrame(covariance, names, names),
            deviations=dict(zip(names, np.sqrt(np.diag(covariance)), strict=True)),
        )
        far.append(list(identify_plate.off(fitted).values()))  # type: ignore[arg-type]
        normal.append(identify_plate.independent(fitted))  # type: ignore[arg-type]
    identify_plate.check_study(identify_plate.judge(np.array(far), np.array(normal)))
