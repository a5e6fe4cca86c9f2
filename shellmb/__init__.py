"""Geometrically exact shells in flexible multibody dynamics, on DOLFINx.

    import shellmb as sm

    run = sm.run("sudden_load")        # or a scene made of sm.Scene, sm.Shell, sm.Beam, ...
    run.history, run.summary, run.fields["plate"], run.plot(), run.view()

Importing this package imports nothing heavy: names are looked up when they are used (`__init__.pyi`
lists them), `shellmb.scene` and `shellmb.forms` are usable without DOLFINx.
"""

import functools
import importlib
import re
from pathlib import Path
from typing import Any

__version__ = "0.1.0"

# functions that the stub writes out, with their options or by cases; it imports all others from
# their modules
_WRITTEN_OUT = {
    "run": "shellmb.api.runs",
    "modes": "shellmb.api.modal",
    "study": "shellmb.api.studies",
    "sensitivities": "shellmb.api.sensitivity.run",
    "adjoint": "shellmb.sensitivity.adjoint.run",
    "fit": "shellmb.api.fitting.fit",
    "frequency_sensitivities": "shellmb.api.sensitivity.run",
}
_PACKAGES = ("errors", "forms", "scene")


@functools.cache
def _modules() -> dict[str, str]:
    """Modules of the functions and classes of the Python interface, by their names."""
    stub = Path(__file__).with_name("__init__.pyi").read_text()
    named = re.findall(r"^from (shellmb\.\S+) import (\w+) as \2$", stub, re.MULTILINE)
    return {name: module for module, name in named} | _WRITTEN_OUT


def __getattr__(name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(f"module 'shellmb' has no attribute '{name}'")
    if name in _PACKAGES:
        return importlib.import_module(f"shellmb.{name}")
    if name in _modules():
        return getattr(importlib.import_module(_modules()[name]), name)
    scene = importlib.import_module("shellmb.scene")
    if name in scene.__all__:
        return getattr(scene, name)
    raise AttributeError(f"module 'shellmb' has no attribute '{name}'; see dir(shellmb)")


def __dir__() -> list[str]:
    scene = importlib.import_module("shellmb.scene")
    return sorted({"__version__", *_modules(), *_PACKAGES, *scene.__all__})
