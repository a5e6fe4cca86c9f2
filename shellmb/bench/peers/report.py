"""What `shellmb bench --peer exudyn` prints and writes."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from shellmb.bench.peers.compare import (
    ASKED,
    EXUDYN,
    OURS,
    Comparison,
    Plate,
    Study,
    compare,
    large_load,
    quick,
    title,
)
from shellmb.bench.peers.exudyn_plate import require
from shellmb.bench.peers.history import TipHistory
from shellmb.bench.peers.our_plate import OurPlate
from shellmb.cli.report import say
from shellmb.errors import SceneError

PICTURE = "peer.png"
NOTE = (
    "Processor times of the steps on one thread, recording the tip and nothing else; set-up and "
    "compilation excluded; the least of several runs, the codes in turn. Error: L2 norm over the "
    "0.5 s of tip deflection less converged answer, relative to the latter, with a cubic spline "
    "through the ends of the steps. Newton tolerance 1e-6 in both codes."
)


def run_peer(out: Path | None, as_json: bool, fast: bool, check: bool) -> bool:
    """Compare, print, draw; say whether we take less time for each error, or nobody asked.

    Args:
        out: Folder of the picture and of `peer.json`; None: neither.
        as_json: Whether stdout gets the runs as a JSON list, and nothing else.
        fast: Whether only a few runs are made.
        check: Whether the times are judged.

    Raises:
        SceneError: If Exudyn is not installed, or on several ranks.
    """
    from mpi4py import MPI

    if MPI.COMM_WORLD.size > 1:
        raise SceneError("bench: codes are compared on one thread; leave out mpiexec")
    require()
    found = compare(quick() if fast else Study(), lambda t: print(t, file=sys.stderr, flush=True))
    large = large_load(*(((1e-2,), 0.05) if fast else ()))
    text = json.dumps([asdict(p) for p in found.points], indent=1)
    if out is not None:
        from shellmb.bench.peers.picture import draw

        out.mkdir(parents=True, exist_ok=True)
        (out / "peer.json").write_text(text + "\n")
        draw(found, out / PICTURE)
    if as_json:
        say(text)
    console = Console(stderr=as_json, highlight=False, width=150)
    _print(console, found, large)
    ours, theirs = ([found.best(code, e) for e in ASKED] for code in (OURS, EXUDYN))
    faster = [
        a is not None and (b is None or a.cpu_s < b.cpu_s)
        for a, b in zip(ours, theirs, strict=True)
    ]
    came_through = all(not h.failed for plate, h in large if isinstance(plate, OurPlate))
    return not check or (all(faster) and came_through)


def sentence(found: Comparison) -> str:
    """Who takes how long for which error."""
    parts = []
    for error in ASKED:
        times = []
        for code in (OURS, EXUDYN):
            best = found.best(code, error)
            if best is None:
                times.append(f"{code} not reached")
            else:
                how = f"{best.scheme}, {best.mesh}, dt = {best.dt:g} s"
                times.append(f"{code} {best.cpu_s:.3g} s ({how})")
        parts.append(f"{100 * error:g} % error: {', '.join(times)}")
    return "; ".join(parts) + "."


def _print(console: Console, found: Comparison, large: Sequence[tuple[Plate, TipHistory]]) -> None:
    for name, value in found.checks.items():
        console.print(f"{name}: {100 * value:.3g} %")
    peaks = ", ".join(f"{code} {peak:.5f} m" for code, peak in found.peaks.items())
    console.print(f"largest deflection, converged: {peaks}")
    if found.apart:
        console.print(
            "The converged answers differ by more than half of the smallest error asked for: each "
            "code is judged by its own."
        )
    table = Table(box=None, header_style="bold", pad_edge=False)
    for name in ("code", "scheme", "mesh"):
        table.add_column(name, no_wrap=True)
    for name in ("dt [s]", "error", "own error", "cpu [s]", "wall [s]", "iterations", "factored"):
        # in brackets there is markup otherwise
        table.add_column(escape(name), justify="right", no_wrap=True)
    for code in (OURS, EXUDYN):
        for p in found.front(code):
            error, own = (
                f"{100 * e:.3g} %" if e is not None else "" for e in (p.error, p.error_own)
            )
            numbers = f"{p.cpu_s:.3g}", f"{p.wall_s:.3g}", f"{p.iterations:.2f}"
            row = (f"{p.dt:g}", error, own, *numbers, f"{p.factorisations:.2f}")
            table.add_row(p.code, p.scheme, p.mesh, *row)
    console.print(table)
    failed = [p for p in found.points if p.failed]
    console.print(f"the best of {len(found.points)} runs, {len(failed)} of which failed")
    for p in failed:
        where = f"{p.code} {p.scheme} {p.mesh} dt = {p.dt:g} s"
        console.print(f"  {where}: {p.failed}", markup=False, soft_wrap=True)
    console.print(NOTE, soft_wrap=True)
    console.print("under 40 N, 12x2:")
    for plate, history in large:
        code = OURS if isinstance(plate, OurPlate) else EXUDYN
        what = f"failed at {history.t[-1]:.4g} s" if history.failed else "came through"
        numbers_ = f"{history.iterations:.1f} iterations per step, peak {history.peak:.4f} m"
        console.print(f"  {code} {title(plate)}: {what}, {numbers_}", markup=False, soft_wrap=True)
    console.print(sentence(found), soft_wrap=True)
