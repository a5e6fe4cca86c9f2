"""Square plate, simply supported on all sides, under a uniform pressure; small displacements.

The deflection of its middle has a closed form, Navier's series with transverse shear
(`demos/references/plates.py`). `shellmb study --bundled static_plate` shows what accuracy costs.
"""

# KIND: start here

from shellmb.demos.references.plates import Plate, rectangle_uniform_deflection
from shellmb.scene import (
    Fixed,
    HardSupport,
    Isotropic,
    Probe,
    Rectangle,
    Scene,
    Shell,
    SurfaceForce,
)

SIDE, THICKNESS = 1.0, 0.01  # [m]
E, NU, PRESSURE = 210e9, 0.3, 1000.0  # [Pa]

EDGES = ("left", "right", "bottom", "top")


def scene(side: float = SIDE, thickness: float = THICKNESS, pressure: float = PRESSURE):
    """The plate.

    Args:
        side: Side [m].
        thickness: Thickness [m].
        pressure: Pressure [Pa].
    """
    steel = Isotropic(E=E, nu=NU, thickness=thickness)
    return Scene(
        "loaded_plate",
        Shell("plate", Rectangle(side, side), steel, mesh=(8, 8)),
        supports=(
            HardSupport(EDGES),
            # held in its plane, where nothing acts
            Fixed("left-bottom", displacement=(0.0, 0.0, None)),
            Fixed("right-bottom", displacement=(None, 0.0, None)),
        ),
        loads=SurfaceForce((0, 0, pressure)),
        probes=Probe("middle", (side / 2, side / 2, 0.0), component=2),
        scheme="linear-statics",
        units="m, kg, s",
    )


def results(run):
    """The deflection of the middle, and its error."""
    shell, load = run.scene.shells[0], run.scene.loads[0]
    side = shell.surface.length
    plate = Plate(E, NU, shell.section.thickness)
    exact = rectangle_uniform_deflection(plate, side, side, load.force[2])
    found = float(run.column("middle")[-1])
    return {"deflection": found, "relative_error": abs(found / exact - 1)}


def check(results):
    """With 8x8 quadrilaterals."""
    assert results["relative_error"] < 1e-3
