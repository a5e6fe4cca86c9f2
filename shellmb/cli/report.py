"""Texts printed at the end of a command."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.cli.failures import first_rank, run_check, tell
from shellmb.show.account import account, with_error

if TYPE_CHECKING:
    from shellmb.api.modeshapes import ModeShapes, RotatingModes
    from shellmb.api.record import StoredResult
    from shellmb.api.sensitivity.record import Sensitivities


def say(text: str) -> None:
    """Print a line as it is."""
    print(text)


def announce(scene: str, quiet: bool) -> None:
    """Say on stderr what happens before the first step, as it may take a while.

    Args:
        scene: Name of the scene.
        quiet: Say nothing.
    """
    # nor that the loops in C are compiled
    logging.getLogger("shellmb.native.library").setLevel(logging.ERROR if quiet else 0)
    if not quiet:
        tell(f"{scene}: building")


def print_list(scenes: Mapping[str, str], kinds: Mapping[str, Sequence[str]]) -> None:
    """The bundled scenes, or studies, by their kinds.

    Args:
        scenes: Description by name.
        kinds: Names by kind.
    """
    width = max(map(len, scenes), default=0)
    for kind, names in kinds.items():
        say(f"{kind}:")
        for name in names:
            say(f"  {name:{width}}  {scenes[name]}")


def print_run(summary: Mapping[str, Any]) -> None:
    """The numbers of a run that say whether to trust it, and its results, from its summary.

    Args:
        summary: The summary.
    """
    from shellmb.diagnostics.base import SETUP

    _print_columns(("", ""), account(summary).items(), show_header=False)
    # what was said when the scene was built stands above already
    _print_warnings(w["says"] for w in summary["warnings"] if w["watch"] != SETUP)


def print_campbell(found: RotatingModes, count: int) -> None:
    """Frequencies over the rate, and whether a mode grows.

    Args:
        found: The modes.
        count: How many branches are shown.
    """
    every = found.frequencies.shape[1]
    branches = min(count, every)
    heads = ("rate [rad/s]", *(f"{k} [Hz]" for k in range(1, branches + 1)))
    rows = zip(found.rates, found.frequencies[:, :branches], strict=True)
    _print_columns(
        heads, ((f"{rate:g}", *("" if f != f else f"{f:.6g}" for f in row)) for rate, row in rows)
    )
    if branches < every:
        say(f"{branches} of {every} branches; all are in {found.directory}")
    say(found.verdict)


def print_modes(found: ModeShapes) -> None:
    """Natural frequencies or load factors with what there is of errors, growth and damping.

    Args:
        found: The modes.
    """
    from shellmb.api.modeshapes import StateModes

    summary, known = found.summary, found.summary.get("errors", {"modes": {}, "remarks": []})
    sizes = [f"{f:.6g}" for f in found.load_factors or found.frequencies]
    for name, frequency in known["modes"].items():
        sizes[int(name[1:]) - 1] = with_error(frequency)
    sizes[: found.rigid] = ["rigid"] * found.rigid
    columns = {"load factor" if found.load_factors else "frequency [Hz]": sizes}
    for name, head in (("growth_per_s", "growth [1/s]"), ("damping_ratios", "damping ratio")):
        numbers = summary.get(name, [])
        if any(numbers) or "damping_ratios" in summary:
            columns[head] = [f"{number:.4g}" for number in numbers]
    rows = enumerate(zip(*columns.values(), strict=True), start=1)
    _print_columns(("mode", *columns), ((str(k), *row) for k, row in rows))
    if isinstance(found, StateModes):
        # which has the warnings in it
        say(found.verdict)
        say(f"drift: {found.drift:.3g} of the scene's length")
        return
    if found.rigid:
        say(f"rigid: motions that no support or spring resists, {found.rigid} of them")
    if (negative := summary.get("negative_load_factor")) is not None:
        say(f"under the opposite load: {-negative:.6g}")
    for name, value in summary["results"].items():
        if isinstance(value, dict):
            say(f"{name}: {with_error(value)}")
    for remark in known["remarks"]:
        say(remark)
    _print_warnings(found.warnings)


def print_sensitivities(found: Sensitivities) -> None:
    """Derivatives of results, or of probes at the end, by each parameter."""
    for p in found.parameters:
        rows = [
            (
                row.name,
                f"{row.value:.6g}",
                f"{row.derivative:.6g}",
                f"{row.derivative * p.value / row.value:.4g}" if row.value else "",
            )
            for row in found.rows(p.name)
        ]
        _print_columns(("", "value", f"by {p.name}", "% for 1 %"), rows)
    _print_warnings(found.warnings)
    say(f"written to {found.directory}")


def _print_warnings(sentences: Iterable[str]) -> None:
    from rich.markup import escape

    from shellmb.accuracy.measuring import console

    for sentence in sentences:
        console().print(f"[bold yellow]warning:[/] {escape(sentence)}", soft_wrap=True)


def _print_columns(
    heads: Sequence[str], rows: Iterable[Sequence[str]], show_header: bool = True
) -> None:
    """Print a table whose cells are there already; the first column names the rows."""
    from shellmb.accuracy.measuring import Column, console, print_table

    columns = [
        Column(head, itemgetter(k), "number" if k else "words") for k, head in enumerate(heads)
    ]
    print_table(console(), columns, rows, show_header=show_header)


def print_numbers(
    head: str, numbers: Mapping[str, float], errors: Mapping[str, float], directory: Path
) -> None:
    """Print numbers with their errors, as far as there are any.

    Args:
        head: What they are of.
        numbers: The numbers by name.
        errors: Their errors by name.
        directory: Where they were written.
    """
    say(head)
    for name, value in numbers.items():
        say(f"  {name:32s} {value:.6g}" + (f" +- {errors[name]:.2g}" if name in errors else ""))
    say(f"written: {directory}")


def finish[T: StoredResult](
    found: T, *, quiet: bool, check: Callable[[Any], None] | None = None, count: int = 6
) -> T:
    """Print what came of a command, and hold it against reference values; collective.

    Args:
        found: What was found.
        quiet: Print nothing.
        check: Reference values of the scene; None: nothing is checked.
        count: How many branches of a Campbell diagram are shown.

    Raises:
        FailedCheck: If a reference value is not met.
    """
    from mpi4py import MPI

    from shellmb.api.modeshapes import ModeShapes, RotatingModes

    # a run as it was computed: files have no infinite numbers
    held: Any = found.computed if hasattr(found.computed, "results") else found
    # the files of the first rank are complete
    MPI.COMM_WORLD.Barrier()
    if not quiet and first_rank():
        if isinstance(found, RotatingModes):
            print_campbell(found, count)
        elif isinstance(found, ModeShapes):
            print_modes(found)
        else:
            print_run(held.summary)
        _print_cost(found.directory)
        say(f"written to {found.directory}")
    if check is not None:
        run_check(check, held.results)
    return found


def _print_cost(directory: Path) -> None:
    """Print what accuracy costs, and why a request ended, if there was one."""
    from shellmb.files.reading import read_json
    from shellmb.options.run import ACCURACY

    if not (directory / ACCURACY).is_file():
        return
    about = read_json(directory / ACCURACY)
    say(f"error of {about['quantity']}, processor time of the run:")
    for offer in about["offers"]:
        say(f"  {offer['says']}")
    say(about["says"])
