"""Controllers: laws in plain Python with a memory, which read sensors and give commands."""

import copy
import math
from collections.abc import Callable
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, InstanceOf

from shellmb.arrays import Floats
from shellmb.scene.control.sensors import Sensor
from shellmb.scene.types import Finite, Name, NonNegative, Positive, Several
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import Sentences, as_names, described, show


class Law:
    """Any controller.

    Attributes:
        name: What commands and results call it.
        sensors: What it reads.
        outputs: Names of what it gives.
        state: Its memory before the first sample.
        period: Time from sample to sample [s]; None: it is sampled before each step.
    """

    name: str
    sensors: tuple[Sensor, ...]
    outputs: tuple[str, ...]
    state: Any
    period: float | None
    label: ClassVar[str]

    def act(self, t: float, readings: Floats, state: Any, dt: float) -> Any:
        """Outputs, one number or as many as there are, and the new state.

        Args:
            t: Time of the sample [s].
            readings: What the sensors read, in their order.
            state: What it gave last.
            dt: Time since the last sample [s]; 0 at the first.
        """
        raise NotImplementedError


@described("controller")
class Controller(Law):
    """A law in Python or NumPy that reads sensors and returns commands, constant between samples.

    A motor takes its torque or force from it, ``Motor("drive", "hinge", command=Command("name"))``,
    a load its factor, ``time=Command("name")``, a driver its acceleration,
    ``rotation=Acceleration("name")``.

    Args:
        name: What commands and results call it.
        sensors: What it reads.
        law: ``law(t, readings, state, dt) -> outputs, state``: of the time [s], what the sensors
            read, shape (sensors,), its memory, and the time since its last sample [s], 0 at
            first. The outputs are one number or as many as there are names. It must depend on
            nothing else: what it remembers is the state, which ``shellmb resume`` goes on with. A
            run works with a copy of the state, and of a law that is an object.
        outputs: Names of its outputs.
        state: Its memory at first: numbers, texts, arrays, and lists, tuples and dicts of these.
        period: Time from sample to sample [s], the first at 0; None: before each step.
    """

    name: Name
    sensors: Several[Sensor]
    law: Callable[..., Any]
    outputs: Annotated[tuple[Name, ...], BeforeValidator(as_names)] = ("u",)
    state: Any = None
    period: Positive | None = None

    AS_GIVEN: ClassVar[tuple[str, ...]] = ("state",)

    def _wrong(self) -> Sentences:
        """Check that it gives something."""
        if not self.outputs or len(set(self.outputs)) < len(self.outputs):
            yield "outputs", "it must be one name at least, each once"
        try:
            copy.deepcopy(self.state)
        except Exception as error:
            yield (
                f"state is {show(self.state)}, which cannot be copied ({error}); it must be "
                "numbers, texts, arrays, lists, tuples and dicts of these"
            )

    def act(self, t: float, readings: Floats, state: Any, dt: float) -> Any:
        """Outputs and the new state, by the law."""
        return self.law(t, readings, state, dt)


@described("PID controller")
class PID(Law):
    """Proportional, integral and derivative: ``u = kp e + ki int e dt + kd de/dt``, limited.

    Of the error ``e = target - sensor``. The integral is that of the trapezoidal rule; the rate of
    the sensor is read, that of the target is its change since the last sample. Where a limit holds
    the output back the integral does not grow further beyond it.

    Args:
        name: What commands and results call it; its only output is ``"u"``.
        sensor: What is controlled.
        target: What it is to be: a number or a function of time.
        kp: Proportional gain.
        ki: Integral gain [1/s].
        kd: Derivative gain [s].
        limits: Least and largest output; None: no limits.
        filter: Time constant of a low-pass filter of first order of the derivative [s]; 0: none.
        period: Time from sample to sample [s], the first at 0; None: before each step.
    """

    name: Name
    sensor: InstanceOf[Sensor]
    target: Finite | TimeFunction
    kp: Finite
    ki: Finite = 0.0
    kd: Finite = 0.0
    limits: tuple[float, float] | None = None
    filter: NonNegative = 0.0
    period: Positive | None = None

    outputs = ("u",)
    # at first; then integral, derivative, error and target of the previous sample
    state = None

    def _wrong(self) -> Sentences:
        """Check the limits."""
        if self.limits is not None and not self.limits[0] < self.limits[1]:
            yield "limits", "the first must be less than the second"

    @property
    def sensors(self) -> tuple[Sensor, ...]:  # type: ignore[override]
        """Sensors that it reads; the rate is among them if it counts."""
        return (self.sensor, self.sensor.rate) if self.kd else (self.sensor,)

    def act(self, t: float, readings: Floats, state: Any, dt: float) -> Any:
        """Output and memory."""
        target = float(self.target(t)) if callable(self.target) else self.target
        error = target - float(readings[0])
        integral, derivative, before, aim = (0.0, 0.0, error, target) if state is None else state
        if self.kd:
            moving = (target - aim) / dt if dt > 0 else 0.0
            rate = self.kd * (moving - float(readings[1]))
            late = self.filter / (self.filter + dt) if self.filter and state is not None else 0.0
            derivative = late * derivative + (1 - late) * rate
        grown = integral + self.ki * dt * (error + before) / 2
        low, high = self.limits or (-math.inf, math.inf)
        wanted = self.kp * error + grown + derivative
        output = min(max(wanted, low), high)
        # held back, and it would be held back more
        if (wanted - output) * (grown - integral) > 0:
            grown = integral
            output = min(max(self.kp * error + grown + derivative, low), high)
        return output, (grown, derivative, error, target)
