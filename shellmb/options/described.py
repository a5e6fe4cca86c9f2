"""Options described once, as fields of dataclasses: signatures and docstrings are made of them."""

import functools
import inspect
import os
import re
import textwrap
from ast import literal_eval
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Literal, cast, get_args, get_origin, get_type_hints

from shellmb.errors import SceneError

# where a field keeps what it says of itself; columns of a docstring
KEY, WIDTH = "option", 100
# nothing has as many, and larger numbers are none of C
MOST = 10**9


@dataclass(frozen=True)
class About:
    """Description of an option beside its name, type and default.

    Args:
        help: What it is, with its unit.
        metavar: What stands for its value on the command line; None: what its type says.
        flag: Its name there; None: its own.
        parse: Makes its value of a text; None: as its type says.
        many: Whether it has several values: on the command line with commas between them.
        former: Its former name in Python, rejected with an error that has the present one.
        former_flag: Its former name on the command line.
    """

    help: str
    metavar: str | None = None
    flag: str | None = None
    parse: Callable[[str], Any] | None = None
    many: bool = False
    former: str | None = None
    former_flag: str | None = None


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

    @property
    def kind(self) -> str:
        """Type as it is written, of several values that of one, without None."""
        if self.type == tuple[int, int]:
            return "counts"
        # an object of the user's own may stand for the name of a scheme
        if self.name in ("scheme", "reference"):
            return "scheme"
        return str(self.type.__name__) if self.about.many else self.written.removesuffix(" | None")

    def takes(self, value: Any) -> bool:
        """Decide whether one of several values is of its type, or a text that means one."""
        if not isinstance(value, str):
            return value is None or bool(self.choices) or _unfit(self.kind, value) is None
        try:
            self.value(value)
        except (ValueError, SceneError):
            return False
        return True

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


def of_today(kind: Any, stored: Mapping[str, Any]) -> dict[str, Any]:
    """Stored values of options by their names of today.

    Args:
        kind: The dataclass.
        stored: The values, of a run or a study that may be older than a name.
    """
    names = {o.about.former: o.name for o in options_of(kind) if o.about.former}
    return {names.get(name, name): value for name, value in stored.items()}


def takes[F: Callable[..., Any]](*options: Option) -> Callable[[F], F]:
    """Let a function with `**options` list them in its signature and its docstring.

    Args:
        options: The options; those that the function has as parameters of its own stay as they are.
    """

    def decorate(function: F) -> F:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        named = {p.name for p in own}
        others, kind = [o for o in options if o.name not in named], inspect.Parameter.KEYWORD_ONLY
        more = [
            inspect.Parameter(o.name, kind, default=o.default, annotation=o.written) for o in others
        ]
        said = [f"{' ' * 8}{o.name}: {o.about.help}" for o in others]
        lines = [textwrap.fill(text, WIDTH, subsequent_indent=" " * 12) for text in said]
        shown = signature.replace(parameters=[*own, *more])
        kinds: dict[str, Any] = {p.name: p.annotation for p in own}
        kinds |= {o.name: o for o in others}
        called = function.__qualname__.removesuffix(".__init__")

        @functools.wraps(function)
        def named_ones(*args: Any, **kwargs: Any) -> Any:
            for o in options:
                if o.about.former in kwargs and o.about.former not in shown.parameters:
                    raise SceneError(
                        f"{function.__name__}: {o.about.former} is now called {o.name}; write "
                        f"{o.name}=..."
                    )
            try:
                given = shown.bind(*args, **kwargs)
            except TypeError as error:
                # as Python says it of any function
                raise TypeError(f"{called}() {error}") from None
            for name, value in given.arguments.items():
                if wrong := _wrong(kinds.get(name), value):
                    # a command that only lists its options is there at once
                    from shellmb.scene.values.validate import show

                    raise SceneError(f"{called}: {name} is {show(value)}; it must be {wrong}")
            return function(*args, **kwargs)

        made: Any = named_ones
        made.__signature__ = shown
        text = "\n".join(lines)
        doc = function.__doc__ or ""
        made.__doc__ = re.sub(r"^ +\*\*\w+:.*$", lambda _: text, doc, flags=re.MULTILINE)
        return cast(F, made)

    return decorate


def checks[T: type](kind: T) -> T:
    """Let the methods of a class look at what they are given, as `takes` does."""
    for name, method in list(vars(kind).items()):
        if inspect.isfunction(method) and not name.startswith("_"):
            setattr(kind, name, takes()(method))
    return kind


