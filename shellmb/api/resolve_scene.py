"""A scene that a call requests: a scene, the name of a bundled one, or a Python file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.errors import SceneError
from shellmb.options.described import read
from shellmb.options.run import Options
from shellmb.running.loader import SceneModule, given
from shellmb.running.request import Request
from shellmb.scene import Scene

if TYPE_CHECKING:
    from mpi4py import MPI

    from shellmb.accuracy.request.search import Outcome
    from shellmb.accuracy.request.target import Target
    from shellmb.running.execute import RunResult
    from shellmb.simulate.simulation import Observer


@dataclass(frozen=True)
class Requested:
    """A scene as it is to be run.

    Args:
        scene: The scene.
        module: The module that defines it.
        request: How it can be built again; None for a scene that was given as it is.
    """

    scene: Scene
    module: SceneModule
    request: Request | None = None

    def run(
        self, directory: Path, observers: Sequence[Observer], comm: MPI.Comm, pictures: bool
    ) -> RunResult:
        """Run it, with its errors where the scene asks for them; collective.

        Args:
            directory: Directory to write.
            observers: Further observers.
            comm: Communicator.
            pictures: Whether pictures are drawn.
        """
        run_it: Any
        if self.scene.errors:
            from shellmb.accuracy.errors import execute_with_errors as run_it
        else:
            from shellmb.running.execute import execute as run_it
        how = {"request": self.request, "results": self.module.results}
        return run_it(self.scene, directory, observers, comm=comm, pictures=pictures, **how)

    def run_to_accuracy(
        self, target: Target, directory: Path, comm: MPI.Comm, pictures: bool, **how: Any
    ) -> Outcome:
        """Run it, or find its modes, with finer and finer meshes and steps; collective.

        Args:
            target: The accuracy that is requested.
            directory: Directory to write; levels in it go on.
            comm: Communicator.
            pictures: Whether pictures are drawn.
            how: Further settings of `Running`.
        """
        from shellmb.accuracy.request.directory import run_to_accuracy
        from shellmb.accuracy.request.search import Running

        own = self.module
        running = Running(comm, own.results, self.request, mode_results=own.mode_results, **how)
        return run_to_accuracy(self.scene, target, directory, running, pictures)


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
        module = given(scene, parameters or {})
        return Requested(chosen.apply(scene), module)
    if not isinstance(scene, str):
        raise SceneError(
            f"scene is a {type(scene).__name__}; it must be a Scene, the name of a bundled one, or "
            "the path of a Python file"
        )
    request = Request(scene, as_text(parameters or {}), chosen)
    return Requested(*request.build(), request)


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
