"""The commands that run a scene many times: `shellmb study` and `sensitivities`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from shellmb.cli.failures import first_rank, tell
from shellmb.cli.options import (
    Clock,
    JsonOption,
    PicturesOption,
    QuietOption,
    SceneArgument,
    SetOption,
    default_directory,
    of_checkout,
    offers,
)
from shellmb.cli.report import announce, print_sensitivities, say
from shellmb.errors import SceneError
from shellmb.options.described import Option, options_of
from shellmb.options.run import Options, StudyOptions

if TYPE_CHECKING:
    from shellmb.accuracy.studies.report import Finding
    from shellmb.accuracy.studies.sweep import Sweep

    # name of its files, folder, what was found
    type Done = tuple[str, Path, list[Finding]]


AXES = options_of(StudyOptions)
SCENES = options_of(Options, "body", "t_end")


@offers(*AXES, *SCENES)
def study(
    scene: Annotated[
        str | None,
        typer.Argument(
            metavar="[SCENE]", help="Name of a bundled scene, or path of a Python file."
        ),
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A result of the scene, or COLUMN:NORM of its history with the norm end, max, "
            "min, mean, l2 or sup; may be repeated; default: the first probe.",
        ),
    ] = None,
    parameters: SetOption = None,
    clock: Annotated[Clock, typer.Option(help="Measure wall or processor times.")] = "wall",
    bundled: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="A bundled study of a checkout, `all`, or `list`."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of records, tables and picture; a study in it continues."),
    ] = None,
    json: JsonOption = False,
    no_pictures: PicturesOption = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Do not report each run.")] = False,
    **options: Any,
) -> None:
    """Measure what accuracy costs: error against time for all combinations of the given options.

    Without options, mesh and step are half, all and twice the scene's own, in one round; elements
    of meshes that are read from files are divided. An option with commas is a list. Each run is
    recorded in `--out` (default: runs/study-SCENE), where a stopped study continues. Times are
    medians over the rounds and exclude the set-up.
    """
    from shellmb.accuracy.studies.sweep import sweep_of
    from shellmb.running.request import parse_parameters

    for one in AXES:
        if one.about.many and options[one.name] is not None:
            options[one.name] = _values(one, options[one.name])
    given = ["quantity"] * bool(quantity) + ["set"] * bool(parameters)
    named = (one for one in (*AXES, *SCENES) if one.name != "repeat")
    given += [one.flag.removeprefix("--") for one in named if options[one.name] is not None]
    if bundled is not None or scene is None:
        _refuse(scene, bundled, given)
        studies = of_checkout("shellmb study --bundled")
        done = studies.run_bundled(bundled or "list", options["repeat"], clock, out, quiet)
        _finish(done, json, not no_pictures)
        return
    sweep = sweep_of(scene, parse_parameters(parameters or []), quantity or [], **options)
    folder = out or Path("runs", f"study-{Path(scene).stem}")
    found = run_study("", sweep, folder, clock, quiet)
    _finish([("study", folder, found)], json, not no_pictures)


def _refuse(scene: str | None, bundled: str | None, given: list[str]) -> None:
    """Say what does not go together."""
    if bundled is None and given:
        raise SceneError(
            f"study: scene is missing; it must be named where {', '.join(given)} is given"
        )
    if bundled is not None and (scene is not None or given):
        named = ", ".join([*([] if scene is None else ["a scene"]), *given])
        raise SceneError(f"study: bundled is '{bundled}'; beside it {named} must be left out")


def run_study(title: str, sweep: Sweep, folder: Path, clock: str, quiet: bool) -> list[Finding]:
    """Run a study.

    Args:
        title: What is said of each run; empty: the name of the scene.
        sweep: The study.
        folder: Folder of its records.
        clock: As of `shellmb study`.
        quiet: Whether runs are not reported.
    """
    from shellmb.accuracy.studies.report import evaluate
    from shellmb.accuracy.studies.runner import measure

    def report(text: str) -> None:
        if not quiet:
            tell(f"{title or sweep.base.scene}: {text}")

    try:
        measured = measure(sweep, folder, report)
    except KeyboardInterrupt:
        tell(f"stopped; the same command continues in {folder}")
        raise
    return evaluate(measured, clock, title)


def _finish(done: list[Done], as_json: bool, pictures: bool) -> None:
    """Print and write what was found, on the first rank."""
    if not first_rank() or not done:
        return
    from shellmb.accuracy.measuring import console, to_json, write
    from shellmb.accuracy.studies.picture import draw
    from shellmb.accuracy.studies.report import print_finding

    to = console(160)
    for name, folder, findings in done:
        drawn = partial(draw, [(f.title, f.judged) for f in findings])
        write(name, to_json(findings), drawn if pictures else None, folder)
        if not as_json:
            for finding in findings:
                print_finding(finding, to)
            say(f"written to {folder}")
    if as_json:
        say(to_json([f for _, _, findings in done for f in findings]))


def _values(option: Option, text: str) -> tuple[Any, ...]:
    """Values of an option from a text with commas."""
    try:
        return tuple(dict.fromkeys(option.value(part.strip()) for part in text.split(",")))
    except ValueError:
        raise SceneError(
            f"study: {option.flag.removeprefix('--')} is '{text}'; it must be values of its kind "
            "with commas between them"
        ) from None


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
        Literal["length", "load"],
        typer.Option(help="Derivatives along a static path at the same 'length' or 'load'."),
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
    try:
        return float(text)
    except ValueError:
        raise SceneError(f"--scale gives {name} the size '{text}'; it must be a number") from None
