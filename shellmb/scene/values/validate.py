"""Checked frozen dataclasses, checks of directions, and errors as one plain sentence.

A sentence says who, which parameter, its value, and what would be right.
"""

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field, fields
from typing import Any, dataclass_transform, get_args

import numpy as np
from pydantic import ConfigDict, ValidationError
from pydantic.dataclasses import dataclass as pydantic_dataclass

from shellmb.errors import SceneError
from shellmb.scene.values.renamed import name_of_today, still_read

# what is wrong with a part of a scene, which `_wrong` of its class says: sentences, each of which
# says what would be right, or the name of a parameter and what would be right
type Sentences = Iterator[str | tuple[str, str]]


def plain(value: Any) -> Any:
    """NumPy scalars and arrays as Python numbers and lists, anything else as it is."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def show(value: Any) -> str:
    """``value`` for an error message: short, and without NumPy's type names."""
    value = plain(value)
    text = getattr(value, "__name__", None) or repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def listed(names: Iterable[str]) -> str:
    """Names for a message."""
    return ", ".join(f"'{n}'" for n in names)


def said(item: Any) -> str:
    """Name that messages use for a part of a scene."""
    own = f"{item.label} '{item.name}'" if hasattr(item, "name") else item.label
    return str(getattr(item, "said", own))


def in_words(error: BaseException) -> str:
    """Text of an error in a user's function, with its type where the text alone says little."""
    text = str(error)
    return text if isinstance(error, TypeError | ValueError) else f"{type(error).__name__}: {text}"


def error_of(part: Any, text: str) -> SceneError:
    """Error about a part of a scene, which it names first.

    Args:
        part: The part.
        text: Says what is wrong, and what would be right.
    """
    return SceneError(f"{said(part)}: {text}")


def refused(part: Any, name: str, right: str) -> SceneError:
    """Error about one parameter of a part of a scene, with its value.

    Args:
        part: The part.
        name: Name of the parameter.
        right: Says what would be right.
    """
    return error_of(part, f"{name} is {show(getattr(part, name))}; {right}")


def differ(part: Any, first: str, second: str, right: str = "they must differ") -> Sentences:
    """Say what is wrong with two equal parameters of a part of a scene.

    Args:
        part: The part.
        first: Name of one parameter.
        second: Name of the other.
        right: Says what would be right.
    """
    if getattr(part, first) == getattr(part, second):
        yield f"{first} and {second} are both {show(getattr(part, first))}; {right}"


def refuse(part: Any, sentences: Iterable[str | tuple[str, str]]) -> None:
    """Refuse a part of a scene with which anything is wrong.

    Args:
        part: The part.
        sentences: What is wrong with it.

    Raises:
        SceneError: With the first of them.
    """
    for wrong in sentences:
        raise error_of(part, wrong) if isinstance(wrong, str) else refused(part, *wrong)


UNKNOWN = "unexpected_keyword_argument"
_BOUNDS = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_KINDS = {
    "finite_number": "it must be a finite number",
    "float_type": "it must be a number",
    "int_type": "it must be a whole number",
    "string_type": "it must be a text",
    "tuple_type": "it must be a tuple",
    "string_too_short": "it must not be empty",
    "callable_type": "it must be a function",
    "bool_type": "it must be True or False",
}


def _requirement(error: Any) -> str:
    """Say what would be right, from one entry of ``ValidationError.errors()``."""
    kind, context = error["type"], error.get("ctx", {})
    if kind in _BOUNDS:
        words, key = _BOUNDS[kind]
        return f"it must be {words} {context[key]:g}"
    if kind == "value_error":
        return str(context["error"])
    if kind == "literal_error":
        return f"it must be {context['expected']}"
    if kind in ("is_instance_of", "dataclass_exact_type"):
        words = context.get("class") or context.get("class_name")
        return f"it must be {'an' if words[0] in 'AEIOU' else 'a'} {words.lower()}"
    return str(_KINDS.get(kind, error["msg"].replace("Input should", "it should")))


