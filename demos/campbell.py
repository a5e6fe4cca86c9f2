"""Campbell diagram of a rotor blade: flapping and lagging stiffened by the rotation.

Run it with `shellmb modes campbell --rate 0,5,10,15,20`. A slender blade on a hub turns with 0 to
20 rad/s, which is seven times its first frequency at rest. The reference are frequencies of a thin
beam by Ritz' method (`demos/references/rotating.py`; Southwell and Gough 1921, Wright et al. 1982).
"""

# KIND: vibrations and motion
# CI: shellmb modes campbell --rate 0,10,20 --check --out runs/ci-campbell

import math
from typing import Any

import numpy as np

from shellmb.demos.references.rotating import flapping, lagging
from shellmb.scene import (
    Beam,
    Driver,
    Line,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Weld,
)

HUB, LENGTH, CHORD, THICKNESS = 0.5, 8.0, 0.3, 0.04
E, NU, RHO = 40e9, 0.3, 1900.0


def scene(rate: float = 5.0, elements: int = 10) -> Scene:
    """A blade on a hub that a motor turns.

    Args:
        rate: Rate at which it turns in time, rad/s; the modes have theirs by `--rate`.
        elements: Number of elements.
    """
    blade = Beam(
        "blade",
        Line((HUB, 0, 0), (HUB + LENGTH, 0, 0)),
        RectangularSection(E=E, nu=NU, width=CHORD, height=THICKNESS, density=RHO),
        elements=elements,
    )
    hub = RigidBody("hub", 50.0, (4.0, 4.0, 6.0))
    joints = (
        Revolute("bearing", "ground", "hub", at=(0, 0, 0), axis=(0, 0, 1)),
        Weld("root", "hub", "blade", at=(HUB, 0, 0)),
    )
    return Scene(
        "campbell",
        beams=blade,
        rigid_bodies=hub,
        joints=joints,
        drivers=Driver("motor", "bearing", rotation=lambda t: rate * t),
        scheme="ep",
        dt=0.01,
        t_end=2.0,
        units="m, kg, s",
    )


def mode_results(modes: Any) -> dict[str, float]:
    """Frequencies of the first two flapping modes and the first lagging one, rad/s, by rate."""
    found: dict[str, float] = {}
    for rate, at in zip(modes.rates, modes.modes, strict=True):
        flaps: list[float] = []
        lags: list[float] = []
        for omega, (real, _) in zip(at.omega, at.shapes, strict=True):
            size = np.abs(real["blade"]).max(axis=0)
            (flaps if size[2] > size[1] else lags).append(float(omega))
        found |= {f"flap1_{rate:g}": flaps[0], f"flap2_{rate:g}": flaps[1]}
        found |= {f"lag1_{rate:g}": lags[0]}
    return found


def check(results: dict[str, float]) -> None:
    """Within 0.3 % of a thin beam; shear and rotary inertia lower the lagging mode by 0.2 %."""
    for name, value in results.items():
        kind, rate = name.split("_")
        thickness = CHORD if kind == "lag1" else THICKNESS
        unit = math.sqrt(E * thickness**2 / 12 / RHO) / LENGTH**2
        thin = (lagging if kind == "lag1" else flapping)(float(rate) / unit, 2, HUB / LENGTH)
        reference = thin[1 if kind == "flap2" else 0] * unit
        assert abs(value / reference - 1) < 3e-3, (name, value, reference)
