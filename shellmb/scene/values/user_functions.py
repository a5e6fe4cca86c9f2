"""Functions of the user's that a scene holds, and their values where they are tried."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shellmb.scene.values.copies import on_trial

# functions that are called with more than numbers, or do more than to give some
OTHERS = {"results", "build", "energy", "strains", "terms"}
# in place of a number that is none, or an error
NONE = 1e300
# positions where functions of position are tried [m], and parameters of surfaces
POSITIONS = np.random.default_rng(1).random((3, 4))


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

    def at(self, *arguments: Any) -> NDArray[np.float64] | str | None:
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

    def trial(self, t_end: float) -> list[NDArray[np.float64] | str | None]:
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
