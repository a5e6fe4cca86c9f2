"""Options of a run: what replaces choices of a scene, for the command line and Python alike."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from shellmb.options.described import option, parse_mesh

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
