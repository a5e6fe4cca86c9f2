"""Reports that `python -m tests.bench --peer` prints and writes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rich.console import Console

from shellmb.accuracy.measuring import Column, console, line, print_table, to_json, write
from shellmb.cli.failures import tell
from shellmb.cli.report import say
from shellmb.demos.verification.measuring import markdown
from shellmb.errors import SceneError
from shellmb.files.writing import write_text
from tests.bench.peers.codes import OURS
from tests.bench.peers.compare import Comparison, Point, compare
from tests.bench.peers.dynamics import buckling, plates
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.dynamics.motion import Motion, Study, title
from tests.bench.peers.dynamics.plates import PEERS, REQUIRE
from tests.bench.peers.picture import draw
from tests.bench.peers.statics import hemisphere, problem, roll_up
from tests.bench.peers.words import fastest

MOTIONS = (plates.STUDY, buckling.STUDY)
STATICS = (roll_up.PROBLEM, hemisphere.PROBLEM)

NOTE = (
    "Processor times of the steps on one thread, recording one displacement and nothing else; "
    "set-up and compilation excluded; the least of several runs, the codes in turn (spread: "
    "slowest less fastest by fastest). Error: L2 norm over time of the displacement less "
    "converged answer, relative to the latter, with a cubic spline through the ends of the steps. "
    "Newton's method ends as early as each code's answer allows: tolerances of 1e-2 (shellmb) and "
    "1e-3 (others) for the plate, 1e-6 for what is compared with and for section 6.1."
)


def run_peer(
    names: Sequence[str], out: Path | None, as_json: bool, fast: bool, check: bool
) -> bool:
    """Compare, print, draw; say whether we take less time for each error, or nobody asked.

    Args:
        names: Peers, keys of `PEERS`.
        out: Folder of the motions' pictures and numbers, and of all tables, by the names of
            `MOTIONS` and `STATICS`; None: none of them.
        as_json: Whether stdout gets the runs of the plate, or of peers without motions those of the
            static problems, as a JSON list and nothing else.
        fast: Whether only a few runs are made.
        check: Whether the times are judged.

    Raises:
        SceneError: If a peer is not installed, or on several ranks.
    """
    from mpi4py import MPI

    if MPI.COMM_WORLD.size > 1:
        raise SceneError("bench: codes are compared on one thread; leave out mpiexec")
    peers = tuple(dict.fromkeys(PEERS[name] for name in names))
    for code in peers:
        REQUIRE[code]()
    moved = [
        (study, _compared(study, peers, fast)) for study in MOTIONS if set(peers) & {*study.every}
    ]
    large = [] if not moved else plates.large_load(peers, *(((1e-2,), 0.05) if fast else ()))
    solved = []
    for static in STATICS:
        tell(static.title)
        cases = static.quick if fast else static.cases
        solved.append((static, problem.compared(static, cases, peers, 1 if fast else 2)))
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        for study, found in moved:
            write(study.name, to_json(found.points), partial(draw, found), out)
        tables = {study.name: markdown(columns(found), best(found)) for study, found in moved}
        tables |= {static.name: markdown(problem.COLUMNS, some) for static, some in solved}
        for name, lines in tables.items():
            write_text(out / f"{name}.md", "\n".join(lines) + "\n")
    if as_json:
        say(to_json(moved[0][1].points if moved else [s for _, some in solved for s in some]))
    to = console(stderr=as_json)
    for study, found in moved:
        line(to, f"{study.title}:")
        _print(to, found)
    if moved:
        _print_large(to, large)
        line(to, NOTE)
    for static, some in solved:
        line(to, f"{static.title}:")
        print_table(to, problem.COLUMNS, some)
        line(to, problem.sentence(static, some))
    faster = all(
        _faster(found, code, error)
        for _, found in moved
        for code in codes(found)[1:]
        for error in found.asked
    )
    came_through = all(not h.failed for plate, h in large if plate.code == OURS)
    return not check or (faster and came_through)


def _compared(study: Study, peers: Sequence[str], fast: bool) -> Comparison:
    """A study of the codes that are asked for."""
    tell(study.title)
    runs = study.quick if fast else study.every
    some = {code: own for code, own in runs.items() if code == OURS or code in peers}
    return compare(some, study.asked, 1 if fast else 2, tell)


def _faster(found: Comparison, code: str, error: float) -> bool:
    """Decide whether we take less time for that error than a peer, or it never has it."""
    mine, theirs = found.best(OURS, error), found.best(code, error)
    return mine is not None and (theirs is None or mine.cpu_s < theirs.cpu_s)


def codes(found: Comparison) -> list[str]:
    """The codes of a comparison, ours first."""
    return [OURS, *(c for c in PEERS.values() if any(p.code == c for p in found.points))]


def sentence(found: Comparison) -> str:
    """Say who takes how long for which error."""

    def quickest(code: str, error: float) -> tuple[float, str] | None:
        run = found.best(code, error)
        if run is None:
            return None
        how = f"{run.scheme}, {run.mesh}, dt = {run.dt:g} s"
        return run.cpu_s, how

    return fastest(codes(found), found.asked, quickest)


def best(found: Comparison) -> list[Point]:
    """Runs that no other one of their code beats, ours first, the fastest first."""
    return [p for code in codes(found) for p in found.front(code)]


def times_ours(found: Comparison, point: Point) -> float:
    """Time by that of our fastest run with at most its error; nan if we have none."""
    mine = found.best(OURS, found.judged(point))
    return point.cpu_s / mine.cpu_s if mine else math.nan


def columns(found: Comparison) -> tuple[Column[Point], ...]:
    """The table of the best."""

    def ratio(point: Point) -> str:
        value = times_ours(found, point)
        return "-" if math.isnan(value) else f"{value:.1f}"

    return (
        Column("code", lambda p: p.code, "words"),
        Column("scheme", lambda p: p.scheme, "words"),
        Column("mesh", lambda p: p.mesh, "words"),
        Column("dt [s]", lambda p: f"{p.dt:g}"),
        Column("error", lambda p: f"{100 * p.error:.3g} %"),
        Column("own error", lambda p: f"{100 * p.error_own:.3g} %"),
        Column("cpu [s]", lambda p: f"{p.cpu_s:.3g}"),
        Column("times ours", ratio),
        Column("spread", lambda p: f"{100 * p.spread:.0f} %"),
        Column("wall [s]", lambda p: f"{p.wall_s:.3g}"),
        Column("iterations", lambda p: f"{p.iterations:.2f}"),
        Column("factored", lambda p: f"{p.factorisations:.2f}"),
    )


def _print(to: Console, found: Comparison) -> None:
    for name, value in found.checks.items():
        line(to, f"{name}: {100 * value:.3g} %")
    peaks = ", ".join(f"{code} {peak:.5f} m" for code, peak in found.peaks.items())
    line(to, f"largest displacement, converged: {peaks}")
    if found.apart:
        line(
            to,
            f"{' and '.join(found.apart)}: the converged answer differs from ours by more than "
            "half of the smallest error asked for, so the error counts against its own.",
        )
    print_table(to, columns(found), best(found))
    failed = [p for p in found.points if p.failed]
    line(to, f"the best of {len(found.points)} runs, {len(failed)} of which failed")
    for p in failed:
        line(to, f"  {p.code} {p.scheme} {p.mesh} dt = {p.dt:g} s: {p.failed}")
    line(to, sentence(found))


def _print_large(to: Console, large: Sequence[tuple[Motion, TipHistory]]) -> None:
    line(to, "cantilever plate under 40 N, 12x2:")
    for plate, history in large:
        what = f"failed at {history.t[-1]:.4g} s" if history.failed else "came through"
        numbers = f"{history.iterations:.1f} iterations per step, peak {history.peak:.4f} m"
        line(to, f"  {plate.code} {title(plate)}: {what}, {numbers}")
