"""A square airbag is inflated from flat: its seams are drawn in, and the sheets wrinkle there.

A quarter of the upper one of two sheets that are joined along their edges, with a section that
carries no compression (`Wrinkling`). Wrinkles are not resolved: across them the membrane shortens
without stress, along them it is in tension. The deflection of the middle is the published one.
"""

# KIND: vibrations and motion

from shellmb.demos.references.membranes import AIRBAG, AIRBAG_SPREAD
from shellmb.scene import (
    Fixed,
    Output,
    Pressure,
    Probe,
    Ramp,
    Rectangle,
    Scene,
    Shell,
    Solver,
    SymmetryPlane,
    Wrinkling,
)

HALF = 0.6 / 2**0.5  # of a side; 1.2 m from corner to corner [m]


def scene(mesh: int = 6, compression: float = 1e-4, scheme: str = "ep", cell: str = "quad"):
    """A quarter of the upper sheet.

    Args:
        mesh: Elements along each of its sides.
        compression: Part of the stiffness that is kept in compression.
        scheme: A dynamic one, or "static".
        cell: "quad" or "tri".
    """
    # air slows the sheets down
    fabric = Wrinkling(
        588e6, 0.4, 0.6e-3, density=1500.0, compression=compression, mass_damping=200.0
    )
    in_time = {"dt": 2e-3, "t_end": 0.1, "loads": Pressure(5e3, time=Ramp(0.02))}
    in_steps = {"dt": 0.1, "loads": Pressure(5e3)}
    return Scene(
        "airbag",
        Shell("bag", Rectangle(HALF, HALF), fabric, mesh=(mesh, mesh), cell=cell),
        supports=[
            SymmetryPlane("left", (1, 0, 0)),
            SymmetryPlane("bottom", (0, 1, 0)),
            Fixed(("right", "top"), displacement=(None, None, 0.0)),
        ],
        probes=[
            Probe("middle", (0, 0, 0)),
            Probe("seam", (HALF, 0, 0), component=0),
        ],
        scheme=scheme,
        # all states change in an iteration
        solver=Solver(newton="full"),
        output=Output(frames=26, fields=("displacement", "principal_N")),
        units="m, kg, s",
        **(in_steps if scheme == "static" else in_time),
    )


def results(run):
    """Deflections at the end, and what the account lacks."""
    return {
        "middle": float(run.column("middle")[-1]),
        "published": AIRBAG,
        "seam_drawn_in": -float(run.column("seam")[-1]),
        "energy_balance": run.summary["energy_balance_error"],
    }


def check(results):
    """As published, to the spread of those who did."""
    assert abs(results["middle"] / results["published"] - 1) < AIRBAG_SPREAD
    assert (results["energy_balance"] or 0.0) < 1e-11
