"""Free bodies that turn steadily: no rigid motion grows, whatever round-off makes of it.

A translation in the plane is a double eigenvalue `i Omega` with one vector. The kind: rings and
plates, one body or several, in the plane or along any axis, in any unit.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import root

import shellmb as sm
from shellmb.running.rotating.campbell import campbell
from shellmb.scene import (
    Beam,
    Clamped,
    Cylinder,
    Cylindrical,
    FollowerForce,
    GeneralSection,
    InitialVelocity,
    Isotropic,
    JointDamper,
    Line,
    Planar,
    Prismatic,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Spherical,
    Weld,
)


def plate(name: str, at: float, length: float = 1.0) -> Shell:
    """A plate in the plane z = 0."""
    section = Isotropic(E=70e9 / length, nu=0.3, thickness=2e-3 * length, density=2700 / length**3)
    place = (at * length, -0.25 * length, 0)
    return Shell(name, Rectangle(length, 0.5 * length, place), section, mesh=(4, 2))


def ring() -> Shell:
    """A steel ring about the axis."""
    steel = Isotropic(E=210e9, nu=0.0, thickness=5e-3, density=7850.0)
    return Shell("ring", Cylinder(0.5, 0.02), steel, mesh=(16, 1))


CASES = {
    "ring": ([ring()], 40.0),
    "plate": ([plate("plate", -0.5)], 20.0),
    "millimetres": ([plate("plate", -0.5, 1000.0)], 20.0),
    "two": ([plate("one", -0.5), ring()], 20.0),
}


@pytest.mark.parametrize(("bodies", "rate"), CASES.values(), ids=CASES)
def test_no_mode_of_a_free_body_grows(bodies: list[Shell], rate: float) -> None:
    """And its translation has the rate of the frame to the last digits."""
    scene = Scene("spins", bodies, scheme="ep", dt=1e-3, t_end=1e-2)
    found = campbell(scene, [rate], count=10, axis=(0, 0, 1), about=(0, 0, 0))
    assert not found.unstable, found.verdict
    (modes,) = found.modes
    assert abs(modes.values.imag - rate).min() < 1e-9 * rate


UP = (0.0, 0.0, 1.0)
WHEEL = RigidBody("wheel", 2.0, (0.1, 0.1, 0.18))
HUB = RigidBody("hub", 0.5, (0.01, 0.01, 0.018))

# joint to ground of a wheel; how often it has the eigenvalue zero, and that of the frame
AXLES = {
    "revolute": (Revolute("axle", "ground", "hub", at=(0, 0, 0), axis=UP), 1, 0),
    "cylindrical": (Cylindrical("axle", "ground", "hub", at=(0, 0, 0), axis=UP), 2, 0),
    "planar": (Planar("axle", "ground", "hub", at=(0, 0, 0), normal=UP), 1, 2),
    "spherical": (Spherical("axle", "ground", "hub", at=(0, 0, 0)), 1, 1),
    "free": (None, 2, 3),
}


@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize(("joint", "zeros", "frames"), AXLES.values(), ids=AXLES)
def test_no_mode_of_a_wheel_on_an_axle_grows(
    joint: Any, zeros: int, frames: int, elastic: bool
) -> None:
    """It may turn, slide and move across as its axle lets it; a plate on a hub does the same."""
    bodies: dict[str, Any] = {"rigid_bodies": replace(WHEEL, name="hub")}
    joints = [] if joint is None else [joint]
    if elastic:
        bodies = {"shells": plate("disc", -0.5), "rigid_bodies": HUB}
        joints.append(Weld("weld", "hub", "disc", at=(0, 0, 0)))
    scene = Scene("wheel", joints=joints, scheme="ep", dt=1e-3, t_end=1e-2, **bodies)
    count = zeros + frames + (2 if elastic else 0)
    found = campbell(scene, [20.0], count=count, axis=UP, about=(0, 0, 0))
    assert not found.unstable, found.verdict
    (modes,) = found.modes
    # of the plate, another zero may be listed for the double one
    assert zeros <= modes.rigid <= zeros + elastic
    at = np.abs(modes.values - 20j) < 1e-6 * 20
    assert np.sum(at) >= frames


def test_free_pairs_on_a_hinge_do_not_grow() -> None:
    """Mechanisms: beside motions of the whole they have one of their own."""
    two = [WHEEL, RigidBody("other", 1.0, (0.05, 0.05, 0.08), com=(0.5, 0, 0))]
    hinge = Revolute("hinge", "wheel", "other", at=(0.2, 0, 0), axis=UP)
    scene = Scene("pair", rigid_bodies=two, joints=hinge, scheme="ep", dt=1e-3, t_end=1e-2)
    middle = (0.5 / 3, 0.0, 0.0)
    found = campbell(scene, [20.0], count=7, axis=UP, about=middle)
    assert not found.unstable, found.verdict
    assert np.sum(np.abs(found.modes[0].values - 20j) < 1e-6 * 20) == 3


@pytest.mark.parametrize(
    ("joint", "velocity"),
    [
        (Cylindrical("axle", "ground", "wheel", at=(0, 0, 0), axis=UP), (0, 0, 3.0)),
        (Planar("axle", "ground", "wheel", at=(0, 0, 0), normal=UP), (3.0, 0, 0)),
        (Prismatic("rail", "ground", "wheel", at=(0, 0, 0), axis=(1, 1, 0)), (2.0, 2.0, 0)),
    ],
)
def test_what_slides_freely_is_steady(joint: Any, velocity: Any) -> None:
    """A wheel that goes along its axle stays as it is; not so where a damper brakes it."""
    spin = (0, 0, 0) if isinstance(joint, Prismatic) else (0, 0, 20.0)
    scene = Scene(
        "slides",
        rigid_bodies=WHEEL,
        joints=joint,
        initial=InitialVelocity(linear=velocity, spin=spin),
        scheme="ep4",
        dt=1e-3,
        t_end=1e-2,
    )
    made = sm.modes(sm.run(scene), count=1, pictures=False)
    # of round-off of velocities
    assert made.drift < 1e-9
    if isinstance(joint, Planar):
        return
    braked = replace(
        scene,
        force_elements=JointDamper("brake", joint.name, damping=1.0, coordinate="translation"),
    )
    assert sm.modes(sm.run(braked), count=1, pictures=False).drift > 1e-2


def beck(s: complex, P: float) -> complex:
    """Characteristic function of Beck's column, `EI = m = L = 1`, for motions `exp(s t)`."""
    W = -1j * s
    middle = np.sqrt(P**2 / 4 + W**2)
    a, b = np.sqrt(middle + P / 2), np.sqrt(middle - P / 2)
    whole = P**2 + 2 * W**2 * (1 + np.cos(a) * np.cosh(b)) + W * P * np.sin(a) * np.sinh(b)
    return complex(whole)


