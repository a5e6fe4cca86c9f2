"""Geometrically exact shells in flexible multibody dynamics, on DOLFINx.

    import shellmb as sm

    run = sm.run("sudden_load")        # or a scene made of sm.Scene, sm.Shell, sm.Beam, ...
    run.history, run.summary, run.fields["plate"], run.plot(), run.view()

Importing this package imports nothing heavy: names are looked up when they are used (`__init__.pyi`
lists them), `shellmb.scene` and `shellmb.forms` are usable without DOLFINx.
"""

import importlib
from typing import Any

from shellmb.guarding.library_options import isolate

__version__ = "0.1.0"

# functions and classes of the Python interface, by the modules that they are in
_API = {
    "run": "shellmb.api.runs",
    "modes": "shellmb.api.modal",
    "matrices": "shellmb.api.matrices",
    "Matrices": "shellmb.api.matrices",
    "linearise": "shellmb.api.responding.linearise",
    "LinearSystem": "shellmb.api.responding.system",
    "response": "shellmb.api.responding.respond",
    "Response": "shellmb.api.responding.response",
    "shock_spectrum": "shellmb.api.responding.curves",
    "study": "shellmb.api.studies",
    "load": "shellmb.api.runs",
    "resume": "shellmb.api.runs",
    "scenes": "shellmb.api.runs",
    "load_scene": "shellmb.api.runs",
    "Run": "shellmb.api.record",
    "ModeShapes": "shellmb.api.modeshapes",
    "RotatingModes": "shellmb.api.rotating",
    "StateModes": "shellmb.api.rotating",
    "Study": "shellmb.api.studies",
    "sweep": "shellmb.api.sweeps",
    "Motion": "shellmb.api.motion",
    "SceneMotion": "shellmb.exchange.motion",
    "export_fmu": "shellmb.exchange.export",
    "couple_precice": "shellmb.exchange.precice",
    "OwnBody": "shellmb.model.user_bodies.body",
    "Hold": "shellmb.model.user_bodies.body",
    "sensitivities": "shellmb.api.sensitivity.run",
    "Sensitivities": "shellmb.api.sensitivity.record",
    "adjoint": "shellmb.sensitivity.adjoint.run",
    "Adjoint": "shellmb.sensitivity.adjoint.run",
    "frequency_sensitivities": "shellmb.api.sensitivity.frequencies",
    "fit": "shellmb.api.fitting.fit",
    "Fit": "shellmb.api.fitting.fitted",
    "rank": "shellmb.api.fitting.rank",
    "ControlError": "shellmb.errors",
    "ConvergenceError": "shellmb.errors",
    "RunError": "shellmb.errors",
    "SceneError": "shellmb.errors",
    "ShellmbError": "shellmb.errors",
    "ShellmbWarning": "shellmb.errors",
}
_PACKAGES = ("errors", "forms", "scene")


isolate()


def __getattr__(name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(f"module 'shellmb' has no attribute '{name}'")
    if name in _PACKAGES:
        return importlib.import_module(f"shellmb.{name}")
    if name in _API:
        return getattr(importlib.import_module(_API[name]), name)
    scene = importlib.import_module("shellmb.scene")
    if name in scene.__all__:
        return getattr(scene, name)
    raise AttributeError(f"module 'shellmb' has no attribute '{name}'; see dir(shellmb)")


def __dir__() -> list[str]:
    scene = importlib.import_module("shellmb.scene")
    return sorted({"__version__", *_API, *_PACKAGES, *scene.__all__})
