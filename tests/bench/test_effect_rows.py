"""The rows of `tests.bench --effects`: what is counted, how shares are made, what is refused."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.bench.__main__ import app
from tests.bench.effects.rows import CASES, EffectPlan

SIDE = [
    "unknowns",
    "solved",
    "stored",
    "coefficients",
    "integrals",
    "kernels",
    "iterations_per_step",
    "factorisations_per_step",
    "step_s",
]
SOME = ("inertia", "dissipation", "joint_mass", "observe_energy")


def bench(*arguments: str, code: int = 0):
    result = CliRunner().invoke(app, [*arguments])
    assert result.exit_code == code, (result.output, result.stderr)
    return result


def test_rows_of_some_effects(tmp_path: Path) -> None:
    """Counts are exact; of times only that they are there and that shares are shares."""
    named = [word for name in SOME for word in ("--effect", name)]
    found = json.loads(bench("--quick", *named, "--json", "--out", str(tmp_path)).stdout)
    assert json.loads((tmp_path / "effects.json").read_text()) == found
    assert (tmp_path / "effects.png").stat().st_size > 10_000
    rows = {row["effect"]: row for row in found}
    assert tuple(rows) == SOME
    for row in found:
        assert list(row["with"]) == list(row["without"]) == SIDE
        assert row["with"]["step_s"] > 0 and row["without"]["step_s"] > 0
        assert row["saved"] < 1 and row["spread"] >= 0
        assert (row["rounds"], row["ranks"]) == (2, 1)
    schemes = {name: (row["scheme"], row["mesh"]) for name, row in rows.items()}
    assert schemes == {
        "inertia": ("ep", "2x1"),
        "dissipation": ("ed", "2x1"),
        "joint_mass": ("ep", "-"),
        "observe_energy": ("ep", "2x1"),
    }

    def more(effect: str) -> dict[str, int]:
        own, less = rows[effect]["with"], rows[effect]["without"]
        return {k: own[k] - less[k] for k in SIDE[:6] if own[k] != less[k]}

    assert more("inertia") == {"stored": 153, "coefficients": 5, "integrals": 2}
    assert more("dissipation")["unknowns"] == 153
    assert more("dissipation")["solved"] == rows["dissipation"]["without"]["solved"]
    assert more("joint_mass")["kernels"] == 2
    # an observer has no part in the system
    assert more("observe_energy").keys() == {"kernels"}


def test_table() -> None:
    lines = bench("--quick", "--effect", "joint_windows").stdout.splitlines()
    assert lines[0].split()[:5] == ["effect", "scheme", "mesh", "unknowns", "solved"]
    (row,) = [line.split() for line in lines if line.startswith("joint_windows")]
    assert row[1:3] == ["ep", "-"]
    assert any("equilibrium_start, which acts before the first step only" in line for line in lines)


def test_a_plan_measures_nothing_twice() -> None:
    assert [case.effect for case, _, _ in EffectPlan().cases()] == list(CASES)
    plan = EffectPlan(
        ("gravity", "dissipation", "motor"), schemes=("ep", "ed"), meshes=((2, 1), (4, 1))
    )
    kinds = [(case.effect, scheme, mesh) for case, scheme, mesh in plan.cases()]
    assert len(set(kinds)) == len(kinds) == 4 + 2 + 2
    assert {scheme for name, scheme, _ in kinds if name == "dissipation"} == {"ed"}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--effect", "speed"), "error: there is no effect 'speed'; it must be one of 'inertia'"),
        (("--effect", "assembly"), "effect is 'assembly', which acts before the first step only"),
        (("--effect", "drilling"), "effect is 'drilling', which no shell has"),
        (("--effects", "--check"), "error: bench: check must be left out beside effects"),
        (("--effects", "--scene", "static"), "scene must be left out beside effects"),
    ],
)
def test_errors_are_sentences(arguments, sentence) -> None:
    assert sentence in bench(*arguments, code=2).stderr
