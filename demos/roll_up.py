"""Cantilever strip rolled up into a full circle by its end moment, in a single load step.

A strip of length `L` under the end moment `M = 2 pi E I / L` becomes a closed circle; at a
fraction of it an arc with
tip displacements `U = L (1 - sin(phi)/phi)`, `W = L (1 - cos(phi))/phi`, `phi = M L/(E I)`.
Problem 3.2 of
Sze, Liu and Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569. The mixed resultants are why
one load step is enough.
"""

# KIND: statics and paths

import math
from typing import Any

from shellmb.scene import Clamped, EdgeMoment, Isotropic, Probe, Rectangle, Scene, Shell, Solver

LENGTH, WIDTH, E = 12.0, 1.0, 1.2e6


def scene(thickness: float = 0.1, turns: float = 1.0) -> Scene:
    """The strip.

    Args:
        thickness: Thickness, m.
        turns: Number of full turns that the end moment makes.
    """
    bending = E * thickness**3 / 12
    strip = Shell(
        "strip",
        Rectangle(LENGTH, WIDTH),
        Isotropic(E=E, nu=0.0, thickness=thickness),
        mesh=(16, 1),
    )
    tip = (LENGTH, 0.0, 0.0)
    return Scene(
        "roll_up",
        strip,
        supports=Clamped("left"),
        loads=EdgeMoment("right", (0.0, -2 * math.pi * turns * bending / LENGTH, 0.0)),
        probes=(Probe("tip_u", tip, component=0), Probe("tip_w", tip, component=2)),
        scheme="static",
        dt=1.0,
        t_end=1.0,
        solver=Solver(max_iterations=60),
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Distance of the tip from where the exact circle closes, and the iterations it took."""
    u, w = float(run.column("tip_u")[-1]), float(run.column("tip_w")[-1])
    return {
        "tip_u": u,
        "tip_w": w,
        "closure_error_over_L": math.hypot(u + LENGTH, w) / LENGTH,
        "iterations": float(run.simulation.iterations),
        "load_steps": float(run.simulation.step),
    }


def check(results: dict[str, float]) -> None:
    """Closed to 0.1 % of the length, from one load step, which is taken in parts."""
    assert results["closure_error_over_L"] < 1e-3
    assert results["load_steps"] <= 4
    assert results["iterations"] <= 80
