"""Heavy bodies on soft mounts swing far slower than their bodies bend: that is not zero.

The kind: eigenvalues that are small beside the bending frequencies of the scene, of springs, of
dampers, or of both, are told from rigid motions by what resists, with their damping and stability.
"""

import numpy as np
import pytest

import shellmb as sm

LENGTH, MASS, TILT = 0.1, 5.0, 0.01
# of the shaft: a radius of 10 mm
SECTION = {"E": 2e11, "nu": 0.3, "radius": 0.01, "density": 7800.0}
RELAXING = sm.Prony([(0.1, 1.0)])
# the shaft bends by this part of the stiffest mounts, whose modes bend it
CLOSE = 2e-4
# [1/s], of rotations about the axis and of what nothing moves back
STILL = 1e-2


def mounted(stiffness: float, damping: float, **section: object) -> sm.Scene:
    """A shaft with a disc at its middle, each end on springs and dampers across, one along."""
    shaft = sm.Beam(
        "shaft",
        sm.Line((0, 0, 0), (LENGTH, 0, 0)),
        sm.CircularSection(**SECTION, **section),
        elements=4,
    )
    middle = (LENGTH / 2, 0, 0)
    elements = []
    for end, x in (("start", 0.0), ("end", LENGTH)):
        for place in ((x, 1.0, 0.0), (x, 0.0, 1.0), *([(-1.0, 0.0, 0.0)] if x == 0 else [])):
            name, where = f"{end} {len(elements)}", ("shaft", "ground", end, place)
            if stiffness > 0:
                elements.append(sm.Spring(f"spring {name}", *where, stiffness=stiffness))
            if damping > 0:
                elements.append(sm.Damper(f"damper {name}", *where, damping=damping))
    return sm.Scene(
        "mounted",
        beams=shaft,
        rigid_bodies=sm.RigidBody("disc", MASS, (2 * TILT, TILT, TILT), com=middle),
        joints=sm.Weld("hub", "disc", "shaft", at=middle),
        force_elements=elements,
        scheme="ep",
        dt=1e-3,
        t_end=2e-3,
    )


def exact(stiffness: float, damping: float) -> np.ndarray:
    """Eigenvalues of the shaft as a rigid body: along, across twice, tilted twice."""
    rod = SECTION["density"] * np.pi * SECTION["radius"] ** 2 * LENGTH
    tilt = TILT + rod * (LENGTH**2 / 12 + SECTION["radius"] ** 2 / 4)
    # of one spring and damper each
    whole = MASS + rod
    inertia = np.array([whole, whole / 2, whole / 2, *2 * [2 * tilt / LENGTH**2]])
    decay = damping / inertia / 2
    return np.asarray(-decay + np.sqrt(stiffness / inertia - decay**2 + 0j) * 1j)


def values_of(found: object) -> np.ndarray:
    table = found.table
    return np.array(table["growth_per_s"] + 1j * table["omega_rad_per_s"])


@pytest.mark.parametrize(("stiffness", "damping"), [(1e4, 30.0), (100.0, 3.0), (10.0, 0.3)])
def test_soft_mounts_swing_with_their_damping(stiffness: float, damping: float) -> None:
    """All but the rotation about the axis."""
    run = sm.run(mounted(stiffness, damping), pictures=False)
    found = sm.modes(run, count=6, pictures=False)
    assert found.rigid == 1
    np.testing.assert_allclose(values_of(found)[1:], exact(stiffness, damping), rtol=CLOSE)


@pytest.mark.parametrize("stiffness", [1e4, 1.0])
def test_soft_mounts_are_no_rigid_motions_at_rest(stiffness: float) -> None:
    """The softest ones swing at 0.1 Hz, and the first bending mode at 5 kHz."""
    found = sm.modes(mounted(stiffness, 0.0), count=7, pictures=False)
    assert found.rigid == 1
    swings = exact(stiffness, 0.0).imag / (2 * np.pi)
    np.testing.assert_allclose(found.frequencies[1:6], swings, rtol=CLOSE)


def test_what_only_dampers_hold_stays_where_it_is_or_dies_away() -> None:
    run = sm.run(mounted(0.0, 3.0), pictures=False)
    # of zeros two may be found as a pair
    values = values_of(sm.modes(run, count=11, pictures=False))
    still = np.abs(values) < STILL
    np.testing.assert_allclose(values[~still][:5], exact(0.0, 3.0).real, rtol=CLOSE)
    assert np.sum(still) >= 4


def test_mounts_of_what_relaxes_are_told_from_its_rigid_motions() -> None:
    """Its poles are known to round-off of its stiffness, which is large beside that of mounts."""
    scene = mounted(100.0, 3.0, relaxation=RELAXING)
    values = values_of(sm.modes(scene, rates=[0.0], count=6, pictures=False))
    values = values[np.abs(values) > STILL][:5]
    np.testing.assert_allclose(values, exact(100.0, 3.0), rtol=CLOSE)


