"""Functions of time whose values are found in the run: commanded, switched, or given from outside.

They stand where any function of time does. Called outside of a run they give what they are before
it begins. Inputs are data: a partner sets them by name (`shellmb.exchange`), a new value compiles
nothing, and a run without a partner has their defaults.
"""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.types import Finite, Name
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import described, extended, show


class Signal:
    """Any of them."""


@described("commanded signal")
class Commanded(Signal):
    """One that a controller gives.

    Args:
        controller: Name of the controller.
        output: Name of its output; None: its only one.
    """

    controller: Name
    output: Name | None = None

    def __call__(self, t: float) -> float:
        """Nothing is commanded before the run."""
        return 0.0


@extended("command")
class Command(Commanded):
    """A controller's output, constant between samples, that commands a motor or a load.

    Args:
        controller: Name of the controller.
        output: Name of its output; None: its only one.
    """


@extended("commanded acceleration")
class Acceleration(Commanded):
    """A driven coordinate whose second derivative is a controller's output, constant in between.

    A coordinate and its rate cannot jump from one sample to the next; its acceleration can
    [rad/s^2 or m/s^2].

    Args:
        controller: Name of the controller.
        output: Name of its output; None: its only one.
    """


@described("switched signal")
class Switched(Signal):
    """One that an event switches.

    Args:
        event: Name of the event.
        time: The function of time that it multiplies; None: 1.
    """

    event: Name
    time: TimeFunction | None = None

    def times(self, t: float) -> float:
        """The switched factor at the time ``t`` [s]."""
        return 1.0 if self.time is None else float(self.time(t))

    @property
    def corners(self) -> tuple[float, ...]:
        """Corners of what is switched [s]."""
        return getattr(self.time, "corners", ())


@extended("switch on")
class On(Switched):
    """0 until an event goes on, 1 while it is on.

    Args:
        event: Name of the event.
        time: A function of time in place of 1.
    """

    def __call__(self, t: float) -> float:
        """No event is on before the run."""
        return 0.0


@extended("switch off")
class Off(Switched):
    """1 until an event goes on, 0 while it is on.

    Args:
        event: Name of the event.
        time: A function of time in place of 1.
    """

    def __call__(self, t: float) -> float:
        """No event is on before the run."""
        return self.times(t)


# parts of a scene in which inputs may stand
PARTS = ("supports", "loads", "drivers", "force_elements", "controllers", "events", "locks")
# others with functions of the user's, in which they may not
OTHERS = ("contacts", "potentials", "couplings", "volumes", "joints", "initial", "own_bodies")


@described("input")
class Input:
    """A number that another program gives, such as a force, a torque or a reference.

    It stands where a function of time does: ``time=Input("push")`` of a load, a component of the
    displacement of a support, the coordinate of a driver, the ``target`` of a controller, and the
    ``command`` of a motor, which holds the mean over the exchanged step.

    Args:
        name: What the partner calls it; the same name may stand at several places.
        default: Its value until the partner sets one; 0 where a motion is prescribed.
        unit: Its unit, for the description of an FMU.
        linear: Whether it changes linearly over an exchanged step, from its last value to the new
            one; if not, it has the new value over the whole step. Prescribed motions must change
            linearly: a jump is an impact.
    """

    name: Name
    default: Finite = 0.0
    unit: str = ""
    linear: bool = False

    def __post_init__(self) -> None:
        """Begin with the default at all times."""
        # a list: each run has its own copy (`simulate.scene_copy`); start, length, both values
        vars(self)["_line"] = [0.0, 0.0, self.default, self.default]

    def take(self, t: float, dt: float, first: float, last: float) -> None:
        """Take the values of an exchanged step.

        Args:
            t: Its start [s].
            dt: Its length [s].
            first: Value at its start.
            last: Value at its end.
        """
        vars(self)["_line"][:] = t, dt, first, last

    @property
    def line(self) -> tuple[float, float, float, float]:
        """Start and length of the last step [s], and the values at its ends."""
        t, dt, first, last = vars(self)["_line"]
        return t, dt, first, last

    @property
    def mean(self) -> float:
        """Mean over the step."""
        return (self.line[2] + self.line[3]) / 2

    def __call__(self, t: float) -> float:
        """Value at the time ``t`` [s]; the one at the end of the step from there on."""
        begin, dt, first, last = self.line
        if t >= begin + dt or first == last:
            return last
        return first + (last - first) * max(t - begin, 0.0) / dt


def inputs_of(part: Any) -> Iterator[Input]:
    """All inputs in a part of a scene, each place once.

    Args:
        part: It.
    """
    if isinstance(part, Input):
        yield part
    elif isinstance(part, tuple):
        for item in part:
            yield from inputs_of(item)
    elif is_dataclass(part) and type(part).__module__.startswith("shellmb."):
        for each in fields(part):
            yield from inputs_of(getattr(part, each.name))


def named_inputs(scene: Any) -> dict[str, list[Input]]:
    """Inputs of a scene by name.

    Args:
        scene: The scene.

    Raises:
        SceneError: If two of one name differ.
    """
    found: dict[str, list[Input]] = {}
    others = tuple(getattr(scene, what) for what in OTHERS)
    for one in inputs_of((others, tuple(body.natural for body in scene.meshed))):
        raise SceneError(
            f"input '{one.name}': it stands where nothing takes it; it must be the time of a load, "
            "a motion of a support or driver, the command of a motor, or in a controller or event"
        )
    for one in inputs_of(tuple(getattr(scene, what) for what in PARTS)):
        same = found.setdefault(one.name, [])
        if same and same[0] != one:
            raise SceneError(
                f"input '{one.name}': it is {show(same[0])} at one place and {show(one)} at "
                "another; inputs of one name must be equal"
            )
        if not any(other is one for other in same):
            same.append(one)
    return found
