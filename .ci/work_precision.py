"""Work-precision pages, one for each problem, from the raw JSON of studies.

    shellmb study --bundled heavy_top --clock cpu --out runs/studies
    python .ci/work_precision.py                       # docs/evidence/work_precision/*.md
    python .ci/work_precision.py --check               # fails if they are not what the files say
    python .ci/work_precision.py --add runs/studies --machine "name of a processor"

The first machine's files are in `demos/studies`, those of others in a folder each of
`demos/studies/machines`, which `--add` makes. All are checked against the schema
`demos/studies/schema.json`. Runs that failed and choices that were left out stay in the pages.
"""

from __future__ import annotations

import argparse
import importlib
import json
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]

from shellmb.accuracy.measuring import Column
from shellmb.demos.studies.bundle import Bundled
from shellmb.demos.studies.bundled import BUNDLED
from shellmb.demos.verification.measuring import markdown

ROOT = Path(__file__).resolve().parents[1]
STORED = ROOT / "demos" / "studies"
PAGES = ROOT / "docs" / "evidence" / "work_precision"
MACHINES = STORED / "machines"
# where from the pages the stored files are
LINK = "../../../demos/studies"
# of lines of prose
WIDTH = 120
NORMS = {
    "l2": "root mean square over time of the difference, over that of the reference",
    "sup": "largest difference over time, over the largest value of the reference",
    "end": "difference at the end, relative",
    "max": "difference of the largest values, relative",
    "min": "difference of the smallest values, relative",
    "mean": "difference of the means over time, relative",
    "": "difference of the numbers, relative",
}

Entry = dict[str, Any]


def entries(file: Path) -> list[Entry]:
    """What a study found, one entry for each quantity, checked against the schema."""
    if not file.is_file():
        return []
    found = json.loads(file.read_text())
    schema = json.loads((STORED / "schema.json").read_text())
    jsonschema.validate(found, schema)
    return list(found)


def machines(name: str) -> Iterator[tuple[str, list[Entry]]]:
    """Machines that have run a study, the first one of `demos/studies`, and what they found."""
    yield (
        json.loads((STORED / "machine.json").read_text())["name"],
        entries(STORED / f"{name}.json"),
    )
    for folder in sorted(MACHINES.glob("*/")):
        if found := entries(folder / f"{name}.json"):
            yield json.loads((folder / "machine.json").read_text())["name"], found


def problem(entry: Entry) -> str:
    """What the problem is: the first paragraphs of its demo."""
    text = importlib.import_module(f"shellmb.demos.{entry['scene']}").__doc__ or ""
    paragraphs = [" ".join(p.split()) for p in text.strip().split("\n\n")]
    plain = [p for p in paragraphs[:2] if not p.startswith(("`", "    "))]
    return "\n\n".join(plain)


def choice(point: Entry, varied: set[str]) -> str:
    """What a run chose, of what was varied."""
    said = []
    for name, value in point["choice"].items():
        if name == "mesh" and "mesh" in varied:
            said.append("x".join(map(str, value)))
        elif name == "alpha" and value is not None and name in varied:
            said.append(f"alpha = {value:g}")
        elif name in varied and value is not None:
            said.append(f"{name} = {value:g}" if isinstance(value, float) else f"{value}")
    return ", ".join(said)


def error(point: Entry) -> str:
    """Error of a run in percent, or why there is none."""
    if point.get("failed"):
        return f"failed: {point['failed']}"
    if point["error"] is None:
        below = point["error_below"]
        return "none" if below is None else f"< {100 * below:.2g} %"
    return f"{100 * point['error']:.3g} %"


def number(point: Entry, name: str, digits: str) -> str:
    """A number of a run that did not fail."""
    return "" if point.get("failed") else format(point[name], digits)


def points(entry: Entry) -> list[str]:
    """The table of all runs, failed ones with them."""
    values: dict[str, set[str]] = {}
    for point in entry["points"]:
        for name, value in point["choice"].items():
            values.setdefault(name, set()).add(str(value))
    varied = {name for name, found in values.items() if len(found) > 1}
    columns = [
        Column[Entry]("run", lambda p: choice(p, varied) or "as the demo has it"),
        Column[Entry]("error", error),
        Column[Entry]("time [s]", lambda p: number(p, "time_s", ".3g")),
        Column[Entry]("steps", lambda p: number(p, "steps", "d")),
        Column[Entry]("rejected", lambda p: number(p, "rejected", "d")),
        Column[Entry]("iterations a step", lambda p: number(p, "iterations", ".1f")),
    ]
    left_out = [f"Left out: {item['choice']}: {item['reason']}." for item in entry["left_out"]]
    return [*markdown(columns, entry["points"]), "", *left_out]


def quantity(entry: Entry) -> list[str]:
    """One quantity: norm, reference, table, advice."""
    name, _, norm = entry["quantity"].partition(":")
    reference = entry["reference"]
    own = reference.get("own", reference["source"] != "exact")
    source = f"a run of ours, {reference['source']}" if own else str(reference["source"])
    known = f"; known to {100 * reference['uncertainty']:.2g} %" * bool(reference["uncertainty"])
    settings = [f"{key} = {value}" for key, value in entry["parameters"].items()]
    if entry["t_end"] is not None:
        settings.append(f"until {entry['t_end']:g} s")
    time = {"cpu": "processor time", "wall": "wall time"}[entry["clock"]]
    return [
        f"## {entry['title']}",
        "",
        f"- *Quantity*: `{name}`; error: {NORMS[norm]}.",
        f"- *Reference*: {source}{known}.",
        f"- *Settings*: {', '.join(settings) or 'those of the demo'}; varied: "
        f"{', '.join(entry['swept']) or 'nothing'}; times are {time} of the steps, with the "
        "observers of every run and nothing written.",
        "",
        *points(entry),
        "",
        entry["sentence"],
        "",
    ]


