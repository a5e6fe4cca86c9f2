"""The command `shellmb sensitivities`."""

from pathlib import Path
from typing import Annotated, Any

import typer

from shellmb.cli.failures import first_rank
from shellmb.cli.options import QuietOption, SceneArgument, SetOption, default_directory, offers
from shellmb.cli.report import announce, print_sensitivities
from shellmb.options.described import options_of
from shellmb.options.run import Options


@offers(*options_of(Options))
def sensitivities(
    scene: SceneArgument,
    by: Annotated[
        str, typer.Option(metavar="NAMES", help="Parameters of the scene, separated by commas.")
    ],
    parameters: SetOption = None,
    scales: Annotated[
        list[str] | None,
        typer.Option(
            "--scale",
            metavar="NAME=VALUE",
            help="Size of a parameter that is zero or small; may be repeated.",
        ),
    ] = None,
    probes: Annotated[
        bool, typer.Option("--probes", help="Derivatives of probes only, which costs less.")
    ] = False,
    no_fields: Annotated[
        bool, typer.Option("--no-fields", help="Omit derivatives of fields.")
    ] = False,
    at: Annotated[
        str, typer.Option(help="Derivatives along a static path at the same 'length' or 'load'.")
    ] = "length",
    out: Annotated[
        Path | None, typer.Option(help="Directory; default: runs/SCENE-sensitivities-TIME.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on in the directory, where this run was stopped.")
    ] = False,
    quiet: QuietOption = False,
    **options: Any,
) -> None:
    """Run a scene and differentiate its histories, results and fields by parameters.

    Writes the run, and the derivatives of its history and results as CSV files.
    `shellmb.load` reads all of it.
    """
    from shellmb.api.sensitivity.run import sensitivities as run
    from shellmb.running.request import parse_parameters

    options["end_forces"] = options["end_forces"] or None
    sizes = parse_parameters(scales or [], "--scale")
    from mpi4py import MPI

    folder = out or default_directory(f"{Path(scene).stem}-sensitivities")
    announce(scene, quiet)
    found = run(
        scene,
        tuple(name.strip() for name in by.split(",") if name.strip()),
        MPI.COMM_WORLD.bcast(folder),
        values=parse_parameters(parameters or []),
        scales={name: _number(name, text) for name, text in sizes.items()},
        columns="probes" if probes else "all",
        fields=not no_fields,
        at=at,
        resume=resume,
        **options,
    )
    if not quiet and first_rank():
        print_sensitivities(found)


def _number(name: str, text: str) -> float:
    from shellmb.errors import SceneError

    try:
        return float(text)
    except ValueError:
        raise SceneError(f"--scale gives {name} the size '{text}'; it must be a number") from None
