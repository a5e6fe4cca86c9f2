"""Options of runs, which replace choices of a scene, of their accuracy, and of studies."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from shellmb.errors import SceneError
from shellmb.options.described import option, parse_mesh, positive, several, take

if TYPE_CHECKING:
    from shellmb.scene import Scene

# options that are of meshes, and of the scene's solver
ELEMENTS = ("mesh", "degree", "cell", "divide")
_SOLVER = ("solve", "newton", "backend", "assembler")


@dataclass(frozen=True)
class Options:
    """Choices that replace those of a scene; None keeps the scene's."""

    # where one is read from a file
    __pydantic_config__: ClassVar = {"extra": "forbid"}

    # from Python also a scheme itself
    scheme: str | None = option(
        "Time scheme (ep, ed, ep4, ed3, generalized-alpha, ed-printed, linear-dynamics), or "
        "statics (static, linear-statics)."
    )
    alpha: float | None = option("Numerical dissipation of ed and ed3, 0 to 1 (0.5 by default).")
    dt: float | None = option("Time step or load step [s].")
    t_end: float | None = option("End time [s].")
    mesh: tuple[int, int] | None = option(
        "Elements along the two sides of every shell, such as 8x4; beams take the first number.",
        metavar="NxM",
        parse=parse_mesh,
    )
    degree: Literal[2, 3] | None = option("Polynomial degree of every shell and beam.")
    cell: Literal["quad", "tri"] | None = option("Use quadrilaterals or triangles for every shell.")
    divide: int | None = option(
        "Subdivide every element of shells and beams into N x N; also those of meshes from files."
    )
    body: str | None = option(
        "Apply mesh, degree, cell, divide and model to this shell or beam only."
    )
    model: str | None = option(
        "How shells and beams deform: exact, floating-frame, modal:K (K modes), or rigid.",
        metavar="MODEL",
    )
    solve: Literal["reduced", "full"] | None = option(
        "Solve for the reduced or for all (full) unknowns."
    )
    newton: Literal["auto", "modified", "full"] | None = option(
        "When to refactorise: auto, once per step (modified), or every iteration (full)."
    )
    backend: Literal["newton", "snes"] | None = option(
        "Newton solver: DOLFINx's (newton) or PETSc's (snes)."
    )
    assembler: Literal["native", "reference"] | None = option(
        "Assemble by the loops in C (native), or slowly by DOLFINx alone, with all unknowns in one "
        "matrix (reference)."
    )
    newton_tolerance: float | None = option(
        "Relative tolerance of Newton's method.", former="tolerance"
    )
    end_forces: bool | None = option("Also record forces at the end of steps.")
    errors: bool | None = option(
        "Estimate the errors of results and of histories of probes, from runs with larger steps "
        "and more elements."
    )
    step_error: float | None = option(
        "Adapt steps to this error, relative to the body size; dt is the first step. Steps are "
        "fixed without it.",
        former="step_tolerance",
        former_flag="--tolerance",
    )

    def apply(self, scene: Scene) -> Scene:
        """The scene with these choices.

        Raises:
            SceneError: If it is impossible.
        """
        # a scheme may be an object, which stays one
        chosen: dict[str, Any] = {f.name: getattr(self, f.name) for f in fields(Options)}
        solver: dict[str, Any] = {name: chosen.pop(name) for name in _SOLVER}
        solver["tolerance"] = chosen.pop("newton_tolerance")
        solver = {name: choice for name, choice in solver.items() if choice is not None}
        step_error = chosen.pop("step_error")
        if step_error is None and self.dt is not None:
            scene = replace(scene, step_control=replace(scene.step_control, step_error=None))
        if solver:
            scene = replace(scene, solver=replace(scene.solver, **solver))
        end_forces = chosen.pop("end_forces")
        # the scene is loaded here, and not where a command lists its options
        from shellmb.scene.schemes import SIMPLEST, is_static

        scheme = self.scheme or SIMPLEST
        if is_static(scheme) and not scene.static and self.dt is None:
            # a time step is no load step: take the default one
            end = scene.t_end if self.t_end is None else self.t_end
            dropped: dict[str, Any] = {"dt": None, "start": "given", "alpha": None}
            dropped["step_control"] = replace(scene.step_control, step_error=None)
            scene = replace(scene, scheme=scheme, t_end=end, **dropped)
            chosen["scheme"] = None
        if (errors := chosen.pop("errors")) is not None:
            scene = replace(scene, errors=errors)
        if end_forces is not None:
            scene = replace(scene, output=replace(scene.output, end_forces=end_forces))
        scene = scene.with_options(**chosen)
        if step_error is None:
            return scene
        return replace(scene, step_control=replace(scene.step_control, step_error=step_error))


# what a study without a word about it does
REPEAT, REFINE = 3, 2


