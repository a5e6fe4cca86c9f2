"""Resultants of a shell at named points against statics."""

import pytest

from shellmb.forms.materials import isotropic_quadratic
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    EdgeForce,
    EdgeMoment,
    Hyperelastic,
    Isotropic,
    Probe,
    Rectangle,
    Scene,
    Shell,
)

LENGTH, WIDTH, FORCE, MOMENT, PULL = 1.0, 0.5, 3.0, 2.0, 40.0


def probes(component: int) -> list[Probe]:
    middle = (LENGTH / 2, WIDTH / 2, 0.0)
    return [
        Probe(name, middle, quantity, component)
        for name, quantity in (("n", "membrane"), ("m", "bending"), ("q", "shear"))
        if not (quantity == "shear" and component == 2)
    ]


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize("energy", [False, True])
def test_cantilever_strip_in_tension_and_bending(cell, energy):
    """nu = 0: N11 is the pull, M11 = M + F (L - x) with the sign of curvature, Q1 = F."""
    section = Isotropic(1e9, 0.0, thickness=0.05)
    if energy:
        section = Hyperelastic(
            isotropic_quadratic,
            {"E": 1e9, "nu": 0.0, "thickness": 0.05, "shear_correction": 5 / 6},
            thickness=0.05,
            density=0.0,
            stiffness=1e9 * 0.05,
        )
    shell = Shell("s", Rectangle(LENGTH, WIDTH), section, mesh=(8, 4), cell=cell)
    loads = [
        EdgeForce("right", (PULL, 0, FORCE)),
        EdgeMoment("right", (0, -MOMENT, 0)),
    ]
    scene = Scene(
        "strip",
        shell,
        supports=Clamped("left"),
        loads=loads,
        probes=probes(0),
        scheme="linear-statics",
        t_end=1.0,
    )
    last = execute(scene).history.iloc[-1]
    # M11 is conjugate to x,1 . d,1: positive where the director leans forward along x
    moment = -(MOMENT + FORCE * LENGTH / 2)
    # resultants are linear along an element of degree 2, constant in a triangle
    tolerance = 1e-6 if cell == "quad" else 0.02
    assert last["n"] == pytest.approx(PULL, rel=tolerance)
    assert last["q"] == pytest.approx(FORCE, rel=10 * tolerance)
    assert last["m"] == pytest.approx(moment, rel=tolerance)
