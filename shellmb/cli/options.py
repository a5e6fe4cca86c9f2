"""Options that several commands have, and the request that they make together."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.core import TyperCommand

from shellmb.errors import SceneError
from shellmb.options.described import Option, option, options_of
from shellmb.options.linear import numbers
from shellmb.options.run import Options

if TYPE_CHECKING:
    from shellmb.api.runs import Requested

# of the measured times
Clock = Literal["cpu", "wall"]
SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a bundled scene, or path of a Python file.")
]
OutOption = Annotated[
    Path | None, typer.Option(help="Run directory; default: runs/SCENE-SCHEME-TIME.")
]
CheckOption = Annotated[
    bool, typer.Option("--check", help="Fail unless results match the scene's reference values.")
]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="NAME=VALUE", help="Set a parameter of the scene; may be repeated."
    ),
]
PicturesOption = Annotated[bool, typer.Option("--no-pictures", help="Do not draw pictures.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print a JSON list.")]


@dataclass(frozen=True)
class PictureOptions:
    """Choices of a picture of a run; from Python they are arguments of `Run.picture`."""

    field: str | None = option("Field that the colours show: N, force, velocity, deformation, ...")
    component: str | None = option("Component of the field, such as 11, z or norm (magnitude).")
    t: float | None = option("Time; default: the last state.")
    camera: Sequence[float] | None = option(
        "Direction towards the eye, degrees, such as 30,-60.",
        metavar="ELEVATION,AZIMUTH",
        parse=numbers("--camera"),
    )
    width: int | None = option("Width of pictures in space, pixels.")
    theme: Literal["light", "dark"] | None = option("Background: light (default) or dark.")
    enlarge: float | None = option("Factor by which displacements are shown.")
    axes: bool = option("Draw a box of axes with numbers and units.", default=False)


def without_types(found: Any) -> Any:
    """Parameters, of which help shows no type where they are just on or off."""
    for parameter in found:
        if getattr(parameter, "is_flag", False) and parameter.metavar is None:
            parameter.metavar = ""
    return found


class Command(TyperCommand):
    """A command that refuses the former name of an option with that of today."""

    def get_params(self, ctx: Any) -> Any:
        """List the parameters."""
        return without_types(super().get_params(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Look for former names before anything is parsed."""
        flags = {flag for parameter in self.params for flag in parameter.opts}
        for known in options_of(Options):
            former = known.about.former_flag
            if known.flag in flags and any(a.partition("=")[0] == former for a in args):
                raise typer.BadParameter(f"{former} is now called {known.flag}", ctx)
        return super().parse_args(ctx, args)


def offers[F: Callable[..., Any]](*options: Option) -> Callable[[F], F]:
    """Let a command with `**options` have them on the command line, behind its first parameter.

    Args:
        options: The options; one of several values is a text with commas.
    """

    def decorate(command: F) -> F:
        signature = inspect.signature(command, eval_str=True)
        kind, every = inspect.Parameter.KEYWORD_ONLY, signature.parameters.values()
        own = [p.replace(kind=kind) for p in every if p.kind is not p.VAR_KEYWORD]
        more = [
            inspect.Parameter(o.name, kind, default=None, annotation=_annotated(o)) for o in options
        ]
        made: Any = command
        made.__signature__ = signature.replace(parameters=[*own[:1], *more, *own[1:]])
        made.__annotations__ = {p.name: p.annotation for p in (*own, *more)}
        return command

    return decorate


def _annotated(option: Option) -> Any:
    """The annotation of an option for typer."""
    about = option.about
    usual = f" Default: {option.default}." if option.default else ""
    shown: dict[str, Any] = {"help": about.help + usual, "metavar": about.metavar}
    type_: Any = option.type
    if about.many or about.parse is not None:
        type_ = str
    elif option.choices and isinstance(option.choices[0], int):
        type_ = int
        shown |= {"min": min(option.choices), "max": max(option.choices)}
    return Annotated[type_ | None, typer.Option(option.flag, **shown)]


def requested(scene: str, parameters: list[str] | None, **options: Any) -> Requested:
    """The scene that a command line requests.

    Args:
        scene: Name of a bundled scene, or path of a Python file.
        parameters: Values of the scene's parameters, each as "name=value".
        options: Of `Options`, as they were given; None: not given.

    Raises:
        SceneError: If anything about it is wrong.
    """
    from shellmb.api.runs import requested as resolved
    from shellmb.running.request import parse_parameters

    return resolved(scene, parse_parameters(parameters or []), **options)


def default_directory(name: str) -> Path:
    """A new directory name for a run.

    Args:
        name: What is run.
    """
    return Path("runs", f"{name}-{datetime.now():%Y%m%d-%H%M%S}")


def of_checkout(command: str) -> Any:
    """The module of the commands that only a checkout has.

    Args:
        command: The command that needs it.

    Raises:
        SceneError: If shellmb is installed without a checkout.
    """
    try:
        return importlib.import_module("shellmb.demos.studies.commands")
    except ModuleNotFoundError as error:
        if not (error.name or "").startswith("shellmb.demos."):
            raise
        raise SceneError(
            f"`{command}` belongs to a checkout of shellmb, run it there: `python3 -m uv run "
            f"{command}`"
        ) from None
