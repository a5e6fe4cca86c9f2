"""Chains of every kind of joint obey the energy law and keep closed, whatever scheme moves them."""

from typing import Any

import numpy as np
import pytest

from shellmb.scene import (
    GROUND,
    Beam,
    CircularSection,
    Cylindrical,
    Distance,
    Gravity,
    InitialVelocity,
    InPlane,
    Isotropic,
    Joint,
    Line,
    Planar,
    Prismatic,
    Rectangle,
    Revolute,
    Scene,
    Screw,
    Shell,
    ShellRevolute,
    Spherical,
    Universal,
    Weld,
)

STEPS, DT = 12, 0.02
SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 0.5), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
# an axis that is not that of anything else, and one across it
AXIS, ACROSS = (0.2, 1.0, 0.3), (1.0, -0.2, 0.0)
KINDS: dict[str, tuple[type[Joint], dict[str, Any]]] = {
    "spherical": (Spherical, {}),
    "revolute": (Revolute, {"axis": AXIS}),
    "universal": (Universal, {"axis": AXIS, "second_axis": ACROSS}),
    "cylindrical": (Cylindrical, {"axis": ACROSS}),
    "prismatic": (Prismatic, {"axis": AXIS}),
    "planar": (Planar, {"normal": (0.0, 0.3, 1.0)}),
    "screw": (Screw, {"axis": AXIS, "pitch": 0.4}),
    "weld": (Weld, {}),
    "distance": (Distance, {}),
    "in-plane": (InPlane, {"normal": AXIS}),
}
MOTION = {"loads": Gravity((0, 0, -9.81)), "dt": DT, "t_end": STEPS * DT}


def _joint(kind: str, name: str, first: str, second: str, at: Any, second_at: Any) -> Joint:
    """A joint of a kind; only a distance joint has its second end elsewhere."""
    made, more = KINDS[kind]
    if kind == "distance":
        more = {"second_at": second_at}
    return made(name, first, second, at=at, **more)


def _moved(watched: Any, body: str) -> float:
    """Largest distance that the centre of a rigid body has moved, m."""
    rigid = watched.simulation.model.rigid
    q = watched.simulation.problem.levels[rigid.name].q.x.array
    return float(np.linalg.norm(q[rigid.local(body, "u")]))


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
@pytest.mark.parametrize("kind", KINDS)
def test_chain_of_rigid_bodies(kind: str, scheme: str, alpha: float, rod, watch) -> None:
    # a weld to the ground would leave nothing that moves
    first = "spherical" if kind == "weld" else kind
    scene = Scene(
        "chain",
        rigid_bodies=[rod("a", (0, 0, 0), (0.5, 0, 0)), rod("b", (0.5, 0, 0), (0.9, 0.3, 0.1))],
        joints=[
            _joint(first, "ground-a", GROUND, "a", (0, 0, 0), (0.0, 0.2, 0.1)),
            _joint(kind, "a-b", "a", "b", "b", (0.6, 0.2, 0.0)),
        ],
        initial=InitialVelocity(spin=(1.0, 2.0, -3.0)),
        scheme=scheme,
        alpha=alpha,
        **MOTION,
    )
    watched = watch(scene)
    watched.check()
    # all that would hold in a chain at rest proves nothing
    assert _moved(watched, "b") > 0.01
    assert kind == "weld" or watched.work.exchanged > 1e-4 * watched.energy.largest
    assert (watched.energy.values["dissipation"] > 0) == (alpha > 0 and scheme in ("ed", "ed3"))


def _everything(scheme: str, alpha: float, rod: Any) -> Scene:
    """A beam on a hinge with a plate at its end, and rods that hang from both by all joints."""
    section = CircularSection(E=2e6, nu=0.3, radius=0.05, density=500.0)
    beam = Beam("beam", Line((0, 0, 0), (1.2, 0, 0)), section, elements=2)
    rubber = Isotropic(E=2e6, nu=0.3, thickness=0.05, density=500.0)
    plate = Shell("plate", Rectangle(0.6, 0.4, origin=(1.2, 0, 0)), rubber, mesh=(1, 1))
    rods, joints = [], [Revolute("hinge", GROUND, "beam", at=(0, 0, 0), axis=AXIS)]
    for k, kind in enumerate(KINDS):
        x = 0.3 * (1 + k % 4)
        rods.append(rod(kind, (x, 0, 0), (x + 0.1, 0.02 * k, -0.3), mass=0.3))
        end = rods[-1].place("b") if kind == "distance" else "a"
        joints.append(_joint(kind, f"beam {kind}", "beam", kind, (x, 0, 0), end))
    joints.append(ShellRevolute("beam-plate", "beam", "plate", at=(1.2, 0, 0)))
    for kind in ("spherical", "distance", "in-plane", "weld"):
        x = {"spherical": 1.8, "distance": 1.5, "in-plane": 1.2, "weld": 1.8}[kind]
        y = {"spherical": 0.0, "distance": 0.4, "in-plane": 0.4, "weld": 0.4}[kind]
        name = f"plate {kind}"
        rods.append(rod(name, (x, y, 0), (x, y + 0.1, -0.3), mass=0.3))
        end = (x, y, 0.0)
        start = rods[-1].place("b") if kind == "distance" else end
        joints.append(_joint(kind, name, name, "plate", tuple(start), end))
    return Scene(
        "everything",
        plate,
        beams=beam,
        rigid_bodies=rods,
        joints=joints,
        initial=InitialVelocity(spin=(1.0, 2.0, -3.0)),
        scheme=scheme,
        alpha=alpha,
        **(MOTION | {"t_end": 6 * DT}),
    )


# a quarter of a minute each; the values of alpha share their kernels
SOME = [
    SCHEMES[0],
    SCHEMES[5],
    *(pytest.param(*SCHEMES[k], marks=pytest.mark.slow) for k in (1, 2, 3, 4)),
]


@pytest.mark.parametrize(("scheme", "alpha"), SOME)
def test_all_joints_at_beams_and_shells(scheme: str, alpha: float, rod, watch) -> None:
    watched = watch(_everything(scheme, alpha, rod))
    watched.check()
    assert len(watched.constraints.joints) == 16
    assert watched.work.exchanged > 1e-2 * watched.energy.largest
    # the beam and the plate bend
    assert watched.energy.values["strain_energy"] > 1e-3 * watched.energy.largest
