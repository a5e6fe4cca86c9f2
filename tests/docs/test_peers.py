"""The table of features: every mark of a peer has its sentence and its source, and no other."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROW = re.compile(r"^\| (.+) \|$", re.MULTILINE)
SOME, NOT_FOUND, NONE = ("●", "◐"), "·", "\N{EN DASH}"


def rows(text: str) -> list[list[str]]:
    """Cells of the rows below the head of a table."""
    return [line.split(" | ") for line in ROW.findall(text) if not line.startswith(("|", "---"))]


PAGE, SOURCES = (
    (ROOT / "docs" / "evidence" / name).read_text() for name in ("peers.md", "peers_sources.md")
)
TABLE = PAGE.partition("## The table\n")[2].partition("\n## ")[0]
HEAD = re.search(r"^\| \| (.+) \|$", TABLE, re.MULTILINE)
PEERS = HEAD[1].split(" | ")[1:] if HEAD else []
FEATURES = {name: marks for name, _, *marks in rows(TABLE)}


@pytest.mark.parametrize("peer", PEERS)
def test_marks_have_sources(peer: str) -> None:
    section = SOURCES.partition(f"\n## {peer}\n")[2].partition("\n## ")[0]
    said = {name: (mark, text) for name, mark, text in rows(section)}
    marks = {name: m[PEERS.index(peer)] for name, m in FEATURES.items()}
    assert marks
    assert {name: m for name, m in marks.items() if m in SOME} == {n: s[0] for n, s in said.items()}
    assert all(re.search(r"\]\(https://\S+\)$", text) for _, text in said.values())
    # its lines are wrapped
    missing = " ".join(section.partition("Not found: ")[2].split()).rstrip(".").split("; ")
    assert {m.lower() for m in missing} == {n.lower() for n, m in marks.items() if m == NOT_FOUND}


def test_the_summary_counts_the_table() -> None:
    ours = [row[1] for row in rows(TABLE)]
    words = {1: "one", 2: "Two", 6: "Six", 9: "nine"}
    have, part, lack = (ours.count(mark) for mark in (*SOME, NONE))
    only = [m for m, mark in zip(FEATURES.values(), ours, strict=True) if mark == "●"]
    nowhere = sum(not set(m) & set(SOME) for m in only)
    in_part = sum("●" not in m for m in only) - nowhere
    assert f"Of {len(ours)} features shellmb has {have}, {words[part]} in part" in PAGE
    assert f"{words[lack]} not:" in PAGE
    assert f"{words[nowhere]} were found nowhere else:" in PAGE
    assert f"{words[in_part]} more were found nowhere else in full:" in PAGE
