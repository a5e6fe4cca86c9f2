"""Checks of sensors, controllers, events, and of what they act on."""

from collections.abc import Callable, Iterator
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.control import signals
from shellmb.scene.control.controllers import Law
from shellmb.scene.description import Description
from shellmb.scene.schemes import SCHEMES
from shellmb.scene.values.validate import Sentences, listed, show

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


def check_inputs(scene: Description, _: Any) -> None:
    """Check that inputs stand where something takes them, and those of one name are equal."""
    signals.named_inputs(scene)


def motion_rules(scene: Description, item: Any) -> Sentences:
    """Refuse commands and inputs by which a support or a driver would jump."""
    for one in signals.inputs_of(item):
        if not one.linear or one.default:
            yield (
                f"{show(one)} prescribes a motion, which begins at 0 and cannot jump; it must be "
                "linear=True with the default 0"
            )
    for name, value in item.given.items():
        if isinstance(value, signals.Signal) and not hasattr(item, "joint"):
            yield (
                f"{show(value)} is no motion of a support; it must be a function of time, or the "
                "body driven by a joint and its driver"
            )
        elif isinstance(value, signals.Signal) and not isinstance(value, signals.Acceleration):
            yield (
                f"{name} is {show(value)}, which jumps, and a coordinate cannot; it must be "
                "Acceleration(...), whose second derivative is commanded"
            )


def signal_rules(scene: Description, item: Any) -> Sentences:
    """Refuse signals of controllers and events that are not there."""
    for name in ("time", "command", "rotation", "translation"):
        signal = getattr(item, name, None)
        if name == "time" and isinstance(signal, signals.Acceleration):
            yield name, "it must be Command(...), as a load has no coordinate to accelerate"
        if isinstance(signal, signals.Switched):
            yield from _event(scene, signal.event, name)
        elif isinstance(signal, signals.Commanded):
            yield from _commanded(scene, signal, name)


def _commanded(scene: Description, signal: signals.Commanded, what: str) -> Sentences:
    known = {c.name: c.outputs for c in scene.controllers}
    who, outputs = f"controller '{signal.controller}'", known.get(signal.controller)
    if outputs is None:
        yield f"{what}: there is no {who}; the scene has {listed(known) or 'none'}"
    elif signal.output is None and len(outputs) > 1:
        yield f"{what}: output is missing; {who} has {listed(outputs)}"
    elif signal.output is not None and signal.output not in outputs:
        yield f"{what}: {who} has no output '{signal.output}'; it has {listed(outputs)}"


def _event(scene: Description, name: str, what: str = "") -> Sentences:
    names = dict.fromkeys(event.name for event in scene.all_events)
    if name not in names:
        where = f"{what}: " if what else ""
        yield f"{where}there is no event '{name}'; the scene has {listed(names) or 'none'}"


def switch_rules(scene: Description, lock: Any) -> Sentences:
    """Refuse locks that an event switches which is not there."""
    return _event(scene, lock.switch) if lock.switch is not None else iter(())


def follow_rules(scene: Description, _: Any) -> Sentences:
    """Refuse controllers and events with schemes that cannot follow them."""
    if not (scene.controllers or scene.all_events):
        return
    what, scheme = "controllers" if scene.controllers else "events", show(scene.scheme_name)
    if scene.controllers and scene.static:
        yield (
            f"it has controllers, and scheme {scheme} has no time in which they could act; they "
            "must be left out, or the scheme be a dynamic one"
        )
    if scene.path is not None:
        yield (
            "it has events, and follows a path of equilibria, which may not end within a step; "
            "they must be left out, or the path"
        )
    if scene.scheme_name in RIVALS or scene.linear:
        able = listed(s for s in SCHEMES if s not in (*RIVALS, "static") and "linear" not in s)
        yield f"it has {what}, which scheme {scheme} cannot have; it must be one of {able}"
    for rate in [s for s in scene.sensors if s.derivative and scene.static]:
        named = f"sensor '{rate.name}' is a rate, and scheme {scheme} has none"
        yield f"{named}; it must be left out"


def period_rules(scene: Description, controller: Law) -> Sentences:
    """Refuse samples that are not at the ends of fixed steps."""
    control, dt, period = scene.step_control, scene.dt, controller.period
    if control.step_error is not None or control.jump_tolerance is not None or period is None:
        return
    if abs(period / dt - round(period / dt)) > MULTIPLE * period / dt or period < dt / 2:
        yield (
            "period",
            f"it must be a multiple of dt, which is {show(dt)}, or the steps must follow a "
            "step_error",
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


def check_sensor(scene: Description, sensor: Any) -> None:
    """Check that there is what a sensor reads."""
    column, known = sensor.column, list(dict.fromkeys(_columns(scene)))
    coordinate = coordinate_read(scene, column)
    if coordinate is not None and scene.joint(coordinate[0], "").active is not None:
        raise SceneError(
            f"sensor '{column}': joint '{coordinate[0]}' has windows of time; a joint whose "
            "coordinate is read must act always"
        )
    if column in known or coordinate is not None:
        return
    owner = column.rpartition(".")[0]
    free = [f"{j.name}.{k}" for j in scene.joints for k in j.freedoms]
    near = [k for k in (*free, *known) if owner and k.startswith(f"{owner}.")]
    there = near or [*free, *(k for k in known if "." not in k)]
    has = f"of {owner!r} it has" if near else "it must be one of"
    raise SceneError(f"sensor '{column}': the run has no such number; {has} {listed(there)}")


RULES: tuple[tuple[str, Callable[[Description, Any], Sentences | None]], ...] = (
    ("supports drivers", motion_rules),
    ("scene", check_inputs),
    ("loads drivers force_elements", signal_rules),
    ("locks", switch_rules),
    ("scene", follow_rules),
    ("controllers", period_rules),
    ("sensors", check_sensor),
)
