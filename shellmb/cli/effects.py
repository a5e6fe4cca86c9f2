"""The command `shellmb effects`."""

from typing import Annotated, Any

import typer

from shellmb.cli.checkout import of_checkout
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
    """Show which effects a scene simulates, omits, why, and what each costs; from a checkout.

    With `--without` or `--with` the scene is run as it is and with that changed: the change of its
    results beside that of its time. PART is one body, joint or element: `--without stretching:arm`.
    Costs are differences to the scene without the effect; times are medians of rounds in turn.
    """
    report = of_checkout("effects.command", "shellmb effects")
    wanted = requested(scene, parameters, **options)
    said = {"without": without or [], "with": with_ or []}
    if without or with_:
        report.tell_comparison(wanted.scene, said, wanted.module.results, repeat or 1, json)
    else:
        report.tell_survey(wanted.scene, 0 if quick else steps, repeat or 3, json)
