"""Controllers and events of a run: what controllers answer when, and when events go on and off."""

import copy
import math
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ControlError
from shellmb.model.signals import Signals
from shellmb.restart import Restartable
from shellmb.scene.control.controllers import Law
from shellmb.scene.control.sensors import Condition, Event, Sensor
from shellmb.scene.lookup import said
from shellmb.scene.values.validate import in_words, show

# tolerance of the time of an event where it says nothing, in steps
TOLERANCE = 1e-6
# so many changes of one event within the scene's step are no mechanics
CHATTER = 40
# solutions of one step after which nothing is found any more; bisection to 1e-9 of it takes 90
MOST = 120


class Watch(Restartable):
    """An event in a run.

    Args:
        event: The event.
        dt: The scene's step, s.

    Attributes:
        times: When it went on, off, on, ..., s.
        armed: Whether the condition that is waited for has been false.
        tolerance: By how much later than the condition it may be found, s.
    """

    remembered = ("times", "armed")

    def __init__(self, event: Event, dt: float) -> None:
        self.event, self._dt = event, dt
        self.times: list[float] = []
        # at the start a condition counts at once
        self.armed = True
        self.tolerance = TOLERANCE * dt if event.tolerance is None else event.tolerance

    @property
    def on(self) -> bool:
        """Decide whether the event is on."""
        return len(self.times) % 2 == 1

    @property
    def condition(self) -> Condition | None:
        """The one that is waited for; None: none any more."""
        return self.event.until if self.on else self.event.when

    def margin(self, read: Mapping[str, float], t: float) -> float:
        """Margin of the condition that is waited for; -inf if there is none.

        Args:
            read: What sensors read, by their names.
            t: Time, s.

        Raises:
            ControlError: If it is no number.
        """
        if self.condition is None:
            return -math.inf

        def reading(sensor: Sensor) -> float:
            return read[sensor.name]

        try:
            found = self.condition.margin(reading, t)
        except ArithmeticError:
            found = math.nan
        if math.isnan(found):
            raise ControlError(
                f"event '{self.event.name}' at t = {t:.9g}: its condition compares what is no "
                f"number, where {', '.join(f'{k} = {v:.6g}' for k, v in read.items())}"
            )
        return found

    def change(self, t: float) -> None:
        """Go on, or off.

        Args:
            t: Time, s.

        Raises:
            ControlError: If it does so again and again.
        """
        self.times.append(t)
        self.armed = False
        if len(self.times) > CHATTER and t - self.times[-1 - CHATTER] < self._dt:
            raise ControlError(
                f"event '{self.event.name}' has gone on and off {CHATTER} times within "
                f"{t - self.times[-1 - CHATTER]:.3g} s before t = {t:.9g}; its conditions 'when' "
                "and 'until' must be further apart"
            )

    @property
    def windows(self) -> list[tuple[float, float]]:
        """Windows of time in which it is on, s."""
        ends = [*self.times[1::2], math.inf]
        return list(zip(self.times[::2], ends, strict=False))


def comes_soon(start: Floats, end: Floats, dt: float, least: float) -> bool:
    """Decide whether a margin that goes on as in a step will cross zero too soon behind it.

    Args:
        start: Margins at its start.
        end: At its end, below zero.
        dt: Its length, s.
        least: What is too soon, s.
    """
    rising = (end > start) & np.isfinite(start)
    rise = end[rising] - start[rising]
    return bool(np.any(-end[rising] * dt < least * rise))


def turning_point(
    before: Floats, start: Floats, end: Floats, steps: tuple[float, float]
) -> float | None:
    """Find where in a step the first of several margins turns at zero or above, by what is known.

    Between two ends below zero, by the parabola through the end before; one that stays below zero
    by a quarter of its own rise is looked at too, as that is only so good.

    Args:
        before: Margins at the start of the step before.
        start: At the start of the step.
        end: At its end, below zero.
        steps: Lengths of both, s.

    Returns:
        The part of the step up to there, s; None where none does.
    """
    first, last = steps
    found = []
    for values in zip(before, start, end, strict=True):
        if not np.all(np.isfinite(values)):
            continue
        a, b, c = (float(v) for v in values)
        slope = (c - b) / last
        bend = (slope - (b - a) / first) / (first + last)
        part = last / 2 - slope / (2 * bend) if bend < 0 else 0.0
        if 0 < part < last:
            top = b + part * slope + part * (part - last) * bend
            if top + (top - max(b, c)) / 4 >= 0:
                found.append(part)
    return min(found, default=None)


