"""The first page is short, and its scene is ten lines that run."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def test_the_first_page_is_read_in_a_minute() -> None:
    lines = README.splitlines()
    assert len(lines) <= 90
    assert max(map(len, lines)) <= 120


def test_the_scene_is_ten_lines() -> None:
    """Statements count whole, however they are wrapped; `test_code` runs it."""
    (code,) = re.findall(r"^```python\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    lines = [line for line in code.splitlines() if line.strip()]
    assert len(lines) <= 10
    assert any(isinstance(node, ast.FunctionDef) for node in ast.parse(code).body)


def test_schemes_are_explained_before_tables_use_them() -> None:
    for name in ("ep", "ed", "ep4", "ed3"):
        assert f"`{name}`" in README
    assert README.index("energy preserving and energy") < README.index("## What it does")


def test_times_beside_other_codes_are_those_of_the_evidence() -> None:
    """The least time of each code for an error of its own, by the table that a command makes."""
    page = (ROOT / "docs" / "evidence" / "beside_others.md").read_text()
    table = page.partition("| code | scheme | mesh | dt [s] |")[2].partition("\n\n")[0]
    runs = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()[2:]]
    shown = re.findall(
        r"^\| ([\d.]+) % \| ([\d.]+) s \| ([\d.]+) s \| ([\d.]+) s \|$", README, re.M
    )
    assert len(shown) == 3
    for error, *times in shown:
        for code, time in zip(("shellmb", "Exudyn", "OpenSees"), times, strict=True):
            enough = [
                float(run[6])
                for run in runs
                if run[0] == code and float(run[5].removesuffix(" %")) <= float(error)
            ]
            assert f"{min(enough):.2g}" == f"{float(time):.2g}", (error, code)
