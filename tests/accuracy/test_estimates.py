"""Estimates from companions: their formulas on errors that are known."""

import math
from dataclasses import replace
from math import log

import numpy as np
import pandas as pd
import pytest

from shellmb.accuracy.errors import Companions, add_errors, judged
from shellmb.accuracy.estimates import GROWING, SAFETY, Estimate, mesh_error, step_error
from shellmb.accuracy.family import Change, Family
from shellmb.accuracy.run_record import RunRecord, alternating, damped
from shellmb.running.execute import execute
from shellmb.show.account import with_error
from tests.bench.errors.mechanisms import chain


def differences(order: float, constant: float = 1e-3) -> list[float]:
    """Of runs with errors `constant h^order`, with 1, 3 and 9 times the step."""
    errors = [constant * h**order for h in (1, 3, 9)]
    return [errors[1] - errors[0], errors[2] - errors[1]]


@pytest.mark.parametrize("order", [0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0])
def test_power_laws_are_covered(order: float) -> None:
    """The kind: whatever the order is, the error is covered, and not by far too much."""
    found = step_error(differences(order), highest=4, size=1.0)
    assert found.order == pytest.approx(order)
    assert 1 <= found.error / 1e-3 <= 5


def test_a_difference_that_vanishes_by_chance_is_not_believed() -> None:
    """Histories cross: numbers of two runs agree without being right."""
    by_chance = step_error([1e-12, 3e-3], highest=2, size=1.0)
    assert by_chance.error > 0.1 * 3e-3 / 3**4


def test_steps_that_are_too_large_tell_no_order() -> None:
    """The kind: nine times the step is not resolved, so the order seems higher than it is.

    Errors are `10 h^2 + c h^4` for one, three and nine times the step, in a scheme of order 3: the
    run itself is in the part of order 2.
    """
    for c in (0.0, 1.0, 3.0):
        errors = [1e-5 * (10 * h**2 + c * h**4) for h in (1, 3, 9)]
        found = step_error([errors[1] - errors[0], errors[2] - errors[1]], highest=3, size=0.5)
        assert 1 <= found.error / errors[0] <= 5, c
        assert found.rough == (found.order > 3)
    # small differences may shrink as fast as they like
    assert not step_error([1e-7, 1e-5], highest=3, size=0.5).rough


def test_growing_differences_are_errors() -> None:
    found = step_error([2e-3, 1e-3], highest=2, size=1.0)
    assert found == Estimate(GROWING * 2e-3, pytest.approx(-log(2) / log(3)))


def test_nothing_known_is_not_zero() -> None:
    assert math.isinf(step_error([], highest=2, size=1.0).error)
    assert math.isinf(mesh_error(None, better=True).error)
    assert step_error([1e-3], highest=2, size=1.0) == Estimate(SAFETY * 1e-3 / 2)


def test_a_smaller_step_tells_of_first_order() -> None:
    """Where the step cannot be larger, the run is compared with half of it."""
    for order in (1.0, 2.0, 3.0):
        found = step_error([1.0 - 0.5**order], highest=2, size=1.0, ratio=0.5)
        assert 1 <= found.error <= 3


def swinging(phases: tuple[float, ...]) -> Companions:
    """A run and its companions, which swing alike, each with a phase of its own."""
    t = np.linspace(0.0, 1.0, 200)
    runs = tuple(
        RunRecord(
            {},
            pd.DataFrame({"t": t, "tip_x": np.sin(10 * t + p), "tip_z": t}),
            {},
            frozenset(),
            0,
            1,
        )
        for p in phases
    )
    return Companions(Change(), runs[0], runs, 3.0, None, True, {})


def test_a_curve_of_any_phase_has_no_certain_end() -> None:
    """The kind: after a snap phases are those of no other step; that ends agree is chance."""
    scene = chain("ep", dt=5e-3)
    by_chance = swinging((0.0, math.pi - 20.0, 1.0))
    found = judged(by_chance, Family(scene, None), scene, 2.0)
    assert found.others["tip_x:end"].error >= found.others["tip_x:l2"].error > 0.5
    assert found.remarks[0].startswith("tip_x (l2, end): does not converge with smaller steps")
    assert found.others["tip_x:end"].to_dict()["error"] is None
    assert with_error(found.others["tip_x:end"].to_dict()).endswith(" (does not converge)")
    # phases that converge are no such kind, and neither is another column
    better = swinging((0.0, 3e-3, 3e-2))
    found = judged(better, Family(scene, None), scene, 2.0)
    assert found.others["tip_x:end"].error < 1e-2
    assert found.remarks == ()


def sampled(every: int, name: str = "largest") -> RunRecord:
    """A run whose result is the largest value at ends of steps, of a curve without an error."""
    t = np.linspace(0.0, 1.0, 361)[::every]
    history = pd.DataFrame({"t": t, "tip_x": np.cos(10 * t - 4.87), "tip_z": t, "flag": t > 0.5})
    results = {"largest": history["tip_x"].max(), "count": 1.0, "number": 0.5, "nothing": 0.0}
    return RunRecord({name: float(results[name])}, history, {}, frozenset(), 0.0, len(t) - 1)


