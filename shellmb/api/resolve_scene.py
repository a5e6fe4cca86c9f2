"""A scene that a call requests: a scene, the name of a bundled one, or a Python file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from shellmb.errors import SceneError
from shellmb.options.described import read
from shellmb.options.run import Options
from shellmb.running.loader import SceneModule
from shellmb.running.request import Request
from shellmb.scene import Scene


@dataclass(frozen=True)
class Requested:
    """A scene as it is to be run.

    Args:
        scene: The scene.
        request: How it can be built again; None for a scene that was given as it is.
        module: The module that defines it, if one does.
    """

    scene: Scene
    request: Request | None = None
    module: SceneModule | None = None

    @property
    def results(self) -> Callable[..., dict[str, float]] | None:
        """Results that the scene measures."""
        return self.scene.results if self.module is None else self.module.results


def requested(
    scene: Scene | str, parameters: Mapping[str, Any] | None, **options: Any
) -> Requested:
    """The scene that a call requests.

    Args:
        scene: A scene, or its name or file.
        parameters: Values of the parameters of a scene that is named.
        options: Of `Options`, what replaces choices of the scene; None: nothing.

    Raises:
        SceneError: If anything about it is wrong.
    """
    chosen = Options(**read(Options, options))
    if isinstance(scene, Scene):
        if parameters:
            raise SceneError(
                f"scene '{scene.name}': parameters are {', '.join(parameters)}; they must be left "
                "out where the scene is made already"
            )
        return Requested(chosen.apply(scene))
    if not isinstance(scene, str):
        raise SceneError(
            f"scene is a {type(scene).__name__}; it must be a Scene, the name of a bundled one, or "
            "the path of a Python file"
        )
    request = Request(scene, as_text(parameters or {}), chosen)
    made, module = request.build()
    return Requested(made, request, module)


def refuse_ranks(what: str) -> None:
    """Refuse several ranks.

    Args:
        what: What is called, for the error.

    Raises:
        SceneError: If there are several.
    """
    from mpi4py import MPI

    if (ranks := MPI.COMM_WORLD.size) > 1:
        raise SceneError(f"{what}: there are {ranks} ranks; it must be called in one process")


def as_text(parameters: Mapping[str, Any]) -> dict[str, str]:
    """Values of parameters as on a command line.

    Args:
        parameters: Values by name.
    """
    return {
        name: ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
        for name, value in parameters.items()
    }
