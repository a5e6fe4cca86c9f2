"""Steps in pairs: the clock in a load, ratios, and environments that are none."""

import os
import sys
from pathlib import Path

import pytest

from shellmb.errors import SceneError
from tests.bench.steps.pairs import Case, Row, cases, measured, python_of
from tests.bench.steps.parts import parts_of
from tests.bench.steps.worker import MANY, Pace


def test_only_steps_in_turn_are_paced() -> None:
    """A run looks over all its time first; a step asks several times, and may be repeated."""
    told: list[float] = []
    pace = Pace(0.1, [2, 4], told.append)
    for t in (0.0, 30.0, 60.0, 0.0, 90.0):
        assert pace(t) == 1.0
    assert not told
    for step in range(6):
        for part in (0.1, 0.5, 0.1, 0.9, 1.0):
            pace(0.1 * (step + part))
        assert len(told) == (step >= 2) + (step >= 4)
    assert all(seconds >= 0 for seconds in told)
    # asked again for all, as by a sweep backwards
    for step in range(6):
        pace(0.1 * (step + 0.5))
    assert len(told) == 2


def test_ratios_are_those_of_rounds() -> None:
    row = Row("row", (2.0, 3.0, 40.0), (1.0, 2.0, 20.0), (1.0, 1.0))
    assert row.ratio == 2.0 and row.width == pytest.approx(0.25)
    alone = Row("row", (2.0,), (), (1.0,))
    assert alone.ratio is None and alone.width == 0.0


def test_rows_are_what_must_not_become_slower() -> None:
    titles = [case.title for case in cases()]
    assert len(set(titles)) == len(titles) == 46
    assert {"plate 64x64 ed3", "mechanism chain100 ep", "mechanism heavy_top ep4"} <= set(titles)
    assert {"gradient 6x2 ed", "adjoint 32x32 ep"} <= set(titles)
    # no run is over before its last round
    assert all(case.steps * case.rounds < MANY / 2 for case in cases())


def test_an_environment_is_a_folder_with_python(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="has neither bin/python nor"):
        python_of(tmp_path)
    (tmp_path / ".venv/bin").mkdir(parents=True)
    (tmp_path / ".venv/bin/python").touch()
    assert python_of(tmp_path) == tmp_path / ".venv/bin/python"
    assert python_of(tmp_path / ".venv") == tmp_path / ".venv/bin/python"


def test_what_fails_says_why() -> None:
    with pytest.raises(SceneError, match=r"mechanism none ep of .* has ended: KeyError: 'none'"):
        measured(Case("mechanism", "none", "ep", 1e-3, 2, 1), [Path(sys.executable)])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["mechanism", "gradient", "adjoint"])
def test_two_of_the_same_take_the_same_time(kind: str) -> None:
    name = "chain3" if kind == "mechanism" else "6x2"
    case = Case(kind, name, "ep", 1e-3, 20, 1 if kind == "adjoint" else 5)
    before = set(os.listdir("/proc/self/fd"))
    row = measured(case, [Path(sys.executable)] * 2)
    # not round-off: what a busy machine makes of equal work
    assert row.ratio == pytest.approx(1, rel=0.5)
    assert all(0 < seconds < 1 for seconds in (*row.own, *row.other))
    assert all(50 < mib < 5000 for mib in row.memory)
    # nothing is left open
    assert set(os.listdir("/proc/self/fd")) <= before


def test_parts_of_steps_are_timed() -> None:
    found = parts_of("chain3", "ep", 2e-3, rounds=1)
    # six unknowns of a body and five multipliers of a joint; no part takes a second
    assert found.unknowns == 33 and found.cost > 1
    assert all(0 < seconds < 1 for seconds in found.seconds)
