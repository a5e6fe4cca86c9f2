"""Settings of the solver, the steps, the output, and of static paths that are followed."""

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from shellmb.scene.fields import DEFAULT, FIELDS
from shellmb.scene.types import NONE, Finite, Listed, Positive, PositiveInt, Untrue
from shellmb.scene.values.validate import Sentences, described, listed, show

Angle = Annotated[float, Field(gt=0, lt=90, allow_inf_nan=False)]
Fraction = Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)]
Growth = Annotated[float, Field(ge=1, allow_inf_nan=False)]


@described("solver")
class Solver:
    """Settings of Newton's method for one step.

    Args:
        solve: Solve linear systems with ``"reduced"`` unknowns (five per shell node, six per frame)
            or with all of them (``"full"``). The result is the same.
        newton: When to factorise: in each iteration (``"full"``), once in each step
            (``"modified"``), or as rarely as pays (``"auto"``). The result is the same where a step
            has one solution: where a body turns by more than a radian in it there may be others,
            such as half a turn, and each step length may find another one; the run warns of such
            turns. Where all is linear there is one factorisation; in linear dynamics ``"auto"``
            solves once in each step, and the others a second time, which takes out round-off.
        backend: DOLFINx's ``NewtonSolver`` or PETSc's SNES.
        assembler: ``"native"`` loops in C, with integrands that are read off their UFL; or the
            ``"reference"``: forms compiled and assembled by DOLFINx alone, all unknowns in one
            matrix. Results are the same to round-off; the reference is slow, and tells whether a
            result depends on the loops.
        tolerance: Relative tolerance, tested for every field by itself.
        max_iterations: Iterations after which a step counts as not converged.
    """

    solve: Literal["reduced", "full"] = "reduced"
    newton: Literal["auto", "modified", "full"] = "auto"
    backend: Literal["newton", "snes"] = "newton"
    assembler: Literal["native", "reference"] = "native"
    tolerance: Positive = 1e-9
    max_iterations: PositiveInt = 30


@described("step control")
class StepControl:
    """Control of the step size: smaller where Newton's method fails, towards ``dt`` afterwards.

    With a ``step_error`` the step follows an estimate of its error, and ``dt`` is the first step
    only; a step error below 1e-4 begins with a shorter one (`docs/theory/stepcontrol.md`).

    Args:
        min_dt: Smallest step before the run gives up [s]; None: 1/1024 of ``dt``, with a step error
            1e-5 of it, and in statics less as long as hardly any load acts: 1/16 of that load.
        max_dt: Largest step [s]; None: ``dt``, with a step error a twentieth of ``t_end``; of paths
            ten times ``dt``, or a displacement (root mean square) of a twentieth of the scene's
            size, if that is more.
        shrink: Factor on the step when it is rejected.
        growth: Factor on the step after ``patience`` good steps, up to ``max_dt``.
        patience: Number of good steps before the step grows.
        jump_tolerance: Largest jump between the states j and i of the energy-decaying scheme,
            relative to the scale of each field; larger ones reject the step. None: no control.
        step_error: What the errors of steps may add up to while a motion as large as the body turns
            by one radian, in ``ep4`` and ``ed3`` by 3.8 and 2.7: of positions relative to the size
            of the body, of directors as of positions across the thickness; dynamic schemes only.
            None: no control. Over longer motions errors add up to more, which the run estimates
            (``summary["step_control"]["accumulated_error"]``) and warns of where it is more than
            two step errors.
        times: Times [s] at which a step has to end: of outputs, or where a function of time of the
            scene has a jump or a corner. Those of ``Step``, ``Ramp``, ``Table`` and ``Sine`` a
            step error knows.
    """

    min_dt: Positive | None = None
    max_dt: Positive | None = None
    shrink: Fraction = 0.5
    growth: Growth = 2.0
    patience: PositiveInt = 4
    jump_tolerance: Positive | None = None
    step_error: Positive | None = None
    times: Listed[Positive] = NONE

    def _wrong(self) -> Sentences:
        """Check that the steps are in order, and that one thing controls them."""
        if self.min_dt and self.max_dt and self.min_dt > self.max_dt:
            yield "min_dt", f"it must be at most max_dt, which is {show(self.max_dt)}"
        for a, b in pairwise(self.times):
            if not b > a:
                yield f"time {b:g} follows {a:g}; times must increase"
        if self.step_error is None:
            return
        if self.step_error >= 1:
            yield "step_error", "it must be less than 1, which is an error as large as the body"
        if self.jump_tolerance is not None:
            yield (
                f"step_error is {show(self.step_error)} and jump_tolerance is "
                f"{show(self.jump_tolerance)}; one of them must be left out"
            )
        if self.min_dt and self.min_dt == self.max_dt:
            yield (
                f"step_error is {show(self.step_error)} and min_dt and max_dt are both "
                f"{show(self.min_dt)}; a step that cannot change must have none"
            )


