"""Steps of this checkout and of another one in turn, and the ratios of their times."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median, quantiles

from rich.console import Console

from shellmb.accuracy.measuring import Column, print_table
from shellmb.demos.effects.stepping import in_turn
from shellmb.errors import SceneError

WORKER = Path(__file__).with_name("worker.py")
SCHEMES = ("ep", "ed", "ep4", "ed3")
# more than that share longer, and a row is missed
LONGER = 1.05


@dataclass(frozen=True)
class Case:
    """A row of the table.

    Args:
        kind: "plate", "mechanism", "gradient" (a plate, by one parameter, beside the run) or
            "adjoint" (by the thickness of each element: the sweep backwards over all steps).
        name: Elements along and across, or the mechanism.
        scheme: Time scheme.
        dt: Length of a step, s.
        steps: Steps of a round.
        rounds: Rounds; of the sweep there is one.
    """

    kind: str
    name: str
    scheme: str
    dt: float
    steps: int
    rounds: int

    @property
    def title(self) -> str:
        """Name of the row."""
        return f"{self.kind} {self.name} {self.scheme}"


@dataclass(frozen=True)
class Row:
    """A row measured.

    Args:
        title: Its name.
        own: Processor times of a step in the rounds here, s.
        other: Those of the other checkout; none without one.
        memory: Peak memory here and there, MiB.
    """

    title: str
    own: tuple[float, ...]
    other: tuple[float, ...]
    memory: tuple[float, ...]

    @property
    def ratios(self) -> list[float]:
        """Time here over that of the other checkout, of each round."""
        return [a / b for a, b in zip(self.own, self.other, strict=True)] if self.other else []

    @property
    def ratio(self) -> float | None:
        """Median of the ratios; None without another checkout."""
        return median(self.ratios) if self.other else None

    @property
    def width(self) -> float:
        """Width of the middle half of the ratios: what the machine makes of equal work."""
        if len(self.ratios) < 2:
            return 0.0
        lower, _, upper = quantiles(self.ratios, n=4, method="inclusive")
        return upper - lower


def cases() -> list[Case]:
    """All rows, short ones first."""
    meshes = {"6x2": (40, 15), "32x32": (4, 5), "64x64": (2, 3)}
    links = {"chain3": 60, "chain10": 40, "chain100": 10, "slider_crank": 60, "four_bar": 60}
    links |= {"heavy_top": 60}
    found = [Case("plate", m, s, 1e-3, *n) for m, n in meshes.items() for s in SCHEMES]
    found += [Case("mechanism", m, s, 2e-3, n, 15) for m, n in links.items() for s in SCHEMES]
    for kind, rounds in (("gradient", 15), ("adjoint", 1)):
        found += [Case(kind, "6x2", s, 1e-3, 40, rounds) for s in SCHEMES]
        found.append(Case(kind, "32x32", "ep", 1e-3, 5, min(rounds, 3)))
    return found


class Worker:
    """A process that makes steps of a case when it is told to.

    Args:
        python: Python of its environment.
        case: The case.
    """

    def __init__(self, python: Path, case: Case) -> None:
        reading, writing = os.pipe()
        # a file, which is never full as a pipe may be
        self._said = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            [str(python), str(WORKER), json.dumps(asdict(case)), str(writing)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
            pass_fds=[writing],
            text=True,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        os.close(writing)
        self._read, self._title = os.fdopen(reading), f"{case.title} of {python}"

    def __enter__(self) -> Worker:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """No process is left."""
        self.process.kill()
        self.process.communicate()
        self._read.close()
        self._said.close()

    def take(self) -> float:
        """The next number that it tells; it then waits.

        Raises:
            SceneError: If it ended instead.
        """
        if line := self._read.readline():
            return float(line)
        self.process.communicate()
        self._said.seek(0)
        said = self._said.read().strip().splitlines()
        raise SceneError(f"{self._title} has ended: {said[-1] if said else 'no step was told'}")

    def round(self) -> float:
        """The time of the next round, s; others wait meanwhile."""
        return self._answer("go\n")

    def end(self) -> float:
        """Peak memory, MiB, and no more steps."""
        return self._answer("\n")

    def _answer(self, word: str) -> float:
        assert self.process.stdin is not None
        self.process.stdin.write(word)
        self.process.stdin.flush()
        return self.take()


def measured(case: Case, pythons: Sequence[Path]) -> Row:
    """Rounds of a case in some environments, in turn.

    Args:
        case: The case.
        pythons: Python of this checkout, and of the other one if there is one.
    """
    with ExitStack() as stack:
        workers = [stack.enter_context(Worker(python, case)) for python in pythons]
        # until all are warm
        for worker in workers:
            worker.take()
        rounds = in_turn(case.rounds, [worker.round for worker in workers])
        if case.kind == "adjoint":
            # all steps were made: the sweep is what follows
            rounds = in_turn(1, [worker.round for worker in workers])
        memory = tuple(worker.end() for worker in workers)
    own, *others = zip(*([s / case.steps for s in times] for times in rounds), strict=True)
    return Row(case.title, own, others[0] if others else (), memory)


def python_of(other: Path) -> Path:
    """Python of an environment, or of that of a checkout.

    Args:
        other: Its folder.

    Raises:
        SceneError: If there is none.
    """
    for place in (other, other / ".venv"):
        if (python := place / "bin" / "python").is_file():
            return python
    raise SceneError(
        f"bench steps: {other} has neither bin/python nor .venv/bin/python; give the folder of an "
        "environment or of a checkout that has one"
    )


COLUMNS = (
    Column[Row]("row", lambda row: row.title, "words"),
    Column[Row]("step [ms]", lambda row: f"{1e3 * median(row.own):.3f}"),
    Column[Row]("other [ms]", lambda row: f"{1e3 * median(row.other):.3f}" if row.other else ""),
    Column[Row]("ratio", lambda row: "" if row.ratio is None else f"{row.ratio:.3f}"),
    Column[Row]("middle half", lambda row: f"{row.width:.3f}" if row.other else ""),
    Column[Row]("peak [MiB]", lambda row: " / ".join(f"{m:.0f}" for m in row.memory)),
)


def rows_of(names: Sequence[str], pythons: Sequence[Path]) -> Iterator[Row]:
    """Rows whose titles have one of some parts, or all; each is printed when it is there.

    Args:
        names: The parts.
        pythons: As of `measured`.

    Raises:
        SceneError: If there is no such row.
    """
    wanted = [c for c in cases() if not names or any(name in c.title for name in names)]
    if not wanted:
        titles = ", ".join(c.title for c in cases())
        raise SceneError(f"bench steps: there is no row '{names[0]}'; rows are {titles}")
    for case in wanted:
        row = measured(case, pythons)
        ratio = "" if row.ratio is None else f", ratio {row.ratio:.3f}"
        print(f"{row.title}: {1e3 * median(row.own):.3f} ms{ratio}", file=sys.stderr, flush=True)
        yield row


def run_steps(other: Path | None, names: Sequence[str], check: bool) -> bool:
    """Measure and print; say whether no row takes longer, or nobody checks.

    Args:
        other: Environment or checkout beside which this one is measured; None: alone.
        names: Parts of the titles of rows; none: all.
        check: Whether rows are judged.
    """
    pythons = [Path(sys.executable), *([] if other is None else [python_of(other)])]
    rows = list(rows_of(names, pythons))
    print_table(Console(), COLUMNS, rows)
    slower = [row.title for row in rows if row.ratio is not None and row.ratio > LONGER]
    for title in slower:
        print(f"more than {LONGER:g} times the other one's: {title}")
    return not (check and slower)