@dataclass(frozen=True, kw_only=True)
class StudyOptions:
    """Axes and references of a study; an empty axis keeps the scene's choice."""

    dt: tuple[float, ...] = several(Options, "dt", "S,S,...", positive)
    mesh: tuple[tuple[int, int], ...] = several(Options, "mesh", "NxM,...")
    scheme: tuple[str, ...] = several(Options, "scheme", "ep,ed,...")
    alpha: tuple[float, ...] = several(Options, "alpha", "A,A,...")
    degree: tuple[int, ...] = several(Options, "degree", "2,3", int)
    cell: tuple[str, ...] = several(Options, "cell", "quad,tri")
    divide: tuple[int, ...] = several(Options, "divide", "1,2,...", int)
    model: tuple[str, ...] = several(Options, "model", "exact,rigid,...")
    solve: tuple[str, ...] = several(Options, "solve", "reduced,full")
    step_error: tuple[float, ...] = several(Options, "step_error", "E,E,...", positive)
    newton_tolerance: tuple[float, ...] = several(Options, "newton_tolerance", "T,T,...", positive)
    exact: float | None = option(
        "Exact value of the quantity. Without it a finer run is the reference."
    )
    reference: str | None = option(
        "Scheme of the reference run: ep4, or else ed with the smallest alpha, if they are swept."
    )
    refine: int = option(
        "Refinement of the reference run, in steps and in elements per side.", REFINE
    )
    repeat: int = option("Number of rounds over all runs, for the times.", REPEAT)


# seconds of the units of a budget
UNITS = {"ms": 1e-3, "s": 1.0, "": 1.0, "min": 60.0, "h": 3600.0}
AUTO = "auto"
# least relative error that may be requested: round-off of forces, over steps
LEAST = 1e-12
# file of a request in its directory
ACCURACY = "accuracy.json"


def parse_seconds(text: str) -> float:
    """A time from "60s", "5min" or a number of seconds.

    Args:
        text: The text.

    Raises:
        SceneError: If it is none.
    """
    number, unit, _ = re.split(r"(ms|s|min|h|)\Z", text, maxsplit=1)
    try:
        return float(number) * UNITS[unit]
    except ValueError:
        raise SceneError(f"budget is '{text}'; it must be a time as 60s, 5min or 1h") from None


@dataclass(frozen=True, kw_only=True)
class AccuracyOptions:
    """Options of a run with a required accuracy, and what other options say of it.

    Args:
        auto: Whether the scheme is chosen.
        body: The only body whose mesh is refined; None: all.
        modes: Whether it is of natural modes, and not of a run.
        loaded: Whether these are about the static equilibrium.
        count: Number of modes at least.

    Raises:
        SceneError: If a number is not possible, or others are given without an accuracy.
    """

    accuracy: float | None = option(
        "Refine mesh and step until the relative error is at most this, such as 1e-3. "
        "`--scheme auto` also chooses among ep, ed, ep4 and ed3; with `--body` only its mesh is "
        "refined.",
        metavar="ERROR",
    )
    of: str | None = option(
        "Quantity that has to meet it: a result, a probe or COLUMN:NORM; default: the first probe.",
        metavar="NAME",
    )
    budget: float | None = option(
        "Begin no further refinement after this time, such as 60s or 5min.",
        metavar="TIME",
        parse=parse_seconds,
    )

    auto: bool = False
    body: str | None = None
    modes: bool = False
    loaded: bool = False
    count: int = 1

    def __post_init__(self) -> None:
        """Check what no scene checks."""
        if self.accuracy is None:
            for name in ("of", "budget"):
                if getattr(self, name) is not None:
                    raise SceneError(
                        f"{name} is {getattr(self, name)}, and no accuracy is given; give "
                        "accuracy, a relative error as 1e-3"
                    )
        elif not 0.0 < self.accuracy < 1.0:
            raise SceneError(
                f"accuracy is {self.accuracy:g}; it must be a relative error between 0 and 1, as "
                "1e-3"
            )
        elif self.accuracy < LEAST:
            raise SceneError(
                f"accuracy is {self.accuracy:g}; it must be at least {LEAST:g}: results have no "
                "more digits"
            )
        if self.budget is not None and not self.budget > 0.0:
            raise SceneError(f"budget is {self.budget:g} s; it must be a positive time, as 60s")


def take_accuracy(options: dict[str, Any]) -> AccuracyOptions | None:
    """Take what is asked of an accuracy out of the options of a run; None: nothing is.

    Args:
        options: The options, by their names.

    Raises:
        SceneError: If one is impossible, or a scheme is to be chosen without an accuracy.
    """
    auto = options.get("scheme") == AUTO
    own = take(AccuracyOptions, options, auto=auto, body=options.get("body"))
    if auto:
        options["scheme"] = None
        if own.accuracy is None:
            raise SceneError(
                "scheme is 'auto', and no accuracy is given; give accuracy, by which it is chosen"
            )
    return None if own.accuracy is None else own
