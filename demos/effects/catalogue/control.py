"""Effects of what a run decides for itself: controllers and events."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from shellmb.demos.effects.catalogue.parts import chosen, use_of_parts
from shellmb.demos.effects.effect import Effect, Use, names, refuse
from shellmb.scene import Event, Off, Scene
from shellmb.scene.control.controllers import Law
from shellmb.scene.control.signals import Commanded, Switched


def _without_controllers(scene: Scene, part: str | None) -> Scene:
    """Without controllers and all that they command."""
    gone = {c.name for c in chosen(scene.controllers, part, "controller")}

    def commanded(value: Any) -> bool:
        return isinstance(value, Commanded) and value.controller in gone

    return replace(
        scene,
        controllers=tuple(c for c in scene.controllers if c.name not in gone),
        force_elements=tuple(
            e for e in scene.force_elements if not commanded(getattr(e, "command", None))
        ),
        drivers=tuple(
            d for d in scene.drivers if not (commanded(d.rotation) or commanded(d.translation))
        ),
        loads=tuple(load for load in scene.loads if not commanded(load.time)),
    )


def _events(scene: Scene) -> Use:
    found = scene.all_events
    return Use(bool(found), f"conditions of {names(found)}" if found else "no conditions")


def _without_events(scene: Scene, part: str | None) -> Scene:
    """As if they never went on."""
    gone = {e.name for e in chosen(scene.all_events, part, "event")}
    loads = []
    for load in scene.loads:
        if isinstance(load.time, Switched) and load.time.event in gone:
            if not isinstance(load.time, Off):
                continue
            changed: Any = load
            load = replace(changed, time=load.time.times)
        loads.append(load)
    return replace(
        scene,
        events=tuple(e for e in scene.events if e.name not in gone),
        locks=tuple(k for k in scene.locks if k.switch not in gone),
        loads=tuple(loads),
    )


EFFECTS = (
    Effect(
        "controller",
        "control",
        "laws that read sensors and command motors, drivers and loads",
        use_of_parts("controllers", (Law,), "controller"),
        _without_controllers,
        refuse("what it does must be given: add a PID or Controller to the scene's controllers"),
    ),
    Effect(
        "event",
        "control",
        "conditions that lock, release, switch loads or end the run",
        _events,
        _without_events,
        refuse(f"its condition must be given: add an {Event.__name__} to the scene's events"),
    ),
)
