"""Functions of the user's: their values at positions and times, copies, and trials of them."""

import copy
import inspect
import types
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np

from shellmb.arrays import Floats, reals
from shellmb.errors import SceneError
from shellmb.scene.values.validate import in_words, show

# functions that are called with more than numbers, or do more than to give some
OTHERS = {"results", "build", "energy", "strains", "terms"}
# in place of a number that is none, or an error
NONE = 1e300
# positions where functions of position are tried [m], and parameters of surfaces
POSITIONS = np.random.default_rng(1).random((3, 4))
OfPosition = Callable[[Any], Any]
# what could be made a float, and is not meant as one, by NumPy's kinds
NO_NUMBERS = {"b": "truth values", "c": "complex numbers"}
# in what a function may keep a memory as a default argument
MUTABLE = (list, dict, set, bytearray, np.ndarray)


def with_own_defaults(function: types.FunctionType) -> types.FunctionType:
    """A function with copies of its defaults; itself if none of them may be changed in place."""
    defaults, named = function.__defaults__, function.__kwdefaults__
    held = [*(defaults or ()), *(named or {}).values()]
    if not any(isinstance(v, MUTABLE) for v in held):
        return function
    made = types.FunctionType(
        function.__code__,
        function.__globals__,
        function.__name__,
        copy.deepcopy(defaults),
        function.__closure__,
    )
    made.__kwdefaults__ = copy.deepcopy(named)
    vars(made).update(vars(function))
    made.__qualname__, made.__module__ = function.__qualname__, function.__module__
    return made


def on_trial(function: Any) -> Any:
    """A copy of a function or object, which may be called without a trace; itself if it has none.

    Args:
        function: Any callable.
    """
    if isinstance(function, types.FunctionType):
        return with_own_defaults(function)
    try:
        return copy.deepcopy(function)
    except Exception:
        return function


@dataclass(frozen=True)
class GivenFunction:
    """A function of the user's, of which copies are tried.

    Args:
        path: Where it is in the scene, as in ``loads[0].time``.
        function: A copy of it, whose memory is its own.
        arguments: Number of its arguments.
    """

    path: str
    function: Any
    arguments: int

    def at(self, *arguments: Any) -> Floats | str | None:
        """Value for some arguments: numbers, words for what gives none; None where it fails."""
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                value = self.function(*arguments)
                try:
                    made = np.asarray(value, dtype=np.float64).ravel()
                except (TypeError, ValueError):
                    return str(value)
        except (Exception, SystemExit):
            return None
        return np.nan_to_num(made, nan=NONE, posinf=NONE, neginf=-NONE)

    def trial(self, t_end: float) -> list[Floats | str | None]:
        """Values at the start, the middle and the end of a run; at positions if it is of such.

        Args:
            t_end: The end of the run [s].
        """
        found = [self.at(*[t] * self.arguments) for t in (0.0, t_end / 2, t_end)]
        if self.arguments == 1 and found[0] is None:
            return [self.at(POSITIONS)]
        if self.arguments == 2:
            return [*found, self.at(POSITIONS[0], POSITIONS[1])]
        return found


def given_functions(value: Any, path: str = "") -> Iterator[GivenFunction]:
    """Functions of the user's below a part of a scene, by their paths; copies, to be tried.

    Args:
        value: The scene, or any part of it.
        path: Its own path.
    """
    if is_dataclass(value) and not isinstance(value, type):
        for f in fields(value):
            if f.name not in OTHERS:
                below = f"{path}.{f.name}" if path else f.name
                yield from given_functions(getattr(value, f.name, None), below)
    elif isinstance(value, Mapping):
        for key in value:
            yield from given_functions(value[key], f"{path}[{key!r}]")
    elif isinstance(value, list | tuple):
        for k, item in enumerate(value):
            name = getattr(item, "name", None)
            yield from given_functions(item, f"{path}[{repr(name) if name else k}]")
    elif callable(value) and not isinstance(value, type) and (count := _arguments(value)):
        yield GivenFunction(path, on_trial(value), count)