@pytest.mark.parametrize("t_end", [1.0, None])
@pytest.mark.parametrize("w", [1e-7, 1.0, 1e9])
def test_rigid_bodies_swing_at_any_rate(w: float, t_end: float | None) -> None:
    """As the earth goes around the sun, or in gigahertz, also where the scene's time says nothing.

    Rates of less than 3e-5 rad/s were zero and above 3e8 there were no modes, as these were looked
    for near one. Closed forms are met to round-off (1e-15 seen).
    """
    end = t_end or 1 / w
    names = ("slow", "fast")
    scene = sm.Scene(
        "oscillators",
        rigid_bodies=[sm.RigidBody(name, 2.0, (1.0,) * 3) for name in names],
        joints=[
            sm.Prismatic(f"{name} rail", sm.GROUND, name, at=(0, 0, 0), axis=(1, 0, 0))
            for name in names
        ],
        force_elements=[
            sm.JointSpring("s", "slow rail", stiffness=2 * w**2),
            sm.JointSpring("f", "fast rail", stiffness=8 * w**2),
            sm.JointDamper("d", "slow rail", damping=0.04 * w),
        ],
        scheme="ep4",
        dt=0.01 * end,
        t_end=end,
    )
    exact = np.array([-0.01 + 1j * np.sqrt(1 - 1e-4), 2j])
    np.testing.assert_allclose(values_of(sm.modes(scene, rates=[0.0], count=2)) / w, exact)
    np.testing.assert_allclose(sm.linearise(scene).poles(2) / w, exact)
    still = np.array(sm.modes(scene, count=2).frequencies)
    np.testing.assert_allclose(2 * np.pi * still / w, [1, 2])


# of frequencies: the round-off of such stiffness is 7e-3 of their squares at most
LOST = 4e-3


def test_a_plate_that_hardly_bends_swings_by_its_weight() -> None:
    """As a rigid one, `omega^2 = 3/2 g/L/(1 + t^2/(4 L^2))`; it bends 3e4 times as fast."""
    metal = sm.Isotropic(E=1e16, nu=0.3, thickness=0.02, density=7800.0)
    scene = sm.Scene(
        "hung",
        sm.Shell("plate", sm.Rectangle(1.0, 0.3), metal, mesh=(4, 2)),
        supports=sm.Hinged("left"),
        loads=sm.Gravity((9.81, 0.0, 0.0)),
        start="equilibrium",
        scheme="ep",
        dt=1e-3,
        t_end=2e-3,
    )
    exact = np.sqrt(1.5 * 9.81 / (1 + 0.02**2 / 4))
    at_rest = sm.modes(scene, count=1, loaded=True, pictures=False)
    state = sm.modes(sm.run(scene, pictures=False), count=1, pictures=False)
    for found in (at_rest, state):
        assert found.rigid == 0
        np.testing.assert_allclose(values_of(found).imag, exact, rtol=1e-5)
    for constraints in ("eliminated", "kept"):
        system = sm.linearise(scene, at="equilibrium", constraints=constraints)
        np.testing.assert_allclose(system.poles(1), 1j * exact, rtol=LOST)


def test_a_blade_that_hardly_bends_flaps_at_its_rate() -> None:
    """`omega^2 = Omega^2 (1 + 3/2 e/L/(1 + t^2/(4 L^2)))` at a hinge `e` beside the axis."""
    rate, aside = 30.0, 0.1
    stiff = sm.RectangularSection(E=1e17, nu=0.3, width=0.1, height=0.02, density=2700.0)
    scene = sm.Scene(
        "blade",
        beams=sm.Beam("blade", sm.Line((aside, 0, 0), (1 + aside, 0, 0)), stiff, elements=4),
        rigid_bodies=sm.RigidBody("hub", 5.0, (0.1,) * 3),
        joints=[
            sm.Revolute("axle", sm.GROUND, "hub", at=(0, 0, 0), axis=(0, 0, 1)),
            sm.Revolute("flap", "hub", "blade", at=(aside, 0, 0), axis=(0, 1, 0)),
        ],
        scheme="ep4",
        dt=1e-3,
        t_end=1e-2,
    )
    found = sm.modes(scene, rates=[rate], count=2, axis=(0, 0, 1), pictures=False)
    exact = rate * np.sqrt(1 + 1.5 * aside / (1 + 0.02**2 / 4))
    # the rotation about the axle is the other one; quotients of four elements: 1.5e-4
    assert found.at(rate).rigid == 1
    np.testing.assert_allclose(found.table["omega_rad_per_s"], [0.0, exact], rtol=3e-4)