def first_crossing(
    margins: Callable[[float], Floats],
    start: Floats,
    end: Floats,
    dt: float,
    tolerance: float,
    least: float = 0.0,
) -> tuple[float, Floats]:
    """Find where in a step the first of several margins comes up to zero.

    By the secant, with the Illinois rule against an end that stays (M. Dowell, P. Jarratt, BIT 11
    (1971) 168-174), and by bisection where two points have not halved what is left. Each point is
    at least the tolerance off both ends, so that what is left in the end is no more.

    Args:
        margins: Margins at a part of the step, s.
        start: At its start, below zero.
        end: At its end, one of them at least zero.
        dt: Its length, s.
        tolerance: By how much later the crossing may be found, s.
        least: Least length of a step, s.

    Returns:
        The length of the step in which it happens, s, and the margins at its end.
    """
    low, high, before, behind = 0.0, dt, start.copy(), end
    weight, stayed, widths = np.ones(2), 0, [math.inf, math.inf]
    for _ in range(MOST):
        if high - max(low, least if low == 0 else 0.0) <= tolerance:
            break
        slow, widths = high - low > widths[0] / 2, [widths[1], high - low]
        crossing = behind >= 0
        a, b = weight[0] * before[crossing], weight[1] * behind[crossing]
        part = float(np.min(a / (a - b))) if np.all(a < 0) else 0.0
        off = min(tolerance, (high - low) / 2)
        middle = min(max(low + part * (high - low), low + off), high - off)
        if slow:
            middle = (low + high) / 2
        if low == 0:
            middle = max(middle, least)
        found = margins(middle)
        if np.any(found >= 0):
            high, behind = middle, found
            weight = np.array([weight[0] / 2 if stayed > 0 else 1.0, 1.0])
            stayed = 1
        else:
            low, before = middle, found
            weight = np.array([1.0, weight[1] / 2 if stayed < 0 else 1.0])
            stayed = -1
    return high, behind


# a sample is due from this part of its period before it
ROUND_OFF = 1e-9
# how values are kept that JSON does not know
ARRAY, TUPLE, DICT = "array", "tuple", "dict"


