"""The commands. What is heavy is imported only when a command needs it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from shellmb import __version__
from shellmb.cli.failures import App, failures_reported, first_rank, tell
from shellmb.cli.options import (
    CheckOption,
    OutOption,
    PictureOptions,
    PicturesOption,
    QuietOption,
    SceneArgument,
    SetOption,
    default_directory,
    of_checkout,
    offers,
    requested,
    without_types,
)
from shellmb.cli.report import announce, finish, print_list, print_numbers, say
from shellmb.cli.study import sensitivities, study
from shellmb.errors import SceneError
from shellmb.options.described import options_of, read, take
from shellmb.options.linear import LinearOptions, ModesOptions, ResponseOptions
from shellmb.options.run import ACCURACY, ELEMENTS, AccuracyOptions, Options, take_accuracy

EXAMPLES = """Examples:

- `shellmb list`: what is bundled, and where to start
- `shellmb run sudden_load --scheme ep4 --dt 5e-3 --out runs/first`: a run, and its directory
- `shellmb run my_scene.py --set thickness=1e-3 --mesh 16x4`: your own, with other parameters
- `shellmb report runs/first`: one page with everything about it
- `shellmb sensitivities sudden_load --by thickness,force`: what results depend on
- `shellmb study sudden_load --dt 2e-2,1e-2,5e-3 --scheme ep,ep4`: what accuracy costs
"""

# what a checkout has and an installation has not
OF_CHECKOUTS = {"bench": "python -m tests.bench", "figures": "python -m demos.paper"}


class Commands(TyperGroup):
    """The commands; the error for one that only a checkout has says where it is."""

    def get_params(self, ctx: Any) -> Any:
        """List the parameters."""
        return without_types(super().get_params(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command that arguments begin with."""
        if instead := OF_CHECKOUTS.get(args[0]):
            ctx.fail(f"'{args[0]}' is not installed; run `{instead}` in the folder of a checkout")
        return super().resolve_command(ctx, args)


app = App(
    cls=Commands,
    epilog=EXAMPLES,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)


