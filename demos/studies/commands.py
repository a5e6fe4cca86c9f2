"""Commands that only a checkout has: `shellmb verify`, `effects`, and `study --bundled`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from shellmb.cli.failures import first_rank
from shellmb.cli.options import JsonOption, SceneArgument, SetOption, offers, requested
from shellmb.cli.report import print_list
from shellmb.options.described import options_of
from shellmb.options.run import ELEMENTS, Options

if TYPE_CHECKING:
    from shellmb.accuracy.studies.report import Finding
    from shellmb.cli.study import Done


def verify(
    json: JsonOption = False,
    case: Annotated[
        str | None,
        typer.Option(metavar="PATTERN", help="Run only the cases whose name contains this."),
    ] = None,
    slow: Annotated[
        bool, typer.Option("--slow", help="Also run the cases that take minutes.")
    ] = False,
) -> None:
    """Compare results with analytic, published and independent values; from a checkout."""
    from shellmb.demos.verification.report import run_verification

    if not run_verification(case, slow, json):
        raise typer.Exit(1)


@offers(*options_of(Options, "scheme", "alpha", "dt", "t_end", *ELEMENTS))
def effects(
    scene: SceneArgument,
    without: Annotated[
        list[str] | None,
        typer.Option(metavar="EFFECT[:PART]", help="Run again without it; may be repeated."),
    ] = None,
    with_: Annotated[
        list[str] | None,
        typer.Option("--with", metavar="EFFECT[:PART]", help="Run again with it."),
    ] = None,
    parameters: SetOption = None,
    steps: Annotated[int, typer.Option(min=1, help="Steps per round of the table.")] = 10,
    repeat: Annotated[
        int | None,
        typer.Option(
            min=1, help="Rounds of the table (default 3), or of compared runs (default 1)."
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="List effects and reasons only; build nothing.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    **options: Any,
) -> None:
    """Show which effects a scene simulates, omits, why, and what each costs; from a checkout.

    With `--without` or `--with` the scene is run as it is and with that changed: the change of its
    results beside that of its time. PART is one body, joint or element: `--without stretching:arm`.
    Costs are differences to the scene without the effect; times are medians of rounds in turn.
    """
    from shellmb.demos.effects.command import tell_comparison, tell_survey

    wanted = requested(scene, parameters, **options)
    said = {"without": without or [], "with": with_ or []}
    if without or with_:
        tell_comparison(wanted.scene, said, wanted.module.results, repeat or 1, json)
    else:
        tell_survey(wanted.scene, 0 if quick else steps, repeat or 3, json)


def run_bundled(
    name: str, repeat: int | None, clock: str, out: Path | None, quiet: bool
) -> list[Done]:
    """Run bundled studies, or list them.

    Args:
        name: Name of one, `all`, or `list`.
        repeat: Rounds; None: those of each study.
        clock: As of `shellmb study`.
        out: Folder of the records; None: the usual one.
        quiet: Whether runs are not reported.
    """
    from shellmb.cli.study import run_study
    from shellmb.demos.studies.bundled import BUNDLED, find_bundled

    if name == "list":
        if first_rank():
            whats = {study.name: study.what for study in BUNDLED}
            print_list(whats, {"studies": list(whats)})
        return []
    done = []
    for item in find_bundled(name):
        folder = (out or Path("runs", "studies")) / item.name
        findings: list[Finding] = []
        for k, part in enumerate(item.parts):
            sweep = part.sweep if repeat is None else replace(part.sweep, repeat=repeat)
            place = folder / str(k + 1) if len(item.parts) > 1 else folder
            findings += run_study(part.title, sweep, place, clock, quiet)
        done.append((item.name, folder, findings))
    return done
