"""The command `shellmb run --accuracy`, and its output."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.cli.failures import first_rank, run_check, tell
from shellmb.cli.report import announce, print_mode_errors, print_summary, say

if TYPE_CHECKING:
    from shellmb.accuracy.request.target import Target
    from shellmb.api.resolve_scene import Requested


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
    from shellmb.options.accuracy import ACCURACY

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
