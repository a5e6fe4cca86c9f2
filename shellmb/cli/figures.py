"""The command `shellmb figures`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from shellmb.cli.failures import first_rank, tell
from shellmb.cli.report import say
from shellmb.errors import SceneError
from shellmb.figures.example import Example
from shellmb.figures.make import find_examples, make
from shellmb.figures.report import print_made
from shellmb.measuring.records import to_json


def run_figures(
    section: str | None, runs: Path, out: Path, only: Sequence[str], as_json: bool, draw: bool
) -> bool:
    """Make the figures of one example or of all, print what was found, say whether all pass.

    Args:
        section: Section of the paper; None: all examples.
        runs: Folder of the runs: a run NAME of example 6.1 is in `6.1/NAME`.
        out: Folder of the pictures: those of example 6.1 are in `6.1`.
        only: Names of the only runs wanted; none: all.
        as_json: Whether a JSON list of the statements is printed.
        draw: Whether pictures are drawn.

    Raises:
        SceneError: If there is no such example or run.
    """
    examples = find_examples(section)
    if only:
        examples = _with_runs(examples, only)

    judged = []
    for example in examples:
        pictures = out / example.section if draw else None
        made = make(example, runs / example.section, pictures, only, tell)
        judged += made.judged
        if first_rank() and not as_json:
            print_made(made)
    if first_rank() and as_json:
        say(to_json(judged, passed="pass"))
    return all(j.passed for j in judged)


def _with_runs(examples: list[Example], names: Sequence[str]) -> list[Example]:
    there = {run.name for e in examples for run in e.runs}
    for name in names:
        if name not in there:
            known = ", ".join(f"'{run.name}'" for e in examples for run in e.runs)
            raise SceneError(f"figures: there is no run '{name}'; give one of {known}")
    return [e for e in examples if not {run.name for run in e.runs}.isdisjoint(names)]
