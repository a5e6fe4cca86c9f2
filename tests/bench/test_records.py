"""Tests of what `python -m tests.bench` measures: the records, their consistency, the bars."""

import json
from dataclasses import fields, replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from shellmb.demos.effects.stepping import observers_of_run
from shellmb.errors import SceneError
from shellmb.running.execute import execute
from shellmb.running.request import Request
from shellmb.simulate.simulation import Simulation
from tests.bench.__main__ import app
from tests.bench.bars import EXPONENT, Bar, bars, exponents
from tests.bench.memory import peak_mib
from tests.bench.record import (
    AUTO,
    FULL,
    MODIFIED,
    PARTS,
    UNREDUCED,
    Measured,
    Record,
    Round,
    typical,
)
from tests.bench.report import plan_of

FIELDS = [
    "scene",
    "scheme",
    "path",
    "newton",
    "mesh",
    "elements",
    "unknowns",
    "iterations_per_step",
    "factorisations_per_step",
    "step_s",
    "residual_s",
    "jacobian_s",
    "reduction_s",
    "factor_s",
    "solve_s",
    "observers_s",
    "bare_s",
    "peak_mib",
    "ranks",
]


@pytest.fixture(scope="module")
def records():
    """Of a quick run, by scene, scheme and way to solve; stdout is parsed whole."""
    done = CliRunner().invoke(app, ["--quick", "--json"])
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    return {(r["scene"], r["scheme"], r["path"], r["newton"]): r for r in found}


CASES = [("dynamic", "ep"), ("dynamic", "ed"), ("static", "static")]


def test_fields(records):
    assert [f.name for f in fields(Record)] == FIELDS
    assert all(list(r) == FIELDS for r in records.values())


def test_all_configurations(records):
    ways = [(how.path, how.newton) for how in (UNREDUCED, FULL, MODIFIED, AUTO)]
    assert set(records) == {(*case, *way) for case in CASES for way in ways}


def test_parts_are_parts_of_the_step(records):
    for r in records.values():
        parts = [r[name] for name in PARTS]
        assert all(p >= 0 for p in parts)
        # each is timed inside the step, none inside another
        assert sum(parts) <= r["step_s"]
        # timed at another moment, when the machine may have done something else
        assert 0 < r["bare_s"] < 10 * r["step_s"]
        assert r["residual_s"] > 0 and r["solve_s"] > 0 and r["observers_s"] > 0
        assert (r["reduction_s"] > 0) == (r["path"] == "reduced")
        assert r["ranks"] == 1 and r["peak_mib"] is None
        assert (r["mesh"], r["elements"]) == ("4x1", 4)


@pytest.mark.parametrize("case", CASES)
def test_numbers(records, case):
    unreduced, full, modified, auto = (
        records[*case, how.path, how.newton] for how in (UNREDUCED, FULL, MODIFIED, AUTO)
    )
    assert full["iterations_per_step"] == unreduced["iterations_per_step"] > 1
    for r in (unreduced, full):
        assert r["factorisations_per_step"] == r["iterations_per_step"]
    assert auto["factorisations_per_step"] <= modified["factorisations_per_step"]
    assert modified["factorisations_per_step"] < full["factorisations_per_step"]
    assert full["unknowns"] == modified["unknowns"] == auto["unknowns"]
    # of 4x1 elements with 27 nodes: five for each of the 24 that are not clamped, at most
    stages = 2 if case[1] == "ed" else 1
    assert full["unknowns"] <= 5 * 24 * stages < unreduced["unknowns"]


