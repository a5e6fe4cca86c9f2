"""The tables in docs/evidence that are made from what `shellmb verify --json` prints.

    shellmb verify --slow --json > demos/studies/verify.json
    python .ci/tables.py                      # writes the tables
    python .ci/tables.py --check              # fails if a page has another one
    python .ci/tables.py --part beams/roll-up # runs these cases, compares with the file

verification.md has a row for every case; in it the value that is nearest to its bound, and the
largest error, whatever its bound. No case is left out. elements.md has a table for each element: a
row for every mesh of `elements/*` with its largest error, beside those of other codes. in_time.md
has a row for every scheme of `in time/*`, with its largest error of each kind.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from shellmb.accuracy.measuring import Column
from shellmb.demos.references.tables import read
from shellmb.demos.verification.measuring import markdown, replaced
from shellmb.demos.verification.table import find_cases

ROOT = Path(__file__).resolve().parents[1]
STORED = ROOT / "demos" / "studies" / "verify.json"
PAGE = ROOT / "docs" / "evidence" / "verification.md"
ELEMENTS = ROOT / "docs" / "evidence" / "elements.md"
IN_TIME = ROOT / "docs" / "evidence" / "in_time.md"
BEGIN, END = "<!-- shellmb verify: begin -->", "<!-- shellmb verify: end -->"
# of other codes, those with as many sides
OTHERS = {
    "quad": ("QUAD4", "QD4", "S4R", "QUAD8", "QD8", "S8R"),
    "tri": ("TRI6", "TR6", "STRI65", "T3FF"),
}
# errors of two machines differ by round-off, seen against the bound, and by this part of themselves
ROUND_OFF, NEAR = 1e-2, 0.05

Entry = dict[str, Any]


def by_case(entries: list[Entry]) -> dict[str, list[Entry]]:
    """Rows of each case, in their order."""
    cases: dict[str, list[Entry]] = {}
    for entry in entries:
        cases.setdefault(name_of(entry), []).append(entry)
    return cases


def size(entry: Entry) -> float:
    """Its error; what is not a number is larger than all."""
    return math.inf if entry["error"] is None else float(entry["error"])


def share(entry: Entry) -> float:
    """Error over its bound; a bound of zero is met exactly or not at all."""
    return size(entry) / entry["tolerance"] if entry["tolerance"] else (size(entry) and math.inf)


def shown(entry: Entry) -> str:
    """Error and bound."""
    error = "not a number" if entry["error"] is None else f"{entry['error']:.2g}"
    return f"{error}, {entry['tolerance']:.2g}"


def table(entries: list[Entry]) -> str:
    """The table in Markdown.

    Args:
        entries: All rows of `shellmb verify --slow --json`.

    Raises:
        SystemExit: If a case is missing, or unknown.
    """
    cases = by_case(entries)
    said = {
        case.name: (case.checks.__doc__ or "").partition("\n")[0] for case in find_cases(slow=True)
    }
    if cases.keys() != said.keys():
        odd = ", ".join(sorted(cases.keys() ^ said.keys()))
        raise SystemExit(f"{STORED.name} and the registered cases differ in: {odd}; make it anew")
    columns: list[Column[list[Entry]]] = [
        Column("case", lambda rows: name_of(rows[0])),
        Column("what", lambda rows: what(said[name_of(rows[0])], rows)),
        Column("values", lambda rows: str(len(rows))),
        Column("nearest to its bound", lambda rows: which(max(rows, key=share))),
        Column("error, allowed", lambda rows: shown(max(rows, key=share))),
        Column("largest error, allowed", lambda rows: shown(max(rows, key=size))),
    ]
    passed = f"{len(entries)} values, {sum(e['pass'] for e in entries)} pass:"
    return "\n".join([passed, "", *markdown(columns, cases.values())])


def name_of(entry: Entry) -> str:
    """Name of the case of a row."""
    return str(entry["case"].partition(": ")[0])


def which(entry: Entry) -> str:
    """What is compared in a row."""
    return str(entry["case"].partition(": ")[2].replace("|", "\\|"))


def what(said: str, rows: list[Entry]) -> str:
    """What a case is, with the Newton iterations that its rows tell."""
    found = [int(n) for row in rows for n in re.findall(r"(\d+) iterations", row["source"])]
    told = f" ({min(found)} to {max(found)} iterations)" if found else ""
    return said.rstrip(".") + told


def differences(stored: list[Entry], now: list[Entry]) -> list[str]:
    """What rows say now that the stored ones do not.

    Args:
        stored: All rows of the file.
        now: Rows of some cases, complete.
    """
    names = by_case(now)
    before = {e["case"]: e for e in stored if name_of(e) in names}
    after = {e["case"]: e for e in now}
    found = [f"{name}: not in both" for name in sorted(before.keys() ^ after.keys())]
    for name in before.keys() & after.keys():
        old, new = before[name], after[name]
        allowed = ROUND_OFF * new["tolerance"] + NEAR * (old["error"] or 0.0)
        errors = (old["error"], new["error"])
        if None in errors or abs(errors[0] - errors[1]) > allowed or not new["pass"]:
            found.append(f"{name}: error {errors[1]}, in the file {errors[0]}")
    return found


def percent(error: float) -> str:
    """A relative error in per cent."""
    return f"{100 * error:+.1f}"


def elements(entries: list[Entry], cell: str) -> str:
    """The table of an element: of each problem and mesh the value that is farthest from one.

    Values that other codes publish have rows of their own.

    Args:
        entries: All rows of `shellmb verify --slow --json`.
        cell: "quad" or "tri".
    """
    others = read("elements")
    meshes: dict[tuple[str, str, str], list[tuple[str, float]]] = {}
    for entry in entries:
        folder, _, case = name_of(entry).partition("/")
        title, _, what = which(entry).partition("; ")
        if folder == "elements" and title.startswith(cell):
            value = math.nan if entry["value"] is None else entry["value"]
            mesh = title.removeprefix(cell).strip()
            same = others[(others["problem"] == case) & (others["mesh"] == mesh)]
            own = what if what in set(same["what"]) else ""
            meshes.setdefault((case, mesh, own), []).append((what, value - 1))

    def published(row: Any) -> str:
        (case, mesh, own), _ = row
        same = others[(others["problem"] == case) & (others["mesh"] == mesh)]
        found = same[same["what"] == (own or "value")]
        rows = [found[found["element"] == element] for element in OTHERS[cell]]
        return ", ".join(
            f"{r['code'].iloc[0]} {r['element'].iloc[0]} {percent(r['value'].iloc[0] - 1)}"
            for r in rows
            if len(r)
        )

    def largest(row: Any) -> tuple[str, float]:
        return max(row[1], key=lambda found: abs(found[1]))

    columns: list[Column[Any]] = [
        Column("problem", lambda row: row[0][0]),
        Column("mesh", lambda row: row[0][1]),
        Column("error, %", lambda row: percent(largest(row)[1])),
        Column("where", lambda row: largest(row)[0]),
        Column("others, error in %", published),
    ]
    return "\n".join(markdown(columns, meshes.items()))


def in_time(entries: list[Entry]) -> str:
    """The table of motions: of each problem and scheme the errors of what is told of all of them.

    Args:
        entries: All rows of `shellmb verify --slow --json`.
    """
    runs: dict[tuple[str, str], dict[str, Entry]] = {}
    for entry in entries:
        folder, _, case = name_of(entry).partition("/")
        if folder == "in time":
            scheme, _, rest = which(entry).partition(", dt=")
            step, _, told = rest.partition(" s, ")
            runs.setdefault((case, f"{scheme}, {step} s"), {})[told] = entry

    def error(row: Any, *words: str) -> str:
        found = [entry for told, entry in row[1].items() if any(w in told for w in words)]
        return "-" if not found else f"{max(size(entry) for entry in found):.2g}"

    columns: list[Column[Any]] = [
        Column("problem", lambda row: row[0][0]),
        Column("scheme, step", lambda row: row[0][1]),
        Column("momentum", lambda row: error(row, "momentum over impulse", "along the axis")),
        Column("angular momentum", lambda row: error(row, "angular")),
        Column("energy balance", lambda row: error(row, "balance")),
        Column("energy in flight", lambda row: error(row, "energy variation", "rise of energy")),
        Column("energy after the pulse", lambda row: error(row, "after the pulse")),
        Column("displacement", lambda row: error(row, "s, distance", "at full load")),
        Column("from another code", lambda row: error(row, "another code")),
    ]
    return "\n".join(markdown(columns, runs.items()))


def pages(stored: list[Entry]) -> dict[Path, str]:
    """The pages with the tables of the stored rows."""
    text = ELEMENTS.read_text()
    for cell in OTHERS:
        begin, end = (f"<!-- {cell}: {each} -->" for each in ("begin", "end"))
        text = replaced(text, begin, end, elements(stored, cell))
    motions = replaced(
        IN_TIME.read_text(), *("<!-- in time: begin -->", "<!-- in time: end -->"), in_time(stored)
    )
    return {
        PAGE: replaced(PAGE.read_text(), BEGIN, END, table(stored)),
        ELEMENTS: text,
        IN_TIME: motions,
    }


def main() -> None:
    """Write, check, or compare."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="fail if the page differs")
    parser.add_argument("--part", metavar="PATTERN", help="run these cases and compare")
    asked = parser.parse_args()
    stored = json.loads(STORED.read_text())
    if asked.part:
        command = [sys.executable, "-m", "shellmb.cli", "verify", "--json", "--case", asked.part]
        said = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False).stdout
        found = differences(stored, json.loads(said))
        if found:
            raise SystemExit(f"{STORED.name} is not what is found:\n" + "\n".join(found))
    for page, wanted in pages(stored).items():
        if asked.check and page.read_text() != wanted:
            raise SystemExit(f"{page.name}: its tables are not those of {STORED.name}")
        if not asked.check and not asked.part:
            page.write_text(wanted)


if __name__ == "__main__":
    main()
