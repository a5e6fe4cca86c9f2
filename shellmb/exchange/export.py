"""Export of a scene as an FMU for co-simulation, by PythonFMU."""

import importlib.util
import re
import shutil
import sys
import tempfile
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shellmb.errors import SceneError
from shellmb.exchange.motion import SceneMotion
from shellmb.exchange.slave import KINDS, PACKAGES, TIME
from shellmb.running.loader import SceneModule, is_file_name, load
from shellmb.scene import Scene
from shellmb.scene.control.signals import named_inputs
from shellmb.scene.units import parse_units
from shellmb.scene.values.validate import show
from shellmb.show.plots import ENERGIES, QUANTITIES

# quantities of columns by what their names end with
COLUMNS = {"rotation": "angle", "translation": "length", "length": "length", "t": "time"}
COLUMNS |= dict.fromkeys(("force", "F1", "F2", "F3", "Fx", "Fy", "Fz"), "force")
COLUMNS |= dict.fromkeys(("torque", "M1", "M2", "M3"), "moment")
COLUMNS |= dict.fromkeys((*ENERGIES, "work_inputs", "energy_balance", "energy"), "energy")
# what masters may do, in the words of both versions of FMI
STATES = "state", "State"
ABILITIES = [f"can{may}FMU{state}" for may in ("GetAndSet", "Serialize") for state in STATES]
ABILITIES.append("canHandleVariableCommunicationStepSize")
PACKAGE_FOLDERS = {"site-packages", "dist-packages"}

# the module that PythonFMU loads: it finds the environment that the FMU was made in, if it is there
SLAVE = '''"""An FMU of shellmb."""

import ctypes
import os
import site
import sys
from pathlib import Path

# PythonFMU 0.7.0 executes this file at each instantiation and then releases its globals once more
# than it took them
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

for folder in {paths!r}:
    if Path(folder).is_dir() and folder not in sys.path:
        site.addsitedir(folder)
for library in {libraries!r}:
    # another Python looks for it in its own folders
    if Path(library).is_file():
        os.environ.setdefault("MPI4PY_LIBMPI", library)

from {package} import Fmi{version}Slave
from shellmb.exchange.slave import slave

Scene = slave({version}, {described!r})


class {name}(Scene, Fmi{version}Slave):
    """The scene."""
'''


def export_fmu(
    scene: str,
    out: Path | str | None = None,
    *,
    version: int = 2,
    parameters: Mapping[str, str] | None = None,
) -> Path:
    """Export a scene as an FMU.

    Args:
        scene: Name of a bundled scene, or path of a Python file.
        out: The FMU to write, or its folder; None: the present folder.
        version: Of FMI, 2 or 3.
        parameters: Start values of its parameters.

    Returns:
        The FMU.

    Raises:
        SceneError: If the scene is impossible, cannot be stepped, or a package is missing.
    """
    if version not in PACKAGES:
        raise SceneError(f"export: FMI is {version}; it must be 2 or 3")
    package = PACKAGES[version]
    if importlib.util.find_spec(package) is None:
        raise SceneError(
            f"export: the package {package} is missing; install it by the extra 'exchange', "
            "`pip install 'shellmb[exchange]'`"
        )
    if not isinstance(scene, str):
        raise SceneError(
            f"export: scene is a {type(scene).__name__}; it must be the name of a bundled scene, "
            "or the path of a Python file, which an FMU takes with it"
        )
    module = load(scene)
    built = module.build(parameters)
    motion = SceneMotion(built)
    name = re.sub(r"\W", "_", f"shellmb_{module.name}")
    outputs = {column: unit_of(column, built) for column in motion.outputs}
    inputs = {k: (some[0].default, some[0].unit) for k, some in named_inputs(built).items()}
    values = _start_values(module, parameters or {})
    names = [TIME, *outputs, *inputs, *values]
    for one in names:
        if names.count(one) > 1:
            raise SceneError(
                f"export: '{one}' names two of the time, inputs, outputs and parameters of "
                f"scene '{built.name}'; each must have a name of its own"
            )
    described = {
        "scene": Path(scene).name if is_file_name(scene) else module.name,
        "description": (module.module.__doc__ or built.name).partition("\n")[0],
        "dt": built.dt,
        "t_end": built.t_end,
        "inputs": inputs,
        "outputs": outputs,
        "parameters": values,
    }
    builder: Any = importlib.import_module(f"{package}.builder").FmuBuilder
    with tempfile.TemporaryDirectory() as folder:
        # Python knows modules of all FMUs of a process by their names
        token = uuid.uuid4().hex[:8]
        script = Path(folder, f"{name}_{token}.py")
        paths = [p for p in sys.path if Path(p).name in PACKAGE_FOLDERS]
        libraries = [str(p) for p in Path(sys.prefix, "lib").glob("libmpi.so.*")]
        how = {"paths": paths, "libraries": libraries, "package": package, "described": described}
        script.write_text(SLAVE.format(name=name, version=version, **how))
        files = [Path(scene).resolve()] if is_file_name(scene) else []
        wanted = dict.fromkeys(ABILITIES, True)
        before = list(sys.path)
        try:
            made = Path(builder.build_FMU(script, dest=folder, project_files=files, **wanted))
        finally:
            sys.path[:] = before
            sys.modules.pop(script.stem, None)
        target = Path(out or "")
        if target.suffix != ".fmu":
            target = target / f"{name}.fmu"
        target.parent.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy2(made, target))


def _start_values(module: SceneModule, given: Mapping[str, str]) -> dict[str, Any]:
    """Values of those parameters of a scene that are plain numbers, truth values or texts."""
    found = {name: p.default for name, p in module.parameters.items()}
    found |= {name: module.value(name, text) for name, text in given.items()}
    plain = {name: value for name, value in found.items() if type(value) in KINDS[2]}
    for name in given:
        if name not in plain:
            raise SceneError(
                f"export: parameter '{name}' is {show(found[name])}; an FMU has numbers, truth "
                "values and texts only: change the default in the file"
            )
    return plain


def unit_of(column: str, scene: Scene) -> str:
    """Unit of an output, if the scene says which units it has; "" if not.

    Args:
        column: Its name.
        scene: The scene.
    """
    units = parse_units(scene.units)
    for probe in scene.probes:
        if probe.name == column:
            return units.of(QUANTITIES[probe.quantity])
    quantity = COLUMNS.get(column.rpartition(".")[2])
    return units.of(quantity) if quantity else ""