class Sampler(Restartable):
    """A controller in a run.

    Args:
        law: The controller.

    Attributes:
        readings: What its sensors read at the last sample, by their names.
        outputs: What it gave, by name.
    """

    remembered = ("readings", "outputs", "_count", "_last")

    def __init__(self, law: Law) -> None:
        self.law = law
        self.readings = {sensor.name: math.nan for sensor in law.sensors}
        self.outputs = dict.fromkeys(law.outputs, 0.0)
        self._memory: Any = copy.deepcopy(law.state)
        self._count = 0
        self._last: float | None = None

    @property
    def next(self) -> float:
        """Time of the next sample, s; infinite where it is sampled at every step."""
        return math.inf if self.law.period is None else self._count * self.law.period

    def due(self, t: float) -> bool:
        """Decide whether a sample is due before a step that begins at a time [s]."""
        period = self.law.period
        return period is None or t >= self.next - ROUND_OFF * period

    def ask(self, t: float, read: Mapping[str, float], comm: MPI.Comm) -> bool:
        """Take a sample; collective.

        Args:
            t: Time, s.
            read: What all sensors read.
            comm: Communicator: the law is evaluated on the first rank.

        Returns:
            Whether the outputs of a controller that holds them have changed.

        Raises:
            ControlError: If the law fails, or gives something else than finite numbers.
        """
        self.readings = {label: read[label] for label in self.readings}
        found: Any = None
        wrong: str | None = None
        if comm.rank == 0:
            try:
                found = self._answer(t)
            except (Exception, SystemExit) as error:
                wrong = f"{said(self.law)} at t = {t:.9g}: {self._error_origin(error)}"
        if comm.size > 1:
            found, wrong = comm.bcast((found, wrong))
        if wrong is not None:
            raise ControlError(wrong)
        outputs, self._memory = found
        changed = outputs != self.outputs and self.law.period is not None
        self.outputs = outputs
        self._count, self._last = self._count + 1, t
        return changed

    def _answer(self, t: float) -> tuple[dict[str, float], Any]:
        since = 0.0 if self._last is None else t - self._last
        readings = np.array(list(self.readings.values()))
        answer = self.law.act(t, readings, self._memory, since)
        if not (isinstance(answer, tuple) and len(answer) == 2):
            raise _Wrong(f"its law gives {show(answer)}; it must give outputs, state")
        given, memory = answer
        names = self.law.outputs
        try:
            values = np.atleast_1d(np.asarray(given, dtype=float)).ravel()
        except (TypeError, ValueError):
            raise _Wrong(f"its outputs are {show(given)}; they must be numbers") from None
        if len(values) != len(names):
            raise _Wrong(
                f"its law gives {len(values)} outputs; it must give {len(names)}: "
                f"{', '.join(names)}"
            )
        outputs = dict(zip(names, values.tolist(), strict=True))
        for name, value in outputs.items():
            if not math.isfinite(value):
                read = ", ".join(f"{label} = {v:.6g}" for label, v in self.readings.items())
                raise _Wrong(
                    f"its output '{name}' is {value}, where {read}; it must be a finite number"
                )
        # refused here, and not when it is to be saved
        packed(memory)
        return outputs, memory

    def _error_origin(self, error: BaseException) -> str:
        if isinstance(error, _Wrong):
            return str(error)
        frame = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(frame.filename).name}, line {frame.lineno}"
        return f"its law fails ({where}: {in_words(error)}); it must give outputs, state"

    def command(self, t: float, signals: Signals) -> None:
        """Hold the outputs from a time [s] on."""
        for name, value in self.outputs.items():
            signals.command(t, (self.law.name, name), value)

    def state(self) -> dict[str, Any]:
        """State for a restart."""
        return super().state() | {"memory": packed(self._memory)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved state."""
        super().restore(state)
        self._memory = unpacked(state["memory"])


class _Wrong(Exception):
    """Error of a law that gave what it must not."""


def packed(value: Any) -> Any:
    """A controller's memory for JSON.

    Raises:
        _Wrong: If it holds anything that cannot be saved.
    """
    if value is None or isinstance(value, bool | int | float | str):
        # also numbers of NumPy that are floats of Python by their class
        return float(value) if isinstance(value, np.floating) else value
    if isinstance(value, np.ndarray | np.generic) and np.asarray(value).dtype.kind in "biuf":
        array = np.asarray(value)
        return {ARRAY: array.tolist(), "dtype": array.dtype.str, "shape": list(array.shape)}
    if isinstance(value, tuple):
        return {TUPLE: [packed(v) for v in value]}
    if isinstance(value, list):
        return [packed(v) for v in value]
    if isinstance(value, dict) and all(isinstance(k, str) for k in value):
        return {DICT: {k: packed(v) for k, v in value.items()}}
    raise _Wrong(
        f"its state holds {show(value)}, which cannot be saved; it must be made of numbers, texts, "
        "arrays of numbers, and lists, tuples and dicts of these"
    )


def unpacked(value: Any) -> Any:
    """A memory from what was saved.

    Args:
        value: As from `packed`.
    """
    if isinstance(value, list):
        return [unpacked(v) for v in value]
    if not isinstance(value, dict):
        return value
    if ARRAY in value:
        array = np.array(value[ARRAY], dtype=value["dtype"]).reshape(value["shape"])
        return array if value["shape"] else array[()]
    if TUPLE in value:
        return tuple(unpacked(v) for v in value[TUPLE])
    return {k: unpacked(v) for k, v in value[DICT].items()}
