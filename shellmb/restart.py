"""States of objects for a restart: copies of some of their attributes."""

from typing import Any, ClassVar

import numpy as np

# a state is taken in each step: most of it is of these types
_CONSTANT = {float, int, bool, str, type(None), tuple, np.float64}


class Restartable:
    """An object whose state is that of some of its attributes.

    These are numbers, texts, arrays, or other such objects, and lists and dictionaries of numbers.
    What stands deeper is replaced by whoever changes it, and never changed in its place.

    Attributes:
        remembered: Names of these attributes.
    """

    remembered: ClassVar[tuple[str, ...]] = ()

    def state(self) -> Any:
        """State for a restart, as JSON; later steps do not change it."""
        return {name.lstrip("_"): _copied(getattr(self, name)) for name in self.remembered}

    def restore(self, state: Any) -> None:
        """Continue from a saved state.

        Args:
            state: As from `state`.
        """
        for name in self.remembered:
            now = getattr(self, name, None)
            setattr(self, name, _taken(state[name.lstrip("_")], now))


def _copied(value: Any) -> Any:
    kind = type(value)
    if kind in _CONSTANT:
        return value
    if kind is dict:
        return {k: v if type(v) in _CONSTANT else _copied(v) for k, v in value.items()}
    if kind is list:
        return list(value)
    return value.tolist() if kind is np.ndarray else value.state()


def _taken(value: Any, now: Any) -> Any:
    """A saved value in the place of another one, whose type JSON may not have."""
    if isinstance(now, Restartable):
        now.restore(value)
        return now
    if isinstance(now, np.ndarray):
        return np.array(value, dtype=now.dtype)
    return list(value) if isinstance(now, list) else _constant(value)


def _constant(value: Any) -> Any:
    """A saved value whose lists were tuples."""
    if isinstance(value, dict):
        return {key: _constant(each) for key, each in value.items()}
    return tuple(map(_constant, value)) if isinstance(value, list | tuple) else value
