"""Reports that `python -m tests.bench mechanisms` prints and writes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from shellmb.accuracy.measuring import Column, console, line, print_table
from shellmb.cli.failures import tell
from shellmb.demos.verification.measuring import markdown
from tests.bench.peers import exudyn
from tests.bench.peers.codes import EXUDYN, OURS
from tests.bench.peers.compare import Comparison, Point, compare
from tests.bench.peers.mechanisms.runs import least_step, study_of
from tests.bench.peers.mechanisms.scenes import MECHANISMS

PAGE = Path(__file__).parents[4] / "docs" / "theory" / "mechanisms.md"
# steps of which the quickest is told, s
STEPS = {"ep": 1e-3, "ep4": 8e-3}
BEGIN, END = "<!-- mechanisms -->", "<!-- /mechanisms -->"


@dataclass(frozen=True)
class Row:
    """The fastest runs of a mechanism for an error.

    Args:
        title: What it is.
        error: The error asked for.
        ours: Our fastest run with it, if any.
        theirs: Exudyn's.
    """

    title: str
    error: float
    ours: Point | None
    theirs: Point | None


def _run(point: Point | None) -> str:
    if point is None:
        return "not reached"
    return f"{point.scheme}, {1e3 * point.dt:.3g} ms: {point.cpu_s:.3g} s"


def _ratio(row: Row) -> str:
    if row.ours is None or row.theirs is None:
        return "-"
    return f"{row.ours.cpu_s / row.theirs.cpu_s:.2g}"


def _step(row: Row) -> str:
    if row.ours is None:
        return "-"
    steps = SPANS[row.title] / row.ours.dt
    return f"{1e3 * row.ours.cpu_s / steps:.2f}"


SPANS = {m.title: float(m.scene().t_end or 0.0) for m in MECHANISMS.values()}
COLUMNS = (
    Column[Row]("mechanism", lambda r: r.title, "words"),
    Column[Row]("error", lambda r: f"{100 * r.error:g} %"),
    Column[Row]("shellmb", lambda r: _run(r.ours), "words"),
    Column[Row]("Exudyn", lambda r: _run(r.theirs), "words"),
    Column[Row]("shellmb over Exudyn", _ratio),
    Column[Row]("a step of ours [ms]", _step),
)


def rows_of(name: str, found: Comparison) -> Iterator[Row]:
    """Rows of the table of one mechanism."""
    for error in found.asked:
        both = (found.best(code, error) for code in (OURS, EXUDYN))
        yield Row(MECHANISMS[name].title, error, *both)


def run_mechanisms(names: Sequence[str], fast: bool, docs: bool) -> None:
    """Compare errors against processor times of mechanisms with Exudyn.

    Args:
        names: Names of the mechanisms; all if empty.
        fast: Whether only a few runs are made.
        docs: Whether the table in the documentation is written anew.
    """
    exudyn.require()
    rows: list[Row] = []
    to = console()
    for name in names or MECHANISMS:
        study = study_of(name, fast)
        tell(study.title)
        found = compare(study.every, study.asked, 1, tell)
        for what, value in found.checks.items():
            # exact motions do not differ
            if value:
                line(to, f"{study.title}, {what}: {100 * value:.2g} %")
        for scheme, dt in STEPS.items():
            both = [1e3 * least_step(name, scheme, dt, observed) for observed in (False, True)]
            numbers = f"{both[0]:.2f} ms at least, {both[1]:.2f} ms with what a run observes"
            line(to, f"{study.title}, a step of {1e3 * dt:g} ms with {scheme.upper()}: {numbers}")
        rows += rows_of(name, found)
        print_table(to, COLUMNS, rows[-len(found.asked) :])
    if docs:
        text = PAGE.read_text()
        before, after = text.split(BEGIN)[0], text.split(END)[1]
        table = "\n".join(markdown(COLUMNS, rows))
        PAGE.write_text(f"{before}{BEGIN}\n\n{table}\n\n{END}{after}")
