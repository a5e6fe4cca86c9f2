"""Modes about steady rotations against closed forms: top, mass on springs, blade, disc."""

import math
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.demos.references.rotating import (
    flapping,
    lagging,
    sleeping_top,
    spinning_membrane,
)
from shellmb.running.rotating.campbell import campbell
from shellmb.scene import (
    Beam,
    Clamped,
    Damper,
    Disc,
    Driver,
    Gravity,
    Isotropic,
    JointDamper,
    JointSpring,
    Line,
    Planar,
    Prismatic,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Spherical,
    Spring,
)
from tests.analytic.solutions import mass_on_springs

UP = (0.0, 0.0, 1.0)
TIMES = {"scheme": "ep", "dt": 0.01, "t_end": 1.0}


def test_wright_1982() -> None:
    """The Ritz solution against what is printed (Wright et al. 1982, no hub), to their digits."""
    np.testing.assert_allclose(flapping(0.0), (3.5160, 22.0345, 61.6972), atol=6e-5)
    np.testing.assert_allclose(flapping(2.0), (4.1373, 22.6149, 62.2732), atol=6e-5)
    np.testing.assert_allclose(flapping(12.0), (13.1702, 37.6031, 79.6145), atol=6e-5)


@pytest.mark.slow  # the demo `campbell` is the small one
def test_blade() -> None:
    """Flapping and lagging within 0.1 % of a thin beam, up to twelve times the first frequency."""
    E, rho, b, h, L = 2e11, 7800.0, 0.04, 0.01, 2.0
    blade = Beam(
        "blade",
        Line((0, 0, 0), (L, 0, 0)),
        RectangularSection(E=E, nu=0.3, width=b, height=h, density=rho),
        elements=8,
    )
    unit = math.sqrt(E * h**2 / 12 / rho) / L**2
    etas = (0.0, 2.0, 12.0)
    scene = Scene("blade", beams=blade, supports=Clamped("start"), **TIMES)
    found = campbell(scene, [eta * unit for eta in etas], count=3, axis=UP)
    for eta, row in zip(etas, found.frequencies, strict=True):
        across, within = flapping(eta, 2), lagging(eta * h / b, 1)
        exact = [across[0], within[0] * b / h, across[1]]
        # along branches: the second flapping mode overtakes none of them here
        np.testing.assert_allclose(2 * np.pi * row[:3] / unit, exact, rtol=1e-3)
    assert not found.unstable
    assert np.array_equal(found.branches[0, :3], [0, 1, 2])


def test_sleeping_top() -> None:
    """A heavy top upright on its tip: nutation, precession, and the spin below which it falls."""
    mass, height, across, along = 2.0, 0.3, 0.1, 0.15
    weight = mass * 9.81 * height
    top = RigidBody("top", mass, (across, across, along), com=(0, 0, height))
    scene = Scene(
        "top",
        rigid_bodies=top,
        joints=Spherical("tip", "ground", "top", at=(0, 0, 0)),
        loads=Gravity((0, 0, -9.81)),
        **TIMES,
    )
    across += mass * height**2
    critical = math.sqrt(4 * across * weight) / along
    rates = [0.6 * critical, 0.98 * critical, 1.02 * critical, 2 * critical]
    found = campbell(scene, rates, count=3, loaded=True, axis=UP)
    for rate, modes in zip(rates, found.modes, strict=True):
        exact = sleeping_top(rate, across, along, weight)
        own = modes.values[modes.rigid :]
        assert modes.rigid == 1  # turning about the axis
        for value in exact:
            pair = complex(value.real, abs(value.imag))
            # near the critical spin two eigenvalues are one: round-off counts by its root
            assert min(abs(own - pair)) < 1e-6 * abs(pair)
        assert bool(modes.unstable) == (rate < critical)
    assert "flutter" in found.verdict
    assert found.modes[3].directions[1:] == ("backward", "backward")


