"""The commands `shellmb plot`, `shellmb view` and `shellmb report`: a run that is there, shown."""

from pathlib import Path
from typing import Annotated, Any

import typer

from shellmb.cli.failures import first_rank
from shellmb.cli.report import say
from shellmb.errors import SceneError

RunArgument = Annotated[
    Path, typer.Argument(metavar="RUN_DIR", help="Directory of a run, or of modes.")
]
FieldOption = Annotated[
    str | None,
    typer.Option(help="Field that the colours show: N, force, velocity, deformation, ..."),
]
ComponentOption = Annotated[
    str | None, typer.Option(help="Component of the field, such as 11, z or norm (magnitude).")
]
CameraOption = Annotated[
    str | None,
    typer.Option(
        metavar="ELEVATION,AZIMUTH", help="Direction towards the eye, degrees, such as 30,-60."
    ),
]
ThemeOption = Annotated[str | None, typer.Option(help="Background: light (default) or dark.")]
EnlargeOption = Annotated[
    float | None, typer.Option(help="Factor by which displacements are shown.")
]
AxesOption = Annotated[
    bool, typer.Option("--axes", help="Draw a box of axes with numbers and units.")
]
TimeOption = Annotated[float | None, typer.Option("--t", help="Time; default: the last state.")]


def plot(
    directory: RunArgument,
    field: FieldOption = None,
    component: ComponentOption = None,
    t: TimeOption = None,
    animation: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write an animation, .gif or .mp4.")
    ] = None,
    curves: Annotated[
        str, typer.Option("--format", help="Format of pictures of curves: png, svg or pdf.")
    ] = "png",
    camera: CameraOption = None,
    width: Annotated[int | None, typer.Option(help="Width of pictures in space, pixels.")] = None,
    theme: ThemeOption = None,
    enlarge: EnlargeOption = None,
    axes: AxesOption = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the pictures; default: that of the run.")
    ] = None,
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
    look = _appearance(camera, theme, enlarge, axes, width)
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
        shown = run.picture(t, field, component, **look)
        file = save(shown, folder / f"{field or 'shape'}.png")
    say(f"written: {file}")
    if animation is not None and isinstance(run, Run):
        say(f"written: {run.animate(animation, field, component, **look)}")


def view(
    directory: RunArgument,
    field: FieldOption = None,
    component: ComponentOption = None,
    t: TimeOption = None,
    camera: CameraOption = None,
    theme: ThemeOption = None,
    enlarge: EnlargeOption = None,
    axes: AxesOption = False,
) -> None:
    """Show the deformed shape in an interactive 3-D window."""
    if not first_rank():
        return
    look = _appearance(camera, theme, enlarge, axes)
    _run(directory, "view").view(t, field, component, **look)


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


def _appearance(
    camera: str | None,
    theme: str | None,
    enlarge: float | None,
    axes: bool,
    width: int | None = None,
) -> dict[str, Any]:
    """Collect what is given of how pictures look."""
    given: dict[str, Any] = {"theme": theme, "enlarge": enlarge, "width": width}
    if camera is not None:
        try:
            given["camera"] = tuple(float(angle) for angle in camera.split(","))
        except ValueError:
            given["camera"] = camera
    return {k: v for k, v in given.items() if v is not None} | {"axes": axes}


def _run(directory: Path, command: str):  # type: ignore[no-untyped-def]
    from shellmb.api.record import Run
    from shellmb.api.runs import load

    found = load(directory)
    if not isinstance(found, Run):
        raise SceneError(
            f"{command}: {directory} holds modes; `shellmb plot {directory}` draws them"
        )
    return found
