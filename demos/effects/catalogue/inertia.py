"""Effects of inertia and of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

from shellmb.demos.effects.catalogue.parts import Fits, Flexible, switches, use_of_field
from shellmb.demos.effects.effect import Effect, Use, names, refuse, whole
from shellmb.errors import SceneError
from shellmb.scene import Ramp, RigidBody, Scene, StepControl
from shellmb.scene.schemes import DISSIPATIVE, SCHEMES
from shellmb.scene.settings import PathFollowing
from shellmb.scene.values.validate import show

# largest jump of ED relative to the size of bodies that `--with adaptivity` allows
JUMP = 1e-2


def _has_jump(scene: Scene) -> bool:
    if isinstance(scene.scheme, str):
        return SCHEMES[scene.scheme].jump
    return "j" in getattr(scene.scheme, "stages", ())


def _dissipates(scene: Scene) -> bool:
    """Decide whether the scheme has a dissipation that may be chosen."""
    return scene.scheme in DISSIPATIVE or hasattr(scene.scheme, "alpha")


def _alpha(scene: Scene) -> float:
    return float(getattr(scene.scheme, "alpha", scene.dissipation))


def _turns(body: Flexible) -> bool:
    """Decide whether the section has second moments."""
    if body.rigid:
        return False
    return body.section.masses[2]


def _eccentric(body: Flexible) -> bool:
    """Decide whether the section has a first moment, with second moments that make it possible."""
    if body.rigid or not body.rotary_inertia:
        return False
    return body.section.masses[1]


def _inertia(scene: Scene) -> Use:
    return Use(not scene.static, f"scheme={show(scene.scheme_name)}")


def _statics(scene: Scene) -> Scene:
    if scene.initial:
        raise SceneError(
            "the scene has initial velocities, which only inertia carries; it must have none"
        )
    # a time step is no load step
    dropped: dict[str, Any] = {"step_control": StepControl(), "start": "given", "alpha": None}
    return replace(scene, scheme="static", dt=None, **dropped)


def _dynamics(scene: Scene) -> Scene:
    # the load parameter is taken as time in seconds, loads keep growing in proportion to it
    assert scene.t_end is not None
    ramp = Ramp(scene.t_end)
    loads: list[Any] = [
        load if load.time is not None else replace(cast(Any, load), time=ramp)
        for load in scene.loads
    ]
    return replace(scene, scheme="ep", loads=tuple(loads))


def _rotary(scene: Scene) -> Use:
    if scene.static:
        return Use(False, f"scheme={show(scene.scheme_name)}: no inertia")
    rigid = [b for b in scene.bodies if isinstance(b, RigidBody) or b.rigid]
    if any(_turns(body) for body in scene.meshed) or not rigid:
        return use_of_field("rotary_inertia", _turns, "no section has second moments")(scene)
    return Use(True, f"inertia of the rigid bodies {names(rigid)}")


def _dynamic_only(field: str, fits: Fits, lacking: str) -> Callable[[Scene], Use]:
    inner = use_of_field(field, fits, lacking)

    def use(scene: Scene) -> Use:
        if scene.static:
            return Use(False, f"scheme={show(scene.scheme_name)}: no inertia")
        return inner(scene)

    return use


def _initial(scene: Scene) -> Use:
    if scene.static or not scene.initial:
        return Use(False, "initial is empty" if not scene.initial else "no inertia")
    return Use(True, f"initial has {len(scene.initial)}")


def _dissipation(scene: Scene) -> Use:
    name = show(scene.scheme_name)
    if not _dissipates(scene):
        return Use(False, f"scheme={name} has none")
    return Use(_alpha(scene) > 0, f"scheme={name}, alpha={_alpha(scene):g}")


def _with_dissipation(scene: Scene) -> Scene:
    if scene.static:
        raise SceneError(
            f"scheme is {show(scene.scheme_name)}, which has no motion to damp; it must be 'ep' "
            "or 'ed'"
        )
    if not _dissipates(scene):
        damped = "ed3" if scene.scheme == "ep4" else "ed"
        return replace(scene, scheme=damped, alpha=scene.alpha or None)
    scheme: Any = scene.scheme
    if isinstance(scheme, str):
        return replace(scene, alpha=None)
    return replace(scene, scheme=replace(scheme, alpha=0.5))


def _adaptivity(scene: Scene) -> Use:
    control, dt = scene.step_control, scene.dt
    assert dt is not None
    if control.jump_tolerance is not None:
        return Use(True, f"step_control.jump_tolerance={control.jump_tolerance:g}")
    if control.step_error is not None:
        return Use(True, f"step_control.step_error={control.step_error:g}")
    smallest = dt / 1024 if control.min_dt is None else control.min_dt
    largest = control.max_dt or dt
    if smallest >= dt and largest <= dt:
        return Use(False, f"step_control.min_dt=dt={dt:g}: a failed step ends the run")
    return Use(True, f"step_control.min_dt={smallest:g}: steps shrink where Newton's method fails")


def _without_adaptivity(scene: Scene) -> Scene:
    return replace(scene, step_control=StepControl(min_dt=scene.dt, max_dt=scene.dt))


def _with_adaptivity(scene: Scene) -> Scene:
    return replace(
        scene, step_control=StepControl(jump_tolerance=JUMP if _has_jump(scene) else None)
    )


def _path(scene: Scene) -> Use:
    if scene.path is None:
        return Use(False, "path=None: load steps" if scene.static else "path=None")
    return Use(True, f"path: branches={show(scene.path.branches)}")


def _start(scene: Scene) -> Use:
    return Use("equilibrium" in scene.starts and not scene.static, f"start={show(scene.start)}")


def _states(scene: Scene) -> tuple[Any, ...]:
    """States that the scene starts from, without the equilibrium."""
    return tuple(start for start in scene.starts if start != "equilibrium")


def _given_state(scene: Scene) -> Use:
    if not _states(scene):
        return Use(False, "start: the reference, or an equilibrium about it")
    return Use(True, f"start: {', '.join(start.label for start in _states(scene))}")


def _assembly(scene: Scene) -> Use:
    return Use(scene.assemble, f"assemble={scene.assemble}")


_GROUP = "inertia and time"

EFFECTS = (
    Effect(
        "inertia",
        _GROUP,
        "inertia: velocities and a time scheme",
        _inertia,
        whole(_statics),
        whole(_dynamics),
        motion=True,
    ),
    Effect(
        "rotary_inertia",
        _GROUP,
        "inertia of directors and sections, I* of eq. 16",
        _rotary,
        *switches("rotary_inertia", _turns, "shell or beam whose section has second moments"),
    ),
    Effect(
        "eccentric_inertia",
        _GROUP,
        "first moment of the mass about the reference surface, s* of eq. 16",
        _dynamic_only(
            "eccentric_inertia", _eccentric, "every section is balanced about its reference: s* = 0"
        ),
        *switches(
            "eccentric_inertia",
            _eccentric,
            "section with a first moment",
            "section with a first moment (an offset, or plies of several densities)",
        ),
    ),
    Effect(
        "initial_velocity",
        _GROUP,
        "velocities at the start",
        _initial,
        whole(lambda scene: replace(scene, initial=())),
        refuse("a velocity must be given: add an InitialVelocity to the scene's initial"),
    ),
    Effect(
        "dissipation",
        _GROUP,
        "damping of high frequencies, state j and jumps of eqs. 28-34",
        _dissipation,
        # with alpha = 0 the state j would still be there
        whole(lambda scene: replace(scene, scheme="ep4" if scene.scheme == "ed3" else "ep")),
        whole(_with_dissipation),
    ),
    Effect(
        "adaptivity",
        _GROUP,
        "steps that change where they fail, or where they are too coarse",
        _adaptivity,
        whole(_without_adaptivity),
        whole(_with_adaptivity),
    ),
    Effect(
        "path_following",
        _GROUP,
        "the path of equilibria through limit points, the load being unknown",
        _path,
        whole(lambda scene: replace(scene, path=None)),
        whole(lambda scene: replace(scene, path=PathFollowing())),
    ),
    Effect(
        "equilibrium_start",
        _GROUP,
        "static equilibrium before the first step",
        _start,
        whole(lambda scene: replace(scene, start=_states(scene) or "given")),
        whole(lambda scene: replace(scene, start=(*scene.starts, "equilibrium"))),
    ),
    Effect(
        "state_start",
        _GROUP,
        "a start from the state of a run, a natural mode or a given shape",
        _given_state,
        whole(
            lambda scene: replace(
                scene, start="equilibrium" if "equilibrium" in scene.starts else "given"
            )
        ),
        refuse("a state must be given: start=FromRun(...), FromMode(...) or FromShape(...)"),
    ),
    Effect(
        "assembly",
        _GROUP,
        "bodies moved so that the joints close",
        _assembly,
        whole(lambda scene: replace(scene, assemble=False)),
        whole(lambda scene: replace(scene, assemble=True)),
    ),
)
