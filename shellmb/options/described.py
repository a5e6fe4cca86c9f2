"""Options described once, as fields of dataclasses: signatures and docstrings are made of them."""

from __future__ import annotations

import functools
import inspect
import re
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import Any, Literal, cast, get_args, get_origin, get_type_hints

from shellmb.errors import SceneError

# where a field keeps what it says of itself; columns of a docstring
KEY, WIDTH = "option", 100


@dataclass(frozen=True)
class About:
    """Description of an option beside its name, type and default.

    Args:
        help: What it is, with its unit.
        metavar: What stands for its value on the command line; None: what its type says.
        flag: Its name there; None: its own.
        parse: Makes its value of a text; None: as its type says.
        many: Whether it has several values: on the command line with commas between them.
    """

    help: str
    metavar: str | None = None
    flag: str | None = None
    parse: Callable[[str], Any] | None = None
    many: bool = False


@dataclass(frozen=True)
class Option:
    """An option of a dataclass.

    Args:
        name: Its name in Python.
        type: Its type, of several values that of one, without None.
        written: Its annotation in Python.
        default: What is taken where nothing is given.
        about: What it says of itself.
    """

    name: str
    type: Any
    written: str
    default: Any
    about: About

    @property
    def flag(self) -> str:
        """Name of the option on the command line."""
        return self.about.flag or "--" + self.name.replace("_", "-")

    @property
    def choices(self) -> tuple[Any, ...]:
        """All values that it may have; none: its type says."""
        return get_args(self.type) if get_origin(self.type) is Literal else ()

    def value(self, text: str) -> Any:
        """The value that a text means.

        Raises:
            ValueError: If it means none.
            SceneError: The same, where there is more to say of it.
        """
        if self.about.parse is not None:
            return self.about.parse(text)
        if not self.choices:
            return self.type(text)
        if text not in map(str, self.choices):
            listed = " or ".join(f"'{choice}'" for choice in self.choices)
            raise SceneError(f"{self.name}: '{text}' is not possible here; it must be {listed}")
        return type(self.choices[0])(text)


def option(help: str, default: Any = None, **more: Any) -> Any:
    """A field of a dataclass that is an option.

    Args:
        help: What it is, with its unit.
        default: What is taken where nothing is given.
        more: As of `About`.
    """
    return field(default=default, metadata={KEY: About(help, **more)})


def several(kind: type, name: str, metavar: str, parse: Callable[[str], Any] | None = None) -> Any:
    """A field for several values of another dataclass' option.

    Args:
        kind: The dataclass.
        name: The option.
        metavar: What stands for its values on the command line.
        parse: Makes a value of a text; None: as the option does.
    """
    one = options_of(kind, name)[0]
    about = replace(one.about, metavar=metavar, parse=parse or one.value, many=True)
    return field(default=(), metadata={KEY: about})


def options_of(kind: Any, *names: str) -> list[Option]:
    """The options of a dataclass.

    Args:
        kind: The dataclass.
        names: The only ones wanted, in their order; none: all.
    """
    hints, found = get_type_hints(kind), {}
    for one in fields(kind):
        about = one.metadata.get(KEY)
        if about is None:
            continue
        written = str(one.type)
        if about.many:
            type_ = get_args(hints[one.name])[0]
            single = written.removeprefix("tuple[").removesuffix(", ...]")
            written = f"Sequence[{single}{' | str' if get_args(type_) else ''}]"
        else:
            type_ = next((t for t in get_args(hints[one.name]) if t is not type(None)), None)
            if type_ is None or get_origin(hints[one.name]) is Literal:
                type_ = hints[one.name]
            if about.parse is not None:
                written = written.replace(" | None", " | str | None")
        default = None if one.default is MISSING else one.default
        found[one.name] = Option(one.name, type_, written, default, about)
    return [found[name] for name in names or found]


def read(kind: Any, given: Mapping[str, Any]) -> dict[str, Any]:
    """Values of options, where texts stand for them, too.

    Args:
        kind: The dataclass.
        given: Values by the names of its options.

    Raises:
        SceneError: If a text means no value.
        ValueError: The same.
    """
    found = dict(given)
    for one in options_of(kind):
        value = given.get(one.name)
        if value is None:
            continue
        if one.about.many:
            values = (one.value(v) if isinstance(v, str) else v for v in value)
            found[one.name] = tuple(tuple(v) if isinstance(v, list) else v for v in values)
        elif isinstance(value, str) and one.about.parse is not None:
            found[one.name] = one.value(value)
    return found


def takes[F: Callable[..., Any]](*options: Option) -> Callable[[F], F]:
    """Let a function with `**options` list them in its signature and its docstring.

    Args:
        options: The options; those that the function has as parameters of its own stay as they are.
    """

    def decorate(function: F) -> F:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        named = {p.name for p in own}
        more = [
            inspect.Parameter(
                o.name, inspect.Parameter.KEYWORD_ONLY, default=o.default, annotation=o.written
            )
            for o in options
            if o.name not in named
        ]
        lines = [
            textwrap.fill(
                f"{o.name}: {o.about.help}",
                WIDTH,
                initial_indent=" " * 8,
                subsequent_indent=" " * 12,
            )
            for o in options
            if o.name not in named
        ]
        shown = signature.replace(parameters=[*own, *more])

        @functools.wraps(function)
        def named_ones(*args: Any, **kwargs: Any) -> Any:
            try:
                shown.bind(*args, **kwargs)
            except TypeError as error:
                # as Python says it of any function
                raise TypeError(f"{function.__name__}() {error}") from None
            return function(*args, **kwargs)

        made: Any = named_ones
        made.__signature__ = shown
        said = "\n".join(lines)
        doc = function.__doc__ or ""
        made.__doc__ = re.sub(r"^ +\*\*\w+:.*$", lambda _: said, doc, flags=re.MULTILINE)
        return cast(F, made)

    return decorate


def positive(text: str) -> float:
    """A positive number from a text.

    Raises:
        ValueError: If it is none.
    """
    value = float(text)
    if not 0 < value < float("inf"):
        raise ValueError(text)
    return value


def parse_mesh(text: str) -> tuple[int, int]:
    """Counts of elements from "NxM".

    Raises:
        SceneError: If the text is not of that form.
    """
    first, x, second = text.lower().partition("x")
    if not (x and first.isdecimal() and second.isdecimal()):
        raise SceneError(f"mesh is '{text}'; it must be two counts as in 8x4")
    return int(first), int(second)