def _arguments(function: Any) -> int:
    """Number of arguments that a function needs; 0 where that is not known, or more than three."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return 0
    plain = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    needed = [p for p in plain if p.default is p.empty] or plain[:1]
    return len(needed) if len(needed) <= 3 else 0


@contextmanager
def refusing(what: str, right: str) -> Iterator[None]:
    """Refuse functions that fail, whatever they raise.

    Args:
        what: What fails, and that it does.
        right: What would be right.

    Raises:
        SceneError: If what is called within raises an error.
    """
    try:
        yield
    except (Exception, SystemExit) as error:
        raise SceneError(f"{what} ({in_words(error)}); {right}") from error


def values_at(function: OfPosition, x: Floats, size: int, who: str) -> Floats:
    """Checked values at points.

    Args:
        function: The function.
        x: Positions, shape (3, n).
        size: Number of components; 1: a scalar.
        who: What messages call it.

    Returns:
        Shape (size, n), of a scalar (n,).

    Raises:
        SceneError: If it fails, or gives another shape, a number that is not finite, or other
            numbers when it is called again.
    """
    with refusing(f"{who} fails", "it must be written for an array of positions"):
        given = function(x)
        # components may be of several kinds, of which an array would make one
        parts = [given, *given] if isinstance(given, list | tuple) else [given]
        kinds = {np.asarray(part).dtype.kind for part in parts} & NO_NUMBERS.keys()
        value = np.zeros(0) if kinds else np.array(given, dtype=float)
        # each rank, and each quantity that needs it, asks for itself
        again = value if kinds else np.asarray(function(x), dtype=float)
    if kinds:
        said = " and ".join(NO_NUMBERS[kind] for kind in sorted(kinds))
        raise SceneError(f"{who} gives {said}; it must give real numbers")
    wanted = x.shape[1:] if size == 1 else (size, *x.shape[1:])
    if value.shape != wanted:
        raise SceneError(
            f"{who} gives an array of shape {value.shape} for positions of shape {x.shape}; "
            f"it must give {'the same shape' if wanted == x.shape else wanted}"
        )
    if not np.isfinite(value).all():
        raise SceneError(f"{who} gives a number that is not finite")
    if not np.array_equal(value, again):
        raise SceneError(
            f"{who} gives other values when it is called again; it must depend on positions only: "
            "make random numbers once, outside of it and with a seed"
        )
    return value


def points_by(who: str, right: str, function: Callable[..., Any], *parameters: Floats) -> Floats:
    """Positions of a curve or a surface of the user's, shape (3, n).

    Args:
        who: What messages call the function.
        right: Says what it must be.
        function: The function.
        parameters: What it is of, each of shape (n,).

    Raises:
        SceneError: If it fails, or gives another shape or a number that is not finite.
    """
    size = parameters[0].size
    with refusing(f"{who} fails", right):
        x = reals(function(*parameters))
    if x.shape != (3, size):
        raise SceneError(
            f"{who} returns an array of shape {x.shape} for {size} points; it must be (3, {size})"
        )
    if not np.isfinite(x).all():
        raise SceneError(f"{who} returns a number that is not finite")
    return x


def check_sign(value: Floats, x: Floats, who: str, strictly: bool) -> None:
    """Refuse values of a scalar function that are negative.

    Args:
        value: The values, shape (n,).
        x: Positions, shape (3, n).
        who: What messages call them.
        strictly: Whether zero is refused, too.

    Raises:
        SceneError: Says where one is.
    """
    if (value <= 0).any() if strictly else (value < 0).any():
        worst = int(np.argmin(value))
        place = tuple(float(f"{c:.4g}") for c in x[:, worst])
        raise SceneError(
            f"{who} is {value[worst]:.4g} at {place}; it must be "
            f"{'greater than' if strictly else 'at least'} 0 everywhere"
        )


def finite_in_time(function: Any, end: float, who: str, size: int, above: float = -np.inf) -> None:
    """Try a function of time at the beginning, the middle and the end; anything else passes.

    Raises:
        SceneError: If it fails, or gives something else than ``size`` finite numbers.
    """
    if not callable(function):
        return
    # a scene is checked again with each option: its functions begin their memory in the run
    function = on_trial(function)
    for t in (0.0, end / 2, end):
        given_at(function, t, who, size, above)


def given_at(function: Any, t: float, who: str, size: int, above: float = -np.inf) -> Any:
    """Value of a function of time.

    Raises:
        SceneError: If it fails, or gives something else than ``size`` finite numbers.
    """
    with refusing(f"{who} fails at t = {t:g}", f"it must give {_wanted(size)}"):
        given = function(t)
    return numbers_at(given, t, who, size, above)


def numbers_at(given: Any, t: float, who: str, size: int = 1, above: float = -np.inf) -> Any:
    """Numbers that a function of time gave, checked.

    Args:
        given: It.
        t: The time [s].
        who: What messages call the function.
        size: How many numbers it must be.
        above: What they must be greater than.

    Raises:
        SceneError: If it is something else than ``size`` such finite numbers.
    """
    try:
        value = np.asarray(given)
    except (TypeError, ValueError):
        value = np.asarray("")
    # texts, complex numbers and truth values are no numbers, nor is an array that has one
    shape = () if size == 1 else (size,)
    fine = value.dtype.kind in "iuf" and value.shape == shape and np.isfinite(value).all()
    if not (fine and (value > above).all()):
        wanted = _wanted(size) if above < 0 else f"a number greater than {above:g}"
        raise SceneError(f"{who} gives {show(given)} at t = {t:g}; it must give {wanted}")
    return value


def _wanted(size: int) -> str:
    return "a finite number" if size == 1 else f"{size} finite numbers"
