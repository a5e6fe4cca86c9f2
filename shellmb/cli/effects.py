"""The command `shellmb effects`."""

from __future__ import annotations

from typing import Annotated

import typer

from shellmb.cli.failures import first_rank, tell
from shellmb.cli.options import (
    AlphaOption,
    DegreeOption,
    EndOption,
    MeshOption,
    SceneArgument,
    SetOption,
    StepOption,
    asked,
)


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
    # scheme and cell are text: what is wrong with them the scene says, in a sentence of its own
    scheme: Annotated[str | None, typer.Option(help="Time scheme, or statics.")] = None,
    alpha: AlphaOption = None,
    dt: StepOption = None,
    t_end: EndOption = None,
    mesh: MeshOption = None,
    degree: DegreeOption = None,
    cell: Annotated[str | None, typer.Option(help="quad or tri.")] = None,
    parameters: SetOption = None,
    steps: Annotated[int, typer.Option(min=1, help="Steps of a round of the table.")] = 10,
    repeat: Annotated[
        int | None, typer.Option(min=1, help="Rounds of the table (3), runs compared (1).")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Only what is there and why: nothing is built.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Show what a scene simulates and what it leaves out, why, and what each effect costs.

    With `--without` or `--with` the scene is run as it is and with that changed: the change of its
    results beside that of its time. PART is one body, joint or element: `--without stretching:arm`.
    Costs are differences to the scene without the effect; times are medians of rounds in turn.
    """
    times = {"scheme": scheme, "alpha": alpha, "dt": dt, "t_end": t_end}
    elements = {"mesh": mesh, "degree": degree, "cell": cell}
    built, module = asked(scene, parameters, **times, **elements).build()
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
