"""Makes an example: its runs, then its figures and the judgement of its statements."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mpi4py import MPI

from demos.paper.example import Example, FinishedRun, Results
from demos.paper.pictures import draw_animation, draw_figure
from demos.paper.runs import finish
from shellmb.barrier import arrive
from shellmb.demos.verification.measuring import Stopwatch
from shellmb.errors import SceneError

# modules of the examples by their section in the paper
EXAMPLES = {"6.1": "lateral_buckling", "6.2": "snap_through", "6.3": "antenna"}


@dataclass(frozen=True)
class Judged:
    """A statement and how it fares.

    Args:
        example: Section of the paper.
        statement: What is stated.
        paper: The paper's value.
        ours: Ours.
        passed: Whether it holds.
        why: If not: where the difference comes from.
    """

    example: str
    statement: str
    paper: str
    ours: str
    passed: bool
    why: str = ""


@dataclass(frozen=True)
class Made:
    """Things made of an example.

    Args:
        example: The example.
        runs: Its runs, those that were wanted.
        judged: Its statements.
        pictures: The files that were drawn.
        wall_s: Wall time of each run, whenever it was made [s].
        drawing_s: Wall time of drawing the figures [s].
    """

    example: Example
    runs: dict[str, FinishedRun]
    judged: list[Judged]
    pictures: list[Path]
    wall_s: dict[str, float]
    drawing_s: float


def find_examples(section: str | None = None) -> list[Example]:
    """The examples.

    Args:
        section: Section of the paper; None: all.

    Raises:
        SceneError: If there is none of that section.
    """
    if section is not None and section not in EXAMPLES:
        known = ", ".join(EXAMPLES)
        raise SceneError(f"figures: there is no example '{section}'; give one of {known}")
    wanted = EXAMPLES if section is None else {section: EXAMPLES[section]}
    rooms = (f"demos.paper.examples.{module}" for module in wanted.values())
    return [importlib.import_module(name).EXAMPLE for name in rooms]


def make(
    example: Example,
    runs: Path,
    out: Path | None,
    only: Sequence[str] = (),
    report: Callable[[str], None] = lambda text: None,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Made:
    """Make an example.

    Args:
        example: The example.
        runs: Folder of its run directories; runs that are finished in it are used.
        out: Folder of its pictures; None: nothing is drawn.
        only: Names of the only runs wanted, figures and statements that need others are left out;
            none: all.
        report: Told what is going on, on every rank.
        comm: Communicator; the call is collective, pictures are drawn on rank 0.

    Raises:
        SceneError: If a run directory holds another run.
        ConvergenceError: If a run fails that the paper does not say to fail.
    """
    finished: Results = {}
    for run in example.runs:
        if only and run.name not in only:
            continue
        report(f"{example.section} {run.name}")
        finished[run.name] = finish(run, runs / run.name, comm)
    watch = Stopwatch()
    pictures: list[Path] = []
    if out is not None and comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        for figure in example.figures:
            if finished.keys() >= {*figure.runs}:
                report(f"{example.section} figure {figure.number}")
                pictures.append(out / f"figure-{figure.number}.png")
                draw_figure(figure, finished, pictures[-1])
        if example.animation in finished:
            report(f"{example.section} animation")
            pictures.append(out / "animation.gif")
            draw_animation(finished[example.animation].states, pictures[-1])
    drawing = watch.wall
    judged = []
    for one in example.statements:
        if finished.keys() >= {*one.runs}:
            verdict = one.judge(finished)
            passed = bool(verdict.passed)
            why = "" if passed else one.why
            judged.append(Judged(example.section, one.text, one.paper, verdict.ours, passed, why))
    wall = {name: wall_time(run) for name, run in finished.items()}
    arrive(comm)
    return Made(example, finished, judged, pictures, wall, drawing)


def wall_time(run: FinishedRun) -> float:
    """Wall time of a run with its set-up, those of all its parts if it was resumed [s]."""
    # the column goes on where a run is resumed, the time of the set-up is that of the last part
    return float(run.history["wall_s"].iloc[-1]) + float(run.summary["setup_s"] or 0.0)
