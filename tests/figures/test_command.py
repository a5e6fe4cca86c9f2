"""`python -m demos.paper`: what it refuses, and that its check decides the exit code."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from demos.paper import make
from demos.paper.__main__ import app
from demos.paper.example import Example, Run, Statement, Verdict
from demos.paper.make import Judged
from demos.paper.page import PAGE, differences

RUN = Run("only", "slider_crank", {}, {"t_end": 0.01})


def example(passed: bool) -> Example:
    said = Statement("It runs", "-", ("only",), lambda results: Verdict("it does", passed))
    return Example("6.1", "A crank", (RUN,), (), (said,), animation="none")


@pytest.mark.parametrize(("passed", "code"), [(True, 0), (False, 1)])
def test_check(passed: bool, code: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The page has what is found, or the check fails; a failure that it lists is no difference."""
    monkeypatch.setattr("demos.paper.__main__.find_examples", lambda section: [example(passed)])
    page = tmp_path / "README.md"
    page.write_text("| It runs | - | it does | pass |\n")
    monkeypatch.setattr("demos.paper.__main__.PAGE", page)
    folders = ["--from", str(tmp_path / "runs"), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, ["6.1", "--check", "--json", *folders])
    assert done.exit_code == code
    assert json.loads(done.stdout)[0]["pass"] is passed
    assert (tmp_path / "runs" / "6.1" / "only" / "summary.json").is_file()
    # without --check everything that was made is told, and that is a success
    assert CliRunner().invoke(app, ["6.1", *folders]).exit_code == 0
    page.write_text("<!-- statements of 6.1: begin --><!-- statements of 6.1: end -->\n")
    assert CliRunner().invoke(app, ["6.1", "--check", *folders]).exit_code == 1
    assert CliRunner().invoke(app, ["6.1", "--write", *folders]).exit_code == 0
    assert CliRunner().invoke(app, ["6.1", "--check", *folders]).exit_code == 0


def test_figures_of_the_page_are_compared() -> None:
    """Kind: a number of the page that is not the one of today, in its last digit but one."""
    ours = "largest 99.2 and 87.0 mm at 76.4 s, x 10; 1.24e+03 N; energy law 7e-13"
    judged = Judged("6.1", "It deflects", "good", ours, True)
    page = "| It deflects | good | {} | pass |".format
    assert not differences(page(ours), [judged])
    assert not differences(page(ours.replace("87.0", "87.1").replace("7e-13", "2e-14")), [judged])
    wrong = {"87.0": "91.1", "76.4": "76.6", "x 10": "x 12", "1.24e+03": "1.26e+03", "mm": "m"}
    for now, then in wrong.items():
        assert differences(page(ours.replace(now, then)), [judged])
    assert differences(page(ours).replace("pass", "**FAIL**"), [judged])
    assert differences("", [judged])


def test_the_page_lists_every_statement() -> None:
    page = PAGE.read_text()
    for each in make.find_examples():
        for said in each.statements:
            assert f"\n| {said.text} | {said.paper} | " in page, said.text


def test_unknown_names() -> None:
    done = CliRunner().invoke(app, ["6.1", "--only", "nothing"])
    assert done.exit_code == 2
    assert "there is no run 'nothing'; give one of 'shell-ed'" in done.stderr
    # one that there is does not make up for it
    done = CliRunner().invoke(app, ["6.1", "--only", "shell-ed", "--only", "nothing"])
    assert done.exit_code == 2 and "there is no run 'nothing'" in done.stderr
    assert CliRunner().invoke(app, ["8"]).exit_code == 2
    assert list(make.EXAMPLES) == ["6.1", "6.2", "6.3"]
