"""The scene: everything a user describes, checked as a whole."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.checks.names import has_field
from shellmb.scene.checks.whole import check
from shellmb.scene.description import Description
from shellmb.scene.initial import FromRun, FromShape
from shellmb.scene.schemes import DISSIPATIVE, is_static
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.models import model_of
from shellmb.scene.values.validate import error_of, extended, listed, show

STATIC_STEPS = 10


@extended("scene")
class Scene(Description):
    """Bodies, their joints, supports and loads, and how the equations are solved.

    Args:
        name: Name of the scene.
        shells: The shells.
        supports: Supports and prescribed motions.
        loads: Loads.
        joins: Joins between shells.
        initial: Initial velocities; they add up.
        probes: What to record at single points.
        scheme: ``"static"``, ``"linear-statics"`` (small displacements),
            ``"linear-dynamics"`` (the same in time), ``"ep"``, ``"ed"``, ``"ep4"``, ``"ed3"``, a
            scheme of others (``"generalized-alpha"``, ``"ed-printed"``), or a scheme object.
        alpha: Numerical dissipation of schemes that have one, 0 (none) to 1: the spectral radius at
            infinite frequency is (1 - alpha)/(1 + alpha). None: 0.5, and 1/9 (a spectral radius of
            0.8) of ``"generalized-alpha"``. Other schemes ignore it, with a warning.
        dt: Time step [s]; in statics the load step in the same measure as ``t_end``; if left out
            a tenth of ``t_end``, or all of it where the scheme is linear.
        t_end: Time at the end [s]; in statics 1 if left out. Steps are counted: the last one ends
            here, and shares what is left with the one before if that is less than ``0.1 dt``.
        solver: Newton's method.
        step_control: How the step size changes.
        output: What is written.
        results: ``results(run) -> dict`` of numbers for ``summary.json``.
        beams: The beams.
        rigid_bodies: The rigid bodies.
        joints: Joints between bodies, or bodies and the ground.
        drivers: Prescribed coordinates of joints.
        force_elements: Springs, dampers, stops and motors.
        glues: Beams glued to shells.
        locks: Joints that are locked for some time.
        assemble: Whether the bodies are moved first so that the joints close, and get the nearest
            velocities at which nothing slips.
        start: What a scene starts from: ``"given"``, the reference; ``"equilibrium"``, under the
            loads of time 0, of a dynamic scene; the state of another run, a natural mode, or a
            given shape (`FromRun`, `FromMode`, `FromShape`); or several of these, one after the
            other.
        redundant: What becomes of constraints that others imply: an error, or they are dropped.
        path: Follows the path of static equilibria through limit points; None: load steps.
        potentials: Energies of the place of bodies.
        contacts: Contact of bodies with rigid obstacles, fixed in space or to rigid bodies, or with
            faces of shells.
        volumes: Volumes that shells enclose, filled with a gas or with a given volume of fluid.
        units: Units of length, mass and time in labels, as ``"m, kg, s"`` or ``"mm, t, s"``; None:
            labels have none. The numbers are in consistent units, whatever these are.
        controllers: Controllers, which read sensors and command motors, drivers and loads.
        events: What happens when conditions become true.
        errors: Whether runs estimate the errors of results and of histories of probes, from
            comparison runs with larger steps and more elements (`docs/howto/errors.md`).
        couplings: Gears, belts, differentials, and other sums of coordinates of joints.
        own_bodies: Bodies of the user's own, described in UFL (`sm.OwnBody`).
        reserves: Reserve factors against failure that are recorded.

    Raises:
        SceneError: If the scene is invalid; the message says how to correct it.
    """

    def __post_init__(self) -> None:
        """Fill in the times of a static scene and check the scene as a whole."""
        if self.static:
            t_end = 1.0 if self.t_end is None else self.t_end
            object.__setattr__(self, "t_end", t_end)
            if self.dt is None:
                steps = 1 if self.scheme_name == "linear-statics" else STATIC_STEPS
                object.__setattr__(self, "dt", t_end / steps)
        check(self)

    def __repr__(self) -> str:
        several: dict[tuple[str, str], tuple[Any, ...]] = {
            ("shell", "shells"): self.shells,
            ("beam", "beams"): self.beams,
            ("rigid body", "rigid bodies"): self.rigid_bodies,
            ("own body", "own bodies"): self.own_bodies,
        }
        counts = [f"{len(some)} {words[len(some) > 1]}" for words, some in several.items() if some]
        return f"<Scene '{self.name}': {', '.join(counts)}, {self.scheme_name}>"

    def with_options(
        self,
        scheme: Any = None,
        alpha: float | None = None,
        dt: float | None = None,
        t_end: float | None = None,
        mesh: tuple[int, int] | None = None,
        degree: Literal[2, 3] | None = None,
        cell: Literal["quad", "tri"] | None = None,
        body: str | None = None,
        model: str | None = None,
        divide: int | None = None,
    ) -> Scene:
        """Replace some choices and check the scene again; None keeps a choice.

        What a new scheme cannot have is left out: the path of a static scene, initial velocities,
        the start and the step error of a dynamic one, the dissipation; and of a new model of all
        bodies fields of resultants and reserve factors. A load step that exceeds a new end becomes
        the default one.

        Args:
            scheme: Scheme.
            alpha: Dissipation.
            dt: Time step [s].
            t_end: Time at the end [s].
            mesh: Counts of elements, of every shell; the first of them also of every beam.
            degree: Degree, of every shell and beam.
            cell: Cell type, of every shell.
            body: The only shell or beam that gets mesh, degree, cell, model, divide; None: all.
            model: How every shell and beam deforms: "exact", "floating-frame", "modal:10", "rigid".
            divide: Elements along each side in place of one, of every shell and beam; also where a
                mesh is read from a file.

        Raises:
            SceneError: If the new scene is impossible, there is no such body, or a mesh file's mesh
                would have to change.
        """
        chosen = {"scheme": scheme, "alpha": alpha, "dt": dt, "t_end": t_end}
        both = {"degree": degree, "model": None if model is None else model_of(model)}
        shell = {"mesh": mesh, "cell": cell, **both}
        beam = {"elements": mesh[0] if mesh is not None else None, **both}
        changes, shell_changes, beam_changes = map(_given, (chosen, shell, beam))
        if both["model"] == "rigid" and body is None:
            # bodies without resultants have no fields of them
            left = tuple(f for f in self.output.fields if has_field(f, {"rigid", "joint"}))
            changes |= {"output": replace(self.output, fields=left), "reserves": ()}
        new = changes.get("scheme", self.scheme)
        dropped = _without_effect(self, new)
        if alpha is not None or scheme is None:
            # what is said for a scheme without dissipation is kept, and warned of
            dropped.pop("alpha", None)
        changes |= dropped
        if dt is None and is_static(new) and t_end is not None and t_end < self.dt:
            changes["dt"] = None
        if is_static(new) and self.step_control.step_error is not None:
            changes["step_control"] = replace(self.step_control, step_error=None)
        names = self._refined(body, mesh) if shell_changes or divide is not None else set()
        if shell_changes:
            changes["shells"] = _changed(self.shells, names, shell_changes)
            changes["beams"] = _changed(self.beams, names, beam_changes)
        adapted = replace(self, **changes)
        return adapted if divide is None else adapted._divided(names, divide)

    def _divided(self, names: set[str], times: int) -> Scene:
        """The scene with more elements along each side of some shells and beams."""
        if times < 1 or times != int(times):
            raise error_of(self, f"divide is {show(times)}; it must be a whole number, 1 or more")
        shells = tuple(s.divided(times) if s.name in names else s for s in self.shells)
        beams = tuple(b.divided(times) if b.name in names else b for b in self.beams)
        return replace(self, shells=shells, beams=beams)

    def _refined(self, body: str | None, mesh: tuple[int, int] | None) -> set[str]:
        """Names of the shells and beams that get a mesh, degree or cell."""
        found = [b for b in self.meshed if body in (None, b.name)]
        if body is not None and not found:
            known = listed(b.name for b in self.meshed) or "none"
            raise SceneError(
                f"scene '{self.name}': body is {show(body)}; it must be one of the scene's shells "
                f"and beams: {known}"
            )
        if mesh is not None and any(b.refined_times is not None for b in found):
            raise SceneError(
                f"scene '{self.name}': mesh is {show(mesh)}; it must be left out where a shell's "
                "mesh is read from a file; divide refines it"
            )
        return {b.name for b in found}


def _without_effect(scene: Scene, scheme: Any) -> dict[str, Any]:
    """Collect what a scheme cannot have, with what is left of it."""
    dropped: dict[str, Any] = {}
    if getattr(scheme, "name", scheme) != "static":
        # only equilibria have a path
        dropped["path"] = None
    if is_static(scheme):
        still = tuple(s for s in scene.starts if isinstance(s, FromRun | FromShape))
        dropped |= {"initial": (), "start": still or "given"}
    if not isinstance(scheme, str) or scheme not in DISSIPATIVE:
        dropped["alpha"] = None
    return dropped


def _given(choices: dict[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in choices.items() if v is not None}


def _changed[B: (Shell, Beam)](
    bodies: tuple[B, ...], names: set[str], changes: dict[str, Any]
) -> tuple[B, ...]:
    return tuple(replace(b, **changes) if b.name in names else b for b in bodies)