def test_an_extreme_of_ends_of_steps_misses_that_between_them() -> None:
    """The kind: results look for the largest value among those of steps, which lies between two."""
    scene = chain("ep", dt=5e-3)
    runs = tuple(sampled(every) for every in (9, 24, 72))
    missed = 1.0 - runs[0].results["largest"]
    assert missed > 1e-3
    found = judged(
        Companions(Change(), runs[0], runs, 3.0, None, True, {}), Family(scene, None), scene, 2.0
    ).results["largest"]
    # cubic splines through few points, of which the extreme of the curve has an error, too
    assert missed <= found.error <= 3 * missed


@pytest.mark.parametrize("name", ["count", "number", "nothing"])
def test_what_no_companion_changes_has_no_error(name: str) -> None:
    """The kind: counts and flags are the largest values of some columns by chance."""
    scene, runs = chain("ep", dt=5e-3), tuple(sampled(every, name) for every in (9, 24, 72))
    alike = Companions(Change(), runs[0], runs, 3.0, None, True, {})
    assert judged(alike, Family(scene, None), scene, 2.0).results[name].error == 0


def test_other_numbers_of_a_curve_of_any_phase_are_of_first_order() -> None:
    """The kind: numbers that a function finds where curves do not converge converge by chance."""
    scene = chain("ep", dt=5e-3)
    by_phase = {
        resolved: tuple(
            replace(run, results={"number": 1.0 + apart})
            for run, apart in zip(swinging(phases).steps, (0.0, 1e-3, 1e-2), strict=True)
        )
        for resolved, phases in ((True, (0.0, 3e-3, 3e-2)), (False, (0.0, 2.0, 1.0)))
    }
    errors = {
        resolved: judged(
            Companions(Change(), runs[0], runs, 3.0, None, True, {}), Family(scene, None), scene, 2
        )
        for resolved, runs in by_phase.items()
    }
    assert errors[False].results["number"].error == pytest.approx(SAFETY * 1e-3 / 2)
    assert errors[True].results["number"].error < 0.5 * errors[False].results["number"].error
    assert any(r.startswith("number") for r in errors[False].remarks)
    assert errors[True].remarks == ()


def test_vibrations_between_steps_are_errors() -> None:
    """The kind: what alternates from step to step has another phase in a finer run."""
    t = np.linspace(0.0, 1.0, 201)
    smooth, corner = np.sin(10 * t), np.maximum(t - 0.5, 0.0)
    for curve in (smooth, corner, smooth + 0.1 * np.sin(150 * t)):
        assert alternating(t, curve) == 0, "steps follow it"
    # 1.6, 2.5 and 3.7 steps to a period
    for rate in (800.0, 500.0, 340.0):
        for size in (1e-3, 1e-5):
            other = size * np.sin(rate * t + 1.0), size * np.sin(rate * t + 3.1)
            true = np.sqrt(np.mean((other[0] - other[1]) ** 2))
            assert 0.5 <= alternating(t, smooth + other[0]) / true <= 3, (rate, size)
    assert alternating(t, smooth + 1e-9 * np.sin(500 * t)) == 0, "round-off"


def test_vibrations_that_a_scheme_damps_are_errors() -> None:
    """The kind: a dissipative scheme of third order takes them out of all companions alike.

    A mass that moves, and has a vibration of 1 radian to a step, of which nothing is left.
    """
    t = np.linspace(0.0, 1.0, 101)
    amplitude, rate, speed = 1e-4, 100.0, 0.5
    history = pd.DataFrame({"t": t, "x": speed * t, "kinetic_energy": speed**2 / 2})
    history["dissipation"] = (amplitude * rate) ** 2 / 2 * (1 - np.exp(-t / 0.1))
    true = amplitude / np.sqrt(2)
    assert 0.3 <= damped(history, "x") / true <= 3
    assert damped(history.drop(columns="dissipation"), "x") == 0
    history["dissipation"] = 0.0
    assert damped(history, "x") == 0


def test_a_run_of_few_steps_tells_no_order() -> None:
    """The kind: nine times the step of a short run leaves a step or two, in which nothing moves."""
    scene = chain("ep", dt=2e-2, t_end=0.3)
    found = add_errors(execute(scene, pictures=False)).summary["errors"]
    (said,) = found["remarks"]
    assert "the run has 15 steps" in said
    assert found["probes"]["tip_x:l2"]["order_step"] is None
    fine = execute(replace(scene, dt=2.5e-3), pictures=False).column("tip_z")[-1]
    end = found["probes"]["tip_z:end"]
    assert 1 <= end["error"] / abs(end["value"] - fine) <= 20


def test_meshes_whose_differences_do_not_fall_have_no_error() -> None:
    """The kind: values `1 + c h^q` with elements `2h`, `h` and `h/2`, and logarithms of `h`."""
    for order in (0.75, 1.0, 2.0, 4.0):
        found = mesh_error(
            1e-1 * (1 - 0.5**order), True, (1e-1 * (2**order - 1), 1e-1 * (1 - 0.5**order)), 1.0
        )
        assert found.converges and 1 <= found.known / 1e-1 <= 12, order
    # the second: by chance the run is as far from the finer mesh as from the coarser one, and both
    # are next to it
    assert not mesh_error(0.1, True, (0.1, 0.1), 1.0).converges
    assert mesh_error(0.1, True, (0.1, 0.1), 1.0).known == math.inf
    assert mesh_error(1e-3, True, (1e-3, 1e-3), 1.0).converges
