"""Slips of units are doubted by name and number, and consistent systems or none are not."""

import re
from typing import Any

from mpi4py import MPI

import pytest

import shellmb as sm
from shellmb.model.model import Model
from shellmb.scene.checks.ignored_settings import doubts

FORCE = sm.EdgeForce("right", (0, 0, -10.0))
STILL = {"scheme": "static", "dt": 1.0, "t_end": 1.0, "loads": FORCE}


def plate(
    E: float, density: float, thickness: float = 2e-3, length: float = 1.0, **more: Any
) -> sm.Scene:
    """A cantilever plate."""
    section = sm.Isotropic(E, 0.3, thickness, density)
    shell = sm.Shell("plate", sm.Rectangle(length, length / 5), section, mesh=(1, 1))
    moving = {"scheme": "ep", "dt": 1e-3, "t_end": 1e-2}
    return sm.Scene("s", shell, supports=sm.Clamped("left"), **(moving | more))


# one steel in consistent systems, softer and lighter things, and scenes without units
RIGHT: dict[str, Any] = {
    "m, kg, s": (210e9, 7850.0),
    "m, t, s": (210e6, 7.85),
    "mm, t, s": (210e3, 7.85e-9, 2.0, 1e3),
    "mm, kg, ms": (210.0, 7.85e-6, 2.0, 1e3),
    "cm, g, s": (2.1e12, 7.85, 0.2, 100.0),
    "no units": (1.0, 1.0, 0.1),
    "rubber": (1e6, 1100.0),
    "a gel": (1e3, 1000.0, 1e-2, 0.1),
    "nearly no mass": (200e9, 1e-9),
}
WRONG: dict[str, tuple[tuple[float, ...], dict[str, Any], str]] = {
    "GPa, kg/m^3": ((210.0, 7850.0), {}, "E = 210 and density = 7850 are those of a metal"),
    "GPa, g/cm^3": ((210.0, 7.85), {}, "E = 210 and density = 7.85 are those of a metal"),
    "Pa, g/cm^3": ((210e9, 7.85), {}, "density = 7.85 are those of a metal"),
    "MPa, kg/m^3": ((70e3, 2700.0), {}, "E = 7e.04 and density = 2700 are those of a metal"),
    "concrete": ((30.0, 2400.0), {}, "by E = 30 and density = 2400 waves run at 0.112"),
    "a polymer": ((3e9, 1.2), {}, "as with Pa with g/cm"),
    "fast": ((210e9, 7.85e-9, 2.0, 1e3), {"units": "mm, t, s"}, "waves run at 5.17e.06 m/s"),
    "slow": ((210.0, 7850.0), {"units": "m, kg, s"}, "waves run at 0.164 m/s"),
    "a force": ((210.0, 0.0), STILL, "edge force causes stresses of about 5e.03, 23.8 times E"),
    "weight": ((210.0, 7850.0), {"loads": sm.Gravity()}, "those of a metal"),
}


@pytest.mark.parametrize("case", RIGHT)
@pytest.mark.parametrize("loads", [(), sm.Gravity((0, 0, -1e-6))])
def test_consistent_units_are_not_doubted(case: str, loads: Any) -> None:
    scene = plate(*RIGHT[case], loads=loads)
    Model(scene, MPI.COMM_WORLD)
    if ", " in case:
        Model(plate(*RIGHT[case], units=case), MPI.COMM_WORLD)


@pytest.mark.parametrize("case", WRONG)
def test_slips_of_units_are_doubted(case: str) -> None:
    numbers, more, message = WRONG[case]
    with pytest.warns(sm.ShellmbWarning, match=f"shell 'plate': .*{message}.*check the units"):
        Model(plate(*numbers, **more), MPI.COMM_WORLD)


BODY = {"name": "body", "mass": 1.0, "inertia": (1, 1, 1)}
PIN = sm.Revolute("pin", "ground", "body", at=(0, 0, 0), axis=(0, 0, 1))


def degrees(rotation: Any = (0, 0, 0), scheme: str = "ep", **more: Any) -> tuple[str, ...]:
    """Doubts about a body on a pin."""
    body = sm.RigidBody(**BODY, rotation=rotation)
    return doubts(
        sm.Scene("s", rigid_bodies=body, joints=PIN, scheme=scheme, dt=0.1, t_end=1.0, **more)
    )


@pytest.mark.filterwarnings("ignore:.* degrees are meant")
@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"rotation": (0, 0, 90.0)}, "'body': rotation is 90 rad, 14.3 turns; .*must be 1.571"),
        ({"force_elements": sm.JointSpring("soft", "pin", 1.0, rest=45)}, "'soft' is 45 rad"),
        (
            {"force_elements": sm.JointStop("stop", "pin", upper=120, stiffness=1.0)},
            "'stop' is 120 rad",
        ),
        (
            {"drivers": sm.Driver("turn", "pin", rotation=lambda t: 90 * min(2 * t, 1.0))},
            "driver 'turn': rotation is 90 rad",
        ),
        (
            {"drivers": sm.Driver("turn", "pin", rotation=lambda t: 30 * t), "scheme": "static"},
            "driver 'turn': rotation is 30 rad",
        ),
        ({"rotation": (0, 0, 1.571)}, ""),
        ({"force_elements": sm.JointSpring("soft", "pin", 1.0, rest=18.85)}, ""),
        # it spins by 90 rad/s
        ({"drivers": sm.Driver("turn", "pin", rotation=lambda t: 90 * t)}, ""),
    ],
)
def test_angles_of_whole_degrees_are_doubted(given: Any, said: str) -> None:
    found = degrees(**given)
    assert len(found) == bool(said)
    if said:
        assert re.search(said, found[0])
