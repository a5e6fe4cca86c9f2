"""Present values of the scene's signals: commands of controllers, and switches of events."""

import math
from dataclasses import dataclass
from typing import Any

from shellmb.scene import Scene
from shellmb.scene.control.signals import Acceleration, Commanded, Input, Off, Signal, Switched
from shellmb.scene.lookup import said
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.user_functions import numbers_at

# name of a controller, and of its output
Key = tuple[str, str]
# what messages call a function of which nothing is known
TIME = "a function of time"


@dataclass(frozen=True)
class Way:
    """A coordinate with a constant acceleration.

    Args:
        begin: Time at which it begins, s.
        place: Coordinate then, rad or m.
        rate: Its rate then.
        acceleration: Its acceleration from then on.
    """

    begin: float = 0.0
    place: float = 0.0
    rate: float = 0.0
    acceleration: float = 0.0

    def at(self, t: float) -> float:
        """The coordinate at a time [s]."""
        s = t - self.begin
        return self.place + s * (self.rate + s * self.acceleration / 2)

    def on(self, t: float, acceleration: float) -> "Way":
        """The motion that goes on from a time [s] with another acceleration."""
        return Way(t, self.at(t), self.rate + (t - self.begin) * self.acceleration, acceleration)


class Signals:
    """Values of the signals of a scene in a run.

    Args:
        scene: The scene.

    Attributes:
        commands: Outputs of controllers, held now.
        ways: Coordinates whose accelerations they are, by the same keys.
        windows: Windows of time in which events are on, by their names; the last may be open. Locks
            share these lists.
    """

    def __init__(self, scene: Scene) -> None:
        self._outputs = {c.name: c.outputs for c in scene.controllers}
        self.commands: dict[Key, float] = {
            (c.name, output): 0.0 for c in scene.controllers for output in c.outputs
        }
        self.ways: dict[Key, Way] = {}
        for driver in scene.drivers:
            for kind in driver.coordinates:
                motion = getattr(driver, kind)
                if isinstance(motion, Acceleration):
                    self.ways[self.key(motion)] = Way()
        self.windows: dict[str, list[tuple[float, float]]] = {e.name: [] for e in scene.all_events}
        self._named = {id(load.time): f"{load.label}: time" for load in scene.loads}
        for body in scene.meshed:
            if body.natural is not None:
                self._named[id(body.natural.time)] = f"natural strain of {said(body)}: time"

    def key(self, signal: Commanded) -> Key:
        """Output of a command."""
        return signal.controller, signal.output or self._outputs[signal.controller][0]

    def on(self, event: str) -> bool:
        """Decide whether an event is on."""
        return any(math.isinf(end) for _, end in self.windows[event][-1:])

    def command(self, t: float, key: Key, value: float) -> None:
        """Hold an output from a time [s] on."""
        self.commands[key] = value
        if key in self.ways:
            self.ways[key] = self.ways[key].on(t, value)

    def __call__(self, function: Any, t: float) -> float:
        """Value of a function of time, or of a signal as it is in the current step.

        Args:
            function: It.
            t: Time within the step, s.
        """
        if not isinstance(function, Signal):
            return float(numbers_at(function(t), t, self._named.get(id(function), TIME)))
        if isinstance(function, Switched):
            on = self.on(function.event)
            return function.times(t) if on is not isinstance(function, Off) else 0.0
        assert isinstance(function, Commanded)
        key = self.key(function)
        return self.ways[key].at(t) if isinstance(function, Acceleration) else self.commands[key]

    def held(self, function: Any) -> float:
        """Value that a motor holds over a step.

        Args:
            function: A command, or an input.
        """
        return function.mean if isinstance(function, Input) else self(function, 0.0)

    def bound(self, function: TimeFunction, who: str) -> TimeFunction:
        """A function of time that gives numbers, whatever is given.

        Args:
            function: The function, or a signal.
            who: What messages call it.
        """
        self._named[id(function)] = who
        return lambda t: self(function, t)
