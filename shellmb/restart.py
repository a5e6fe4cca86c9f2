"""States of objects for a restart: copies of some of their attributes, and mappings of these."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import reduce
from operator import getitem
from typing import Any, ClassVar

import numpy as np

# a state is taken in each step: most of it is of these types
_CONSTANT = {float, int, bool, str, type(None), tuple, np.float64}


class Restartable:
    """An object whose state is that of some of its attributes.

    These are numbers, texts, arrays, data classes of them, other such objects or lists of them,
    and lists and dictionaries of numbers and texts. What stands deeper is replaced by whoever
    changes it, and never changed in its place. Arrays become lists; those that nobody may write to
    (`constant`) are large, of one rank each, stay as they are, and are saved apart (`arrays_of`).

    Attributes:
        remembered: Names of these attributes.
    """

    remembered: ClassVar[tuple[str, ...]] = ()
    _keys: ClassVar[tuple[tuple[str, str], ...]] = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        # each step takes a state
        cls._keys = tuple((name.lstrip("_"), name) for name in cls.remembered)

    def state(self) -> Any:
        """State for a restart, as JSON, but for arrays that are constant; no step changes it."""
        return {
            key: value if type(value := getattr(self, name)) in _CONSTANT else _copied(value)
            for key, name in self._keys
        }

    def restore(self, state: Any) -> None:
        """Continue from a saved state.

        Args:
            state: As from `state`.
        """
        for key, name in self._keys:
            setattr(self, name, _taken(state[key], getattr(self, name, None)))


def _copied(value: Any) -> Any:
    kind = type(value)
    if kind in _CONSTANT:
        return value
    if kind is dict:
        return {k: v if type(v) in _CONSTANT else _copied(v) for k, v in value.items()}
    if kind is list:
        return [v if type(v) in _CONSTANT else _copied(v) for v in value]
    if kind is np.ndarray:
        return value.tolist() if value.flags.writeable else value
    if isinstance(value, Restartable):
        return value.state()
    return _copied(_values(value)) if is_dataclass(value) else value


def _values(data: Any) -> dict[str, Any]:
    """Values of the fields of a data class."""
    return {field.name: getattr(data, field.name) for field in fields(data)}


def _taken(value: Any, now: Any) -> Any:
    """A saved value in the place of another one, whose type JSON may not have."""
    if isinstance(now, Restartable):
        now.restore(value)
        return now
    if value is None:
        return None
    if isinstance(now, np.ndarray):
        found = np.array(value, dtype=now.dtype)
        return found if now.flags.writeable else constant(found)
    if is_dataclass(now):
        own = {name: _taken(value[name], each) for name, each in _values(now).items()}
        return type(now)(**own)  # type: ignore[misc]
    if isinstance(now, list):
        restored = now and isinstance(now[0], Restartable)
        return [_taken(*pair) for pair in zip(value, now, strict=True)] if restored else list(value)
    return _constant(value)


def _constant(value: Any) -> Any:
    """A saved value whose lists were tuples."""
    if isinstance(value, dict):
        return {key: _constant(each) for key, each in value.items()}
    if isinstance(value, np.ndarray):
        return constant(value)
    return tuple(map(_constant, value)) if isinstance(value, list | tuple) else value


def constant(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The array, to which nobody may write from now on."""
    array.flags.writeable = False
    return array


def arrays_of(state: Any, prefix: str = "") -> dict[str, Any]:
    """Arrays in a state, by their paths in it.

    Args:
        state: The state.
        prefix: What paths begin with.
    """
    found: dict[str, Any] = {}
    for key, value in state.items() if isinstance(state, dict) else ():
        path = f"{prefix}{key}"
        found |= {path: value} if isinstance(value, np.ndarray) else arrays_of(value, f"{path}/")
    return found


def without_arrays(state: Any) -> Any:
    """A state without these arrays, as JSON."""
    if not isinstance(state, dict):
        return state
    plain = {k: v for k, v in state.items() if not isinstance(v, np.ndarray)}
    return {key: without_arrays(value) for key, value in plain.items()}


def with_arrays(state: Any, arrays: Mapping[str, Any]) -> Any:
    """A state as it was with its arrays.

    Args:
        state: As from `without_arrays`.
        arrays: As from `arrays_of`.
    """
    whole = without_arrays(state)
    for path, array in arrays.items():
        *way, last = path.split("/")
        reduce(getitem, way, whole)[last] = array
    return whole


def below[V](entries: Mapping[str, V], prefix: str) -> dict[str, V]:
    """Entries whose keys begin with a prefix, without it."""
    return {k.removeprefix(prefix): v for k, v in entries.items() if k.startswith(prefix)}
