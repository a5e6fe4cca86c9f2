"""Choice of the assembler: the loops in C, or the reference in plain DOLFINx and NumPy."""

from collections.abc import Callable
from contextvars import ContextVar
from functools import wraps
from typing import Any, Literal

Assembler = Literal["native", "reference"]

_CHOSEN: ContextVar[Assembler] = ContextVar("assembler", default="native")


def is_native() -> bool:
    """Decide whether what is made now is to be the loops in C."""
    return _CHOSEN.get() != "reference"


def assembled_as[**P, R](solver: Callable[..., Any]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function such that it works with the assembler of a scene.

    Args:
        solver: Finds the scene's solver settings among the function's arguments.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            # no context, which would be made anew for each step
            token = _CHOSEN.set(solver(*args, **kwargs).assembler)
            try:
                return function(*args, **kwargs)
            finally:
                _CHOSEN.reset(token)

        return call

    return decorate
