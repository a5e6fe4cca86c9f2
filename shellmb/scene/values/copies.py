"""Copies of users' functions, which may keep a memory in an object or in a default argument."""

from __future__ import annotations

import copy
import types
from typing import Any

import numpy as np

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
