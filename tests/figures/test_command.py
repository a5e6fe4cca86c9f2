"""`python -m demos.paper`: what it refuses, and that its check decides the exit code."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from demos.paper import make
from demos.paper.__main__ import app
from demos.paper.example import Example, Run, Statement, Verdict

RUN = Run("only", "slider_crank", {}, {"t_end": 0.01})


def example(passed: bool) -> Example:
    said = Statement("It runs", "-", ("only",), lambda results: Verdict("it does", passed))
    return Example("6.1", "A crank", (RUN,), (), (said,), animation="none")


@pytest.mark.parametrize(("passed", "code"), [(True, 0), (False, 1)])
def test_check(passed: bool, code: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("demos.paper.__main__.find_examples", lambda section: [example(passed)])
    folders = ["--from", str(tmp_path / "runs"), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, ["6.1", "--check", "--json", *folders])
    assert done.exit_code == code
    assert json.loads(done.stdout)[0]["pass"] is passed
    assert (tmp_path / "runs" / "6.1" / "only" / "summary.json").is_file()
    # without --check everything that was made is told, and that is a success
    assert CliRunner().invoke(app, ["6.1", *folders]).exit_code == 0


def test_unknown_names() -> None:
    done = CliRunner().invoke(app, ["6.1", "--only", "nothing"])
    assert done.exit_code == 2
    assert "there is no run 'nothing'; give one of 'shell-ed'" in done.stderr
    # one that there is does not make up for it
    done = CliRunner().invoke(app, ["6.1", "--only", "shell-ed", "--only", "nothing"])
    assert done.exit_code == 2 and "there is no run 'nothing'" in done.stderr
    assert CliRunner().invoke(app, ["8"]).exit_code == 2
    assert list(make.EXAMPLES) == ["6.1", "6.2", "6.3"]
