"""Checks of scenes with small displacements, and of paths of equilibria."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.loads.supports import Driven, Fixed, at_rest, moves
from shellmb.scene.lookup import said
from shellmb.scene.multibody.rolling import Contact
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from shellmb.scene.description import Description

# a rotation by this is off by its square in a linear analysis: positions by half a per cent, rad
SMALL_ANGLE = 0.1
# times at which prescribed rotations are looked at, in parts of the run
LOOKED_AT = np.linspace(0.0, 1.0, 33)


def check(scene: Description) -> None:
    """Check a scene with a linear scheme.

    Raises:
        SceneError: If something of it is not small.
    """
    if not scene.linear:
        return
    scheme = f"with scheme '{scene.scheme_name}'"
    for joint in scene.joints:
        if isinstance(joint, Contact):
            raise SceneError(
                f"{joint.said}: what rolls goes far, and {scheme} displacements are small; the "
                "scheme must be another, as 'ep'"
            )
    for driver in scene.drivers:
        _small(scene, driver.rotation, f"driver '{driver.name}': rotation")
    for support in scene.supports:
        if isinstance(support, Driven):
            _small(scene, support.rotation, f"{said(support)}: rotation")
    for lock in scene.acting_locks:
        late = [start for start, _ in lock.active or () if start > 0]
        if lock.switch is not None:
            raise SceneError(
                f"lock of joint '{lock.joint}': event '{lock.switch}' switches it; {scheme} it "
                "must begin at 0, in the reference configuration, in a window"
            )
        if late:
            raise SceneError(
                f"lock of joint '{lock.joint}': a window begins at t = {late[0]:g}; {scheme} it "
                "must begin at 0, in the reference configuration"
            )
    _given(scene, scheme)


def _given(scene: Description, scheme: str) -> None:
    """Check where the scene starts, and what is requested."""
    who = f"scene '{scene.name}'"
    for what, wrong in (
        ("start is 'equilibrium'", "equilibrium" in scene.starts),
        ("assemble is True", scene.assemble),
    ):
        if wrong:
            raise SceneError(
                f"{who}: {what}; {scheme} it must be left out: displacements are from the given "
                "positions, which are at rest"
            )
    if scene.output.end_forces and not scene.static:
        raise SceneError(
            f"{who}: output has end_forces; {scheme} it must have none: forces are means over the "
            "step, free of oscillation"
        )


def _small(scene: Description, angle: Any, who: str) -> None:
    if angle is None:
        return
    assert scene.t_end is not None
    times = LOOKED_AT * scene.t_end
    angles = [abs(float(angle(t)) if callable(angle) else float(angle)) for t in times]
    worst = int(np.argmax(angles))
    if angles[worst] > SMALL_ANGLE:
        raise SceneError(
            f"{who} is {show(float(f'{angles[worst]:.4g}'))} at t = {times[worst]:g}; with scheme "
            f"'{scene.scheme_name}' rotations must be at most {SMALL_ANGLE:g} rad, or the scheme "
            "another, as 'static' or 'ep'"
        )


def check_path(scene: Description) -> None:
    """Check that a scene is one whose path can be followed.

    Raises:
        SceneError: Says what stands against it.
    """
    if scene.path is None:
        return
    if scene.starts:
        raise SceneError(
            f"scene '{scene.name}': start is {show(scene.start)}; a path starts from the unloaded "
            "structure, so it must be left out"
        )
    who = f"scene '{scene.name}': path following"
    if scene.scheme_name != "static":
        raise SceneError(
            f"{who} has scheme {show(scene.scheme_name)}; it must be 'static', or path must be "
            "left out"
        )
    _check_given(scene, who)
    followed: list[Any] = [*scene.loads, *(body for body in scene.meshed if body.natural)]
    followed += [p for p in scene.potentials if p.load]
    followed += [s for s in scene.supports if moves(s)]
    followed += [v for v in scene.volumes if v.change is not None]
    followed += [joint for joint in scene.joints if joint.given]
    followed += [coupling for coupling in scene.couplings if coupling.given]
    if not followed and not scene.drivers:
        raise SceneError(
            f"{who} has no load to follow; it must have one at least: a load, a natural strain, a "
            "potential with load=True, or a prescribed motion"
        )
    for load in scene.loads:
        if load.time is not None:
            raise SceneError(
                f"{who}: a {load.label} has a function of time; it must be left out, because the "
                "load factor multiplies all loads"
            )
    moved = [f"lock of joint '{lock.joint}'" for lock in scene.locks]
    moved += [f"windows of joint '{j.name}'" for j in scene.joints if j.active is not None]
    if moved:
        raise SceneError(
            f"{who}: something is prescribed over time ({moved[0]}); it must be left out, because "
            "loads are followed and there is no time"
        )


def _check_given(scene: Description, who: str) -> None:
    """Refuse motions that do not begin with the unloaded structure."""
    given: list[tuple[str, Any]] = []
    for support in scene.supports:
        what = f"{said(support)} at {show(support.at)}"
        if isinstance(support, Fixed):
            if not moves(support) and not at_rest(support):
                raise SceneError(
                    f"{who}: {what} prescribes a number other than 0; it must be a "
                    "function of the load factor, as lambda factor: 0.1 * factor"
                )
            components = (*support.displacement, *support.director)
            given += [(what, c) for c in components if c is not None]
        elif isinstance(support, Driven):
            given += [(f"{what}: rotation", support.rotation)]
            given += [(f"{what}: translation", support.translation)]
    given += [(f"{said(v)}: change", v.change) for v in scene.volumes if v.change is not None]
    for driver in scene.drivers:
        given += [(f"driver '{driver.name}': {c}", getattr(driver, c)) for c in driver.coordinates]
    for what, value in given:
        start = np.max(np.abs(value(0.0) if callable(value) else value or 0.0))
        if start > 0:
            raise SceneError(
                f"{who}: {what} is {start:g} at the load factor 0; it must be 0 there, because a "
                "path starts from the unloaded structure"
            )
