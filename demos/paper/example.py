"""Description of an example of the paper: runs, figures of them, statements about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import matplotlib.figure
import pandas as pd

from shellmb.observers.files.described import read_described
from shellmb.running.standard import FIELDS
from shellmb.scene import Scene
from shellmb.show.fields import Fields

__all__ = ["Example", "Figure", "FinishedRun", "Results", "Run", "Statement", "Verdict"]


@dataclass(frozen=True)
class Run:
    """One run that figures and statements need.

    Args:
        name: Its name, that of its directory too.
        demo: The demo that describes the scene.
        settings: Parameters of the demo's `scene(...)`.
        options: What `shellmb run` takes beside them: scheme, alpha, dt, t_end, mesh, ...
        expected_failure: Of a run that the paper says cannot be finished: why. What it computed
            until then is used.
    """

    name: str
    demo: str
    settings: Mapping[str, Any]
    options: Mapping[str, Any]
    expected_failure: str | None = None


@dataclass(frozen=True)
class FinishedRun:
    """Content of a run's directory.

    Args:
        name: Its name.
        scene: The scene that was run.
        history: The history, one row per step and one before the first.
        summary: The summary; `results` in it are those of the demo.
        directory: The run directory.
    """

    name: str
    scene: Scene
    history: pd.DataFrame
    summary: dict[str, Any]
    directory: Path

    @property
    def results(self) -> dict[str, float]:
        """Results that the demo measured."""
        return dict(self.summary["results"])

    @cached_property
    def states(self) -> Fields:
        """The frames that were written, for pictures of the deformed system."""
        described = read_described(self.directory)
        return Fields(self.directory / FIELDS, described.bodies, described.labels)


# finished runs by name
Results = dict[str, FinishedRun]


@dataclass(frozen=True)
class Figure:
    """One figure.

    Args:
        number: The paper's number, "4"; with a letter, "4b", where it is ours beyond the paper.
        caption: What is seen, and what the paper says of it.
        runs: Names of the runs that it needs.
        draw: Draws it.
    """

    number: str
    caption: str
    runs: tuple[str, ...]
    draw: Callable[[matplotlib.figure.Figure, Results], None]


@dataclass(frozen=True)
class Verdict:
    """Verdict on a statement.

    Args:
        ours: Our value, with its unit.
        passed: Whether the statement holds.
    """

    ours: str
    passed: bool


@dataclass(frozen=True)
class Statement:
    """Something that the paper states in its text.

    Args:
        text: What is stated.
        paper: The paper's value, or its words; of what it does not say, "(ours)".
        runs: Names of the runs that it is about.
        judge: Compares.
        why: Of what does not hold: where the difference comes from.
    """

    text: str
    paper: str
    runs: tuple[str, ...]
    judge: Callable[[Results], Verdict]
    why: str = ""


@dataclass(frozen=True)
class Example:
    """One example of the paper.

    Args:
        section: Its section, "6.1".
        title: Its title.
        runs: All its runs.
        figures: Its figures.
        statements: What is stated of it.
        animation: Name of the run that the animation shows.
    """

    section: str
    title: str
    runs: tuple[Run, ...]
    figures: tuple[Figure, ...]
    statements: tuple[Statement, ...]
    animation: str

    def run(self, name: str) -> Run:
        """The run of that name.

        Raises:
            KeyError: If there is none.
        """
        return {run.name: run for run in self.runs}[name]