@pytest.mark.mpi
def test_ranks(mpirun, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    arguments = ["--scene", "static", "--mesh", "2x1", "--repeat", "1", "--json"]
    found = json.loads(mpirun(2, "-m", "tests.bench", *arguments))
    assert [r["ranks"] for r in found] == [2] * 4


def test_memory():
    # Python with DOLFINx takes more than 50 MiB, eight elements nothing to speak of
    assert 50 < peak_mib("static", "static", (2, 1), AUTO) < 1024


def test_observers_are_those_of_a_run(tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(Simulation, "run", lambda self, observers: seen.extend(observers))
    from shellmb.cli.main import _reports

    scene, _ = Request("sudden_load").build()
    execute(scene, tmp_path / "run", _reports("", False, False)["observers"], pictures=False)
    of_bench = observers_of_run(tmp_path).values()
    assert {type(o) for o in seen} == {type(o) for o in of_bench}
    assert len(seen) == len(of_bench)


def test_no_round_outlasts_the_motion():
    """Of 500 steps, 5 before the first round and 2 before each."""
    assert plan_of(False, steps=245, rounds=2).steps == 245
    with pytest.raises(SceneError, match="steps is 246; it must be at most 245 in 2 rounds"):
        plan_of(False, steps=246, rounds=2)
    with pytest.raises(SceneError, match="steps is 40; it must be at most 22 in 20 rounds"):
        plan_of(False, rounds=20)
    assert plan_of(False, steps=246, rounds=2, scenes=["static"]).steps == 246


def made(how, step, mesh="6x2", scheme="ep", elements=12, bare=1.0, observers=0.0, peak=None):
    """Measurements of three rounds with that step time, disturbed by the same noise."""
    parts = dict.fromkeys(PARTS, 0.0) | {"observers_s": observers * step}
    rounds = tuple(
        Round(1, 2.0, 2.0, noise * step, noise * bare, {k: noise * v for k, v in parts.items()})
        for noise in (5.0, 1.0, 0.5)
    )
    numbers = dict(elements=elements, unknowns=1, iterations_per_step=2.0)
    record = Record(
        "dynamic",
        scheme,
        how.path,
        how.newton,
        mesh,
        **numbers,
        factorisations_per_step=2.0,
        step_s=step,
        **parts,
        bare_s=bare,
        peak_mib=peak,
        ranks=1,
    )
    return Measured(record, rounds)


def verdicts(*measured):
    return {bar.name: (pytest.approx(bar.value), bar.passed) for bar in bars(measured)}


def test_bars_by_hand():
    found = verdicts(
        made(UNREDUCED, 10.0),
        made(FULL, 4.0, bare=2.0),
        made(AUTO, 2.5, observers=0.2, peak=3000.0),
        made(AUTO, 7.0, scheme="ed"),
        made(AUTO, 14.0, scheme="ep4"),
    )
    assert found["full/full over reduced/full, dynamic ep 6x2"] == (2.5, True)
    assert found["reduced/full over reduced/auto, dynamic ep 6x2"] == (1.6, False)
    assert found["full/full over reduced/auto, dynamic ep 6x2"] == (4.0, False)
    assert found["step over bare work, reduced/full, dynamic ep 6x2"] == (2.0, True)
    assert found["step over bare work, reduced/auto, dynamic ep 6x2"] == (2.5, False)
    assert found["share of observers, reduced/auto, dynamic ep 6x2"] == (0.2, False)
    assert found["share of observers, reduced/auto, dynamic ed 6x2"] == (0.0, True)
    assert found["peak memory [MiB], reduced/auto, dynamic ep 6x2"] == (3000.0, False)
    assert found["ED step over EP step, reduced/auto, 6x2"] == (2.8, True)
    assert found["EP4 step over ED step, reduced/auto, 6x2"] == (2.0, False)
    assert Bar("at least", 1.0, 1.0, True).passed and not Bar("", 0.9, 1.0, True).passed


@pytest.mark.parametrize("exponent", [1.1, 1.4])
def test_growth(exponent):
    sizes = (12, 64, 1024, 4096)
    some = [made(FULL, 2e-3 * n**exponent, f"{n}x1", elements=n) for n in sizes]
    growth = exponents(some, "ep")
    assert growth.fit == pytest.approx(exponent)
    assert growth.steepest == pytest.approx(exponent)
    # two iterations in each step
    assert growth.constant == pytest.approx(1e-3)
    judged = [b.passed for b in bars(some) if "growth" in b.name]
    assert judged == [exponent <= EXPONENT] * 2
    assert exponents(some[:2], "ep") is None


def test_the_median_round_is_recorded():
    rounds = made(FULL, 1.0).rounds
    assert typical(rounds).step_s == 1.0
    assert typical([replace(rounds[0], step_s=s) for s in (4.0, 3.0, 1.0, 2.0)]).step_s == 2.0
