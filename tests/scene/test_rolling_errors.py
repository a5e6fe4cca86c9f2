"""Impossible wheels, spheres and blades give their own sentence; a start that slips does, too."""

from typing import Any

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    GROUND,
    Beam,
    CircularSection,
    Gravity,
    InitialVelocity,
    Isotropic,
    Joint,
    KnifeEdge,
    Line,
    Rectangle,
    RigidBody,
    Rolling,
    Scene,
    Shell,
    Spring,
)
from shellmb.simulate.simulation import Simulation

Z = (0.0, 0.0, 1.0)
R = 0.3
WHEEL = RigidBody("wheel", 2.0, (0.045, 0.09, 0.045), position=(0, 0, R))
ON: dict[str, Any] = {"at": (0, 0, 0), "normal": Z, "radius": R}


def scene(*joints: Joint, **more: Any) -> Scene:
    given: dict[str, Any] = {"rigid_bodies": WHEEL, "scheme": "ep", "dt": 0.01, "t_end": 0.02}
    return Scene("wheel", joints=joints, **(given | more))


def rolling(**more: Any) -> Rolling:
    return Rolling("roll", GROUND, "wheel", **({**ON, "axis": (0, 1, 0)} | more))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: rolling(radius=0.0), r"radius is 0\.0; it must be greater than 0"),
        (lambda: rolling(radius=-1.0), r"radius is -1\.0; it must be greater than 0"),
        (lambda: rolling(axis=(0, 0, 2)), r"axis \(0\.0, 0\.0, 2\.0\) is normal to the plane"),
        (lambda: rolling(axis=(0, 0, 0)), "it must not be zero"),
        (lambda: rolling(normal=(0, 0, 0)), "it must not be zero"),
        (lambda: rolling(active=(0, 1)), "it must be None: contacts act always"),
        (
            lambda: Rolling("roll", "wheel", **ON),
            "rolling joint 'roll': second is 'ground'; it must be the body that moves on the plane",
        ),
        (
            lambda: KnifeEdge("cut", GROUND, "wheel", at=(0, 0, 0), normal=Z, direction=(0, 0, 1)),
            "knife-edge joint 'cut': direction .* is normal to the plane",
        ),
    ],
)
def test_what_no_contact_is(make, says) -> None:
    with pytest.raises(SceneError, match=says):
        make()


def test_contacts_need_a_time_and_places() -> None:
    with pytest.raises(SceneError, match="scheme is 'static'; it must be a dynamic one"):
        scene(rolling(), scheme="static", dt=None, t_end=None)
    with pytest.raises(SceneError, match="rolling joint 'roll': at is missing"):
        scene(rolling(at=None))
    bar = CircularSection(1e9, 0.3, radius=0.01, density=1e3)
    beam = Beam("axle", Line((0, 0, R), (0, 1, R)), bar)
    with pytest.raises(SceneError, match="second_at is missing; it must be the centre of the whee"):
        scene(Rolling("roll", GROUND, "axle", axis=(0, 1, 0), **ON), beams=beam)
    plate = Shell("plate", Rectangle(1, 1), Isotropic(1.0, 0.3, thickness=0.01, density=1.0))
    with pytest.raises(SceneError, match="second is shell 'plate', whose nodes have no frame; it"):
        scene(Rolling("roll", GROUND, "plate", second_at=(0, 0, 0), **ON), shells=plate)


@pytest.mark.parametrize("height", [0.07, -0.07, -2 * R - 0.07])
def test_a_wheel_off_its_plane(height: float) -> None:
    """Above it and in it; on the other side it rolls there."""
    lifted = RigidBody("wheel", 2.0, (0.045, 0.09, 0.045), position=(0, 0, R + height))
    with pytest.raises(SceneError, match=r"joint 'roll': it is open by 0\.07 in the given posit"):
        Simulation(scene(rolling(), rigid_bodies=lifted))


def test_a_start_that_slips() -> None:
    """A wheel that moves and does not turn; the nearest velocities roll."""
    slides = InitialVelocity((1.5, 0, 0))
    with pytest.raises(SceneError, match=r"rolling joint 'roll': it slips with 1\.5 m/s at"):
        Simulation(scene(rolling(), initial=slides))
    # momentum about the point of contact: m v R = (m R^2 + I) v'/R
    mended = Simulation(scene(rolling(), initial=slides, assemble=True))
    rigid = mended.model.rigid
    assert rigid is not None
    v = mended.problem.levels[rigid.name].rates["v"].x.array[rigid.local("wheel", "u")]
    expected = 1.5 * 2.0 * R**2 / (2.0 * R**2 + 0.09)
    assert v == pytest.approx([expected, 0, 0], abs=1e-12)


def test_wheels_on_one_axle_are_redundant_by_name() -> None:
    """Rigid with each other, neither moves sideways because the other does not."""
    second = Rolling(
        "other", GROUND, "wheel", **{**ON, "second_at": (0, 0.5, R), "axis": (0, 1, 0)}
    )
    # of 7 + 2 constraints: upright, sideways; along each for itself, so that they run straight
    with pytest.raises(SceneError, match=r"constraints are redundant: .* of joint 'other'"):
        Simulation(scene(rolling(), second))
    Simulation(scene(rolling(), second, redundant="drop"))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_side_of_the_body_makes_the_normal(side: float) -> None:
    """A wheel below the plane, the normal's sign either way: weight is carried by a pull."""
    hanging = RigidBody("wheel", 2.0, (0.045, 0.09, 0.045), position=(0, 0, -R))
    simulation = Simulation(
        scene(rolling(normal=(0, 0, side)), rigid_bodies=hanging, loads=Gravity((0, 0, -9.81)))
    )
    simulation.advance()
    (group,) = simulation.model.mechanism.groups
    q = simulation.problem.levels[group.name].q.x.array
    assert group.sliding(q, 0 * q)[0, 4] == pytest.approx(-2.0 * 9.81)  # type: ignore[attr-defined]
    assert np.all(np.isfinite(q))


def test_equilibrium_and_modes_of_a_wheel_on_a_spring() -> None:
    """It rolls into equilibrium, and swings as a mass `m + I/R^2`."""
    wall = Spring("spring", GROUND, "wheel", (-1, 0, R), (0, 0, R), stiffness=100.0)
    pulled = scene(
        rolling(), force_elements=wall, loads=Gravity((3.0, 0, -9.81)), start="equilibrium"
    )
    simulation = Simulation(pulled)
    simulation.advance()
    rigid = simulation.model.rigid
    assert rigid is not None
    u = simulation.problem.levels[rigid.name].q.x.array[rigid.local("wheel", "u")]
    # it stays there: 6 N on 100 N/m
    assert u == pytest.approx([0.06, 0.0, 0.0], abs=1e-9)
    found = natural_modes(scene(rolling(), force_elements=wall), count=3)
    # without weight nothing keeps it from steering or falling
    assert found.omega2[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert found.omega2[2] == pytest.approx(100.0 / (2.0 + 0.09 / R**2), rel=1e-9)