def _wrong(kind: Option | str | None, value: Any) -> str | None:
    """Words for what a value should be, if it is of another kind; choices are checked elsewhere.

    Args:
        kind: The option, or how the type of a parameter is written.
        value: The value.
    """
    if isinstance(kind, Option):
        if value is None:
            return None
        if kind.about.many:
            if kind.kind == "scheme" and (isinstance(value, str) or _is_scheme(value)):
                return None
            fits = _is_several(value) and all(map(kind.takes, value))
            return None if fits else "a list of values"
        if kind.choices or (kind.about.parse and isinstance(value, str)):
            return None
        return _unfit(kind.kind, value)
    optional, kind = str(kind).endswith(" | None"), str(kind).removesuffix(" | None")
    return None if optional and value is None else _unfit(kind, value)


def _unfit(kind: str, value: Any) -> str | None:
    if kind.startswith("Literal[") and kind.endswith("]"):
        choices = literal_eval(kind.removeprefix("Literal"))
        known = isinstance(value, str) and value in choices
        return None if known else " or ".join(map(repr, choices))
    pairs = (pair for begin, pair in KINDS.items() if kind.startswith(begin))
    fits, words = next(pairs, (None, None))
    return None if fits is None or fits(value) else words


def _is_whole(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool) and abs(int(value)) < MOST


def _is_path(value: Any) -> bool:
    # a run stands for its own
    value = getattr(value, "directory", value)
    known = isinstance(value, str | os.PathLike) and bool(os.fsencode(value))
    parts = Path(value).parts if known else ()
    return known and all(len(os.fsencode(p)) < 256 and "\0" not in p for p in parts)


def _is_number(value: Any) -> bool:
    """Decide whether a value is one that fits into a float; which ones are right is no type's."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def _are_counts(value: Any) -> bool:
    several = not isinstance(value, str | bytes | Mapping) and hasattr(value, "__len__")
    return several and len(value) == 2 and all(map(_is_whole, value))


def _is_several(value: Any) -> bool:
    known = isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping)
    return known and getattr(value, "ndim", 1) == 1


def _is_scheme(value: Any) -> bool:
    """Decide whether a value is a scheme itself in place of its name."""
    return all(hasattr(value, name) for name in ("stages", "expand"))


def _is_mapping(value: Any) -> bool:
    return isinstance(value, Mapping) and all(isinstance(key, str) for key in value)


def _are_names(value: Any) -> bool:
    return isinstance(value, list | tuple) and all(isinstance(name, str) for name in value)


def _is_axis(value: Any) -> bool:
    return _is_whole(value) and value in (0, 1, 2)


def _is_vector(value: Any) -> bool:
    return _is_several(value) and len(value := list(value)) == 3 and all(map(_is_number, value))


def _has(*names: str) -> Callable[[Any], bool]:
    """Tell things by their methods, without the libraries that they are of."""
    return lambda value: all(callable(getattr(type(value), name, None)) for name in names)


# truth values of NumPy have the name of Python's
# by how a type begins where it is written: whether a value is of it, and what it must be
KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "bool": (lambda value: type(value).__name__ == "bool", "True or False"),
    "int": (_is_whole, "a whole number"),
    "float | Mapping": (lambda v: _is_number(v) or _is_mapping(v), "a number, or numbers by names"),
    "float": (_is_number, "a number"),
    "counts": (_are_counts, "two counts as in (8, 4) or '8x4'"),
    "Vec3 | int": (lambda v: _is_vector(v) or _is_axis(v), "0, 1, 2 or a vector"),
    "Vec3": (_is_vector, "three numbers"),
    "str | int": (lambda value: isinstance(value, str) or _is_whole(value), "a text or a number"),
    "str | Sequence": (lambda v: isinstance(v, str) or _are_names(v), "one name or several"),
    "scheme": (lambda value: isinstance(value, Hashable) or _is_scheme(value), "a text"),
    "str": (lambda value: isinstance(value, str), "a text"),
    "Sequence[str]": (lambda v: isinstance(v, str) or _are_names(v), "a list of names"),
    "Sequence[Observer]": (
        lambda value: _is_several(value) and all(map(_has("start", "accepted"), value)),
        "a list of observers",
    ),
    "MPI.Comm": (_has("Get_rank", "allreduce"), "a communicator of mpi4py"),
    "Executor": (_has("submit", "shutdown"), "an executor as of concurrent.futures"),
    "Path | str": (_is_path, "a path, of names with less than 256 letters"),
    "Mapping": (_is_mapping, "values by their names"),
    "Callable[[str]": (callable, "a function"),
}


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


def take[T](kind: type[T], options: dict[str, Any], **own: Any) -> T:
    """Take the choices of one kind out of the options of a command or function.

    Args:
        kind: The kind.
        options: The options, by their names.
        own: Others of them.

    Raises:
        SceneError: If a text means no value.
    """
    given = {one.name: options.pop(one.name, None) for one in options_of(kind)} | own
    return kind(**{k: v for k, v in read(kind, given).items() if v is not None})
