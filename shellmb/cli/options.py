"""Options that several commands have, and the request that they make together."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from shellmb.errors import SceneError

if TYPE_CHECKING:
    from shellmb.running.loader import SceneModule
    from shellmb.running.request import Request
    from shellmb.scene import Scene


class Scheme(StrEnum):
    """Time schemes that the command line knows."""

    static = "static"
    linear = "linear"
    linear_dynamics = "linear-dynamics"
    ep = "ep"
    ed = "ed"
    ep4 = "ep4"
    ed3 = "ed3"
    generalized_alpha = "generalized-alpha"
    ed_printed = "ed-printed"


class Cell(StrEnum):
    """Cell types."""

    quad = "quad"
    tri = "tri"


class Solve(StrEnum):
    """Which unknowns the linear systems have."""

    reduced = "reduced"
    full = "full"


class Clock(StrEnum):
    """What is measured in."""

    cpu = "cpu"
    wall = "wall"


class Newton(StrEnum):
    """When Newton's method factorises."""

    auto = "auto"
    modified = "modified"
    full = "full"


class Backend(StrEnum):
    """Whose Newton solver."""

    newton = "newton"
    snes = "snes"


SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a bundled scene, or path of a Python file.")
]
OutOption = Annotated[
    Path | None, typer.Option(help="Run directory; runs/SCENE-SCHEME-TIME if left out.")
]
CheckOption = Annotated[
    bool, typer.Option("--check", help="Fail unless the scene's reference values are met.")
]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
AlphaOption = Annotated[
    float | None, typer.Option(help="Dissipation of schemes that have one, from 0 to 1.")
]
StepOption = Annotated[float | None, typer.Option(help="Time or load step [s].")]
ToleranceOption = Annotated[
    float | None,
    typer.Option(
        help="Error of a step, relative to the size of bodies, by which steps are chosen; the "
        "step is the first one then. A step without it is fixed."
    ),
]
EndOption = Annotated[float | None, typer.Option(help="Time at the end [s].")]
MeshOption = Annotated[
    str | None, typer.Option(metavar="NxM", help="Elements of every shell along its two sides.")
]
DegreeOption = Annotated[int | None, typer.Option(min=2, max=3, help="Degree of the elements.")]
CellOption = Annotated[Cell | None, typer.Option(help="Quadrilaterals or triangles.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Parameter of the scene; may be repeated."),
]
PicturesOption = Annotated[bool, typer.Option("--no-pictures", help="Draw no pictures.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print a JSON list.")]


def asked(scene: str, parameters: list[str] | None, **options: Any) -> Request:
    """What a command line asks for.

    Args:
        scene: Name of a bundled scene, or path of a Python file.
        parameters: Values of the scene's parameters, each as "name=value".
        options: Of `Options`, as they were given, the mesh as "NxM"; None: not given.

    Raises:
        SceneError: If a mesh or a parameter is not of its form.
    """
    from shellmb.running.request import Options, Request, parse_mesh, parse_parameters

    if options.get("mesh") is not None:
        options["mesh"] = parse_mesh(options["mesh"])
    # as they are stored: plain values
    plain: dict[str, Any] = {
        k: v.value if isinstance(v, StrEnum) else v for k, v in options.items()
    }
    return Request(scene, parse_parameters(parameters or []), Options(**plain))


def asked_of_run(
    scene: str,
    state: Path | None,
    again: bool,
    parameters: list[str] | None,
    elements: dict[str, Any],
) -> tuple[Scene, SceneModule, Path | None]:
    """A scene that may be that of a run, and the run's directory.

    Args:
        scene: Name of a scene or its file, or the run directory of a bundled scene.
        state: Run directory of the scene.
        again: Whether the run's steps are taken again, for which the scene is the run's own.
        parameters: As of `asked`.
        elements: Options of the mesh.

    Raises:
        SceneError: If what a run has of its own is given, too, or there is no such run.
    """
    run = Path(scene) if state is None and Path(scene).is_dir() else None
    given = run or (state if again else None)
    if given is None:
        return *asked(scene, parameters, **elements).build(), state
    from shellmb.running.request import scene_of_run

    if parameters or any(elements.values()):
        raise SceneError(f"modes: {given} holds a run, which has its own mesh and parameters")
    return *scene_of_run(given, "modes", None if run is not None else scene), given


def numbers(option: str, text: str | None) -> list[float] | None:
    """Numbers separated by commas; None where there is no text.

    Args:
        option: Name of the option.
        text: What is given for it.

    Raises:
        SceneError: If they are none.
    """
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise SceneError(f"--{option} is {text!r}; it must be numbers as 0,5,10") from None


def default_directory(name: str) -> Path:
    """A new directory name for a run.

    Args:
        name: What is run.
    """
    return Path("runs", f"{name}-{datetime.now():%Y%m%d-%H%M%S}")
