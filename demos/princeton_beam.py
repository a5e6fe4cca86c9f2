"""Princeton beam: a cantilever strip bends about both axes and twists under a load at its tip.

The load points at an angle to the strip's stiff axis, so that a large deflection along the soft one
turns part of it into torsion. Dowell and Traybar measured it (Princeton, 1975); with the data of
O. A. Bauchau et al., Validation of flexible multibody dynamics beam formulations using benchmark
problems, Multibody Syst. Dyn. 37 (2016) 29-48, sec. 3.1, eight codes agree. Here a beam with their
stiffness, or a shell of the strip itself; `demos/references/data/princeton_beam.csv` has what a
commercial beam, a commercial solid and another beam code found.
"""

# KIND: statics and paths
# CI: shellmb run princeton_beam --check --no-pictures
# CI: shellmb run princeton_beam --set model=shell --check --no-pictures --out runs/ci-princeton

from typing import Any, Literal

import numpy as np

from shellmb.demos.references import tables
from shellmb.scene import (
    Beam,
    Clamped,
    EdgeForce,
    GeneralSection,
    Isotropic,
    Line,
    Output,
    PointForce,
    Probe,
    Rectangle,
    Scene,
    Shell,
)

LENGTH, HEIGHT, THICKNESS = 0.508, 12.377e-3, 3.2024e-3  # [m]
E, NU = 71.7e9, 0.31
LOADS = {"F1": 4.448, "F2": 8.896, "F3": 13.345}  # [N]
# axial, shear along the soft and the stiff axis [N]; twist, bending along the stiff and the soft
# axis [N m^2]
STIFFNESS = (2.84191e6, 6.40131e5, 9.03881e5, 3.10338, 36.2794, 2.42873)


def scene(
    load: Literal["F1", "F2", "F3"] = "F3",
    angle: Literal["0", "15", "30", "45", "60", "75", "90"] = "45",
    model: Literal["beam", "shell"] = "beam",
    elements: int = 8,
    mesh: tuple[int, int] = (24, 1),
    dt: float = 0.25,
) -> Scene:
    """The strip along x, its stiff axis along z.

    Args:
        load: Which load.
        angle: Of the load to the stiff axis [degrees].
        model: A beam, or a shell.
        elements: Elements of the beam.
        mesh: Elements of the shell.
        dt: Part of the load that a step adds.
    """
    turned = np.radians(float(angle))
    force = LOADS[load] * np.array([0.0, np.sin(turned), -np.cos(turned)])
    tip = (LENGTH, 0.0, 0.0)
    body: Any
    if model == "beam":
        section = GeneralSection(STIFFNESS)
        body = {
            "beams": Beam("strip", Line((0, 0, 0), tip), section, elements, up=(0, 0, 1)),
            "supports": Clamped("start"),
            "loads": PointForce("end", tuple(force)),
        }
        place: Any = "end"
    else:
        plane = Rectangle(LENGTH, HEIGHT, origin=(0, 0, -HEIGHT / 2), axis2=(0, 0, 1))
        body = {
            "shells": Shell("strip", plane, Isotropic(E, NU, thickness=THICKNESS), mesh=mesh),
            "supports": Clamped("left"),
            "loads": EdgeForce("right", tuple(force / HEIGHT)),
        }
        place = tip
    return Scene(
        "princeton_beam",
        **body,
        probes=(Probe("flapwise", place, component=1), Probe("edgewise", place, component=2)),
        scheme="static",
        dt=dt,
        output=Output(frames=5),
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Displacements of the tip, and how far other codes are apart from them and one another."""
    last = run.history.iloc[-1]
    found = {"flapwise": abs(float(last["flapwise"])), "edgewise": abs(float(last["edgewise"]))}
    (force,) = run.scene.loads
    vector = np.array(force.force) * (HEIGHT if run.scene.shells else 1.0)
    size = float(np.linalg.norm(vector))
    angle = round(float(np.degrees(np.arctan2(vector[1], -vector[2]))))
    name = next(name for name, value in LOADS.items() if np.isclose(value, size))
    table = tables.read("princeton_beam")
    rows = table[(table["load"] == name) & (table["angle_deg"] == angle)]
    for column in ("flapwise", "edgewise"):
        others = rows[column].to_numpy()
        if len(others) and others.max() > 0:
            found[f"{column}_least"] = float(others.min())
            found[f"{column}_most"] = float(others.max())
    return found


def check(results: dict[str, float]) -> None:
    """Between the codes of the table, which are up to 5 % apart, or 1 % beyond them."""
    for column in ("flapwise", "edgewise"):
        if f"{column}_least" in results:
            least, most = results[f"{column}_least"], results[f"{column}_most"]
            assert 0.99 * least < results[column] < 1.01 * most, column
