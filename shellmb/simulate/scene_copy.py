"""A scene of a run's own: what a run changes in it, the next run of the same scene does not see.

Laws may keep their memory in place: in the state that they are given, in an object of the user's,
in a default of an argument. All that is copied. What a function reads from outside, variables of
its module or of the function around it, cannot be: others may look at it, too. So a run remembers
what has changed there meanwhile, and the next one says that it begins with it.
"""

import copy
import functools
import types
import weakref
from collections.abc import Iterator, Mapping
from dataclasses import is_dataclass
from typing import Any

import numpy as np

from shellmb.errors import warn
from shellmb.scene import Scene
from shellmb.scene.fingerprint import Fingerprint, outside
from shellmb.scene.values.user_functions import MUTABLE, with_own_defaults

# whose functions keep nothing, and whose objects are not copied
LIBRARIES = {"shellmb", "numpy", "scipy", "ufl", "dolfinx", "basix", "petsc4py", "mpi4py"}
LIBRARIES |= {"builtins", "math", "functools", "operator", "pathlib", "types", "enum", "abc"}

# what runs have changed outside of functions: names by function
_CHANGED: weakref.WeakKeyDictionary[Any, list[str]] = weakref.WeakKeyDictionary()


def is_ours(module: str) -> bool:
    """Decide whether a module is of this package or of a library; demos are as a user's.

    Args:
        module: Its name.
    """
    return module.split(".")[0] in LIBRARIES and not module.startswith("shellmb.demos.")


class SceneCopy:
    """A scene with copies of all that a run may change in it.

    Args:
        scene: The scene, of which the rest is shared.

    Attributes:
        scene: The scene with the copies.
    """

    def __init__(self, scene: Scene) -> None:
        self._name = scene.name
        self._memo: dict[int, Any] = {}
        # originals must live as long as their numbers mean them
        self._kept: list[Any] = []
        self._functions: list[types.FunctionType] = []
        self.scene: Scene = self._own(scene, "")
        self._before = {f: outside(f) for f in self._functions}
        for function, names in [(f, _CHANGED.get(f)) for f in self._functions]:
            if names:
                warn(
                    f"scene '{scene.name}': an earlier run has changed {', '.join(names)}, which "
                    f"the function {function.__qualname__} reads from outside, and this run "
                    "starts with the changed values; keep the memory of a law in its state or in "
                    "an object"
                )

    @property
    def remembers(self) -> bool:
        """Decide whether a run may change an object of the user's, or a default of a function."""
        return any(self._remembers(v) for v in self._kept)

    def _remembers(self, value: Any) -> bool:
        if isinstance(value, functools.partial):
            # what is not copied is not changed
            return any(id(v) in self._memo for v in self._parts(value))
        held = (types.FunctionType, types.MethodType, np.random.Generator, Iterator)
        return not is_ours(type(value).__module__) or isinstance(value, held)

    def finish(self) -> None:
        """Remember what the run has changed outside of functions."""
        for function, before in self._before.items():
            changed = sorted(_differ(before, outside(function)))
            if changed:
                _CHANGED[function] = changed

    def _own(self, value: Any, path: str) -> Any:
        """A value, or its copy where it holds anything that may be changed."""
        if id(value) in self._memo:
            return self._memo[id(value)]
        made = self._made(value, path)
        if made is not value:
            self._memo[id(value)] = made
            self._kept.append(value)
        return made

    def _made(self, value: Any, path: str) -> Any:
        kind = type(value)
        if isinstance(value, types.FunctionType):
            return self._function(value)
        if kind in (tuple, list, dict):
            return self._several(value, path)
        if kind.__module__.startswith("shellmb.") and is_dataclass(value):
            return self._described(value, path)
        plain = isinstance(value, type | types.ModuleType | str | int | float | None)
        if plain or (is_ours(kind.__module__) and not self._holds(value)):
            return value
        for part in self._parts(value):
            if isinstance(part, types.FunctionType):
                self._own(part, path)
        try:
            return copy.deepcopy(value, self._memo)
        except Exception as error:
            warn(
                f"scene '{self._name}': {path} is or holds a {kind.__name__} that cannot be copied "
                f"({error}); the next run of this scene starts with what this run changes in it"
            )
            return value

    @staticmethod
    def _holds(value: Any) -> bool:
        """Decide whether something of a library's class may be changed in a run."""
        kinds = (*MUTABLE, types.MethodType, functools.partial, np.random.Generator)
        return isinstance(value, kinds) or isinstance(value, Iterator)

    @staticmethod
    def _parts(value: Any) -> list[Any]:
        """List what a partial function consists of; nothing of other values."""
        if not isinstance(value, functools.partial):
            return []
        return [value.func, *value.args, *value.keywords.values()]

    def _several(self, values: Any, path: str) -> Any:
        keys = list(values) if isinstance(values, dict) else range(len(values))
        items = {k: self._own(values[k], f"{path}[{k!r}]") for k in keys}
        if isinstance(values, tuple):
            # of what is not changed the same objects are left, and so is what they are in
            return values if all(items[k] is values[k] for k in keys) else tuple(items.values())
        return items if isinstance(values, dict) else list(items.values())

    def _described(self, value: Any, path: str) -> Any:
        fields: Mapping[str, Any] = vars(value)
        own = {n: self._own(item, f"{path}.{n}".lstrip(".")) for n, item in fields.items()}
        if all(own[name] is item for name, item in fields.items()):
            return value
        # its checks were made; they would be made again, of other objects
        made = object.__new__(type(value))
        vars(made).update(own)
        return made

    def _function(self, function: types.FunctionType) -> types.FunctionType:
        if is_ours(function.__module__ or ""):
            return function
        self._functions.append(function)
        return with_own_defaults(function)


def _differ(then: Fingerprint, now: Fingerprint) -> set[str]:
    """Names of variables whose values differ."""
    paths = {p for p in {*then, *now} if (p in then) != (p in now) or then[p] != now[p]}
    return {p.split(".")[0].split("[")[0] for p in paths}
