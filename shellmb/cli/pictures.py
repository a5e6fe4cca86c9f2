"""The commands `shellmb plot`, `shellmb view` and `shellmb report`: a run that is there, shown."""

from pathlib import Path
from typing import Annotated, Any

import typer

from shellmb.cli.failures import first_rank
from shellmb.cli.options import offers
from shellmb.cli.report import say
from shellmb.errors import SceneError
from shellmb.options.described import options_of, read
from shellmb.options.pictures import PictureOptions

RunArgument = Annotated[
    Path, typer.Argument(metavar="RUN_DIR", help="Directory of a run, or of modes.")
]
SHOWN = ("field", "component", "t")
LOOK = ("camera", "theme", "enlarge", "axes")


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
    from shellmb.api.modeshapes import CAMPBELL, ModeShapes, RotatingModes
    from shellmb.api.record import Run
    from shellmb.api.runs import load
    from shellmb.show.pictures import save

    run = load(directory)
    folder = out or directory
    if not isinstance(run, Run | ModeShapes | RotatingModes):
        run = run.run
    shown, look = _chosen(options)
    field, component, t = (shown[name] for name in SHOWN)
    if isinstance(run, Run) and field is None and t is None and animation is None:
        for file in run.draw(out, curves, **look):
            say(f"written: {file}")
        return
    folder.mkdir(parents=True, exist_ok=True)
    if isinstance(run, RotatingModes):
        from shellmb.show.campbell import draw_campbell

        file = draw_campbell(directory / CAMPBELL, folder / "campbell.png")
    elif isinstance(run, ModeShapes):
        file = save(run.picture(), folder / "modes.png")
    else:
        picture = run.picture(**shown, **look)
        file = save(picture, folder / f"{field or 'shape'}.png")
    say(f"written: {file}")
    if animation is not None and isinstance(run, Run):
        say(f"written: {run.animate(animation, field, component, **look)}")


@offers(*options_of(PictureOptions, *SHOWN, *LOOK))
def view(directory: RunArgument, **options: Any) -> None:
    """Show the deformed shape in an interactive 3-D window."""
    if not first_rank():
        return
    shown, look = _chosen(options)
    _run(directory, "view").view(**shown, **look)


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
        raise SceneError(
            f"{command}: {directory} holds modes; `shellmb plot {directory}` draws them"
        )
    return found
