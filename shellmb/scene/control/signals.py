"""Functions of time whose values are found in the run: what controllers command, and events switch.

They stand where any function of time does. Called outside of a run they give what they are before
it begins.
"""

from __future__ import annotations

from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import Name, described


class Signal:
    """Any of them."""


class Commanded(Signal):
    """One that a controller gives.

    Attributes:
        controller: Name of the controller.
        output: Name of its output; None: its only one.
    """

    controller: str
    output: str | None

    def __call__(self, t: float) -> float:
        """Nothing is commanded before the run."""
        return 0.0


@described("command")
class Command(Commanded):
    """A controller's output, constant between samples, that commands a motor or a load.

    Args:
        controller: Name of the controller.
        output: Name of its output; None: its only one.
    """

    controller: Name
    output: Name | None = None


@described("commanded acceleration")
class Acceleration(Commanded):
    """A driven coordinate whose second derivative is a controller's output, constant in between.

    A coordinate and its rate cannot jump from one sample to the next; its acceleration can
    [rad/s^2 or m/s^2].

    Args:
        controller: Name of the controller.
        output: Name of its output; None: its only one.
    """

    controller: Name
    output: Name | None = None


class Switched(Signal):
    """One that an event switches.

    Attributes:
        event: Name of the event.
        time: The function of time that it multiplies; None: 1.
    """

    event: str
    time: TimeFunction | None

    def times(self, t: float) -> float:
        """The switched factor at the time ``t`` [s]."""
        return 1.0 if self.time is None else float(self.time(t))

    @property
    def corners(self) -> tuple[float, ...]:
        """Corners of what is switched [s]."""
        return getattr(self.time, "corners", ())


@described("switch on")
class On(Switched):
    """0 until an event goes on, 1 while it is on.

    Args:
        event: Name of the event.
        time: A function of time in place of 1.
    """

    event: Name
    time: TimeFunction | None = None

    def __call__(self, t: float) -> float:
        """No event is on before the run."""
        return 0.0


@described("switch off")
class Off(Switched):
    """1 until an event goes on, 0 while it is on.

    Args:
        event: Name of the event.
        time: A function of time in place of 1.
    """

    event: Name
    time: TimeFunction | None = None

    def __call__(self, t: float) -> float:
        """No event is on before the run."""
        return self.times(t)
