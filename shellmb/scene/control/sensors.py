"""Sensors, formulas of them, conditions on these, and events that go on when one is true."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator
from typing import Annotated, Any

from pydantic import InstanceOf

from shellmb.errors import SceneError
from shellmb.scene.types import Name, Positive
from shellmb.scene.values.validate import Sentences, described, show

# what a sensor reads now
type Reading = Callable[["Sensor"], float]

_OPERATIONS: dict[str, Callable[..., float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "abs": abs,
}
# what the rate of a column is called
RATE = ".rate"
# margin of a strict comparison of equals: as little below zero as a number can be
_NOT_YET = -5e-324


def _formula(sign: str, turned: bool = False) -> Callable[[Any, Any], Formula]:
    """Operator that makes a formula of a quantity and something, or of both in turned order."""
    return lambda one, other: Formula(sign, (other, one) if turned else (one, other))


def _condition(sign: str) -> Callable[[Any, Any], Condition]:
    """Operator that compares a quantity with something."""
    return lambda one, other: Condition(sign, (one, other))


class Quantity:
    """A number that a run knows at the end of each step; to be calculated and compared with."""

    def value(self, read: Reading, t: float) -> float:
        """Value of the quantity.

        Args:
            read: What sensors read.
            t: Time [s].
        """
        raise NotImplementedError

    __add__, __radd__ = _formula("+"), _formula("+", turned=True)
    __sub__, __rsub__ = _formula("-"), _formula("-", turned=True)
    __mul__, __rmul__ = _formula("*"), _formula("*", turned=True)
    __truediv__ = _formula("/")

    def _refuse(self, other: Any) -> Formula:
        raise SceneError(
            f"formula of a sensor and {show(other)}: a sensor can be added, subtracted, multiplied "
            "and divided by something, and abs() taken; anything else is a controller's law"
        )

    __rtruediv__ = __pow__ = __rpow__ = __mod__ = __rmod__ = _refuse
    __floordiv__ = __rfloordiv__ = __matmul__ = __rmatmul__ = _refuse

    def __neg__(self) -> Formula:
        return Formula("*", (-1.0, self))

    def __abs__(self) -> Formula:
        return Formula("abs", (self,))

    __ge__, __gt__ = _condition(">="), _condition(">")
    __le__, __lt__ = _condition("<="), _condition("<")


@described("sensor")
class Sensor(Quantity):
    """Reads a number of the run at the end of each step.

    Args:
        column: What ``history.csv`` calls it: the name of a probe, ``"JOINT.rotation"`` [rad] or
            ``"JOINT.translation"`` [m] of any joint that has it, ``"JOINT.F1"`` to ``"JOINT.M3"``,
            ``"NAME.torque"`` and ``"NAME.force"`` of drivers and force elements,
            ``"ELEMENT.length"``, energies, momenta. What is a mean over a step is 0 before the
            first.
        derivative: Whether its rate is read: of coordinates of joints that of the motion at the end
            of the step, of all others what it has changed by over the step, over its length.
    """

    column: Name
    derivative: bool = False

    @property
    def rate(self) -> Sensor:
        """Rate of the value.

        Raises:
            SceneError: If it is one already.
        """
        if self.derivative:
            raise SceneError(
                f"sensor '{self.name}': it is a rate already; it must be that of a column, "
                f"Sensor('{self.column}').rate"
            )
        return Sensor(self.column, derivative=True)

    @property
    def name(self) -> str:
        """Name of its readings in results."""
        return f"{self.column}{RATE}" if self.derivative else self.column

    def value(self, read: Reading, t: float) -> float:
        """Reading of the sensor."""
        return read(self)


def sensors_of(part: Any) -> Iterator[Sensor]:
    """All sensors in a formula or condition.

    Args:
        part: It, or a part of it.
    """
    if isinstance(part, Sensor):
        yield part
    elif isinstance(part, Formula | Condition):
        for inner in part.parts:
            yield from sensors_of(inner)


def _wrong_operands(what: str, parts: tuple[Any, ...]) -> Sentences:
    """Refuse what has no value: neither a quantity, a number, nor a function of time."""
    for part in parts:
        if isinstance(part, Quantity) or callable(part):
            continue
        if isinstance(part, bool) or not isinstance(part, int | float) or math.isnan(part):
            yield (
                f"{what} {show(part)}: a sensor can be compared and calculated with a number, a "
                "function of time or another sensor"
            )


def _value(part: Any, read: Reading, t: float) -> float:
    if isinstance(part, Quantity):
        return part.value(read, t)
    return float(part(t)) if callable(part) else float(part)


@described("formula")
class Formula(Quantity):
    """An expression of sensors, numbers and functions of time, by ``+ - * /`` and ``abs``.

    Args:
        operation: One of them.
        parts: What it is applied to.
    """

    operation: str
    parts: tuple[Any, ...]

    def _wrong(self) -> Sentences:
        """Check what it is applied to."""
        return _wrong_operands(f"'{self.operation}' of", self.parts)

    def value(self, read: Reading, t: float) -> float:
        """Value of the quantity."""
        return _OPERATIONS[self.operation](*(_value(part, read, t) for part in self.parts))


@described("condition")
class Condition:
    """A comparison of sensors, ``angle >= 1.5``, or two of them joined by ``&`` or ``|``.

    Args:
        operation: One of ``>=``, ``>``, ``<=``, ``<``, ``&``, ``|``.
        parts: What it compares, or the two conditions.
    """

    operation: str
    parts: tuple[Any, Any]

    def _wrong(self) -> Sentences:
        """Check what is compared."""
        return _wrong_operands(self.operation, () if self.operation in "&|" else self.parts)

    def __and__(self, other: Condition) -> Condition:
        return Condition("&", (self, other))

    def __or__(self, other: Condition) -> Condition:
        return Condition("|", (self, other))

    def __bool__(self) -> bool:
        raise SceneError(
            "condition: only a run knows whether it is true; it must be given as it is, without "
            "`and`, `or` and `not`, and two of them joined by & or |, each in brackets"
        )

    def margin(self, read: Reading, t: float) -> float:
        """Margin by which it is true; negative where it is false.

        Args:
            read: What sensors read.
            t: Time [s].
        """
        first, second = self.parts
        if self.operation in "&|":
            both = first.margin(read, t), second.margin(read, t)
            return min(both) if self.operation == "&" else max(both)
        by = _value(first, read, t) - _value(second, read, t)
        by = by if self.operation.startswith(">") else -by
        return _NOT_YET if by == 0 and not self.operation.endswith("=") else by


# true at the start
ALWAYS = Condition(">=", (0.0, 0.0))


@described("event")
class Event:
    """An event that goes on when a condition becomes true, and off when another one does.

    A condition that is true at the start counts at once. Later only one that has been false does:
    what goes off does not go on again before ``when`` has been false. The step in which a condition
    becomes true is repeated, shorter, until it ends there.

    Args:
        name: What locks, loads and results call it.
        when: The condition at which it goes on, as ``Sensor("hinge.rotation") >= 1.5``.
        until: The condition at which it goes off; None: it stays on.
        ends: Whether the run ends when it goes on.
        tolerance: How much later than the condition the step may end [s]; None: 1e-6 of ``dt``. No
            step is shorter than 1e-3 of ``dt``: an event closer than this to another event, or to
            a fixed step end, is handled at that instant.
    """

    name: Name
    when: Annotated[Condition, InstanceOf[Condition]]
    until: Annotated[Condition, InstanceOf[Condition]] | None = None
    ends: bool = False
    tolerance: Positive | None = None
