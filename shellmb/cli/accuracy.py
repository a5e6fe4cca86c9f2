"""The command `shellmb run --accuracy`, and its output."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.cli.failures import first_rank, run_check, tell
from shellmb.cli.report import announced, print_summary, say

if TYPE_CHECKING:
    from shellmb.options.accuracy import Asked
    from shellmb.running.loader import SceneModule
    from shellmb.running.request import Request
    from shellmb.scene import Scene


def run_accurately(
    scene: Scene,
    module: SceneModule,
    request: Request,
    asked: Asked,
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
        request: How it was asked for.
        asked: The accuracy that is asked for.
        directory: Directory to write; levels in it go on.
        quiet: Whether nothing is printed.
        pictures: Whether pictures are drawn.
        check: Whether the scene's reference values must be met.
    """
    from mpi4py import MPI

    from shellmb.accuracy.request.place import run_to_accuracy
    from shellmb.accuracy.request.search import Running
    from shellmb.accuracy.request.wanted import wanted_of

    how = Running(MPI.COMM_WORLD, module.results, request, tell=_silent if quiet else tell)
    with announced(scene.name, quiet):
        outcome = run_to_accuracy(scene, wanted_of(asked), directory, how, pictures)
    if not quiet:
        print_accuracy(directory)
    if check and module.check is not None and outcome.run is not None:
        run_check(module.check, outcome.run.results)
    return outcome


def print_accuracy(directory: Path) -> None:
    """The last run of a request, what accuracy costs, and why it ended.

    Args:
        directory: Its directory.
    """
    if not first_rank():
        return
    from shellmb.guarding.reading import read_json
    from shellmb.options.accuracy import ACCURACY

    summary, about = read_json(directory / "summary.json"), read_json(directory / ACCURACY)
    print_summary(summary)
    say(f"error of {about['quantity']}, processor time of the run:")
    for offer in about["offers"]:
        say(f"  {offer['says']}")
    say(about["says"])
    say(f"written to {directory}")


def _silent(text: str) -> None:
    pass
