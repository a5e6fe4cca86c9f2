"""The command `shellmb export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shellmb.cli.options import SceneArgument, SetOption
from shellmb.cli.report import say
from shellmb.errors import SceneError


def export(
    scene: SceneArgument,
    fmu: Annotated[
        bool, typer.Option("--fmu", help="Write a functional mock-up unit for co-simulation.")
    ] = False,
    fmi: Annotated[int, typer.Option(metavar="2|3", help="Version of FMI.")] = 2,
    parameters: SetOption = None,
    out: Annotated[
        Path | None, typer.Option(help="File NAME.fmu, or its folder; default: the present one.")
    ] = None,
) -> Path:
    """Export a scene for other programs: as an FMU, which they step by its inputs and outputs."""
    if not fmu:
        raise SceneError("export: the format is missing; it must be --fmu")
    from shellmb.exchange.export import export_fmu
    from shellmb.running.request import parse_parameters

    made = export_fmu(scene, out, version=fmi, parameters=parse_parameters(parameters or []))
    say(f"written {made}")
    return made
