"""A scene as plain values by the names of its fields, to be stored and compared.

Two scenes with the same fingerprint describe the same physics. Functions count by their compiled
code and by the values that they use: what they close over, and what they read of their module.
"""

import contextlib
import functools
import hashlib
import inspect
import json
import pickle
import sys
import types
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.scene.scene import Scene
from shellmb.scene.values.renamed import STORED

type Leaf = bool | int | float | str | list[Any] | None
type Fingerprint = dict[str, Leaf]
# a field, what it was, what it is
type Difference = tuple[str, str, str]

# how a run is evaluated and shown; nothing of it moves a body
WITHOUT = {"results", "output", "units"}
# longer values are kept as a checksum [characters]
LONGEST = 200
# libraries whose objects count by their kind, and numbers by their value
OF_FORMS = ("ufl", "dolfinx", "basix")
PYTHON, CODE = "python", "'s code"


def fingerprint(scene: Scene, whole: bool = False) -> Fingerprint:
    """Every field of a scene and of its parts, by a path as in ``shells['plate'].section.E``.

    Args:
        scene: The scene.
        whole: Whether also of what moves no body.
    """
    walk = _Walk()
    for f in fields(scene):
        if whole or f.name not in WITHOUT:
            walk.add(f.name, getattr(scene, f.name))
    # the code of functions is that of a version of Python
    return {PYTHON: ".".join(map(str, sys.version_info[:2])), **walk.found}


def outside(function: types.FunctionType) -> Fingerprint:
    """Variables that a function reads from outside, by name.

    Args:
        function: The function.
    """
    walk = _Walk()
    for name, value in {**_used(function), **vars(function)}.items():
        if not isinstance(value, types.ModuleType | types.FunctionType | type):
            walk.add(name, value)
    return walk.found


def differences(then: Mapping[str, Any], now: Mapping[str, Any]) -> list[Difference]:
    """Fields in which two fingerprints differ, with both values in words.

    Args:
        then: One, as it was read back.
        now: The other.
    """
    found: list[Difference] = []
    then = {STORED.get(path, path): value for path, value in then.items()}
    same_python = then.get(PYTHON) == now.get(PYTHON)
    for path in [*then, *(p for p in now if p not in then)]:
        was, is_ = (_words(x[path]) if path in x else "missing" for x in (then, now))
        if was == is_ or path == PYTHON or (path.endswith(CODE) and not same_python):
            continue
        # what is of another kind has other fields, too
        if not any(path.startswith((f"{p}.", f"{p}[", f"{p}'")) for p, _, _ in found):
            found.append((path, was, is_))
    return found


def _words(value: Leaf) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _digest(text: str | bytes) -> str:
    data = text.encode() if isinstance(text, str) else text
    return f"sha256 {hashlib.sha256(data).hexdigest()[:16]}"


