"""Types of the fields of a scene's parts, each with the check of its values."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    InstanceOf,
    ValidationError,
    WrapValidator,
)

from shellmb.scene.values.validate import plain


def number(value: Any) -> float:
    """``value`` as a float; truth values and texts are no numbers.

    Raises:
        ValueError: If it is none.
    """
    if isinstance(value, bool | np.bool_ | str | bytes):
        raise ValueError("it must be a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError("it must be a finite number") from None


def number_or_nan(value: Any) -> float:
    """``value`` as a float; what is no number becomes NaN, which is within no bounds."""
    try:
        return number(value)
    except (TypeError, ValueError):
        return math.nan


def _untrue(value: Any) -> Any:
    """For choices among numbers: Python counts True as 1."""
    if isinstance(value, bool):
        raise ValueError("it must be a number")
    return value


def numbers(value: Any) -> np.ndarray:
    """Numbers in rows and columns, each as :func:`number` takes it.

    Raises:
        ValueError: If something is no number, or rows differ in length.
        TypeError: The same.
    """
    array = np.asarray(plain(value), dtype=object)
    return np.array([number(v) for v in array.ravel()], dtype=float).reshape(array.shape)


def vector(value: Any) -> tuple[float, float, float]:
    """Three finite numbers.

    Raises:
        ValueError: If it is no such vector.
    """
    value = plain(value)
    try:
        if isinstance(value, str | bytes | dict | set | frozenset):
            raise TypeError("it has no order of components")
        x, y, z = (number(c) for c in value)
    except (TypeError, ValueError):
        raise ValueError("it must be a vector of three numbers") from None
    if not all(math.isfinite(c) for c in (x, y, z)):
        raise ValueError("every component must be finite")
    return (x, y, z)


def explained(right: str) -> WrapValidator:
    """One sentence for all that may be wrong with a value, as where it may have several forms.

    Args:
        right: Says what would be right.
    """

    def check(value: Any, usual: Callable[[Any], Any]) -> Any:
        try:
            return usual(plain(value))
        except ValidationError:
            raise ValueError(right) from None

    return WrapValidator(check)


def _once(value: Any) -> Any:
    """For names of edges: a load would act twice on one that is named twice."""
    if isinstance(value, tuple) and len(set(value)) < len(value) and isinstance(value[0], str):
        raise ValueError("it must name each edge once")
    return value


def _nonzero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if not any(value):
        raise ValueError("it must not be zero")
    return value


def _windows(value: Any) -> tuple[tuple[float, float], ...] | None:
    """Windows of time; a single pair is welcome."""
    value = plain(value)
    if value is None:
        return None
    try:
        single = isinstance(value[0], int | float)
        pairs = tuple((number(a), number(b)) for a, b in ([value] if single else value))
    except (TypeError, ValueError, IndexError, KeyError):
        raise ValueError("it must be a pair (start, end) of times, or several pairs") from None
    last = -math.inf
    for a, b in pairs:
        if not (math.isfinite(a) and last < a < b):
            raise ValueError("its times must increase from each start to its end to the next start")
        last = b
    return pairs


Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
# no run has more of anything that is counted, and larger ones are no numbers of C
PositiveInt = Annotated[int, Field(gt=0, le=10**9)]
Untrue = BeforeValidator(_untrue)
Name = Annotated[str, Field(min_length=1)]
Vec3 = Annotated[tuple[float, float, float], BeforeValidator(vector)]
Axis = Annotated[Vec3, AfterValidator(_nonzero)]
Matrix3 = Annotated[
    tuple[Vec3, Vec3, Vec3], explained("it must be three rows of three finite numbers")
]
Spot = Annotated[
    Name | Vec3, explained("it must be the name of a point or finite coordinates (x, y, z)")
]
Windows = Annotated[tuple[tuple[float, float], ...], BeforeValidator(_windows)]
Names = Annotated[tuple[Name, ...], Field(min_length=1)]
Edge = Annotated[
    Name | Names,
    explained("it must be the name of an edge or a tuple of such names"),
    AfterValidator(_once),
]
Place = Annotated[
    Name | Names | Vec3,
    explained("it must be a name, a tuple of names, or finite coordinates (x, y, z)"),
    AfterValidator(_once),
]

# type checkers take a field whose type is a descriptor as it is set when an object is made, and as
# it is read afterwards (mypy: of the class itself, not of one that is derived from it)
if TYPE_CHECKING:

    class Held[R, G]:
        """A field that is read as ``R`` and given as ``G``."""

        def __get__(self, made: Any, kind: Any, /) -> R: ...

        def __set__(self, made: Any, value: G, /) -> None: ...

    type Several[T] = Held[tuple[T, ...], T | Sequence[T]]
    type Listed[T] = Held[tuple[T, ...], Sequence[T] | NDArray[Any]]
    type Completed = Held[float, float | None]
    type Vector = Held[tuple[float, float, float], Sequence[float] | NDArray[Any]]
    type OneWindowOrMore = Held[
        tuple[tuple[float, float], ...] | None,
        tuple[float, float] | Sequence[tuple[float, float]] | None,
    ]
else:
    _T = TypeVar("_T")

    class Held:
        """A field is checked as it is read."""

        def __class_getitem__(cls, kinds: tuple[Any, Any]) -> Any:
            return kinds[0]

    Listed = tuple[_T, ...]
    Completed, OneWindowOrMore, Vector = Positive | None, Windows | None, Vec3
    Several = Annotated[
        tuple[InstanceOf[_T], ...],
        BeforeValidator(lambda given: given if isinstance(given, tuple) else (given,)),
    ]
# defaults of such fields: no objects, nothing at all, and zero
NONE: Any = ()
NOTHING: Any = None
ORIGIN: Any = (0.0, 0.0, 0.0)
