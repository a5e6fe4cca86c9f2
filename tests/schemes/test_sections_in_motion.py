"""Coupled, eccentric and nonlinear sections in every dynamic scheme: laws, and closed forms.

An offset is a matter of description: the same plate, told about a surface below or above its
middle, moves in the same way. That fixes the signs of the coupling `B` and of the first moment
`s*`, which no energy law does.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import ufl

from shellmb.observers.account.momentum import Momentum
from shellmb.scene import (
    Clamped,
    Driven,
    Gravity,
    Hyperelastic,
    InitialVelocity,
    Isotropic,
    Rectangle,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import Simulation

from .conftest import LAWFUL

# wave speed one, as the plates of conftest.py
H, OFFSET = 0.1, 0.03
SOFT = Isotropic(E=1.0, nu=0.3, thickness=H, density=1.0)


def stiffening(strains: Any, parameters: Any) -> Any:
    """Stiffer the more it is stretched, and coupled.

    Of the sixth degree: stresses of the third would be averaged exactly by Gauss' points alone.
    """
    e = ufl.dot(strains.eps, strains.eps) + parameters["c"] * ufl.dot(strains.kap, strains.kap)
    more = parameters["k"] * e**3 + parameters["b"] * strains.eps[0] * strains.kap[0]
    return parameters["A"] / 2 * (e + more + ufl.dot(strains.gam, strains.gam) / 3)


# at strains of a tenth the terms of sixth degree are half of the others
STIFFENING = Hyperelastic(
    stiffening,
    {"A": H, "c": H**2 / 12, "k": 5e3, "b": H / 10},
    thickness=H,
    density=1.0,
    stiffness=H,
)
SECTIONS = {
    "offset up": replace(SOFT, offset=OFFSET),
    "offset down": replace(SOFT, offset=-OFFSET),
    "nonlinear": STIFFENING,
    # thicker towards a corner, its lower face flat: coupled and eccentric everywhere differently
    "tapered": replace(
        SOFT,
        thickness=lambda x: 0.05 * (1 + x[0] * x[1]),
        offset=lambda x: 0.025 * (1 + x[0] * x[1]),
    ),
}
# Newton leaves an error of the order of the square of its tolerance; what is seen is round-off
ROUND_OFF = 1e-11


def scene_of(section: Any, scheme: str, alpha: float, **more: Any) -> Scene:
    shell = Shell("plate", Rectangle(1.0, 0.5), section, mesh=more.pop("mesh", (2, 1)))
    times = {"dt": 0.2, "t_end": 2.0}
    return Scene("plate", shell, scheme=scheme, alpha=alpha, **times | more)


# what takes long: a nonlinear section in sub-intervals, fields as coefficients; and rivals
LONG = {"nonlinear": ("ed",), "tapered": ("ed", "ed3")}


def takes_long(section: str, scheme: str) -> bool:
    """Whether it is not for every day."""
    return scheme == "ed-printed" or scheme in LONG.get(section, ())


CASES = [
    pytest.param(
        section,
        scheme,
        id=f"{section}-{scheme[0]}-{scheme[1]:g}",
        marks=[pytest.mark.slow] if takes_long(section, scheme[0]) else [],
    )
    for section in SECTIONS
    for scheme in LAWFUL
]


@pytest.mark.parametrize(("section", "scheme"), CASES)
def test_energy_law_and_momenta(section, scheme, account, make) -> None:
    """Free flight, fast enough to stretch and bend by some per cent."""
    motion = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(0.4, 0.6, -0.3))
    momentum = Momentum(account)
    simulation = Simulation(scene_of(SECTIONS[section], *scheme, initial=motion))
    simulation.run([account, momentum])
    assert account.values["strain_energy"] > 1e-4 * account.largest
    assert account.relative_error < ROUND_OFF
    kept = make(*scheme).conserves & momentum.drift.keys()
    assert "momentum" in kept
    for kind in kept:
        assert momentum.drift[kind] < ROUND_OFF, kind
    if "energy" not in make(*scheme).conserves:
        assert account.values["dissipation"] > 1e-8 * account.largest


@pytest.mark.parametrize(("section", "scheme"), CASES)
def test_energy_law_under_prescribed_motion(section, scheme, account) -> None:
    """An edge that is turned and carried along: what it takes to do that is in the account."""
    drive = Driven(
        "left",
        translation=lambda t: (0.0, 0.02 * np.sin(t) ** 2, 0.1 * np.sin(t) ** 2),
        axis=(0, 1, 0),
        rotation=lambda t: 0.6 * np.sin(t) ** 2,
    )
    simulation = Simulation(scene_of(SECTIONS[section], *scheme, supports=drive))
    simulation.run([account])
    assert account.relative_error < ROUND_OFF
    assert account.values["work_supports"] > 1e-5
    assert account.values["strain_energy"] > 1e-6


def middle_of_tip(scene: Scene, offset: float) -> np.ndarray:
    """Displacement of the material middle of a plate's free corner over the steps, (n, 3)."""
    simulation, found = Simulation(scene), []
    body = simulation.model.shells["plate"]
    node = int(np.argmin(np.linalg.norm(body.mixed.nodes("u") - [1.0, 0.0, 0.0], axis=1)))
    assert simulation.t_end > 0
    while simulation.t_end - simulation.t > 1e-9:
        simulation.advance()
        state = simulation.problem.state("plate").x.array
        u, w = (state[body.mixed.dofs[p]].reshape(-1, 3)[node] for p in ("u", "w"))
        found.append(u + offset * w)
    return np.array(found)


