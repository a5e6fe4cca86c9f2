"""Checks of sensors, controllers, events, and of what they act on."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.control.controllers import Law
from shellmb.scene.control.signals import (
    Acceleration,
    Commanded,
    Signal,
    Switched,
    inputs_of,
    named_inputs,
)
from shellmb.scene.description import Description
from shellmb.scene.schemes import SCHEMES
from shellmb.scene.values.validate import listed, refused, said, show

# a period is a multiple of the step to this part of it
MULTIPLE = 1e-9
RIVALS = ("generalized-alpha", "ed-printed")
# columns of the account that every dynamic run has; statics has the first three
ACCOUNT = (
    "strain_energy",
    "total_energy",
    "kinetic_energy",
    "work_loads",
    "work_terms",
    "work_supports",
    "dissipation",
    *(f"{kind}_{axis}" for kind in ("momentum", "angular_momentum") for axis in "xyz"),
)
_FORCES = ("F1", "F2", "F3", "M1", "M2", "M3")
_EFFORT = {"rotation": "torque", "translation": "force"}


def check_signals(scene: Description) -> None:
    """Check that sensors, controllers and events are there, and fit the scheme and its steps.

    Raises:
        SceneError: At the first thing that is impossible.
    """
    _places(scene)
    names = Counter(event.name for event in scene.all_events)
    for name, count in names.items():
        if count > 1:
            raise SceneError(
                f"scene '{scene.name}': {count} events are named '{name}' (a lock with a condition "
                "has one of its own); each must have a name of its own"
            )
    named_inputs(scene)
    for signal, who in _signals(scene):
        _known(scene, signal, who)
    for lock in scene.locks:
        if lock.switch is not None:
            _event(scene, lock.switch, f"lock of joint '{lock.joint}'")
    if scene.controllers or scene.all_events:
        _scheme(scene)
    for controller in scene.controllers:
        _period(scene, controller)
    _sensors(scene)


def _signals(scene: Description) -> Iterator[tuple[Any, str]]:
    """All signals, and what has them."""
    for load in scene.loads:
        if isinstance(load.time, Signal):
            yield load.time, f"{said(load)}: time"
    for driver in scene.drivers:
        for name, value in driver.given.items():
            if isinstance(value, Signal):
                yield value, f"{said(driver)}: {name}"
    for element in scene.force_elements:
        if isinstance(element.command, Commanded):
            yield element.command, f"{said(element)}: command"


def _places(scene: Description) -> None:
    """Commands and switches where they make sense."""
    for support in scene.supports:
        _moves_on(support)
        for value in support.given.values():
            if isinstance(value, Signal):
                raise SceneError(
                    f"{said(support)}: {show(value)} is no motion of a support; it must be a "
                    "function of time, or the body driven by a joint and its driver"
                )
    for load in scene.loads:
        if isinstance(load.time, Acceleration):
            raise refused(
                load, "time", "it must be Command(...), as a load has no coordinate to accelerate"
            )
    for driver in scene.drivers:
        _moves_on(driver)
        for name, value in driver.given.items():
            if isinstance(value, Signal) and not isinstance(value, Acceleration):
                raise SceneError(
                    f"{said(driver)}: {name} is {show(value)}, which jumps, and a coordinate cannot"
                    "; it must be Acceleration(...), whose second derivative is commanded"
                )


def _moves_on(item: Any) -> None:
    """Check that inputs that prescribe a motion do not jump."""
    for one in inputs_of(item):
        if not one.linear or one.default:
            raise SceneError(
                f"{said(item)}: {show(one)} prescribes a motion, which begins at 0 and cannot jump;"
                " it must be linear=True with the default 0"
            )


def _known(scene: Description, signal: Any, who: str) -> None:
    """Check that what a signal is of is there."""
    if isinstance(signal, Switched):
        _event(scene, signal.event, who)
        return
    assert isinstance(signal, Commanded)
    found = [c for c in scene.controllers if c.name == signal.controller]
    if not found:
        names = listed(c.name for c in scene.controllers) or "none"
        raise SceneError(
            f"{who}: there is no controller '{signal.controller}'; the scene has {names}"
        )
    outputs = found[0].outputs
    if signal.output is None and len(outputs) > 1:
        raise SceneError(
            f"{who}: output is missing; controller '{signal.controller}' has {listed(outputs)}"
        )
    if signal.output is not None and signal.output not in outputs:
        raise SceneError(
            f"{who}: controller '{signal.controller}' has no output '{signal.output}'; it has "
            f"{listed(outputs)}"
        )


def _event(scene: Description, name: str, who: str) -> None:
    names = dict.fromkeys(event.name for event in scene.all_events)
    if name not in names:
        known = listed(names) or "none"
        raise SceneError(f"{who}: there is no event '{name}'; the scene has {known}")


def _scheme(scene: Description) -> None:
    """Check what schemes can follow."""
    what = "controllers" if scene.controllers else "events"
    who, scheme = f"scene '{scene.name}'", show(scene.scheme_name)
    if scene.controllers and scene.static:
        raise SceneError(
            f"{who}: it has controllers, and scheme {scheme} has no time in which they could act; "
            "they must be left out, or the scheme be a dynamic one"
        )
    if scene.path is not None:
        raise SceneError(
            f"{who}: it has events, and follows a path of equilibria, which may not end within a "
            "step; they must be left out, or the path"
        )
    if scene.scheme_name in RIVALS or scene.linear:
        able = listed(s for s in SCHEMES if s not in (*RIVALS, "static") and "linear" not in s)
        raise SceneError(
            f"{who}: it has {what}, which scheme {scheme} cannot have; it must be one of {able}"
        )
    rates = [s for s in scene.sensors if s.derivative]
    if rates and scene.static:
        raise SceneError(
            f"{who}: sensor '{rates[0].name}' is a rate, and scheme {scheme} has none; it must be "
            "left out"
        )


def _period(scene: Description, controller: Law) -> None:
    """With fixed steps samples are at the ends of some."""
    control, dt, period = scene.step_control, scene.dt, controller.period
    if control.step_error is not None or control.jump_tolerance is not None or period is None:
        return
    if abs(period / dt - round(period / dt)) > MULTIPLE * period / dt or period < dt / 2:
        raise SceneError(
            f"{said(controller)}: period is {show(period)}; it must be a multiple of dt, which is "
            f"{show(dt)}, or the steps must follow a step_error"
        )


def coordinate_read(scene: Description, column: str) -> tuple[str, str] | None:
    """The joint and coordinate that a column is of; None for any other column.

    Args:
        scene: The scene.
        column: Its name.
    """
    for joint in scene.joints:
        for kind in joint.freedoms:
            if column == f"{joint.name}.{kind}":
                return joint.name, kind
    return None


def _columns(scene: Description) -> Iterator[str]:
    """Columns of the history that sensors may read, besides those of single joints' coordinates."""
    yield from (probe.name for probe in scene.probes)
    yield from (reserve.name for reserve in scene.reserves)
    for driver in scene.drivers:
        yield from (f"{driver.name}.{_EFFORT[name]}" for name in driver.coordinates)
    for between in scene.point_elements:
        yield from (f"{between.name}.length", f"{between.name}.force")
    for element in scene.joint_elements:
        yield from (f"{element.name}.{_EFFORT[name]}" for name in scene.coordinates_of(element))
    for lock in scene.acting_locks:
        yield from (f"{lock.joint}.lock_{_EFFORT[name]}" for name in scene.coordinates_of(lock))
    for joint in scene.joints:
        yield from (f"{joint.name}.{force}" for force in _FORCES)
    yield from ACCOUNT[:2] if scene.static else ACCOUNT


def _sensors(scene: Description) -> None:
    """Check that there is what sensors read."""
    if not scene.sensors:
        return
    known = list(dict.fromkeys(_columns(scene)))
    for sensor in scene.sensors:
        column = sensor.column
        coordinate = coordinate_read(scene, column)
        if coordinate is not None and scene.joint(coordinate[0], "").active is not None:
            raise SceneError(
                f"sensor '{column}': joint '{coordinate[0]}' has windows of time; a joint whose "
                "coordinate is read must act always"
            )
        if column in known or coordinate is not None:
            continue
        owner = column.rpartition(".")[0]
        near = [f"{j.name}.{k}" for j in scene.joints for k in j.freedoms if j.name == owner]
        near += [k for k in known if owner and k.startswith(f"{owner}.")]
        free = [f"{j.name}.{k}" for j in scene.joints for k in j.freedoms]
        there = near or [*free, *(k for k in known if "." not in k)]
        raise SceneError(
            f"sensor '{column}': the run has no such number; "
            f"{f'of {owner!r} it has' if near else 'it must be one of'} {listed(there)}"
        )