def _version(value: bool) -> None:
    if value:
        say(f"shellmb {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Geometrically exact shells in flexible multibody dynamics.

    SCENE is the name of a bundled scene (see `shellmb list`) or the path of a Python file that
    defines a function `scene() -> Scene`. Every run leaves a directory with summary.json,
    history.csv, fields for ParaView, pictures, and the last good state.

    Exit codes: 0 success; 1 no convergence, a failed check, a full disk, or a function of the scene
    that fails; 2 an impossible scene or option; 128 and its number: stopped by a signal, 130 by
    Ctrl-C.
    """


@app.command(name="list")
@failures_reported
def list_scenes() -> None:
    """List the bundled scenes by their kinds, one line each."""
    from shellmb.running.loader import demos, kinds

    if first_rank():
        print_list(demos(), kinds())


@app.command()
@failures_reported
@offers(*options_of(Options), *options_of(AccuracyOptions))
def run(
    scene: SceneArgument,
    parameters: SetOption = None,
    out: OutOption = None,
    no_pictures: PicturesOption = False,
    quiet: QuietOption = False,
    check: CheckOption = False,
    **options: Any,
) -> Any:
    """Run a scene and write its results to a directory.

    Works under mpiexec: `mpiexec -n 2 shellmb run SCENE`.
    """
    # a scene that has them keeps them
    for name in ("end_forces", "errors"):
        options[name] = options[name] or None
    accuracy = take_accuracy(options)
    wanted = requested(scene, parameters, **options)
    built, module = wanted.scene, wanted.module
    if check:
        module.require_check(module.results or built.results, "results(run)")

    from mpi4py import MPI

    kind, world = built.scheme_name if accuracy is None else "accuracy", MPI.COMM_WORLD
    directory = world.bcast(out or default_directory(f"{module.name}-{kind}"))
    how = _reports(built.name, quiet, accuracy is not None)
    found = wanted.run(directory, world, not no_pictures, accuracy, **how)
    return finish(found, quiet=quiet, check=module.check if check else None)


@app.command()
@failures_reported
def resume(
    directory: Annotated[Path, typer.Argument(metavar="RUN_DIR", help="Directory of a run.")],
    scene: Annotated[
        str | None,
        typer.Argument(metavar="[SCENE]", help="File of the scene, if it is defined in one."),
    ] = None,
    trust: Annotated[
        bool, typer.Option("--trust", help="Execute the file that RUN_DIR names as its scene.")
    ] = False,
    no_pictures: PicturesOption = False,
    quiet: QuietOption = False,
) -> Any:
    """Continue a run from its last saved state.

    The scene is built again with the same options; it must be the same scene. The number of ranks
    may differ. A scene file is executed only if it is given here or trusted.
    """
    from shellmb.running.request import read_request

    # a bad scene says so before anything heavy is loaded
    built, _ = read_request(directory).trusted(scene, trust).build()
    from mpi4py import MPI

    from shellmb.api.runs import resumed

    how = _reports(built.name, quiet, (directory / ACCURACY).is_file())
    found = resumed(directory, scene, trust, MPI.COMM_WORLD, not no_pictures, **how)
    return finish(found, quiet=quiet)


@app.command()
@failures_reported
@offers(
    *options_of(ModesOptions),
    *options_of(Options, *ELEMENTS, "errors"),
    *options_of(AccuracyOptions),
)
def modes(
    scene: SceneArgument,
    count: Annotated[
        int | None, typer.Option(min=1, help="Number of modes; six at most if not given.")
    ] = None,
    parameters: SetOption = None,
    out: OutOption = None,
    no_pictures: PicturesOption = False,
    quiet: QuietOption = False,
    check: CheckOption = False,
    **elements: Any,
) -> Any:
    """Natural frequencies and modes of a scene, rigid-body modes included.

    --rate: complex modes about steady rotations, and their Campbell diagram:
    `shellmb modes campbell --rate 0,5,10,20`

    --state: complex modes about the state of a run, frozen in time; --at: about that of a time:
    `shellmb modes sudden_load --state runs/first --at 0.1`

    --buckling: load factors at which the linear solution under the loads becomes unstable:
    `shellmb modes lateral_plate --buckling`
    """
    chosen, accuracy = take(ModesOptions, elements), take_accuracy(elements)
    elements["errors"] = elements["errors"] or None
    # the scene may be that of a run, whose steps may be taken again
    run = Path(scene) if chosen.state is None and Path(scene).is_dir() else None
    of = run or (chosen.state if chosen.at is not None else None)
    if of is None:
        wanted = requested(scene, parameters, **elements)
    else:
        from shellmb.api.runs import Requested
        from shellmb.running.request import scene_of_run

        if parameters or any(elements[name] for name in ELEMENTS):
            raise SceneError(f"modes: {of} holds a run, which has its own mesh and parameters")
        wanted = Requested(*scene_of_run(of, "modes", None if run is not None else scene))
        chosen = replace(chosen, state=of)
    module = wanted.module
    chosen.check(accuracy is not None or bool(elements["errors"]))
    if check and (chosen.moving or chosen.buckling):
        raise SceneError("modes: --check is given with a state or --buckling; leave it out")
    if check:
        module.require_check(module.mode_results, "mode_results(modes)")

    from mpi4py import MPI

    from shellmb.api.modal import MOST, write_modes

    kind, world = "modes" if accuracy is None else "modes-accuracy", MPI.COMM_WORLD
    directory = world.bcast(out or default_directory(f"{module.name}-{kind}"))
    told = {} if accuracy is None else _reports(wanted.scene.name, quiet, True)
    found = write_modes(wanted, chosen, accuracy, count, directory, world, not no_pictures, **told)
    return finish(found, quiet=quiet, check=module.check if check else None, count=count or MOST)


@app.command()
@failures_reported
@offers(
    *options_of(ResponseOptions),
    *options_of(LinearOptions),
    *options_of(Options, *ELEMENTS, "errors"),
)
def response(
    scene: SceneArgument,
    parameters: SetOption = None,
    out: OutOption = None,
    no_pictures: PicturesOption = False,
    quiet: QuietOption = False,
    **options: Any,
) -> Any:
    """Response of a scene that is linearised: harmonic, random, and to spectra of shocks.

    From its loads to its probes, with its own damping:
    `shellmb response damped_plate --frequencies 1:50:200`

    --psd: to random loads or accelerations of ground:
    `shellmb response damped_plate --frequencies 1:500:50 --modes 6 --psd base.z=1e-2`
    """
    from shellmb.api.responding.linearise import response as respond
    from shellmb.running.request import parse_parameters

    given = {k: v for k, v in options.items() if v is not None and v is not False}
    directory = out or default_directory(f"{Path(scene).stem}-response")
    chosen = parse_parameters(parameters or [])
    found = respond(scene, directory, parameters=chosen, pictures=not no_pictures, **given)
    if not quiet:
        print_numbers(found.about, found.numbers, found.errors, directory)
    return found


def _of_checkout(name: str) -> None:
    """Add a command that only a checkout has; elsewhere it says so."""
    try:
        command, settings = getattr(of_checkout(f"shellmb {name}"), name), {}
    except SceneError:

        def command() -> None:
            """Say that it belongs to a checkout of shellmb."""
            of_checkout(f"shellmb {name}")

        settings = {"allow_extra_args": True, "ignore_unknown_options": True}
    app.command(name, context_settings=settings)(failures_reported(command))


_of_checkout("verify")


@app.command()
@failures_reported
def export(
    scene: SceneArgument,
    fmu: Annotated[bool, typer.Option("--fmu", help="Write an FMU for co-simulation.")] = False,
    fmi: Annotated[int, typer.Option(metavar="2|3", help="Version of FMI.")] = 2,
    parameters: SetOption = None,
    out: Annotated[Path | None, typer.Option(help="NAME.fmu, or a folder for it.")] = None,
) -> None:
    """Export a scene for other programs: as an FMU, which they step by its inputs and outputs."""
    from shellmb.exchange.export import export_fmu
    from shellmb.running.request import parse_parameters

    if not fmu:
        raise SceneError("export: the format is missing; it must be --fmu")
    given = parse_parameters(parameters or [])
    say(f"written {export_fmu(scene, out, version=fmi, parameters=given)}")


_of_checkout("effects")
app.command()(failures_reported(study))
app.command()(failures_reported(sensitivities))


def _reports(scene: str, quiet: bool, levels: bool) -> dict[str, Any]:
    """Say how a run goes: what is told of levels, and the observers of a run by itself."""
    # said when all is loaded, as a signal in between must leave one line
    how: dict[str, Any] = {"begin": partial(announce, scene, quiet)}
    if quiet:
        return how
    from shellmb.observers.progress import ProgressReport

    return how | ({"tell": tell} if levels else {"observers": [ProgressReport()]})


RunArgument = Annotated[
    Path, typer.Argument(metavar="RUN_DIR", help="Directory of a run, or of modes.")
]
SHOWN = ("field", "component", "t")
LOOK = ("camera", "theme", "enlarge", "axes")


@app.command()
@failures_reported
@offers(*options_of(PictureOptions))
def plot(
    directory: RunArgument,
    animation: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write an animation, .gif or .mp4.")
    ] = None,
    curves: Annotated[
        str, typer.Option("--format", help="Format of pictures of curves: png, svg or pdf.")
    ] = "png",
    out: Annotated[
        Path | None, typer.Option(help="Folder of the pictures; default: that of the run.")
    ] = None,
    **options: Any,
) -> None:
    """Draw the pictures of a run again, or with `--field` or `--t` only its shape.

    `shellmb plot runs/x --field N --component 11 --animation n11.mp4`
    """
    if not first_rank():
        return
    from shellmb.api.modeshapes import ModeShapes, RotatingModes
    from shellmb.api.record import Run
    from shellmb.api.runs import load
    from shellmb.show.pictures import draw_directory, save

    run = load(directory)
    folder = out or directory
    folder.mkdir(parents=True, exist_ok=True)
    if not isinstance(run, Run | ModeShapes | RotatingModes):
        run = run.run
    shown, look = _chosen(options)
    field, component, t = (shown[name] for name in SHOWN)
    if isinstance(run, Run) and field is None and t is None and animation is None:
        made = run.draw(out, curves, **look)
    elif isinstance(run, RotatingModes):
        made = draw_directory(directory, out, curves=curves)
    elif isinstance(run, ModeShapes):
        made = [save(run.picture(), folder / "modes.png")]
    else:
        picture = run.picture(**shown, **look)
        made = [save(picture, folder / f"{field or 'shape'}.png")]
        if animation is not None:
            made.append(run.animate(animation, field, component, **look))
    for file in made:
        say(f"written: {file}")


@app.command()
@failures_reported
@offers(*options_of(PictureOptions, *SHOWN, *LOOK))
def view(directory: RunArgument, **options: Any) -> None:
    """Show the deformed shape in an interactive 3-D window."""
    if not first_rank():
        return
    shown, look = _chosen(options)
    _run(directory, "view").view(**shown, **look)


@app.command()
@failures_reported
def report(
    directory: RunArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="File of the page; default: report.html in the run directory."
        ),
    ] = None,
) -> None:
    """Write one self-contained HTML page with everything about a run."""
    if not first_rank():
        return
    say(f"written: {_run(directory, 'report').report(out)}")


def _chosen(options: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Tell apart what a picture shows, and how it looks as far as that is given."""
    given = read(PictureOptions, options)
    shown = {name: given.pop(name) for name in SHOWN}
    return shown, {name: value for name, value in given.items() if value is not None}


def _run(directory: Path, command: str):  # type: ignore[no-untyped-def]
    from shellmb.api.record import Run
    from shellmb.api.runs import load

    found = load(directory)
    if not isinstance(found, Run):
        raise SceneError(f"{command}: {directory} has modes; `shellmb plot {directory}` draws them")
    return found