def springs(damping: float) -> Scene:
    """A mass between two springs across one another, on a hub that turns."""
    far = 10.0
    hub = RigidBody("hub", 1.0, (1.0, 1.0, 1.0), points={"x": (far, 0, 0), "y": (0, far, 0)})
    mass = RigidBody("mass", 2.0, (0.1, 0.1, 0.1))
    ends = {"second_at": (0, 0, 0)}
    elements: list[object] = [
        Spring("kx", "hub", "mass", at="x", stiffness=2.0 * 10.0**2, **ends),
        Spring("ky", "hub", "mass", at="y", stiffness=2.0 * 15.0**2, **ends),
    ]
    if damping:
        viscosity = 2 * 2.0 * damping
        elements += [
            Damper("cx", "hub", "mass", at="x", damping=viscosity, **ends),
            Damper("cy", "hub", "mass", at="y", damping=viscosity, **ends),
        ]
    return Scene(
        "springs",
        rigid_bodies=(hub, mass),
        joints=(
            Revolute("axle", "ground", "hub", at=(0, 0, 0), axis=UP),
            Planar("table", "hub", "mass", at=(0, 0, 0), normal=UP),
        ),
        drivers=Driver("motor", "axle", rotation=lambda t: 3.0 * t),
        force_elements=tuple(elements),
        **TIMES,
    )


@pytest.mark.parametrize("damping", [pytest.param(0.0, marks=pytest.mark.slow), 0.5])
def test_mass_on_turning_springs(damping: float) -> None:
    """Between the critical speeds it diverges; dampers that turn along let it flutter above."""
    rates = [0.0, 5.0, 9.999, 12.0, 20.0, 40.0]
    # the third mode turns the mass about itself, which nothing holds
    found = campbell(springs(damping), rates, count=3)
    assert found.axis.along(UP)
    for rate, modes in zip(rates, found.modes, strict=True):
        exact = mass_on_springs(rate, 10.0, 15.0, damping)
        own = modes.values[modes.rigid :]
        for value in own:
            assert min(abs(exact - value)) < 1e-6 * abs(value) + 1e-6
        assert bool(modes.unstable) == bool(np.max(exact.real) > 1e-3)
        if not damping:
            assert bool(modes.unstable) == (10.0 < rate < 15.0)
    if damping:
        assert found.modes[0].damping[-1] == pytest.approx(damping / 15.0, rel=1e-6)
        assert "divergence" in found.verdict
        assert found.modes[-1].unstable


@pytest.mark.parametrize("viscosity", [4.0, 50.0])
def test_damped_at_rest(viscosity: float) -> None:
    """A slide on spring and damper to ground, which need not turn along: `m s^2 + c s + k = 0`."""
    scene = Scene(
        "slide",
        rigid_bodies=RigidBody("slide", 2.0, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", "ground", "slide", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=(
            JointSpring("spring", "rail", stiffness=200.0),
            JointDamper("damper", "rail", damping=viscosity),
        ),
        **TIMES,
    )
    roots = np.roots([2.0, viscosity, 200.0])
    count = 1 if viscosity < 40 else 2
    (modes,) = campbell(scene, [0.0], count=count).modes
    exact = sorted((r for r in roots if r.imag >= 0), key=abs)
    np.testing.assert_allclose(modes.values[:count], exact, rtol=1e-9)
    assert modes.damping[0] == pytest.approx(min(viscosity / 40.0, 1.0))
    assert not modes.unstable