@pytest.mark.parametrize("rate", [1.0, 5.43])
def test_flutter_beside_a_free_ring_is_found(rate: float) -> None:
    """A column on the axis flutters as it does at rest: from the frame by `omega -+ Omega`.

    At the second rate one of them is the frame's own, as of the ring's translations.
    """
    P = 22.0

    def parts(z: Any) -> list[float]:
        value = beck(complex(*z), P)
        return [value.real, value.imag]

    growth, omega = root(parts, [3.0, 10.9], tol=1e-12).x
    stiff = 12 / 3e-3**2
    section = GeneralSection(
        [stiff, stiff / 2.4, stiff / 2.4, 1, 1, 1],
        mass_per_length=1.0,
        second_moments=(7.5e-7, 0, 7.5e-7),
    )
    soft = Isotropic(E=2e6, nu=0.0, thickness=5e-3, density=10.0)
    scene = Scene(
        "flutters",
        Shell("ring", Cylinder(0.5, 0.02), soft, mesh=(8, 1)),
        beams=Beam("column", Line((0, 0, 0), UP), section, elements=8, up=(1, 0, 0)),
        supports=Clamped("start", body="column"),
        loads=FollowerForce("end", (-P, 0, 0), body="column"),
        scheme="ep",
        dt=1e-2,
        t_end=1.0,
    )
    found = campbell(scene, [rate], count=12, axis=UP, about=(0, 0, 0), loaded=True)
    assert "flutter" in found.verdict
    (modes,) = found.modes
    grow = [v for k, v in enumerate(modes.values) if k + 1 in modes.unstable]
    assert len(grow) == 2
    for value, exact in zip(grow, (omega - rate, omega + rate), strict=True):
        # eight elements: 2e-3 of the growth
        assert value == pytest.approx(complex(growth, exact), abs=0.02)
    assert np.sum(np.abs(modes.values - 1j * rate) < 1e-6 * rate) >= 3


@pytest.mark.parametrize(("damped", "free", "bodies"), [(2, 2, 2), (3, 0, 2), (3, 2, 1), (1, 3, 0)])
def test_each_motion_that_nothing_holds_is_one_zero(damped: int, free: int, bodies: int) -> None:
    """Kind: slides with dampers have a zero once, free ones twice, and both mix in the shapes."""
    slides = damped + free
    scene = Scene(
        "slides",
        rigid_bodies=[
            RigidBody(f"b{k}", 1.0 + k, (0.1, 0.2, 0.3), position=(0, 2.0 * k, 0))
            for k in range(slides + bodies)
        ],
        joints=[
            Prismatic(f"j{k}", "ground", f"b{k}", at=(0, 2.0 * k, 0), axis=(1, 0, 0))
            for k in range(slides)
        ],
        force_elements=[JointDamper(f"d{k}", f"j{k}", 0.4 + k) for k in range(damped)],
        scheme="ep",
        dt=0.1,
        t_end=0.1,
    )
    count = slides + 6 * bodies
    run = sm.run(scene, pictures=False)
    found = sm.modes(run, count=count + damped, pictures=False)
    assert found.summary["rigid_modes"] == count
    decay = sorted(-(0.4 + k) / (1.0 + k) for k in range(damped))[::-1]
    np.testing.assert_allclose(found.table["growth_per_s"][count:], decay, rtol=1e-9)
