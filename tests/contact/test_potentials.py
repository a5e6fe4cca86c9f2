"""Potentials of users: fields, foundations, and directors that are turned."""

import numpy as np
import pytest
import ufl
from numpy.testing import assert_allclose

from shellmb.scene import (
    InitialVelocity,
    Isotropic,
    Potential,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    SurfaceForce,
)

OTHERS = [("ep4", 0.0), ("ed", 1.0), ("ed3", 1.0)]
SCHEMES = [("ep", 0.0), *(pytest.param(*s, marks=pytest.mark.slow) for s in OTHERS)]


def attracted(at, p):
    """Energy of a mass in the field of a centre: concave across, convex along the radius."""
    return -p["mu"] / ufl.sqrt(ufl.dot(at.x, at.x))


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_an_orbit(scheme, alpha, run) -> None:
    """An ellipse from its pericentre, r = 1 to r = 2.2: energy is kept, or falls a little."""
    mass, mu = 3.0, 12.0
    speed = np.sqrt(mu / mass * 1.375)
    period = 2 * np.pi * np.sqrt(1.6**3 * mass / mu)
    scene = Scene(
        "orbit",
        rigid_bodies=RigidBody("moon", mass, (1.0, 1.0, 1.0), position=(1, 0, 0)),
        potentials=Potential("field", attracted, parameters={"mu": mu}),
        initial=InitialVelocity(linear=(0, speed, 0)),
        scheme=scheme,
        alpha=alpha,
        dt=period / 80,
        t_end=period,
    )
    found = run(scene).history
    energy = found.total_energy
    assert_allclose(energy.iloc[0], -mu / (2 * 1.6), rtol=1e-12)
    loss = abs(energy.iloc[-1] / energy.iloc[0] - 1)
    # what Newton leaves at 1e-9 of the unknowns
    assert loss < 1e-10 if alpha == 0 else 1e-9 < loss < 0.02
    # back at the start after a period: of the velocity, in parts of it
    v = found[["momentum_x", "momentum_y"]].iloc[-1].to_numpy() / mass / speed
    order = {"ep": 0.2, "ep4": 1e-3, "ed": 0.1, "ed3": 0.02}[scheme]
    assert_allclose(v, [0, 1], atol=order)
    assert_allclose(found["field.energy"], found.potential_energy)


def foundation(at, p):
    """Springs per area."""
    return p["k"] / 2 * ufl.dot(at.u, at.u)


def test_a_plate_that_only_a_foundation_holds(run) -> None:
    """A uniform load moves it by `p/k` everywhere, and nothing bends."""
    plate = Shell(
        "plate",
        Rectangle(0.4, 0.3),
        Isotropic(70e9, 0.3, thickness=2e-3, density=2700.0),
        mesh=(2, 2),
    )
    scene = Scene(
        "bed",
        shells=plate,
        potentials=Potential("bed", foundation, parameters={"k": 1e5}),
        loads=SurfaceForce((0, 50.0, 100.0)),
        dt=1.0,
    )
    end = run(scene).history.iloc[-1]
    assert_allclose(end["bed.energy"], (100.0**2 + 50**2) / 1e5 / 2 * 0.12, rtol=1e-9)
    assert_allclose([end["bed.Fx"], end["bed.Fy"], end["bed.Fz"]], [0, -6, -12], atol=1e-8)
    assert end.strain_energy < 1e-12 * end["bed.energy"]


def leaning(at, p):
    """Directors are drawn to z, and the place to the centre of an anisotropic well."""
    return p["m"] * (1 - at.directors[0][2]) + p["k"] / 2 * (at.u[2] + 0.3 * at.u[0]) ** 2


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_directors_of_a_shell(scheme, alpha, run) -> None:
    """A tumbling plate in a field that turns its directors; half the step gives nearly the same."""
    ends = []
    for dt in (2e-3, 1e-3):
        scene = Scene(
            "leaning",
            shells=Shell(
                "plate",
                Rectangle(0.4, 0.3),
                Isotropic(7e8, 0.3, thickness=5e-3, density=2700.0),
                mesh=(1, 1),
            ),
            potentials=Potential("field", leaning, parameters={"m": 200.0, "k": 2e4}),
            initial=InitialVelocity(spin=(2.0, 3.0, 1.0)),
            scheme=scheme,
            alpha=alpha,
            dt=dt,
            t_end=0.04,
        )
        found = run(scene).history
        if alpha == 0:
            assert np.ptp(found.total_energy) < 1e-11 * found.total_energy.max()
        ends.append(found["field.energy"].iloc[-1])
    assert ends[0] > 0.01
    assert_allclose(ends[0], ends[1], rtol=0.05)
