"""The command `shellmb run --accuracy`, and its output."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.cli.failures import first_rank, run_check, tell
from shellmb.cli.report import announce, print_mode_errors, print_summary, say

if TYPE_CHECKING:
    from shellmb.accuracy.request.target import Target
    from shellmb.running.loader import SceneModule
    from shellmb.running.request import Request
    from shellmb.scene import Scene


def run_accurately(
    scene: Scene,
    module: SceneModule,
    request: Request,
    wanted: Target,
    directory: Path,
    *,
    quiet: bool,
    pictures: bool,
    check: bool,
) -> Any:
    """Run levels of a scene until an error is met, and print what came of it.

    Args:
        scene: The scene.
        module: What defines it.
        request: How it was requested.
        wanted: The accuracy that is requested.
        directory: Directory to write; levels in it go on.
        quiet: Whether nothing is printed.
        pictures: Whether pictures are drawn.
        check: Whether the scene's reference values must be met.
    """
    from mpi4py import MPI

    from shellmb.accuracy.request.directory import run_to_accuracy
    from shellmb.accuracy.request.search import Running

    how = Running(MPI.COMM_WORLD, module.results, request, mode_results=module.mode_results)
    if not quiet:
        how = replace(how, tell=tell)
    announce(scene.name, quiet)
    outcome = run_to_accuracy(scene, wanted, directory, how, pictures)
    if not quiet:
        print_accuracy(directory)
    if check and module.check is not None:
        from shellmb.files.reading import read_json
        from shellmb.running.results import plain_results

        run_check(module.check, plain_results(read_json(directory / "summary.json")))
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