class _Walk:
    """Collects the values below a value."""

    def __init__(self) -> None:
        self.found: Fingerprint = {}
        # objects on the way down: functions may call one another, objects hold one another
        self._above: set[int] = set()

    def add(self, path: str, value: Any) -> None:
        """Add a value and all below it."""
        if isinstance(value, np.generic | np.ndarray):
            value = value.tolist()
        if value is None or isinstance(value, bool | int | float | str):
            self._leaf(path, value)
        elif id(value) in self._above:
            self._leaf(path, "as above")
        else:
            self._above.add(id(value))
            self._parts(path, value)
            self._above.discard(id(value))

    def _leaf(self, path: str, value: Leaf) -> None:
        text = json.dumps(value)
        self.found[path] = value if len(text) <= LONGEST else _digest(text)

    def _parts(self, path: str, value: Any) -> None:
        if isinstance(value, Path):
            self._leaf(path, _digest(value.read_bytes()) if value.is_file() else str(value))
        elif isinstance(value, Mapping):
            for key in value:
                self.add(f"{path}[{key!r}]", value[key])
        elif isinstance(value, list | tuple):
            self._several(path, value)
        elif hasattr(value, "in_values"):
            self._children(path, type(value).__qualname__, value.in_values())
        elif type(value).__module__.partition(".")[0] in OF_FORMS:
            # what it is made of is the same on no two ranks, and has no end
            self._leaf(path, f"{type(value).__name__} {getattr(value, 'value', '')}".strip())
        elif isinstance(value, set | frozenset):
            self._several(path, sorted(value, key=repr))
        elif isinstance(value, functools.partial):
            self._children(path, "partial", vars(value) | {"function": value.func})
            self._several(f"{path}.args", value.args)
            self.add(f"{path}.keywords", value.keywords)
        elif isinstance(value, types.MethodType):
            self.add(path, value.__func__)
            self.add(f"{path}.self", value.__self__)
        elif isinstance(value, types.FunctionType):
            self._function(path, value)
        elif isinstance(value, type | types.ModuleType):
            self._leaf(path, value.__name__)
        elif not hasattr(value, "__dict__") and not _slots(value):
            self._leaf(path, _opaque(value))
        else:
            self._object(path, value)

    def _several(self, path: str, values: Any) -> None:
        plain = json.dumps(values, default=lambda _: None)
        if json.dumps(values, default=repr) == plain and "{" not in plain:
            self._leaf(path, json.loads(plain))
            return
        for k, item in enumerate(values):
            name = getattr(item, "name", None)
            self.add(f"{path}[{name if isinstance(name, str) else k!r}]", item)

    def _children(self, path: str, kind: str, values: Mapping[str, Any]) -> None:
        self._leaf(path, kind)
        for name, value in values.items():
            self.add(f"{path}.{name}", value)

    def _object(self, path: str, value: Any) -> None:
        kind = type(value)
        if is_dataclass(value):
            values = {f.name: getattr(value, f.name, None) for f in fields(value)}
        else:
            values = {**_slots(value), **getattr(value, "__dict__", {})}
        self._children(path, kind.__qualname__, _of_classes(kind) | values)

    def _function(self, path: str, function: types.FunctionType) -> None:
        self._leaf(path, function.__qualname__)
        module = function.__module__ or ""
        if module.startswith("shellmb.") and not module.startswith("shellmb.demos."):
            return
        self._leaf(f"{path}{CODE}", _digest(_code(function.__code__)))
        for name, value in {**_used(function), **vars(function)}.items():
            # libraries count by their names, which the code holds
            if not isinstance(value, types.ModuleType | type):
                self.add(f"{path}.{name}", value)
        for name, default in inspect.signature(function).parameters.items():
            if default.default is not inspect.Parameter.empty:
                self.add(f"{path}.{name}", default.default)


def _slots(value: Any) -> dict[str, Any]:
    """Attributes that an object has no dictionary for."""
    several = (vars(base).get("__slots__", ()) for base in type(value).__mro__)
    names = [n for some in several for n in ((some,) if isinstance(some, str) else some)]
    return {name: getattr(value, name) for name in names if hasattr(value, name)}


def _opaque(value: Any) -> str:
    """Name of what has no attributes of Python's, with a checksum of what it is made from."""
    name = str(getattr(value, "__name__", type(value).__qualname__))
    # most that can be copied to other processes are values, as numbers of other kinds are
    with contextlib.suppress(Exception):
        return f"{name} {_digest(pickle.dumps(value, protocol=4))}"
    return name


def _of_classes(kind: type) -> dict[str, Any]:
    """Functions and values in the classes of a scheme or a law of the user's own."""
    found: dict[str, Any] = {}
    for base in reversed(kind.__mro__):
        if _of_library(base):
            continue
        for name, value in vars(base).items():
            if name.startswith("__") and name != "__call__":
                continue
            plain = getattr(value, "__func__", getattr(value, "fget", value))
            if isinstance(plain, types.FunctionType | bool | int | float | str | Sequence):
                found[name] = plain
    return found


def _of_library(kind: type) -> bool:
    """Decide whether a class is of a library, which counts by its name, and what it has in it."""
    top = kind.__module__.partition(".")[0]
    file = getattr(sys.modules.get(top), "__file__", None) or ""
    known = top == "shellmb" or (top != "__main__" and top in sys.stdlib_module_names)
    return known or "site-packages" in Path(file).parts


def _used(function: types.FunctionType) -> dict[str, Any]:
    """Variables from outside that a function reads."""
    known = function.__globals__
    read = {name: known[name] for name in _names(function.__code__) if name in known}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        # a variable that was deleted has an empty cell
        with contextlib.suppress(ValueError):
            read[name] = cell.cell_contents
    return read


def _names(code: types.CodeType) -> Iterator[str]:
    yield from code.co_names
    for value in code.co_consts:
        if isinstance(value, types.CodeType):
            yield from _names(value)


def _code(code: types.CodeType) -> str:
    """Compiled code without what says where it stood."""
    return repr([code.co_code, code.co_names, code.co_varnames, list(_constants(code))])


def _constants(code: types.CodeType) -> Iterator[str]:
    for k, value in enumerate(code.co_consts):
        if isinstance(value, types.CodeType):
            yield _code(value)
        elif isinstance(value, frozenset):
            # in no order that lasts
            yield repr(sorted(map(repr, value)))
        elif not (k == 0 and isinstance(value, str)):
            # the first may be the description of a function
            yield repr(value)
