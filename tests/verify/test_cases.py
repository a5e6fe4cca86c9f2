"""Every case of `shellmb verify` passes; and the table tells what fails."""

import json
import math

import pytest

from shellmb.accuracy.measuring import to_json
from shellmb.demos.verification import table
from shellmb.demos.verification.cases import Case, Check
from shellmb.demos.verification.table import Row, find_cases, rows_of, run_cases
from shellmb.errors import ConvergenceError

# a minute or more each
# of orders there are tests for every scheme, too (`tests/schemes/test_accuracy.py`)
LONG = {
    "dynamics/tumbling plate",
    "dynamics/sudden load",
    "dynamics/order, large motion",
    "dynamics/order, small vibration",
    "mechanisms/order",
    "mechanisms/slider-crank",
    # of which `tests/rotating` has what is short
    "modes/arm",
    "modes/blade",
    "modes/disc",
}

# of some hundred values on public problems, those that are quick and were farthest from right
SHORT = {
    "elements/patch",
    "elements/point force",
    "elements/forces at nodes",
    "elements/torsion",
    "elements/free sheet",
    "elements/compressed plate",
    # of motions the one that another code has run, too
    "in time/short cylinder",
}


def is_long(case: Case) -> bool:
    whole = case.name.startswith(("elements/", "in time/"))
    return case.name in LONG or (whole and case.name not in SHORT)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=case.name, marks=[pytest.mark.slow] if is_long(case) else [])
        for case in find_cases(slow=True)
    ],
)
def test_case(case: Case) -> None:
    rows = list(rows_of(case))
    assert rows
    failed = [
        f"{r.case}: {r.value:g}, not {r.reference:g}, {r.source}" for r in rows if not r.passed
    ]
    assert not failed, "\n".join(failed)


@pytest.mark.parametrize(
    ("check", "error", "passed"),
    [
        (Check("a", 1.005, 1.0, ""), 0.005, True),
        (Check("a", 0.98, 1.0, ""), 0.02, False),
        (Check("a", -0.5, 0.0, "", 0.4), 0.5, False),
        (Check("a", 2.9, 3.0, "", 0.2, "at least"), 0.1, True),
        (Check("a", 3.9, 3.0, "", 0.2, "at least"), 0.0, True),
        (Check("a", 2.7, 3.0, "", 0.2, "at least"), 0.3, False),
        (Check("a", 1e-12, 0.0, "", 1e-9, "at most"), 1e-12, True),
        (Check("a", 2.5, 2.0, "", 0.0, "at most"), 0.5, False),
        (Check("a", math.nan, 1.0, "", 1e9, "at least"), math.inf, False),
    ],
)
def test_errors(check: Check, error: float, passed: bool) -> None:
    assert check.error == pytest.approx(error)
    assert check.passed is passed


def _made_up() -> Case:
    def checks():
        yield Check("first", 1.0, 1.0, "by hand")
        raise ConvergenceError("it did not converge", field=None, norms={})

    return Case("made up/case", checks)


def test_a_failed_run_is_a_failed_row() -> None:
    good, bad = rows_of(_made_up())
    assert good.passed and good.case == "made up/case: first"
    assert not bad.passed and "it did not converge" in bad.source


def test_json_is_a_list_of_plain_numbers() -> None:
    good, bad = json.loads(to_json(list(rows_of(_made_up())), passed="pass"))
    wanted = {"case", "value", "reference", "source", "error", "wall_s", "pass", "tolerance"}
    assert set(good) == set(bad) == wanted
    assert good["pass"] is True and good["value"] == 1.0
    assert bad["pass"] is False and bad["value"] is None and bad["error"] is None


def test_pattern_and_report(monkeypatch: pytest.MonkeyPatch) -> None:
    assert {c.name for c in find_cases("plates/")} >= {"plates/square", "plates/circle"}
    assert [c.name for c in find_cases("*/NAFEMS")] == ["frequencies/NAFEMS"]
    assert find_cases("no such case") == []
    slow = Case("slow one", _made_up().checks, slow=True)
    monkeypatch.setattr(table, "CASES", {"slow one": slow})
    assert find_cases() == [] and find_cases(slow=True) == find_cases("slow one") == [slow]
    seen: list[Row] = []
    assert run_cases("slow one", report=seen.append) == seen and len(seen) == 2