def page(study: Bundled) -> str:
    """The page of a problem."""
    (_, first), *others = machines(study.name)
    lines = [
        f"# {study.name}",
        "",
        f"![Error over time: {study.name}]({LINK}/{study.name}.png)",
        "",
        study.what,
        "",
        "**Problem.** " + problem(first[0]),
        "",
        f"Made by `shellmb study --bundled {study.name} --clock cpu`; raw data: "
        f"[{study.name}.json]({LINK}/{study.name}.json).",
        "",
    ]
    for entry in first:
        lines += quantity(entry)
    if others:
        lines += ["## Other machines", "", *elsewhere(first, others), ""]
    return "\n".join(wrapped("\n".join(lines))).rstrip() + "\n"


def wrapped(text: str) -> Iterator[str]:
    """Lines of a page; those of prose are wrapped."""
    for line in text.split("\n"):
        if len(line) <= WIDTH or line.startswith(("|", "![")):
            yield line
        else:
            indent = "  " if line.startswith("- ") else ""
            yield from textwrap.wrap(
                line,
                WIDTH,
                subsequent_indent=indent,
                break_long_words=False,
                break_on_hyphens=False,
            )


def elsewhere(first: list[Entry], others: list[tuple[str, list[Entry]]]) -> list[str]:
    """Times of other machines over those of the first, of runs that both have."""
    rows = []
    for name, found in others:
        for entry in found:
            ours = next((e for e in first if e["title"] == entry["title"]), None)
            times = [] if ours is None else sorted(ratios(ours, entry))
            if times:
                rows.append((name, entry["title"], times))
    columns = [
        Column[tuple[str, str, list[float]]]("machine", lambda row: row[0]),
        Column[tuple[str, str, list[float]]]("study", lambda row: row[1]),
        Column[tuple[str, str, list[float]]](
            "time over the first machine's: least, median, most",
            lambda row: f"{row[2][0]:.2f}, {row[2][len(row[2]) // 2]:.2f}, {row[2][-1]:.2f}",
        ),
    ]
    return list(markdown(columns, rows))


def ratios(ours: Entry, theirs: Entry) -> Iterator[float]:
    """Ratios of the times of runs that chose the same."""
    known = {json.dumps(p["choice"], sort_keys=True): p for p in ours["points"]}
    for point in theirs["points"]:
        same = known.get(json.dumps(point["choice"], sort_keys=True))
        if same is not None and not point.get("failed") and not same.get("failed"):
            yield point["time_s"] / same["time_s"]


def index(studies: list[Bundled]) -> str:
    """The list of the pages."""
    machine = json.loads((STORED / "machine.json").read_text())
    lines = [
        "# Work and precision",
        "",
        "One page for each problem: error against time, what was solved, every run with its",
        "error, cost and failure. All pages are made from raw data by one command,",
        "`python .ci/work_precision.py`; a second machine adds its own:",
        "",
        "    shellmb study --bundled all --clock cpu --out runs/studies",
        '    python .ci/work_precision.py --add runs/studies --machine "name of the processor"',
        "",
        f"First machine: {machine['name']}, {machine['notes']}.",
        "",
        "```{toctree}",
        ":maxdepth: 1",
        "",
        *(study.name for study in studies),
        "```",
    ]
    return "\n".join(lines) + "\n"


def add(folder: Path, machine: str) -> None:
    """Take over what a second machine found.

    Args:
        folder: What `shellmb study --bundled all --out` wrote.
        machine: Its name.
    """
    target = MACHINES / re.sub(r"\W+", "-", machine.strip().lower()).strip("-")
    found = [f for s in BUNDLED for f in folder.glob(f"{s.name}/{s.name}.json") if entries(f)]
    if not found:
        raise SystemExit(f"{folder} holds no results of bundled studies")
    target.mkdir(parents=True, exist_ok=True)
    for file in found:
        (target / file.name).write_text(file.read_text())
    (target / "machine.json").write_text(json.dumps({"name": machine}, indent=1) + "\n")


def main() -> None:
    """Write, or check."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="fail if the pages differ")
    parser.add_argument("--add", type=Path, help="folder of the studies of a second machine")
    parser.add_argument("--machine", help="its name")
    given = parser.parse_args()
    if (given.add is None) != (given.machine is None):
        raise SystemExit("--add and --machine must be given together")
    if given.add is not None:
        add(given.add, given.machine)
    studies = [s for s in BUNDLED if (STORED / f"{s.name}.json").is_file()]
    made = {f"{s.name}.md": page(s) for s in studies} | {"index.md": index(studies)}
    stale = {p.name for p in PAGES.glob("*.md")} - made.keys()
    for name in stale if not given.check else ():
        (PAGES / name).unlink()
    for name, text in made.items():
        path = PAGES / name
        if given.check and (stale or not path.is_file() or path.read_text() != text):
            raise SystemExit(f"{path.relative_to(ROOT)} is not what the JSON files say")
        if not given.check:
            path.write_text(text)


if __name__ == "__main__":
    main()
