"""`shellmb effects` as a user calls it: table, JSON, comparison, errors."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from shellmb.cli.main import app
from shellmb.demos.effects.catalogue.registry import EFFECTS

SMALL = str(Path(__file__).parents[1] / "run" / "scene_small.py")
RUNNER = CliRunner()


def effects(*arguments: str, code: int = 0):
    result = RUNNER.invoke(app, ["effects", SMALL, "--mesh", "2x1", *arguments])
    assert result.exit_code == code, (result.output, result.stderr)
    return result


def test_costs_of_a_small_scene() -> None:
    """Counts are exact; of times only that they are there and that shares are shares."""
    answer = json.loads(effects("--steps", "2", "--repeat", "1", "--json").stdout)
    rows = {row["effect"]: row for row in answer["effects"]}
    assert list(rows) == list(EFFECTS)
    assert answer["step_s"] > 0
    assert answer["solved"] < answer["total"]["unknowns"]
    inertia = rows["inertia"]
    assert inertia["used"] and inertia["share"] is None
    assert inertia["stored"] == answer["total"]["unknowns"]
    assert (rows["rotary_inertia"]["integrals"], rows["rotary_inertia"]["coefficients"]) == (1, 1)
    assert rows["rotary_inertia"]["share"] < 1
    assert "joint to the ground" in rows["flexibility"]["needed"]
    assert rows["drilling"]["used"] is False and rows["drilling"]["kernels"] is None
    observers = [row for row in rows.values() if row["group"] == "observers" and row["used"]]
    assert len(observers) == 7
    assert 0 < sum(row["share"] for row in observers) < 1
    assert rows["observe_energy"]["kernels"] > 0


def test_table() -> None:
    lines = effects("--quick").stdout.splitlines()
    assert lines[0].strip() == "effects of small"
    used = next(line for line in lines if line.startswith("  transverse_shear"))
    assert "transverse_shear=True of 'plate'" in used
    assert any(line.startswith("  coupling") and "B = 0" in line for line in lines)


def test_what_shear_is_worth() -> None:
    """Results beside times: with h/L = 0.002 shear changes the tip by 1e-3 at the very start."""
    found = json.loads(effects("--without", "transverse_shear", "--json").stdout)
    assert found["without"] == ["transverse_shear"] and found["with"] == []
    results = {row["name"]: row for row in found["results"]}
    tip = results["tip"]
    assert 0 < abs(tip["relative"]) < 0.05
    assert results["tip_z at the end"]["before"] == tip["before"]
    times = {row["name"]: row for row in found["times"]}
    assert times["steps"]["before"] == times["steps"]["after"] == 5
    assert times["time of all steps [s]"]["before"] > 0


def test_another_scheme_and_a_table_of_both() -> None:
    out = effects("--with", "dissipation", "--without", "rotary_inertia", "--dt", "2.5e-3").stdout
    assert "without rotary_inertia and with dissipation" in out
    assert "time of all steps [s]" in out
    unknowns = next(line for line in out.splitlines() if line.startswith("unknowns"))
    assert unknowns.split()[-2:] == ["+100.00", "%"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--without", "gravity"), "error: --without gravity: it is not there: loads has no"),
        (("--with", "drilling"), "error: --with drilling: the shells of eq. 9 have no moment"),
        (("--without", "speed"), "error: there is no effect 'speed'; it must be one of 'inertia'"),
        (("--scheme", "rk4"), "scheme is 'rk4'; it must be one of 'static'"),
        (("--set", "held=false", "--without", "inertia"), "--without inertia: shell 'plate': noth"),
    ],
)
def test_errors_are_sentences(arguments, sentence) -> None:
    assert sentence in effects(*arguments, code=2).stderr
