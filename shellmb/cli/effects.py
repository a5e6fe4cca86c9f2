"""The command `shellmb effects`."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from shellmb.cli.failures import first_rank
from shellmb.run.request import Options, Request, parse_mesh, parse_parameters


def effects(
    scene: Annotated[
        str,
        typer.Argument(metavar="SCENE", help="Name of a bundled scene, or path of a Python file."),
    ],
    without: Annotated[
        list[str] | None,
        typer.Option(metavar="EFFECT[:PART]", help="Run again without it; may be repeated."),
    ] = None,
    with_: Annotated[
        list[str] | None,
        typer.Option("--with", metavar="EFFECT[:PART]", help="Run again with it."),
    ] = None,
    scheme: Annotated[str | None, typer.Option(help="Time scheme, or statics.")] = None,
    alpha: Annotated[float | None, typer.Option(help="Dissipation of ED, from 0 to 1.")] = None,
    dt: Annotated[float | None, typer.Option(help="Time or load step [s].")] = None,
    t_end: Annotated[float | None, typer.Option(help="Time at the end [s].")] = None,
    mesh: Annotated[
        str | None, typer.Option(metavar="NxM", help="Elements of every shell along its sides.")
    ] = None,
    degree: Annotated[int | None, typer.Option(min=2, max=3, help="Degree of elements.")] = None,
    cell: Annotated[str | None, typer.Option(help="quad or tri.")] = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Parameter of the scene."),
    ] = None,
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
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    options = {
        "scheme": scheme,
        "alpha": alpha,
        "dt": dt,
        "t_end": t_end,
        "mesh": None if mesh is None else parse_mesh(mesh),
        "degree": degree,
        "cell": cell,
    }
    given = Options(**{k: v for k, v in options.items() if v is not None})  # type: ignore[arg-type]
    built, module = Request(scene, parse_parameters(parameters or []), given).build()
    said = {"without": without or [], "with": with_ or []}

    from shellmb.effects.registry import changed

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
    """What is going on, beside what is printed."""
    if first_rank():
        print(f"effects: {text}", file=sys.stderr, flush=True)
