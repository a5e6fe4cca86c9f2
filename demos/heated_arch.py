"""A bimetal arch between fixed hinges is heated until it snaps through: a thermostat's switch.

Two metals of unlike expansion would curve the strip the other way, if it were free: that is its
natural curvature, which grows with the temperature. The hinges hold the ends, so the arch is pushed
together, sinks, and at a limit point it snaps. The path of equilibria is followed beyond it, and
the curvature at the limit point is that of the theory of shallow arches.
"""

# KIND: statics and paths

import numpy as np

from shellmb.demos.references.beams import heated_arch
from shellmb.scene import (
    Fixed,
    Isotropic,
    NaturalStrain,
    Output,
    Parametric,
    PathFollowing,
    Probe,
    Scene,
    Shell,
    StepControl,
    SymmetryPlane,
)

E, THICKNESS, WIDTH = 2e11, 1e-3, 0.02  # [Pa], [m]
SPAN, RISE = 0.2, 3e-3  # [m]


def scene(mesh: int = 8, t_end: float = 9.0):
    """Half of the arch.

    Args:
        mesh: Elements along it.
        t_end: Length of the path, in units of the load factor at its beginning.
    """

    def half(xi, eta):
        return np.stack([SPAN / 2 * xi, WIDTH * eta, RISE * np.sin(np.pi * xi / 2)])

    arch = Shell(
        "arch",
        Parametric(half),
        # the mean of both metals, without lateral contraction: a wide beam
        Isotropic(E, 0.0, thickness=THICKNESS),
        mesh=(mesh, 1),
        # of 1/m times the load factor, towards the side of the hinges
        natural=NaturalStrain(curvature=(-1.0, 0.0, 0.0)),
    )
    return Scene(
        "heated_arch",
        arch,
        supports=[
            Fixed("left", displacement=(0, 0, 0)),
            SymmetryPlane("right", (1, 0, 0)),
            SymmetryPlane(("bottom", "top"), (0, 1, 0)),
        ],
        probes=Probe("sinks", "right-bottom", component=2),
        scheme="static",
        path=PathFollowing(),
        dt=0.02,
        t_end=t_end,
        step_control=StepControl(max_dt=0.5),
        output=Output(frames=31, fields=("displacement", "N", "M")),
        units="m, kg, s",
    )


def results(run):
    """The limit point, and the one of shallow arches."""
    (point,) = [p for p in run.summary["path"] if p["kind"] == "limit point"][:1]
    force, curvature = heated_arch(E * THICKNESS, E * THICKNESS**3 / 12, SPAN, RISE)
    return {
        "curvature_at_snap": point["load_factor"],
        "shallow_arch": curvature,
        "axial_force_over_euler": force,
        "sinks_by": float(-run.column("sinks")[-1]),
    }


def check(results):
    """Shallow theory leaves out squares of slopes, 2e-3; one limit point, and the arch goes on."""
    assert abs(results["curvature_at_snap"] / results["shallow_arch"] - 1) < 5e-3
    assert results["sinks_by"] > 1e-3
