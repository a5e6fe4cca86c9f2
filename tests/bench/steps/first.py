"""First steps of bundled scenes, each in a process of its own: `python -m tests.bench first`."""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from shellmb.accuracy.measuring import Column, console, print_table
from shellmb.demos.verification.measuring import markdown, replaced
from shellmb.errors import SceneError
from shellmb.running.loader import demos, load
from tests.bench.steps.process import ROOT, last_line

PAGE = ROOT / "docs" / "evidence" / "costs.md"
BEGIN, END = "<!-- first steps: begin -->", "<!-- first steps: end -->"


@dataclass(frozen=True)
class First:
    """The first accepted step of a scene.

    Args:
        name: Name of the scene.
        wall_s: Time from the end of its import to the end of the step, s.
        cpu_s: Processor time of the same, s.
    """

    name: str
    wall_s: float
    cpu_s: float


COLUMNS = (
    Column[First]("scene", lambda f: f.name, "words"),
    Column[First]("processor time [s]", lambda f: f"{f.cpu_s:.1f}"),
    Column[First]("wall time [s]", lambda f: f"{f.wall_s:.1f}"),
)


def first_step(name: str) -> First:
    """First step of a bundled scene in a process of its own; nothing but loops in C is kept.

    Raises:
        ShellmbError: If the process fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        arguments = "tests.bench.steps.first", name, folder
        found = last_line(f"the first step of '{name}'", *arguments, OMP_NUM_THREADS="1")
    return First(name, *json.loads(found))


def run_first(names: Sequence[str], rounds: int, docs: bool) -> None:
    """Print the first steps of bundled scenes, the slowest first.

    Args:
        names: The scenes; all if empty.
        rounds: Processes of each, of which the least times are told.
        docs: Whether the table in the documentation is written anew.

    Raises:
        SceneError: If there is no such scene, or the table would lose others.
    """
    if names and docs:
        raise SceneError("bench: --docs is given with --scene; the table has all, leave one out")
    unknown = [name for name in names if name not in demos()]
    if unknown:
        raise SceneError(f"bench: there is no bundled scene '{unknown[0]}' (`shellmb list`)")
    rows = sorted(_rows(names or list(demos()), rounds), key=lambda row: -row.cpu_s)
    print_table(console(), COLUMNS, rows)
    if docs:
        table = "\n".join(markdown(COLUMNS, rows))
        PAGE.write_text(replaced(PAGE.read_text(), BEGIN, END, table))


def _rows(names: Sequence[str], rounds: int) -> Iterator[First]:
    for name in names:
        some = [first_step(name) for _ in range(rounds)]
        yield First(name, min(s.wall_s for s in some), min(s.cpu_s for s in some))


def main(name: str, folder: str) -> None:
    """Run a scene up to its first step, as `shellmb run` does, print wall and processor time."""
    module = load(name)
    scene = module.build()
    begin = time.perf_counter(), time.process_time()
    from shellmb.running.execute import execute
    from shellmb.simulate.simulation import BaseObserver, Simulation

    class Ends(BaseObserver):
        """Ends the process behind the first step."""

        def accepted(self, simulation: Simulation) -> None:
            """Print the times."""
            now = time.perf_counter(), time.process_time()
            print(json.dumps([b - a for a, b in zip(begin, now, strict=True)]), flush=True)
            os._exit(0)

    execute(scene, Path(folder) / "run", [Ends()], pictures=False, results=module.results)


if __name__ == "__main__":
    main(*sys.argv[1:])
