"""References that are not ours agree with EP4 in small steps; what is left out of a grid."""

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from shellmb.accuracy.studies.choice import Base
from shellmb.accuracy.studies.quantity import parse_quantity
from shellmb.accuracy.studies.report import evaluate
from shellmb.accuracy.studies.runner import measure
from shellmb.accuracy.studies.sweep import Sweep, make_grid
from shellmb.demos.studies.bundled import BUNDLED
from shellmb.demos.studies.solutions import crank_torque, top_center
from shellmb.demos.verification.measuring import replaced

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("scene", "quantity", "end", "solution"),
    [
        ("heavy_top", "z:sup", 0.02, top_center),
        ("slider_crank", "drive.torque:sup", 0.05, crank_torque),
    ],
)
def test_references_that_are_not_ours(scene, quantity, end, solution) -> None:
    sweep = Sweep(
        Base(scene, t_end=end),
        (parse_quantity(quantity),),
        scheme=("ep4",),
        dt=(end / 50, end / 100),
        solution=solution(end),
        repeat=1,
    )
    (finding,) = evaluate(measure(sweep), "cpu")
    coarse, fine = (p.error for p in finding.judged.good)
    assert not finding.judged.reference.own
    # of order 4 in steps of 0.03 rad (top), 1/100 of the run-up (crank)
    assert fine < 1e-6
    assert fine < coarse / 8


def test_dissipations_of_single_schemes() -> None:
    sweep = Sweep(
        Base("heavy_top"),
        scheme=("ep", "ed", "ed3"),
        alpha=(0.0, 0.5, 1.0),
        dissipations={"ed": (0.0, 1.0), "ed3": (0.5,)},
    )
    grid = make_grid(sweep)
    assert {(c.scheme, c.alpha) for c in grid.choices} == {
        ("ep", None),
        ("ed", 0.0),
        ("ed", 1.0),
        ("ed3", 0.5),
    }


def test_every_bundled_study_can_be_run() -> None:
    """Nothing of any grid is impossible, and dynamic ones compare all schemes, or all models."""
    for study in BUNDLED:
        grids = [make_grid(p.sweep) for p in study.parts]
        schemes = {c.scheme for grid in grids for c in grid.choices}
        if not schemes <= {"static", "linear-statics"}:
            models = {c.model for grid in grids for c in grid.choices}
            compared = schemes >= {"ep", "ed", "ep4", "ed3"} or len(models - {"exact"}) > 1
            assert compared, study.name
            assert not any(grid.left_out for grid in grids)


@pytest.fixture(scope="module")
def tables() -> Any:
    """The script that writes the tables, as a module."""
    spec = importlib.util.spec_from_file_location("study_tables", ROOT / ".ci/study_tables.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_tables_are_those_of_the_stored_results(tables: Any) -> None:
    for path, made in ((tables.PAGE, tables.table()), (tables.SECTIONS, tables.sections())):
        text = path.read_text()
        wanted = replaced(text, tables.BEGIN, tables.END, made)
        assert text == wanted, "run .ci/study_tables.py"


def test_a_cell_names_the_cheapest_and_its_factor_over_ep(tables: Any) -> None:
    offers = [
        {"family": "EP4", "time_s": 0.2, "upper_bound": False},
        {"family": "ED alpha = 1", "time_s": 0.5, "upper_bound": False},
        {"family": "EP", "time_s": 2.5, "upper_bound": False},
    ]
    target = {"known": True, "offers": offers, "not_reached": []}
    told = tables.cell({}, target)
    assert told == "**EP4** 0.2 s, 12 times cheaper than EP (ED alpha = 1 2.5 times as much)"
    missed = {"known": True, "offers": offers[:1], "not_reached": ["EP"]}
    assert tables.cell({}, missed) == "**EP4** 0.2 s; EP does not reach it"
    assert tables.cell({}, {"known": True, "offers": [], "not_reached": []}) == "not reached"
    entry = {"reference": {"uncertainty": 3e-4}}
    assert tables.cell(entry, {"known": False}) == "reference known to 0.03 %"
