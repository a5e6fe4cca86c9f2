"""Prose of all pages is wrapped: a change of a sentence is a change of few lines."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# made by a command from `--help`
GENERATED = {"commands.md"}
PAGES = [
    page
    for page in (
        *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "demos/README.md")),
        *sorted(ROOT.glob("docs/*.md")),
        *sorted(ROOT.glob("docs/*/*.md")),
    )
    if page.name not in GENERATED and "_build" not in page.parts
]
FENCED = re.compile(r"^(```+).*?^\1", re.MULTILINE | re.DOTALL)
WIDTH = 120


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_lines_are_wrapped(page: Path) -> None:
    """Tables, formulas, code and single words such as links may be longer."""
    prose = FENCED.sub("", page.read_text())
    long = [
        line
        for line in prose.splitlines()
        if len(line) > WIDTH
        and not line.startswith(("|", "    ", "$$", "!["))
        and max(map(len, line.split())) < WIDTH / 2
    ]
    assert not long
