"""The first page is short, and its scene is ten lines that run."""

import ast
import re
from pathlib import Path

README = (Path(__file__).parents[2] / "README.md").read_text()


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