@pytest.mark.parametrize("of", ["shell", pytest.param("beam", marks=pytest.mark.slow)])
def test_damping_of_sections(of: str) -> None:
    """`tau |s| / 2` of the strains and `rate / 2 |s|` of the mass, where it does not turn.

    Where it turns, the stiffness that comes with the pull is not damped, and the ratio is smaller.
    """
    tau, rate = 2e-4, 3.0
    damped = {
        "E": 70e9,
        "nu": 0.0,
        "density": 2700.0,
        "stiffness_damping": tau,
        "mass_damping": rate,
    }
    bodies: dict[str, Any] = (
        {"shells": Shell("plate", Rectangle(1.0, 0.1), Isotropic(thickness=0.01, **damped))}
        if of == "shell"
        else {
            "beams": Beam(
                "beam",
                Line((0, 0, 0), (1, 0, 0)),
                RectangularSection(width=0.1, height=0.01, **damped),
            )
        }
    )
    edge = "left" if of == "shell" else "start"
    scene = Scene("strip", supports=Clamped(edge), **bodies, **TIMES)
    still, turning = campbell(scene, [0.0, 20.0], count=3, axis=UP).modes
    size = np.abs(still.values)
    np.testing.assert_allclose(still.damping, tau * size / 2 + rate / (2 * size), rtol=1e-6)
    size = np.abs(turning.values[0])
    assert turning.damping[0] < 0.99 * (tau * size / 2 + rate / (2 * size))


def test_free_gyroscope() -> None:
    """A free symmetric body: its tilt stands in space, its wobble has `(C/A - 1) Omega`."""
    body = RigidBody("body", 2.0, (0.1, 0.1, 0.18))
    modes = campbell(Scene("free", rigid_bodies=body, **TIMES), [10.0], count=6, axis=UP).modes[0]
    assert modes.rigid == 2
    # three circles of what is at rest in space: the double one of translations to its root
    np.testing.assert_allclose(modes.omega[2:], [8.0, 10.0, 10.0, 10.0], rtol=1e-6)
    assert not modes.unstable
    assert modes.directions.count("backward") == 3
    assert modes.directions[2] == "forward"


@pytest.mark.slow
def test_spinning_disc() -> None:
    """A thin free disc spins like a membrane (Lamb and Southwell), its modes in pairs."""
    disc = Shell(
        "disc",
        Disc(0.5),
        Isotropic(E=7e10, nu=0.3, thickness=1e-4, density=2700.0),
        mesh=(4, 4),
    )
    scene = Scene("disc", disc, **TIMES)
    (modes,) = campbell(scene, [100.0], count=10, axis=UP).modes
    ratios = (modes.omega[modes.rigid :] / 100.0) ** 2
    for diameters, circles, many in ((1, 0, 2), (2, 0, 2), (0, 1, 1), (3, 0, 2)):
        exact = spinning_membrane(diameters, circles, 0.3)
        # bending adds up to 1e-3 of the third, the mesh the same; translations are at 1, too
        near = np.sum(np.abs(ratios / exact - 1) < 4e-3)
        assert near == (4 if diameters == 1 else many), (diameters, circles, ratios)
    assert not modes.unstable


@pytest.mark.parametrize("scale", [(1e6, 1e6, 1e6), (1e9, 1e9, 1e9), (1e-3, 1.0, 1.0)])
def test_units_do_not_matter(scale: tuple[float, float, float]) -> None:
    """Kind: units in which displacements are far from directors, as um with uN and us."""

    def turning(length: float, force: float, time: float) -> np.ndarray:
        """Frequencies of a wire that turns about its end, and poles at rest, in SI units."""
        mass = force * time**2 / length
        section = sm.CircularSection(
            radius=3e-3 * length,
            E=70e9 * force / length**2,
            nu=0.3,
            density=2700 * mass / length**3,
        )
        wire = sm.Beam("wire", sm.Line((0, 0, 0), (0.5 * length, 0, 0)), section, elements=2)
        scene = sm.Scene("wire", beams=wire, supports=sm.Clamped("start"))
        found = sm.modes(scene, count=3, rates=[50.0 / time], axis=(0, 0, 1)).frequencies[0]
        poles = abs(sm.linearise(scene.with_options(scheme="ep", dt=1.0, t_end=1.0)).poles(2))
        return np.array([*found, *poles]) * time

    # sixteen digits are left to be seven where the sizes of unknowns are nine apart
    np.testing.assert_allclose(turning(*scale), turning(1.0, 1.0, 1.0), rtol=1e-6)
