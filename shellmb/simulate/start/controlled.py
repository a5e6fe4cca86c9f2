"""Controllers of a scene that starts from a run: they go on from what they remember there."""

from __future__ import annotations

from typing import Any

from shellmb.errors import warn
from shellmb.model.signals import Signals, Way
from shellmb.prefixes import below
from shellmb.scene import Scene
from shellmb.scene.fingerprint import fingerprint
from shellmb.scene.lookup import listed
from shellmb.simulate.start.stored import Stored

# what of a controller says what its memory is: its class, and what it gives by which law; gains,
# targets and periods may be others
MEMORY = ("'].law", "'].outputs", "'].sensors")


def taken_up(signals: Signals, scene: Scene, stored: Stored, who: str) -> dict[str, dict[str, Any]]:
    """States of samplers that go on in a scene, whose time begins at zero, by controller.

    Coordinates that controllers accelerate go on, too, by whatever law.

    Args:
        signals: The signals of the scene.
        scene: The scene.
        stored: The last state of the other run; without its values those of a frame are taken.
        who: Name of the start in messages.
    """
    names = stored.names("controllers")
    both = [c.name for c in scene.controllers if c.name in names]
    now, control = fingerprint(scene), stored.control
    same = [name for name in both if _memory(now, name) == _memory(stored.scene, name)]
    anew = both if control is None else [name for name in both if name not in same]
    if anew:
        why = "frames do not have their memories" if control is None else "their laws are others"
        warn(f"{who}: controllers {listed(anew)} begin with empty memories, because {why}")
    if control is None:
        return {}
    saved = dict(zip(names, control["samplers"], strict=True))
    for key, way in zip(control.get("accelerated", ()), control["ways"], strict=False):
        if tuple(key) in signals.ways:
            begin, *rest = way
            signals.ways[key[0], key[1]] = Way(begin - stored.t, *rest)
    return {name: _since(saved[name], stored.t) for name in same}


def _memory(scene: dict[str, Any], name: str) -> dict[str, Any]:
    found = below(scene, f"controllers['{name}")
    return {k: v for k, v in found.items() if k == "']" or k.startswith(MEMORY)}


def _since(state: dict[str, Any], t: float) -> dict[str, Any]:
    """A state of a sampler as it is where a time is zero: the next sample is the first one."""
    last = state["last"]
    return state | {"count": 0, "last": None if last is None else last - t}
