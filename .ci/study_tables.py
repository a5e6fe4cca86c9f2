"""What accuracy costs: the tables of docs/evidence/bundled_studies.md and demos/studies/README.md.

shellmb study --bundled all --clock cpu --out runs/studies
cp runs/studies/*/*.json runs/studies/*/*.png demos/studies
python .ci/study_tables.py            # writes both
python .ci/study_tables.py --check    # fails if they are not what the JSON files say

Of each study and quantity: who is cheapest for an error, with its factor over EP.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from shellmb.accuracy.measuring import Column
from shellmb.accuracy.studies.advice import TARGETS
from shellmb.demos.studies.bundled import BUNDLED
from shellmb.demos.verification.measuring import markdown, replaced

ROOT = Path(__file__).resolve().parents[1]
STORED = ROOT / "demos" / "studies"
PAGE, SECTIONS = ROOT / "docs" / "evidence" / "bundled_studies.md", STORED / "README.md"
BEGIN, END = "<!-- shellmb study: begin -->", "<!-- shellmb study: end -->"
# what others are compared with, and how many of them a cell names
BASE, NAMED = "EP", 3

Entry = dict[str, Any]


def stored(name: str) -> list[Entry]:
    """What is stored of a study, one entry for each quantity; nothing if it was not run."""
    path = STORED / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else []


def is_own(entry: Entry) -> bool:
    """Whether the reference is a run of ours."""
    return bool(entry["reference"].get("own", entry["reference"]["source"] != "exact"))


def seconds(time: float) -> str:
    """A time in few digits."""
    return f"{time:.2g} s" if time >= 0.1 else f"{1000 * time:.2g} ms"


def times(ratio: float) -> str:
    """A ratio of times in few digits."""
    return f"{ratio:.1f}" if ratio < 10 else f"{ratio:.0f}"


def cell(entry: Entry, target: Entry) -> str:
    """Who is cheapest for an error, with its factor over EP; then the others with theirs."""
    if not target["known"]:
        return f"reference known to {100 * entry['reference']['uncertainty']:.2g} %"
    offers = target["offers"]
    if not offers:
        return "not reached"
    best, *others = offers
    base = next((o for o in offers if o["family"] == BASE), None)
    said = f"**{best['family'] or 'all'}** {'<= ' * best['upper_bound']}{seconds(best['time_s'])}"
    if base is not None and base is not best:
        less = "at least " * best["upper_bound"]
        said += f", {less}{times(base['time_s'] / best['time_s'])} times cheaper than {BASE}"
    elif BASE in target["not_reached"]:
        said += f"; {BASE} does not reach it"
    ratios = [
        f"{o['family']} {times(o['time_s'] / best['time_s'])}" for o in others if o is not base
    ]
    if ratios:
        said += f" ({', '.join(ratios[:NAMED])} times as much)"
    return said


def table() -> str:
    """The table of the page in Markdown."""

    def whose(row: tuple[str, Entry]) -> str:
        source = str(row[1]["reference"]["source"])
        return f"own: {source}" if is_own(row[1]) else source

    def target(title: str, k: int) -> Column[tuple[str, Entry]]:
        def said(row: tuple[str, Entry]) -> str:
            entry, targets = row[1], row[1]["targets"]
            # a study of before did not ask for the smallest error
            return cell(entry, targets[k]) if k < len(targets) else "-"

        return Column(title, said)

    columns = [
        Column[tuple[str, Entry]]("study", lambda row: f"`{row[0]}` {row[1]['title']}"),
        Column("reference", whose),
        *map(target, ("for 1 % error", "for 0.1 %", "for 0.01 %"), range(len(TARGETS))),
    ]
    return "\n".join(markdown(columns, ((s.name, e) for s in BUNDLED for e in stored(s.name))))


def sections() -> str:
    """All studies with their pictures, sentences and orders, in Markdown."""
    lines: list[str] = []
    for study in BUNDLED:
        entries = stored(study.name)
        if not entries:
            continue
        name = study.name
        lines += [f"## {name}", "", study.what, "", f"![{name}]({name}.png)", ""]
        for entry in entries:
            reference = entry["reference"]
            whose = "own, " if is_own(entry) else ""
            known = f", known to {100 * reference['uncertainty']:.2g} %"
            known = known if reference["uncertainty"] else ""
            lines += [
                f"*{entry['title']}* (reference: {whose}{reference['source']}{known}). "
                + entry["sentence"],
                "",
            ]
            orders = [
                f"{o['family'] or 'all'} in {o['direction']}{' at ' * bool(o['at'])}{o['at']}: "
                + ("too few runs tell" if o["order"] is None else f"{o['order']:.2f}")
                for o in entry["orders"]
            ]
            lines += [f"Observed orders: {'; '.join(orders)}.", ""]
    return "\n".join(lines).rstrip()


def main() -> None:
    """Write, or check."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="fail if the files differ")
    check = parser.parse_args().check
    for path, made in ((PAGE, table()), (SECTIONS, sections())):
        text = path.read_text()
        wanted = replaced(text, BEGIN, END, made)
        if check and text != wanted:
            raise SystemExit(f"{path.relative_to(ROOT)} is not what the JSON files say")
        if not check:
            path.write_text(wanted)


if __name__ == "__main__":
    main()
