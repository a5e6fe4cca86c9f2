"""Checks of a scene that concern several of its parts; all of them before DOLFINx is imported."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.bodies import Shell
from shellmb.scene.loads import Gravity, SurfaceForce
from shellmb.scene.supports import Driven, Fixed
from shellmb.scene.validate import edge_names, show

if TYPE_CHECKING:
    from shellmb.scene.scene import Scene

__all__ = ["SCHEMES", "check", "find_shell"]

# name -> whether it has velocities, and whether it has a state j just after the step's beginning
SCHEMES = {
    "static": (False, False),
    "linear": (False, False),
    "ep": (True, False),
    "ed": (True, True),
}


def check(scene: Scene) -> None:
    """Check the whole scene.

    Raises:
        SceneError: At the first thing that is impossible.
    """
    _names(scene)
    _scheme(scene)
    _targets(scene)
    _time_functions(scene)
    _surface_forces(scene)
    if scene.static:
        _supported(scene)
    else:
        _massive(scene)


def _names(scene: Scene) -> None:
    if not scene.shells:
        raise SceneError(f"scene '{scene.name}': it has no shells; it must have one at least")
    for what, items in (("shells", scene.shells), ("probes", scene.probes)):
        for name, count in Counter(item.name for item in items).items():
            if count > 1:
                raise SceneError(
                    f"scene '{scene.name}': {count} {what} are named '{name}'; "
                    "each must have a name of its own"
                )


def _scheme(scene: Scene) -> None:
    scheme = scene.scheme
    if isinstance(scheme, str):
        if scheme not in SCHEMES:
            raise SceneError(
                f"scene '{scene.name}': scheme is {show(scheme)}; "
                f"it must be one of {_listed(SCHEMES)}, or a scheme object"
            )
        has_jump = SCHEMES[scheme][1]
    elif not isinstance(getattr(scheme, "name", None), str):
        raise SceneError(
            f"scene '{scene.name}': scheme is {show(scheme)}; "
            f"it must be one of {_listed(SCHEMES)}, or a scheme object with a name"
        )
    else:
        has_jump = "j" in getattr(scheme, "stages", ())
    for what in ("dt", "t_end"):
        if getattr(scene, what) is None:
            raise SceneError(
                f"scene '{scene.name}': {what} is missing; scheme '{scene.scheme_name}' needs it"
            )
    if scene.control.jump_tolerance is not None and not has_jump:
        raise SceneError(
            f"scene '{scene.name}': jump_tolerance is {show(scene.control.jump_tolerance)}; "
            f"it must be left out, because scheme '{scene.scheme_name}' has no jump as 'ed' has"
        )


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"'{n}'" for n in names)


def find_shell(scene: Scene, body: str | None, who: str) -> Shell:
    """The shell named ``body``, or the only one where that is None.

    Args:
        scene: The scene.
        body: A name or None.
        who: Who asks, for the error.

    Raises:
        SceneError: If there is no such shell, or the choice is open.
    """
    known = [s.name for s in scene.shells]
    if body is None:
        if len(known) > 1:
            raise SceneError(f"{who}: body is missing; it must be one of {_listed(known)}")
        return scene.shells[0]
    for shell in scene.shells:
        if shell.name == body:
            return shell
    raise SceneError(f"{who}: there is no shell '{body}'; the scene has {_listed(known)}")


def _targets(scene: Scene) -> None:
    """Names of bodies, edges and points."""
    items: tuple[Any, ...] = (*scene.supports, *scene.loads, *scene.initial, *scene.probes)
    for item in items:
        who = item.label if not hasattr(item, "name") else f"{item.label} '{item.name}'"
        for shell in _acted_on(scene, item, who):
            if hasattr(item, "edge"):
                _edges(shell, item.edge, who)
            if hasattr(item, "point"):
                _point(shell, item.point, who)
            if isinstance(item, Fixed):
                _edge_or_point(shell, item.where, who)
    for join in scene.joins:
        for body, edge in ((join.first, join.first_edge), (join.second, join.second_edge)):
            _edges(find_shell(scene, body, "join"), edge, "join")


def _acted_on(scene: Scene, item: Any, who: str) -> tuple[Shell, ...]:
    everywhere = isinstance(item, Gravity) or item.label == "initial velocity"
    if item.body is None and everywhere:
        return scene.shells
    return (find_shell(scene, item.body, who),)


def _edges(shell: Shell, edge: str | tuple[str, ...], who: str) -> None:
    known = shell.surface.edges
    for name in edge_names(edge):
        if known is not None and name not in known:
            raise SceneError(
                f"{who}: shell '{shell.name}' has no edge '{name}'; its edges are {_listed(known)}"
            )


def _point(shell: Shell, point: Any, who: str) -> None:
    known = shell.surface.points
    if isinstance(point, tuple) and isinstance(point[0], str):
        raise SceneError(f"{who}: point is {show(point)}; it must be one point")
    if known is not None and isinstance(point, str) and point not in known:
        raise SceneError(
            f"{who}: shell '{shell.name}' has no point '{point}'; its points are {_listed(known)}, "
            "or give coordinates"
        )


def _edge_or_point(shell: Shell, where: Any, who: str) -> None:
    edges, points = shell.surface.edges, shell.surface.points
    if (
        edges is None
        or points is None
        or (isinstance(where, tuple) and len(where) == 3 and not isinstance(where[0], str))
    ):
        return
    if isinstance(where, str) and where in points:
        return
    for name in edge_names(where):
        if name not in edges:
            raise SceneError(
                f"{who}: shell '{shell.name}' has no edge or point '{name}'; its edges are "
                f"{_listed(edges)}, its points {_listed(points)}"
            )


def _time_functions(scene: Scene) -> None:
    """Every function of time gives finite numbers at the beginning, the middle and the end."""
    assert scene.t_end is not None
    for load in scene.loads:
        _finite_in_time(load.time, scene.t_end, f"{load.label}: time", 1)  # type: ignore[attr-defined]
    for s in scene.supports:
        if isinstance(s, Fixed):
            for c in (*s.displacement, *s.director):
                _finite_in_time(c, scene.t_end, "fixed components: prescribed value", 1)
        elif isinstance(s, Driven):
            _finite_in_time(s.angle, scene.t_end, "driven edge: angle", 1)
            _finite_in_time(s.translation, scene.t_end, "driven edge: translation", 3)


def _finite_in_time(function: Any, t_end: float, who: str, size: int) -> None:
    if not callable(function):
        return
    wanted = "a finite number" if size == 1 else f"{size} finite numbers"
    for t in (0.0, t_end / 2, t_end):
        try:
            value = np.asarray(function(t), dtype=float)
        except (TypeError, ValueError) as error:
            raise SceneError(f"{who} fails at t = {t:g} ({error}); it must give {wanted}") from None
        if value.size != size or not np.isfinite(value).all():
            raise SceneError(f"{who} gives {show(value)} at t = {t:g}; it must give {wanted}")


def _surface_forces(scene: Scene) -> None:
    """A force given as a function of position, tried at a few points where the surface is known."""
    for load in scene.loads:
        if not isinstance(load, SurfaceForce) or not callable(load.force):
            continue
        surface = find_shell(scene, load.body, "surface force").surface
        if surface.edges is None:
            continue
        s = np.linspace(0.05, 0.95, 7)
        x = surface.position(s, s[::-1].copy())
        value = np.asarray(load.force(x), dtype=float)
        if value.shape != x.shape:
            raise SceneError(
                f"surface force: force gives an array of shape {value.shape} for positions of "
                f"shape {x.shape}; it must give the same shape"
            )
        if not np.isfinite(value).all():
            raise SceneError("surface force: force gives a number that is not finite")


def _supported(scene: Scene) -> None:
    """In statics every group of joined shells needs a support."""
    group = {s.name: s.name for s in scene.shells}
    for join in scene.joins:
        old, new = group[join.first], group[join.second]
        group = {name: new if g == old else g for name, g in group.items()}
    held = {group[find_shell(scene, s.body, "support").name] for s in scene.supports}
    for name, g in group.items():
        if g not in held:
            raise SceneError(
                f"shell '{name}': nothing supports it, so it can move rigidly; a static scene must "
                "support every shell or join it to one that is supported"
            )


def _massive(scene: Scene) -> None:
    for shell in scene.shells:
        m = shell.section.mass[0]
        if not (m > 0 and math.isfinite(m)):
            raise SceneError(
                f"shell '{shell.name}': its mass per area is {m:g}; it must be greater than 0 with "
                f"scheme '{scene.scheme_name}', so give its section a density"
            )