def told(sign: int, scheme: tuple[str, float], mesh: tuple[int, int]) -> np.ndarray:
    """By how much an offset changes what it must not, along the plate and across it, shape (2,).

    A cantilever is let go, to hang along its length and across it at once.
    """
    held = {"supports": Clamped("left"), "loads": Gravity((2e-3, 0.0, 2e-4)), "mesh": mesh}
    plain = middle_of_tip(scene_of(SOFT, *scheme, **held), 0.0)
    moved = replace(SOFT, offset=sign * OFFSET)
    offset = middle_of_tip(scene_of(moved, *scheme, **held), sign * OFFSET)
    # to the side it moves by a hundredth of this, which meshes as coarse do not know
    return (np.abs(offset - plain).max(axis=0) / np.abs(plain).max(axis=0))[[0, 2]]


@pytest.mark.parametrize("sign", [1, -1])
def test_an_offset_is_a_matter_of_description(lawful, sign) -> None:
    """Of elements, too: a part of the mass that grows with the offset is taken at the nodes."""
    # found 0.3 % along and 1.5 % across on this mesh; with either sign wrong, motions across
    # differ by as much as they are
    assert (told(sign, lawful, (4, 2)) < [0.01, 0.03]).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_an_offset_is_a_matter_of_description_the_more_elements_there_are(sign) -> None:
    coarse, fine = (told(sign, ("ep", 0.0), mesh) for mesh in ((4, 2), (8, 4)))
    # of the third order and more: found 10 and 13 times less
    assert (fine < coarse / 5).all()
    assert (fine < 1e-3).all()  # not round-off


def test_momenta_of_an_eccentric_plate_in_closed_form(account) -> None:
    """Those of a cuboid whose middle is off the reference surface."""
    v, spin = np.array([0.1, -0.2, 0.3]), np.array([0.4, 0.6, -0.3])
    a, b = 1.0, 0.5
    motion = InitialVelocity(linear=tuple(v), spin=tuple(spin))
    simulation = Simulation(scene_of(SECTIONS["offset up"], "ep", 0.0, initial=motion))
    momentum = Momentum(account)
    account.start(simulation)
    momentum.start(simulation)
    mass, centre = a * b * H, np.array([a / 2, b / 2, OFFSET])
    linear = mass * (v + np.cross(spin, centre))
    moments = mass / 12 * np.array([b**2 + H**2, a**2 + H**2, a**2 + b**2])
    angular = np.cross(centre, linear) + moments * spin
    np.testing.assert_allclose(momentum.values["momentum"], linear, rtol=1e-12)
    np.testing.assert_allclose(momentum.values["angular momentum"], angular, rtol=1e-12)
    energy = (linear @ (v + np.cross(spin, centre)) + spin @ (moments * spin)) / 2
    assert account.values["kinetic_energy"] == pytest.approx(energy, rel=1e-12)