def _too_many(label: str, cls: Any) -> str:
    """Of a class that is given more than it takes without names."""
    first = [f.name for f in fields(cls) if not f.kw_only]
    others = [f.name for f in fields(cls) if f.kw_only]
    if not others:
        return f"{label}: it has {len(first)} parameters, and more are given: {', '.join(first)}"
    return (
        f"{label}: more than {', '.join(first)} are given without their names; the others must "
        f"have theirs: {'=, '.join(others)}="
    )


def _field(place: Any, names: list[str]) -> str:
    """Name of a parameter that pydantic gives by name or by position."""
    return names[place] if isinstance(place, int) and place < len(names) else str(place)


def sentence(label: str, cls: type, failure: ValidationError) -> str:
    """The first error of a construction.

    Args:
        label: Who, as `with_name` has it.
        cls: The class.
        failure: What pydantic says.
    """
    names = [f.name for f in fields(cls)]
    errors = failure.errors(include_url=False)
    for error in errors:
        former = str(error["loc"][0]) if error["loc"] else ""
        if error["type"] == UNKNOWN and (today := name_of_today(former, names)):
            return f"{label}: {former} is now called {today}; write {today}=..."
        if error["type"] == "unexpected_positional_argument":
            # before what seems to be missing, because it has no name
            return _too_many(label, cls)
        if error["type"] == "multiple_argument_values":
            placed = [f.name for f in fields(cls) if not f.kw_only]
            return (
                f"{label}: {former} is given twice, with and without its name; the order of those "
                f"without a name is {', '.join(placed)}"
            )
    error = errors[0]
    loc, kind = error["loc"], error["type"]
    first = loc[0] if loc else ""
    where = _field(first, names)
    where += "".join(f"[{i}]" for i in loc[1:] if isinstance(i, int))
    if kind in ("missing", "too_long") and len(loc) > int(kind == "missing"):
        return f"{label}: {_field(first, names)} has the wrong number of entries"
    if kind in ("missing", "missing_argument"):
        return f"{label}: {where} is missing; its parameters are {', '.join(names)}"
    if kind == UNKNOWN:
        return f"{label}: there is no parameter {where}; its parameters are {', '.join(names)}"
    right = _requirement(error)
    if not loc:
        # of the object as a whole: its arguments are no value to show
        return f"{label}: {right}"
    if kind == "is_instance_of" and (home := _home(cls, error["input"])):
        right += f"; what this is, belongs into {home}="
    return f"{label}: {where} is {show(error['input'])}; {right}"


def _home(cls: Any, value: Any) -> str | None:
    """The parameter of a class that takes several objects of the kind of a value."""
    for name, one in cls.__pydantic_fields__.items():
        kinds = get_args(one.annotation)
        kind = get_args(kinds[0])[0] if kinds and get_args(kinds[0]) else None
        if kinds[1:] == (...,) and isinstance(kind, type) and isinstance(value, kind):
            return str(name)
    return None


def with_name(label: str, cls: type, args: tuple[Any, ...], kwargs: dict[str, Any]) -> str:
    """``shell 'roof'`` rather than ``shell`` where a name was given."""
    names = [f.name for f in fields(cls)]
    if "name" not in names:
        return label
    position = names.index("name")
    name = kwargs.get("name", args[position] if len(args) > position else None)
    return f"{label} {name!r}" if isinstance(name, str) and name else label


def _tuples(value: Any) -> Any:
    """A plain value, with tuples for lists, also within lists and tuples."""
    value = plain(value)
    return tuple(_tuples(v) for v in value) if type(value) in (list, tuple) else value


def as_names(names: str | tuple[str, ...]) -> tuple[str, ...]:
    """One name or several, always as a tuple."""
    return (names,) if isinstance(names, str) else names


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
            for kind in reversed(type(self).__mro__):
                if "_wrong" in vars(kind):
                    refuse(self, vars(kind)["_wrong"](self))

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
