"""Paths along what is prescribed, and along potentials that are loads."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from shellmb.errors import ConvergenceError, SceneError
from shellmb.running.execute import RunResult, execute
from shellmb.scene import (
    GROUND,
    Beam,
    Clamped,
    Driven,
    Driver,
    Fixed,
    Isotropic,
    JointSpring,
    Line,
    PathFollowing,
    PointForce,
    Potential,
    Prismatic,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Spring,
)
from tests.scenes import plate
from tests.simulate.test_arclength import STIFFNESS, truss, truss_load

RISE, SOFT = 0.5, 0.1


def pushed_softly(**path: Any) -> Scene:
    """The truss, pushed by a driven body through a spring softer than the truss snaps."""
    base, top, up = truss(RISE), (0.0, 0.0, RISE), (0.0, 0.0, RISE + 5.0)
    grip = RigidBody("grip", mass=1.0, inertia=(1.0, 1.0, 1.0), position=up)
    spring = Spring("soft", "grip", "post", at=up, second_at=top, stiffness=SOFT)
    return replace(
        base,
        rigid_bodies=(*base.rigid_bodies, grip),
        joints=(*base.joints, Prismatic("rail", GROUND, "grip", at=up, axis=(0, 0, 1))),
        force_elements=(*base.force_elements, spring),
        loads=(),
        drivers=Driver("push", "rail", translation=lambda factor: -factor),
        path=PathFollowing(**path),
    )


def columns(run: RunResult) -> dict[str, Any]:
    return {name: values.to_numpy() for name, values in run.history.items()}


def test_what_a_soft_spring_pushes_snaps_back() -> None:
    run = execute(pushed_softly(load_end=1.2))
    found = columns(run)
    # the driver has moved as far as the head, and by what the spring is shorter
    forces = [STIFFNESS * truss_load(RISE + w, RISE) for w in found["w"]]
    moved = -found["w"] + np.array(forces) / SOFT
    # Newton's method leaves 2e-15
    assert found["load_factor"] == pytest.approx(moved, abs=1e-12)
    # it comes back beyond its limit point, and below where it began
    kinds = [p["kind"] for p in run.summary["path"]]
    assert kinds == ["limit point"] * 2
    first, second = (p["load_factor"] for p in run.summary["path"])
    assert first > 1.09 and second < -0.09
    assert found["unstable"].max() == 1 and found["unstable"][-1] == 0


def turned(factor: float) -> float:
    """The angle of an edge, which does not grow in proportion to the factor."""
    return 1.2 * factor + 0.6 * factor**2


def bent(path: PathFollowing | None) -> Scene:
    """A strip whose edge is turned as pure bending turns it, at its length."""

    def translation(factor: float) -> tuple[float, float, float]:
        angle = turned(factor)
        return float(np.sinc(angle / np.pi)) - 1, 0.0, 2 * math.sin(angle / 2) ** 2 / (angle or 1.0)

    edge = Driven(
        "right", about=(1, 0, 0), axis=(0, -1, 0), rotation=turned, translation=translation
    )
    return Scene(
        "strip",
        plate(Isotropic(1.0, 0.3, thickness=0.01), mesh=(4, 1)),
        supports=[Clamped("left"), edge],
        probes=[Probe(name, (0.5, 0.5, 0.0), component=k) for k, name in enumerate("xyz")],
        scheme="static",
        dt=0.1,
        t_end=1.0 if path is None else 30.0,
        path=path,
    )


@pytest.mark.parametrize("branches", ["ignore", "detect"])
def test_a_path_along_a_rotation_ends_where_steps_do(branches: Any) -> None:
    steps = columns(execute(bent(None)))
    path = columns(execute(bent(PathFollowing(load_end=1.0, branches=branches))))
    assert path["load_factor"][-1] == pytest.approx(1.0, abs=1e-9)
    for name in "xyz":
        # the last factor is known to 1e-9, of displacements of 0.2
        assert path[name][-1] == pytest.approx(steps[name][-1], abs=1e-9)
    # the derivative by the factor is exact: Newton's method converges as it does with loads
    assert path["iterations"][1:-1].max() <= 4


def test_a_potential_that_is_a_load_is_multiplied_by_the_factor() -> None:
    loaded = truss(RISE, load_end=1.0)
    weight = Potential(
        "weight", lambda at, p: p["F"] * at.u[2], body="post", parameters={"F": 2.0}, load=True
    )
    pulled = replace(loaded, loads=(), potentials=weight)
    by_force, by_potential = columns(execute(loaded)), columns(execute(pulled))
    # the path of a force is that of its potential, to round-off
    for name in ("load_factor", "w", "t"):
        assert by_potential[name] == pytest.approx(by_force[name], abs=1e-11)
    expected = 2.0 * by_force["load_factor"] * by_force["w"]
    assert by_potential["weight.energy"] == pytest.approx(expected, abs=1e-11)
    assert by_potential["weight.Fz"][1:] == pytest.approx(
        -2.0 * by_force["load_factor"][1:], abs=1e-11
    )
    steps = [
        columns(execute(replace(scene, path=None, dt=0.25, t_end=1.0)))
        for scene in (loaded, pulled)
    ]
    assert steps[0]["w"] == pytest.approx(steps[1]["w"], abs=1e-11)


def test_prescribed_motions_begin_at_rest() -> None:
    base = bent(PathFollowing())
    with pytest.raises(SceneError, match=r"fixed components at 'right' prescribes a number"):
        replace(base, supports=Fixed("right", displacement=(None, None, 0.1)))
    with pytest.raises(SceneError, match=r"driven edge at 'right': rotation is 0.3 at the load"):
        replace(base, supports=Driven("right", rotation=lambda factor: 0.3 + factor))
    with pytest.raises(SceneError, match=r"has no load to follow.*load=True"):
        replace(base, supports=Clamped("left"))


GIVEN = {
    "steep": lambda f: 0.01 * math.sqrt(f + 0.01) - 0.001,
    "flat": lambda f: 0.01 * f**2,
    "flat and far": lambda f: 0.3 * f**3,
    "down": lambda f: -0.02 * (math.exp(f) - 1 - f),
}


@pytest.mark.parametrize("form", GIVEN)
@pytest.mark.parametrize("kind", ["shell", "beam", "two", "loaded"])
def test_each_row_has_what_is_prescribed(kind: str, form: str) -> None:
    """Kind: values that are no line of the load factor, the only ones, two, or beside a load."""
    given, other = GIVEN[form], lambda f: 1e-5 * f
    steel = {"E": 210e9, "nu": 0.3, "density": 7800.0}
    end = "end" if kind == "beam" else "right"
    held = Fixed(end, displacement=(other if kind == "two" else None, None, given))
    line = Line((0, 0, 0), (1, 0, 0))
    bodies: dict[str, Any] = {
        "beams": Beam("beam", line, RectangularSection(**steel, width=0.1, height=0.02), elements=2)
    }
    if kind != "beam":
        shape = Rectangle(1.0, 0.1)
        bodies = {"shells": Shell("s", shape, Isotropic(**steel, thickness=2e-3), mesh=(4, 1))}
    scene = Scene(
        "strip",
        supports=[Clamped("start" if kind == "beam" else "left"), held],
        loads=PointForce("right-top", (0.0, 0.1, 0.0)) if kind == "loaded" else (),
        probes=[
            Probe(name, "end" if kind == "beam" else "right-bottom", component=k)
            for k, name in enumerate("xyz")
        ],
        scheme="static",
        # with a load the arc length is that of what it moves at first
        dt=0.1,
        t_end=1e6,
        path=PathFollowing(load_end=1.0),
        **bodies,
    )
    found = columns(execute(scene))
    exact = np.array([given(f) for f in found["load_factor"]])
    assert np.abs(found["z"] - exact).max() < 1e-12 * np.abs(exact).max()
    if kind == "two":
        assert found["x"] == pytest.approx(1e-5 * found["load_factor"], abs=1e-17)
    assert found["load_factor"][-1] == pytest.approx(1.0, abs=1e-9)
    # where so much is prescribed long steps of the load find other equilibria
    steps = columns(execute(replace(scene, path=None, t_end=1.0, dt=0.25)))
    for name in "" if form == "flat and far" else "xyz":
        assert found[name][-1] == pytest.approx(steps[name][-1], rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("power", [1, 2])
def test_a_driven_mechanism_has_its_angle(power: int) -> None:
    """A crank of rigid bodies on a path: its angle in each row, the torque of its spring."""
    scene = Scene(
        "crank",
        rigid_bodies=RigidBody("crank", 1.0, (1.0, 1.0, 1.0), com=(1.0, 0, 0)),
        joints=Revolute("pin", GROUND, "crank", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=JointSpring("spring", "pin", 3.0),
        drivers=Driver("drive", "pin", rotation=lambda f: 1.5 * f**power + 0.3 * f**3),
        scheme="static",
        t_end=10.0,
        path=PathFollowing(load_end=1.0),
    )
    found = columns(execute(scene))
    f = found["load_factor"]
    angle = 1.5 * f**power + 0.3 * f**3
    assert found["pin.rotation"] == pytest.approx(angle, abs=1e-12)
    assert found["drive.torque"][1:] == pytest.approx(3.0 * angle[1:], abs=1e-9)
    assert f[-1] == pytest.approx(1.0, abs=1e-9)


def test_what_turns_round_is_said() -> None:
    """At the largest value of what alone is prescribed nothing moves; it says so, and where."""
    scene = replace(bent(PathFollowing(load_end=1.0)), probes=())
    back = Fixed("right", displacement=(None, None, lambda f: 0.1 * math.sin(3 * f)))
    with pytest.raises(ConvergenceError, match=r"reverses between the load factors 0\.5.*load_end"):
        execute(replace(scene, supports=[Clamped("left"), back]))
