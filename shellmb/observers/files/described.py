"""Description of a scene for pictures and readers of a run, stored as `scene.json`."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter

from shellmb.errors import SceneError
from shellmb.files.reading import read_json, undamaged
from shellmb.files.writing import write_text
from shellmb.scene import Scene
from shellmb.scene.units import Units, parse_units

# name in a run directory
DESCRIBED = "scene.json"


@dataclass(frozen=True)
class ProbeLine:
    """A probe.

    Args:
        name: Its column.
        quantity: What it records.
    """

    name: str
    quantity: str


@dataclass(frozen=True)
class Described:
    """A scene in plain values, without geometry, materials and functions.

    Args:
        name: Name.
        scheme: Name of the scheme.
        dynamic: Whether it moves in time.
        path: Whether it follows a static path.
        units: Units of labels; None: none.
        bodies: Kind of each body by its name: "shell", "beam", "rigid body", "own body".
        probes: Probes.
        joints: Names of the joints.
        drivers: Names of the drivers.
        elements: Names of springs, dampers and motors.
    """

    name: str
    scheme: str
    dynamic: bool
    path: bool
    units: str | None
    bodies: dict[str, str]
    probes: tuple[ProbeLine, ...]
    joints: tuple[str, ...]
    drivers: tuple[str, ...]
    elements: tuple[str, ...]

    @property
    def labels(self) -> Units:
        """Units of its labels."""
        return parse_units(self.units)

    @property
    def time_label(self) -> str:
        """Label of the axis of time."""
        if self.path:
            return "arc length [-]"
        return self.labels.label("time", "time") if self.dynamic else "load parameter [-]"

    def write(self, directory: Path) -> None:
        """Write the file.

        Args:
            directory: The run directory.
        """
        write_text(directory / DESCRIBED, json.dumps(asdict(self), indent=1) + "\n")


def describe(scene: Scene) -> Described:
    """A scene in plain values."""
    return Described(
        scene.name,
        scene.scheme_name,
        not scene.static,
        scene.path is not None,
        scene.units,
        {body.name: body.label for body in scene.bodies},
        tuple(ProbeLine(p.name, p.quantity) for p in scene.probes),
        tuple(joint.name for joint in scene.joints),
        tuple(driver.name for driver in scene.drivers),
        tuple(element.name for element in scene.force_elements),
    )


def read_described(directory: Path) -> Described:
    """The scene of a run directory.

    Args:
        directory: It.

    Raises:
        SceneError: If it holds none, or not in a form that can be read.
    """
    file = directory / DESCRIBED
    if not file.exists():
        missing = f"{directory} holds no {DESCRIBED}"
        if not directory.exists():
            missing = f"there is no directory {directory}"
        raise SceneError(f"{missing}; give the directory of a run or of modes")
    with undamaged(file):
        found: Described = TypeAdapter(Described).validate_python(read_json(file))
    # they are written as they are read
    parse_units(found.units)
    return found
