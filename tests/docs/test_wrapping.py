"""Prose of all pages is wrapped: a change of a sentence is a change of few lines."""

import re
from pathlib import Path

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


def test_lines_are_wrapped() -> None:
    """Tables, formulas, code and single words such as links may be longer."""
    assert len(PAGES) > 50
    long = [
        f"{page.relative_to(ROOT)}: {line}"
        for page in PAGES
        for line in FENCED.sub("", page.read_text()).splitlines()
        if len(line) > WIDTH
        and not line.startswith(("|", "    ", "$$", "!["))
        and max(map(len, line.split())) < WIDTH / 2
    ]
    assert not long, "\n".join(long)
