"""A scene as an FMU: what its Python side does when a master calls it; its states as bytes."""

import atexit
import ctypes
import importlib
import io
import json
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from shellmb.errors import SceneError, ShellmbError
from shellmb.exchange.motion import SceneMotion
from shellmb.files.writing import as_list
from shellmb.running.loader import load, scene_of
from shellmb.scene.control.signals import inputs_of
from shellmb.simulate.target_times import near

# packages of both versions of FMI, and how they call kinds of variables
PACKAGES = {2: "pythonfmu", 3: "pythonfmu3"}
KINDS = {
    2: {float: "Real", int: "Integer", bool: "Boolean", str: "String"},
    3: {float: "Float64", int: "Int32", bool: "Boolean", str: "String"},
}
TIME = "time"
# name of what is no array in the bytes of a state
REST = "rest"
# libraries of FMUs that let go of Python as it ends
_ENDING: set[Path] = set()


def slave(version: int, described: Mapping[str, Any]) -> type:
    """Class of an FMU.

    Args:
        version: Of FMI, 2 or 3.
        described: What its scene is, with inputs, outputs and parameters.
    """
    package = importlib.import_module(PACKAGES[version])
    base: Any = getattr(package, f"Fmi{version}Slave")
    enums = importlib.import_module(f"{PACKAGES[version]}.enums")
    kinds = ("Causality", "Variability", "Status")
    causalities, variabilities, status = (getattr(enums, f"Fmi{version}{kind}") for kind in kinds)

    class Slave(base):  # type: ignore[misc]
        """A scene that a master steps."""

        def __init__(self, **how: Any) -> None:
            super().__init__(**how)
            _end_in_order(self.resources)
            self.description = described["description"]
            times = {"start_time": 0.0, "stop_time": described["t_end"]}
            self.default_experiment = package.DefaultExperiment(**times, step_size=described["dt"])
            self._values: dict[str, Any] = {k: v for k, (v, _) in described["inputs"].items()}
            self._parameters: dict[str, Any] = dict(described["parameters"])
            self._motion: SceneMotion | None = None
            if version == 3:
                self._register(TIME, float, "independent", "continuous")
            for name, value in self._parameters.items():
                self._register(name, type(value), "parameter", "fixed")
            for name in self._values:
                self._register(name, float, "input", "continuous")
            for name in described["outputs"]:
                self._register(name, float, "output", "continuous")

        def _register(self, name: str, kind: type, causality: str, variability: str) -> None:
            ways: dict[str, Any] = {"getter": lambda: self._get(name)}
            if causality in ("parameter", "input"):
                ways["setter"] = lambda value: self._set(name, value)
            made = getattr(package, KINDS[version][kind])
            ways |= {"causality": causalities[causality], "variability": variabilities[variability]}
            self.register_variable(made(name, **ways), nested=False)

        def _get(self, name: str) -> Any:
            for known in (self._parameters, self._values):
                if name in known:
                    return known[name]
            return self._now().outputs["t" if name == TIME else name]

        def _set(self, name: str, value: Any) -> None:
            if name in self._values:
                self._values[name] = value
            elif self._motion is None:
                self._parameters[name] = value
            elif value != self._parameters[name]:
                raise SceneError(
                    f"parameter '{name}': it is set to {value} after the initialisation; it must "
                    "be set before"
                )

        def _now(self) -> SceneMotion:
            """The motion, which is made when it is first needed."""
            if self._motion is None:
                scene = described["scene"]
                name = str(Path(self.resources, scene)) if scene.endswith(".py") else scene
                make, who = load(name).module.scene, f"scene '{scene}'"
                made = scene_of(make, self._parameters, who, "scene()")
                # what is moved would jump: it moves over the first step
                moved = {one.name for one in inputs_of((made.supports, made.drivers))}
                start = {k: v for k, v in self._values.items() if k not in moved}
                self._motion = SceneMotion(made, start=start)
            return self._motion

        def exit_initialization_mode(self) -> None:
            """Build the scene."""
            self._now()

        def do_step(self, current_time: float, step_size: float) -> bool:
            """Step; a step that fails is discarded, and the motion stays where it is."""
            motion = self._now()
            try:
                if abs(current_time - motion.time) > near(motion.time, abs(step_size)):
                    here = f"{motion.time:g}, where the last one ended (the first one at 0)"
                    raise SceneError(f"step: it begins at {current_time:g}; it must be at {here}")
                for name, value in self._values.items():
                    motion.inputs[name] = value
                motion.trial(step_size)
                motion.accept()
            except ShellmbError as failure:
                self.log(str(failure), status.error)
                return False
            return True

        def _get_fmu_state(self) -> Any:
            arrays, motion = self._now().state()
            kept = {"values": dict(self._values), "parameters": dict(self._parameters)}
            return arrays, {**kept, "motion": motion}

        def _set_fmu_state(self, state: Any) -> None:
            arrays, rest = state
            self._values, parameters = dict(rest["values"]), dict(rest["parameters"])
            if parameters != self._parameters:
                self._parameters, self._motion = parameters, None
            self._now().take_up((arrays, rest["motion"]))

        _fmu_state_to_bytes = staticmethod(to_bytes)
        _fmu_state_from_bytes = staticmethod(from_bytes)

        def to_xml(self, model_options: Any = None) -> Element:
            """Describe the model; add what the packages leave out: units."""
            root: Element = super().to_xml(model_options or {})
            # names are those of the history, which may have any letters
            root.set("variableNamingConvention", "flat")
            units = dict(described["outputs"]) | {k: u for k, (_, u) in described["inputs"].items()}
            definitions = Element("UnitDefinitions")
            for unit in sorted({*units.values()} - {""}):
                SubElement(definitions, "Unit", name=unit)
            for variable in root.iterfind("ModelVariables/*"):
                if unit := units.get(variable.get("name", "")):
                    # of FMI 2 a part of the variable has its type, of FMI 3 it itself
                    (variable if version == 3 else variable[0]).set("unit", unit)
            if len(definitions):
                root.insert([child.tag for child in root].index("CoSimulation") + 1, definitions)
            return root

    return Slave


