"""What a user asked to run, in words that can be stored: scene, parameters, options."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from shellmb.errors import SceneError
from shellmb.run.loader import SceneModule, load
from shellmb.scene import Scene
from shellmb.scene.checks_effect import check_alpha

# name in a run directory
REQUEST = "request.json"
# options that are of the scene's solver
_SOLVER = ("solve", "newton", "backend", "tolerance")


@dataclass(frozen=True)
class Options:
    """Choices that replace those of a scene; None keeps the scene's.

    Args:
        scheme: Name of the scheme.
        alpha: Dissipation of the energy-decaying scheme.
        dt: Time step, s.
        t_end: Time at the end, s.
        mesh: Counts of elements of every shell; the first of them also of every beam.
        degree: Degree of every shell and beam.
        cell: Cell type of every shell.
        body: The only shell or beam that gets mesh, degree and cell; None: all of them.
        solve: Unknowns of the linear systems.
        newton: When Newton's method factorises.
        backend: Whose Newton solver.
        tolerance: Relative tolerance of Newton's method.
    """

    scheme: str | None = None
    alpha: float | None = None
    dt: float | None = None
    t_end: float | None = None
    mesh: tuple[int, int] | None = None
    degree: Literal[2, 3] | None = None
    cell: Literal["quad", "tri"] | None = None
    body: str | None = None
    solve: Literal["reduced", "full"] | None = None
    newton: Literal["auto", "modified", "full"] | None = None
    backend: Literal["newton", "snes"] | None = None
    tolerance: float | None = None

    def apply(self, scene: Scene) -> Scene:
        """The scene with these choices.

        Raises:
            SceneError: If it is impossible.
        """
        chosen = asdict(self)
        solver: dict[str, Any] = {name: chosen.pop(name) for name in _SOLVER}
        solver = {name: choice for name, choice in solver.items() if choice is not None}
        if solver:
            scene = replace(scene, solver=replace(scene.solver, **solver))
        if self.scheme in ("static", "linear") and not scene.static and self.dt is None:
            # a time step is no load step: take the default one
            end = scene.t_end if self.t_end is None else self.t_end
            lost: dict[str, Any] = {"dt": None, "start": "given", "alpha": 1.0}
            scene = replace(scene, scheme=self.scheme, t_end=end, **lost)
            chosen["scheme"] = None
        return scene.with_options(**chosen)


@dataclass(frozen=True)
class Request:
    """A scene with parameters and options, as given on the command line.

    Args:
        scene: Name of a demo or path of a Python file.
        parameters: Values of the scene's parameters as text.
        options: Choices that replace those of the scene.
    """

    scene: str
    parameters: Mapping[str, str] = field(default_factory=dict)
    options: Options = Options()

    def build(self) -> tuple[Scene, SceneModule]:
        """The scene, and the module that defines it.

        Raises:
            SceneError: If anything about it is wrong.
        """
        module = load(self.scene)
        scene = self.options.apply(module.build(self.parameters))
        if self.options.alpha is not None:
            check_alpha(scene, self.options.alpha)
        return scene, module

    def to_dict(self) -> dict[str, Any]:
        """Plain values; the path of a file becomes absolute."""
        is_file = self.scene.endswith(".py") or "/" in self.scene
        return {
            "scene": str(Path(self.scene).resolve()) if is_file else self.scene,
            "parameters": dict(self.parameters),
            "options": {k: v for k, v in asdict(self.options).items() if v is not None},
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Request:
        """The request from its plain values."""
        options = dict(values["options"])
        if "mesh" in options:
            options["mesh"] = tuple(options["mesh"])
        return cls(values["scene"], values["parameters"], Options(**options))


def parse_mesh(text: str) -> tuple[int, int]:
    """Counts of elements from "NxM".

    Raises:
        SceneError: If the text is not of that form.
    """
    first, x, second = text.lower().partition("x")
    if not (x and first.isdecimal() and second.isdecimal()):
        raise SceneError(f"mesh is '{text}'; it must be two counts as in 8x4")
    return int(first), int(second)


def parse_parameters(items: list[str]) -> dict[str, str]:
    """Values of parameters from "name=value" items.

    Raises:
        SceneError: If an item is not of that form.
    """
    values = {}
    for item in items:
        name, equals, text = item.partition("=")
        if not (equals and name.strip()):
            raise SceneError(f"--set is '{item}'; it must be of the form name=value")
        values[name.strip()] = text.strip()
    return values


def read_request(out: Path | str) -> Request:
    """How the scene of a run directory was asked for.

    Args:
        out: The run directory.

    Raises:
        SceneError: If the directory does not say.
    """
    file = Path(out) / REQUEST
    if not file.is_file():
        raise SceneError(
            f"resume: there is no {file}; give a directory made by `shellmb run`, or resume it "
            "from Python with the scene"
        )
    return Request.from_dict(json.loads(file.read_text()))
