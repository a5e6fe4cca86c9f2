"""Texts printed at the end of a command, and runs to an accuracy, which end with them."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.cli.failures import first_rank, run_check, tell
from shellmb.show.account import account, with_error

if TYPE_CHECKING:
    from shellmb.accuracy.request.target import Target
    from shellmb.api.runs import Requested
    from shellmb.api.sensitivity.record import Sensitivities
    from shellmb.running.execute import RunResult
    from shellmb.running.natural_modes.run import BucklingModes
    from shellmb.running.natural_modes.vibration import Modes
    from shellmb.running.rotating.campbell import Campbell
    from shellmb.running.rotating.state import StateModes


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


def print_run(result: RunResult) -> None:
    """The numbers of a run that say whether to trust it, and its results."""
    from rich.markup import escape

    from shellmb.accuracy.measuring.tables import console
    from shellmb.diagnostics.base import SETUP

    _print_columns(("", ""), account(result.summary).items(), show_header=False)
    to = console()
    for caution in result.warnings:
        # what was said when the scene was built stands above already
        if caution.watch != SETUP:
            to.print(f"[bold yellow]warning:[/] {escape(caution.says)}", soft_wrap=True)
    say(f"written to {result.out}")


def print_summary(summary: Mapping[str, Any]) -> None:
    """The numbers of a run that say whether to trust it, and its results, from its summary.

    Args:
        summary: The summary.
    """
    _print_columns(("", ""), account(summary).items(), show_header=False)
    for warning in summary["warnings"]:
        say(f"warning: {warning['says']}")


def print_campbell(found: Campbell, count: int, directory: Path) -> None:
    """Frequencies over the rate, and whether a mode grows.

    Args:
        found: The modes.
        count: How many branches are shown.
        directory: Where everything about them is.
    """
    branches = min(count, found.branches.shape[1])
    heads = ("rate [rad/s]", *(f"{k} [Hz]" for k in range(1, branches + 1)))
    rows = zip(found.rates, found.frequencies[:, :branches], strict=True)
    _print_columns(
        heads, ((f"{rate:g}", *("" if f != f else f"{f:.6g}" for f in row)) for rate, row in rows)
    )
    if branches < found.branches.shape[1]:
        say(f"{branches} of {found.branches.shape[1]} branches; all are in {directory}")
    say(found.verdict)
    say(f"written to {directory}")


def print_state_modes(about: StateModes, directory: Path) -> None:
    """Modes about a state: frequencies, growth, damping, and whether one grows.

    Args:
        about: The modes.
        directory: Where everything about them is.
    """
    found = about.modes
    sizes = ["rigid"] * found.rigid + [f"{f:.6g}" for f in found.frequencies[found.rigid :]]
    numbers = enumerate(zip(sizes, found.values, found.damping, strict=True), start=1)
    rows = [(str(k), size, f"{v.real:.4g}", f"{damping:.4g}") for k, (size, v, damping) in numbers]
    _print_columns(("mode", "frequency [Hz]", "growth [1/s]", "damping ratio"), rows)
    say(about.verdict)
    say(f"drift: {about.drift:.3g} of the scene's length")
    say(f"written to {directory}")


def print_modes(found: Modes, directory: Path, errors: Mapping[str, Any] | None = None) -> None:
    """Natural frequencies, and whether modes grow.

    Args:
        found: The modes.
        errors: Frequencies with their errors by "f1", "f2", ..., and results.
        directory: Where everything about them is.
    """
    others = {name: with_error(each.to_dict()) for name, each in (errors or {}).items()}
    columns = 3 if found.growth.any() else 2
    rows = []
    for k, (frequency, growth) in enumerate(zip(found.frequencies, found.growth, strict=True)):
        shown = others.pop(f"f{k + 1}", f"{frequency:.6g}")
        rows.append((str(k + 1), "rigid" if k < found.rigid else shown, f"{growth:.4g}")[:columns])
    _print_columns(("mode", "frequency [Hz]", "growth [1/s]")[:columns], rows)
    if found.rigid:
        say(f"rigid: motions that no support or spring resists, {found.rigid} of them")
    for name, each in others.items():
        say(f"{name}: {each}")
    _print_end(found.warnings, directory)


def print_mode_errors(summary: Mapping[str, Any]) -> None:
    """Natural frequencies and results of modes with their errors.

    Args:
        summary: The summary of the modes.
    """
    known, rigid = summary["errors"], summary["rigid_modes"]
    frequencies = known["modes"].items()
    rows = [(k[1:], "rigid" if int(k[1:]) <= rigid else with_error(v)) for k, v in frequencies]
    _print_columns(("mode", "frequency [Hz]"), rows)
    for name, value in summary["results"].items():
        say(f"{name}: {with_error(value)}")
    for remark in (*known["remarks"], *(f"warning: {w}" for w in summary["warnings"])):
        say(remark)


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
    _print_end(found.warnings, found.directory)


def print_buckling(found: BucklingModes, directory: Path) -> None:
    """Load factors of linear buckling.

    Args:
        found: The modes.
        directory: Where everything about them is.
    """
    rows = [(str(k), f"{factor:.6g}") for k, factor in enumerate(found.factors, start=1)]
    _print_columns(("mode", "load factor"), rows)
    if found.negative is not None:
        say(f"under the opposite load: {-found.negative:.6g}")
    _print_end(found.warnings, directory)


def _print_end(warnings: Iterable[str], directory: Path) -> None:
    for warning in warnings:
        say(f"warning: {warning}")
    say(f"written to {directory}")


def _print_columns(
    heads: Sequence[str], rows: Iterable[Sequence[str]], show_header: bool = True
) -> None:
    """Print a table whose cells are there already; the first column names the rows."""
    from shellmb.accuracy.measuring.tables import Column, console, print_table

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


def run_accurately(
    wanted: Requested, target: Target, directory: Path, *, quiet: bool, pictures: bool, check: bool
) -> Any:
    """Run levels of a scene until an error is met, and print what came of it.

    Args:
        wanted: The scene.
        target: The accuracy that is requested.
        directory: Directory to write; levels in it go on.
        quiet: Whether nothing is printed.
        pictures: Whether pictures are drawn.
        check: Whether the scene's reference values must be met.
    """
    from mpi4py import MPI

    # loaded before anything is said, as a signal in between must leave one line
    import shellmb.accuracy.request.directory  # noqa: F401

    how = {} if quiet else {"tell": tell}
    announce(wanted.scene.name, quiet)
    outcome = wanted.run_to_accuracy(target, directory, MPI.COMM_WORLD, pictures, **how)
    if not quiet:
        print_accuracy(directory)
    if check and wanted.module.check is not None:
        from shellmb.files.reading import read_json
        from shellmb.running.results import plain_results

        run_check(wanted.module.check, plain_results(read_json(directory / "summary.json")))
    return outcome


def print_accuracy(directory: Path) -> None:
    """The last run of a request, what accuracy costs, and why it ended.

    Args:
        directory: Its directory.
    """
    if not first_rank():
        return
    from shellmb.files.reading import read_json
    from shellmb.options.run import ACCURACY

    summary, about = read_json(directory / "summary.json"), read_json(directory / ACCURACY)
    if about["modes"]:
        print_mode_errors(summary)
    else:
        print_summary(summary)
    say(f"error of {about['quantity']}, processor time of the run:")
    for offer in about["offers"]:
        say(f"  {offer['says']}")
    say(about["says"])
    say(f"written to {directory}")
