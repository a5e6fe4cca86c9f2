"""Checked frozen dataclasses, and checks of directions."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import field, fields
from typing import Any, dataclass_transform

import numpy as np
from pydantic import ConfigDict, ValidationError
from pydantic.dataclasses import dataclass as pydantic_dataclass

from shellmb.errors import SceneError
from shellmb.scene.values.messages import in_words as in_words
from shellmb.scene.values.messages import plain, sentence, with_name
from shellmb.scene.values.messages import show as show
from shellmb.scene.values.renamed import still_read


def _tuples(value: Any) -> Any:
    """A plain value, with tuples for lists, also within lists and tuples."""
    value = plain(value)
    return tuple(_tuples(v) for v in value) if type(value) in (list, tuple) else value


def edge_names(edge: str | tuple[str, ...]) -> tuple[str, ...]:
    """One name or several, always as a tuple."""
    return (edge,) if isinstance(edge, str) else edge


def unit_vector(v: Sequence[float], what: str) -> np.ndarray:
    """``v / |v|``, shape (3,).

    Args:
        v: A vector.
        what: Who asks, for the error, as in ``"cylinder: axis"``.

    Raises:
        SceneError: If ``v`` has no direction.
    """
    a = np.asarray(v, dtype=float)
    norm = float(np.linalg.norm(a))
    if not norm > 0:
        raise SceneError(f"{what} is {show(v)}; it must have a length greater than 0")
    return a / norm


def frame(
    what: str, first: str, a: Sequence[float], second: str, b: Sequence[float]
) -> tuple[Any, Any, Any]:
    """Orthonormal axes from two vectors that have to be perpendicular."""
    e1, e2 = unit_vector(a, f"{what}: {first}"), unit_vector(b, f"{what}: {second}")
    # the cosine of their angle, beyond round-off
    if abs(e1 @ e2) > 1e-9:
        raise SceneError(
            f"{what}: {first} {show(a)} and {second} {show(b)} are not perpendicular; they must be"
        )
    return e1, e2, np.cross(e1, e2)


def _plainly(made: Any, name: str, value: Any) -> Any:
    """A value with tuples for lists and arrays, unless the class takes it as it is given."""
    try:
        return value if name in getattr(made, "AS_GIVEN", ()) else _tuples(value)
    except RecursionError:
        raise SceneError(
            f"{made.label}: {name} is a list that holds itself; it must hold values"
        ) from None


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def described[T](label: str) -> Callable[[type[T]], type[T]]:
    """Make a class a frozen pydantic dataclass whose construction fails with one sentence.

    Args:
        label: What a user calls such an object, as in ``"isotropic section"``; begins messages.

    Returns:
        The class decorator. The decorated class raises :class:`SceneError` only.
    """

    def decorate(cls: type[T]) -> type[T]:
        # strict: neither texts nor truth values are numbers, and numbers are no truth values
        config = ConfigDict(
            arbitrary_types_allowed=True, extra="forbid", strict=True, defer_build=True
        )
        made: Any = pydantic_dataclass(frozen=True, config=config)(cls)
        checked_init = made.__init__

        @functools.wraps(checked_init)
        def init(self: Any, *args: Any, **kwargs: Any) -> None:
            given = zip((f.name for f in fields(made)), args, strict=False)
            args = (*(_plainly(made, *pair) for pair in given), *args[len(fields(made)) :])
            kwargs = {n: _plainly(made, n, v) for n, v in still_read(label, kwargs).items()}
            try:
                checked_init(self, *args, **kwargs)
            except ValidationError as failure:
                said = with_name(label, made, args, kwargs)
                raise SceneError(sentence(said, made, failure)) from None
            finally:
                # pydantic builds checks with the first object, and puts its own in place
                if made.__init__ is not init:
                    made.__init__ = init

        made.__init__ = init
        made.label = label
        return made

    return decorate


def extended[T](label: str) -> Callable[[type[T]], type[T]]:
    """:func:`described` for a class that adds no fields to those of its described base.

    A type checker takes its fields from there: mypy would read one of `Several` as it is given.

    Args:
        label: What a user calls such an object.
    """
    return described(label)