def _fields(value: Any) -> Any:
    """Names of fields, one of them without its tuple, or "all" of them."""
    names = (value,) if isinstance(value, str) else value
    if not isinstance(names, list | tuple):
        raise ValueError("it must be names of fields")
    unknown = [name for name in names if name not in (*FIELDS, "all")]
    if unknown:
        raise ValueError(f"'{unknown[0]}' is no field; there are {listed(FIELDS)}, and 'all'")
    # without it nothing moves
    return tuple(dict.fromkeys(("displacement", *names)))


@described("output")
class Output:
    """Fields, frames and files that a run writes.

    Args:
        frames: Number of states stored for field files, pictures and animation; None: 50;
            up to 400 if something turns by more than 20 degrees between frames.
        fields: What they hold of each body, beside the displacement: names of
            :data:`shellmb.scene.fields.FIELDS`, or ``"all"`` that the scene's bodies have. What is
            not named is not computed.
        end_forces: Whether forces of joints, drivers, locks and supports are in the history also
            as they are at the end of each step, and not only as means over it, and means also
            without what alternates in EP. It costs two factorisations per step; in statics forces
            are values anyway, and nothing is added.
    """

    frames: PositiveInt | None = None
    fields: Annotated[tuple[str, ...], BeforeValidator(_fields)] = DEFAULT
    end_forces: bool = False


@described("path following")
class PathFollowing:
    """Follow the curve of equilibria by its arc length, the load factor being an unknown.

    All loads of the scene are multiplied by the load factor, 1 being the loads as described, and
    so are potentials with ``load=True``. What is prescribed by a function (``Fixed``, ``Driven``,
    ``Driver``) is its value at the load factor, which takes the place of time, from 0 on. Time
    is the arc length of the displacements, scaled such that it grows like the load factor at the
    unloaded state: a structure that stays linear reaches its full load at time 1. The scene's
    ``dt`` is the first step, ``t_end`` the longest path.

    Args:
        load_end: Load factor at which the path ends before ``t_end``; a step ends exactly there.
            None: it ends at ``t_end`` only.
        load_levels: Load factors at which steps end, whenever the path passes them.
        iterations: Target number of Newton iterations per step; the step size is adapted to it.
        turn_deg: Angle between the tangents at both ends of a step beyond which the step is
            repeated with a smaller one [degrees].
        branches: What to do at bifurcations: ``"ignore"`` them, ``"detect"`` and locate them by the
            inertia of the stiffness matrix, or ``"switch"`` to the other branch.
        side: On which side of the path a branch is taken.
        switches: Number of branches to switch to at most, one after the other.
    """

    load_end: Finite | None = None
    load_levels: Listed[Finite] = NONE
    iterations: PositiveInt = 5
    turn_deg: Angle = 30.0
    branches: Literal["ignore", "detect", "switch"] = "detect"
    side: Annotated[Literal[1, -1], Untrue] = 1
    switches: PositiveInt = 1

    def _wrong(self) -> Sentences:
        """Check that the end is not the start, and that levels differ."""
        if self.load_end == 0.0:
            yield "load_end is 0; it must be another load factor, because the path starts there"
        if 0.0 in self.load_levels or len(set(self.load_levels)) < len(self.load_levels):
            yield (
                f"load_levels is {show(self.load_levels)}; they must be different load factors "
                "other than 0, where the path starts"
            )