def to_bytes(state: Any) -> bytes:
    """Bytes of a state of a `SceneMotion`: arrays and JSON, so that reading them executes nothing.

    Args:
        state: As from its `state`.
    """
    arrays, rest = state
    plain = json.dumps(rest, default=as_list).encode()
    file, text = io.BytesIO(), np.frombuffer(plain, dtype=np.uint8)
    found: dict[str, Any] = {REST: text, **{f"/{name}": array for name, array in arrays.items()}}
    np.savez(file, **found)
    return file.getvalue()


def from_bytes(given: bytes) -> Any:
    """A state again.

    Args:
        given: As from `to_bytes`.
    """
    with np.load(io.BytesIO(given)) as found:
        arrays = {name.removeprefix("/"): found[name] for name in found.files if name != REST}
        return arrays, json.loads(found[REST].tobytes())


def _end_in_order(resources: str | None) -> None:
    """Let libraries of FMUs let go of Python as it ends.

    They do so by a destructor of the library, which at the end of a process runs after those of its
    variables, and would free once more what these have freed: "corrupted double-linked list".

    Args:
        resources: Folder of the FMU's resources; None: it is being made.
    """
    mode = getattr(os, "RTLD_NOLOAD", None)
    # where there are no arguments Python is the library's own, which ends it
    if resources is None or mode is None or not sys.orig_argv:
        return
    for path in set(Path(resources).parent.glob("binaries/*/*.so")) - _ENDING:
        with suppress(OSError, AttributeError):
            atexit.register(ctypes.CDLL(str(path), mode | os.RTLD_NOW).finalizePythonInterpreter)
            _ENDING.add(path)
