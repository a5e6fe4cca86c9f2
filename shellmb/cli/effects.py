"""The command `shellmb effects`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from shellmb.cli.failures import first_rank, tell
from shellmb.cli.options import SceneArgument, SetOption, offers, requested
from shellmb.options.described import options_of
from shellmb.options.run import ELEMENTS, Options


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
    """Show which effects a scene simulates, which it omits, why, and what each costs.

    With `--without` or `--with` the scene is run as it is and with that changed: the change of its
    results beside that of its time. PART is one body, joint or element: `--without stretching:arm`.
    Costs are differences to the scene without the effect; times are medians of rounds in turn.
    """
    built, module = requested(scene, parameters, **options).build()
    said = {"without": without or [], "with": with_ or []}

    from shellmb.effects.catalogue.registry import changed

    if without or with_:
        other = changed(built, said["without"], said["with"])

        from shellmb.effects.compare import compare
        from shellmb.effects.report import comparison_json, print_comparison

        compared = compare(built, other, module.results, repeat or 1, _report)
        if first_rank() and json:
            print(comparison_json(built.name, said, compared))
        elif first_rank():
            print_comparison(built.name, said, compared)
        return

    from shellmb.effects.report import print_survey, survey_json
    from shellmb.effects.survey import survey

    found = survey(built, 0 if quick else steps, repeat or 3, _report)
    if first_rank() and json:
        print(survey_json(built.name, found))
    elif first_rank():
        print_survey(built.name, found)


def _report(text: str) -> None:
    tell(f"effects: {text}")
