"""The antenna of section 6.3 with its panels reduced to modes about frames that move with them.

Each panel with the two beams glued to its edges is one body in modes; the connectors, 0.2 m long
and 20 mm thick, are rigid. The panels' strains are small and their motion is large: that is what
modes about a floating frame are for. A step costs the same whatever the mesh, and nothing but
positions is measured, as bodies in modes have no resultants.
"""

# KIND: vibrations and motion

from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.demos.antenna import CONNECTOR, HINGES, PANELS, RHO, opening
from shellmb.demos.antenna import scene as antenna
from shellmb.scene import Beam, Line, RigidBody, Scene
from shellmb.scene.values.models import model_of

# CI: shellmb run antenna_panels --scheme ep --check --no-pictures

# opening at 20 s of hinges A1, C1 and C3, as part of their `theta_0`, with exact panels of 10x4:
# shellmb run antenna_panels --set panels=exact --mesh 10x4
EXACT = {"A1": 0.082533, "C1": 0.052402, "C3": 0.162691}


def rigid(connector: Beam) -> RigidBody:
    """A connector as a rigid body.

    Args:
        connector: The beam.
    """
    assert isinstance(connector.curve, Line)
    ends = np.array([connector.curve.start, connector.curve.end])
    along, length = ends[1] - ends[0], float(np.linalg.norm(ends[1] - ends[0]))
    mass = RHO * CONNECTOR**2 * length
    unit = along / length
    slender = mass * (length**2 + CONNECTOR**2) / 12
    inertia = slender * np.eye(3) + (mass * CONNECTOR**2 / 6 - slender) * np.outer(unit, unit)
    rows: Any = tuple(tuple(float(x) for x in row) for row in inertia)
    middle: Any = tuple(float(x) for x in ends.mean(axis=0))
    return RigidBody(connector.name, mass, rows, middle)


def scene(panels: str = "modal:1", nx: int = 5, ny: int = 2, dt: float = 0.2) -> Scene:
    """The antenna.

    Args:
        panels: How the panels deform: "exact", "rigid", "modal:4".
        nx: Elements of a panel across the hinges.
        ny: Elements along them.
        dt: Time step, s.
    """
    full = antenna(nx=nx, ny=ny, dt=dt, t_end=20.0)
    glued = {glue.beam for glue in full.glues}
    model: Any = model_of(panels)
    return replace(
        full,
        name="antenna_panels",
        shells=tuple(replace(shell, model=model) for shell in full.shells),
        beams=tuple(replace(beam, model=model) for beam in full.beams if beam.name in glued),
        rigid_bodies=tuple(rigid(beam) for beam in full.beams if beam.name not in glued),
        probes=tuple(probe for probe in full.probes if probe.quantity == "position"),
        # two rigid panels on a line of two hinges
        redundant="drop" if panels == "rigid" else full.redundant,
    )


def results(run: Any) -> dict[str, float]:
    """Openings of hinges and the way of the antenna's tip at the end, and the energy account."""
    history = run.history
    found = {f"opening_{hinge}": float(opening(history, hinge)[-1]) for hinge in EXACT}
    found["tip_x"] = float(history[f"C{PANELS}_x"].iloc[-1] - history[f"C{PANELS}_x"].iloc[0])
    found["apart"] = max(
        float(np.abs(opening(history, one) - opening(history, other)).max())
        for one, other in zip(HINGES[::2], HINGES[1::2], strict=True)
    )
    found["energy_balance_error"] = run.summary["energy_balance_error"]
    return found


def check(results: dict[str, float]) -> None:
    """The energy law; hinges open as with exact panels, within 1 %."""
    assert results["energy_balance_error"] < 1e-9
    for hinge, exact in EXACT.items():
        assert abs(results[f"opening_{hinge}"] / exact - 1) < 1e-2, hinge
