"""Couplings of the coordinates of joints: gears, belts, differentials, and sums of one's own."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from shellmb.scene.multibody.elements import Coordinate, JointElement
from shellmb.scene.types import Finite, Name, Positive
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import Sentences, described, show

# name of a joint with one coordinate, or of any joint and a coordinate
Which = Name | tuple[Name, Coordinate]


@dataclass(frozen=True)
class Coupled(JointElement):
    """A coordinate of a coupling.

    Args:
        name: Name of the coupling.
        joint: Name of the joint.
        coordinate: Which of its coordinates; None: the only one.
        factor: Its factor.
    """

    coordinate: Coordinate | None
    factor: float

    label: ClassVar[str] = "coupling"


@described("relation")
class Relation:
    """Base class of couplings: a sum of factors times coordinates has a given value.

    Args:
        name: Its name in the results.

    Attributes:
        given: The value as a function of time; empty: zero.
        above: What it must be greater than.
        turns: Whether all coordinates must be rotations.
    """

    name: Name
    label: ClassVar[str]
    above: ClassVar[float] = -math.inf
    turns: ClassVar[bool] = False

    @property
    def said(self) -> str:
        """Name that messages use for it."""
        return f"{self.label} '{self.name}'"

    @property
    def weights(self) -> Sequence[tuple[Any, float]]:
        """Each coordinate with its factor."""
        raise NotImplementedError

    @property
    def given(self) -> tuple[TimeFunction, ...]:
        """The value over time, if it has one."""
        return ()

    @property
    def terms(self) -> tuple[Coupled, ...]:
        """The coordinates with their factors."""
        given = [(w if isinstance(w, tuple) else (w, None), f) for w, f in self.weights]
        return tuple(Coupled(self.name, joint, kind, f) for (joint, kind), f in given)


@described("coupling")
class Coupling(Relation):
    """The sum of factors times coordinates of joints stays as it begins, or follows a function.

    A coordinate is the name of a joint, or with ``"rotation"`` or ``"translation"`` where the joint
    has both, as in ``{"wheel": 0.1, ("slide", "translation"): -1.0}``.

    Args:
        name: Its name in the results.
        factors: Factor of each coordinate, not zero; at least two.
        value: The sum over time, which begins as zero; None: zero.
    """

    factors: Mapping[Which, Finite]
    value: TimeFunction | None = None

    def _wrong(self) -> Sentences:
        """Refuse factors of zero."""
        for which, factor in self.factors.items():
            if factor == 0:
                yield f"the factor of {show(which)} is 0; it must not be 0"

    @property
    def weights(self) -> Sequence[tuple[Any, float]]:
        """Each coordinate with its factor."""
        return list(self.factors.items())

    @property
    def given(self) -> tuple[TimeFunction, ...]:
        """The sum, if it is given."""
        return () if self.value is None else (self.value,)


@described("gear")
class Gear(Relation):
    """A coordinate in proportion to another one, with any ratio: gears, rack and pinion.

    Args:
        name: Its name in the results.
        first: Joint of the first coordinate, or the joint and ``"rotation"`` or ``"translation"``.
        second: That of the second one.
        ratio: The second coordinate over the first one: of outer gears minus the first number of
            teeth over the second, of a pinion and its rack the radius of the pinion [m/rad].
    """

    first: Which
    second: Which
    ratio: Finite = field(kw_only=True)

    def _wrong(self) -> Sentences:
        """Refuse a ratio of zero."""
        if self.ratio == 0:
            yield "ratio", "it must not be 0; what keeps the second coordinate at 0 is a Lock"

    @property
    def weights(self) -> Sequence[tuple[Any, float]]:
        """Each coordinate with its factor."""
        return (self.first, -self.ratio), (self.second, 1.0)


@described("belt")
class Belt(Relation):
    """A belt or chain around two pulleys, which does not slip.

    Args:
        name: Its name in the results.
        first: Joint about which the first pulley turns.
        second: That of the second one; both axes point to the same side.
        radii: Their radii [m].
        crossed: Whether the pulleys turn against each other.
    """

    first: Which
    second: Which
    radii: tuple[Positive, Positive] = field(kw_only=True)
    crossed: bool = field(default=False, kw_only=True)

    turns = True

    @property
    def weights(self) -> Sequence[tuple[Any, float]]:
        """Each coordinate with its factor."""
        a, b = self.radii
        return (self.first, a), (self.second, b if self.crossed else -b)


@described("differential")
class Differential(Relation):
    """Three rotations about one line: a differential, or the sun, ring and carrier of a planet.

    Relative to the carrier both wheels turn by angles whose sum, weighted by the teeth, is zero
    (Willis).

    Args:
        name: Its name in the results.
        carrier: Joint about which the carrier turns.
        first: That of the first wheel, an output or the sun.
        second: That of the second one, an output or the ring.
        teeth: Numbers of teeth of both wheels.
    """

    carrier: Which
    first: Which
    second: Which
    teeth: tuple[Positive, Positive] = field(default=(1.0, 1.0), kw_only=True)

    turns = True

    @property
    def weights(self) -> Sequence[tuple[Any, float]]:
        """Each coordinate with its factor."""
        a, b = self.teeth
        return (self.first, a), (self.second, b), (self.carrier, -a - b)
