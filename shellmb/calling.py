"""Packages that can be called: `shellmb.run(scene)` beside `shellmb.run.execute`."""

from __future__ import annotations

import importlib
import inspect
import sys
import types
from collections.abc import Callable
from typing import Any


def callable_module(name: str, function: str) -> None:
    """Let calls of a module go to a function of the same name in the Python interface.

    `import shellmb.run.execute` makes the package `run` an attribute of `shellmb`, whatever stood
    there; so the package itself is what is called.

    Args:
        name: Name of the module, which is being imported.
        function: Where the function is, as "package.module:name"; imported with the first call.
    """

    def found() -> Callable[..., Any]:
        module, _, attribute = function.partition(":")
        made: Callable[..., Any] = getattr(importlib.import_module(module), attribute)
        return made

    class Called(types.ModuleType):
        def __call__(self, *args: Any, **kwargs: Any) -> Any:
            return found()(*args, **kwargs)

        @property
        def __signature__(self) -> inspect.Signature:
            return inspect.signature(found())

    sys.modules[name].__class__ = Called
