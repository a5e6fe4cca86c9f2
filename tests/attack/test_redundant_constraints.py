"""Supports, joins, drivers and joints that say the same twice, or contradict one another."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.preprocessing.checked_model import checked_model
from shellmb.preprocessing.constraint_analysis import redundancy
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    GROUND,
    Clamped,
    Driven,
    Driver,
    EdgeForce,
    Fixed,
    Isotropic,
    Join,
    JointSpring,
    PointForce,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Spherical,
    SymmetryPlane,
    Weld,
)
from shellmb.simulate.simulation import Simulation

SECTION = Isotropic(E=1e5, nu=0.0, thickness=0.05, density=1.0)
LYING = Shell("lying", Rectangle(1.0, 0.5), SECTION, mesh=(2, 1))
STANDING = replace(LYING, name="standing", surface=Rectangle(1.0, 0.5, axis2=(0, 0, 1)))
HALVES = replace(LYING, name="half", surface=Rectangle(1.0, 0.5, origin=(0, -0.5, 0)))
KINK = Join("lying", "standing", "bottom", "bottom")
FLAT = Join("lying", "half", "bottom", "top")
TIMES = {
    "static": {},
    "linear-statics": {},
    "ep": {"dt": 0.1, "t_end": 0.1},
    "ed": {"dt": 0.1, "t_end": 0.1},
}
ROD = RigidBody("rod", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.5, 0.0, 0.0))
Y = (0.0, 1.0, 0.0)
PINS = [
    Revolute("pin", GROUND, "rod", at=(0, 0, 0), axis=Y),
    Revolute("further pin", GROUND, "rod", at=(0, 1, 0), axis=Y),
]


def both(first: Any, second: Any, join: Join = KINK, other: Shell = STANDING) -> dict[str, Any]:
    """Two shells joined along x, each with a support."""
    return {"shells": (LYING, other), "joins": join, "supports": (first, second)}


def on(body: str, kind: type = Clamped, **options: Any) -> Any:
    return kind("left", body=body, **options)


def rising(t: float) -> tuple[float, float, float]:
    return (0.0, 0.0, 0.1 * t)


# turned about the join, on which neither of the two moves
TURN = {"axis": (1, 0, 0), "rotation": lambda t: 0.1 * t}

WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "one edge of a join is held, the other moves": (
        both(on("lying"), on("standing", Driven, translation=rising)),
        "clamped edge 'left' and driven edge 'left' contradict one another on shell 'standing': at "
        "(0, 0, 0) the displacement along z is 0 by the former",
    ),
    "an edge is clamped and moves": (
        {"shells": LYING, "supports": (on("lying"), on("lying", Driven, translation=rising))},
        "clamped edge 'left' and driven edge 'left' contradict one another on shell 'lying': at",
    ),
    "an edge has two displacements": (
        {
            "shells": LYING,
            "supports": (
                Clamped("right"),
                Fixed("left", (None, None, 0.1)),
                Fixed("left", (None, None, 0.2)),
            ),
        },
        "the displacement along z is 0.1 by the former and 0.2 by the latter at t = 0; they must",
    ),
    "one side of a kink turns": (
        both(
            Clamped("bottom", body="lying"),
            Driven("bottom", body="standing", **TURN),
        ),
        "kink between 'lying' and 'standing' at (0, 0, 0): its motion contradicts the supports",
    ),
    "one side of a smooth join turns": (
        both(
            Clamped("bottom", body="lying"),
            Driven("top", body="half", **TURN),
            FLAT,
            HALVES,
        ),
        "clamped edge 'bottom' and driven edge 'top' contradict one another on shell 'half': at "
        "(0, 0, 0) the change of the director along y is 0 by the former",
    ),
    "a plane of symmetry along the shell": (
        {"shells": LYING, "supports": (on("lying"), SymmetryPlane("right", (0, 0, 1)))},
        "symmetry plane at 'right': normal is (0.0, 0.0, 1.0); it must not be the normal of the "
        "shell 'lying' itself, as it is at (1, 0, 0)",
    ),
    "a director is held along itself": (
        {
            "shells": LYING,
            "supports": (on("lying"), Fixed("right", director=(None, None, 0))),
        },
        "the director of 'lying' at (1, 0, 0) is fixed along its own direction by a support",
    ),
    "a joint at a clamped edge": (
        {
            "shells": LYING,
            "supports": on("lying"),
            "joints": Spherical("ball", GROUND, "lying", at=(0, 0, 0)),
        },
        "3 of the constraints are redundant: 3 of joint 'ball' (implied by the supports); use",
    ),
    "a joint at an edge that moves": (
        {
            "shells": LYING,
            "supports": on("lying", Driven, translation=rising),
            "joints": Spherical("ball", GROUND, "lying", at=(0, 0, 0)),
        },
        "joint 'ball': its motion contradicts the supports",
    ),
    "two pins": (
        {
            "rigid_bodies": ROD,
            "joints": PINS,
            "force_elements": JointSpring("s", "pin", stiffness=1.0),
        },
        "5 of the constraints are redundant: 5 of joint 'further pin' (implied by 'pin'); use",
    ),
    "two drivers": (
        {
            "rigid_bodies": ROD,
            "joints": PINS,
            "redundant": "drop",
            "drivers": [
                Driver("one", "pin", rotation=lambda t: t / 50),
                Driver("two", "further pin", rotation=lambda t: t / 25),
            ],
        },
        "joint 'further pin.rotation': its motion contradicts 'pin.rotation': no",
    ),
    "a driver at a weld": (
        {
            "rigid_bodies": ROD,
            "joints": [Weld("weld", GROUND, "rod", at=(1, 0, 0)), PINS[0]],
            "redundant": "drop",
            "drivers": Driver("one", "pin", rotation=lambda t: t / 50),
        },
        "joint 'pin.rotation': its motion contradicts 'weld'",
    ),
}


@pytest.mark.parametrize("scheme", TIMES)
@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_named(case: str, scheme: str) -> None:
    options, said = WRONG[case]
    with pytest.raises(SceneError) as error:
        checked_model(Scene("s", scheme=scheme, **options, **TIMES[scheme]), MPI.COMM_WORLD)
    assert said in str(error.value)


@pytest.mark.parametrize("case", ["one side of a kink turns", "two pins", "two drivers"])
def test_modes_say_the_same(case: str) -> None:
    options, said = WRONG[case]
    with pytest.raises(SceneError) as error:
        natural_modes(Scene("s", **options), count=1)
    assert said in str(error.value)


CONSISTENT: dict[str, tuple[dict[str, Any], int]] = {
    "a kink, both clamped": (both(on("lying"), on("standing")), 1),
    "a kink, both clamped along it": (
        both(Clamped("bottom", body="lying"), Clamped("bottom", body="standing")),
        5,
    ),
    "a kink, both moved": (
        both(
            on("lying", Driven, translation=rising, axis=Y, rotation=lambda t: 0.1 * t),
            on("standing", Driven, translation=rising, axis=Y, rotation=lambda t: 0.1 * t),
        ),
        1,
    ),
    "a smooth join, both clamped": (both(on("lying"), on("half"), FLAT, HALVES), 0),
    # the corner's displacement is held across the oblique plane by both
    "a kink, one oblique plane for both": (
        both(
            on("lying", SymmetryPlane, normal=(1, 1, 1)),
            on("standing", SymmetryPlane, normal=(1, 1, 1)),
        )
        | {"scheme": "ep", "dt": 0.1, "t_end": 0.1},
        # supports find it among themselves
        0,
    ),
    "one node of a join held by components": (
        both(on("lying"), Fixed("left", (0, 0, 0), (0, 0, 0), body="standing")),
        1,
    ),
    "a director held by two supports": (
        {
            "shells": LYING,
            "supports": (
                on("lying"),
                Fixed("right", director=(0, 0, None)),
                Fixed("right", director=(None, None, 0)),
            ),
        },
        # supports find it among themselves
        0,
    ),
}


@pytest.mark.parametrize("case", CONSISTENT)
def test_what_is_consistent_is_left_out(case: str) -> None:
    options, count = CONSISTENT[case]
    _, redundant = checked_model(Scene("s", **options), MPI.COMM_WORLD)
    assert len(redundant) == count


@pytest.mark.parametrize("scheme", TIMES)
def test_a_kink_with_both_sides_moved_follows(scheme: str) -> None:
    options, _ = CONSISTENT["a kink, both moved"]
    simulation = Simulation(Scene("s", scheme=scheme, **options, **TIMES[scheme]))
    simulation.run()
    body = simulation.model.shells["standing"]
    node = np.argmin(np.linalg.norm(body.mixed.nodes("u"), axis=1))
    u = simulation.problem.state("standing").x.array[body.mixed.dofs["u"].reshape(-1, 3)[node]]
    np.testing.assert_allclose(u, rising(simulation.t_end), atol=1e-12)


def test_redundant_joints_of_a_static_scene_are_dropped() -> None:
    """A rod on two pins and a spring turns as on one of them."""
    force = PointForce((0.5, 0, 0), (0, 0, 2.0), body="rod")
    spring = JointSpring("spring", "pin", stiffness=30.0)
    turned = []
    for joints in (PINS, PINS[:1]):
        options = {
            "rigid_bodies": ROD,
            "force_elements": spring,
            "redundant": "drop",
            "loads": force,
        }
        simulation = Simulation(Scene("s", joints=joints, **options))
        simulation.run()
        rigid = simulation.model.rigid
        assert rigid is not None
        q = simulation.problem.levels[rigid.name].q.x.array
        turned.append(q[rigid.local("rod", "w")])
    assert len(simulation.redundant) == 0
    np.testing.assert_allclose(turned[0], turned[1], atol=1e-10)
    # moment 2 N times half a metre over the stiffness, less for the lever that turns
    assert abs(turned[0][2]) == pytest.approx(np.sin(1.0 / 30.0), rel=1e-3)


def test_a_joint_at_a_clamped_edge_is_dropped() -> None:
    options, _ = WRONG["a joint at a clamped edge"]
    tips = []
    for joints in (options["joints"], ()):
        loads = EdgeForce("right", (0, 0, 0.1))
        scene = Scene("s", **options | {"joints": joints}, redundant="drop", loads=loads, dt=1.0)
        simulation = Simulation(scene)
        simulation.run()
        body = simulation.model.shells["lying"]
        tips.append(
            np.abs(simulation.problem.levels["lying"].q.x.array[body.mixed.dofs["u"]]).max()
        )
    assert tips[0] == pytest.approx(tips[1], rel=1e-9)


def linkage(closed: bool, hanging: int) -> Scene:
    """A bar on two cranks, or on one of them, from which a chain of rods hangs; off the axes."""
    shared: dict[str, Any] = {"mass": 1.0, "inertia": (0.1, 0.2, 0.3)}
    turned: dict[str, Any] = {"rotation": (0.3, 0.7, -0.2)}
    cranks = [RigidBody(f"crank {x}", position=(x, 0.0, 0.5), **shared, **turned) for x in (0, 2)]
    bar = RigidBody("bar", position=(1.0, 0.0, 1.0), **shared)
    joints = [
        joint
        for x, crank in zip((0.0, 2.0), cranks, strict=True)
        for joint in (
            Revolute(f"foot {x}", GROUND, crank.name, at=(x, 0, 0), axis=Y),
            Revolute(f"head {x}", crank.name, "bar", at=(x, 0, 1), axis=Y),
        )
    ]
    rods, before = [], "bar"
    for k in range(hanging):
        rods.append(RigidBody(f"rod {k}", position=(0.5, 0.1, 0.7 - 0.3 * k), **shared, **turned))
        axis = (0.6, 0.8, 0.0) if k % 2 else Y
        joints.append(Revolute(f"pin {k}", before, f"rod {k}", at=(0.5, 0, 1 - 0.3 * k), axis=axis))
        before = rods[-1].name
    bodies = (*cranks, bar, *rods)
    return Scene(
        "linkage",
        rigid_bodies=bodies if closed else (cranks[0], bar, *rods),
        joints=joints if closed else [j for j in joints if "2.0" not in j.name],
        redundant="drop",
        scheme="ep",
        dt=1e-2,
        t_end=1e-2,
    )


def test_only_loops_are_looked_through(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a tree of joints nothing can be redundant, and what hangs on a loop changes nothing.

    A chain of 1000 rods took 40 s for what nobody finds.
    """
    looked: list[int] = []
    search = redundancy._dependent

    def spy(rows: Any, *args: Any) -> Any:
        looked.append(sum(len(row.columns) > 0 for row in rows))
        return search(rows, *args)

    def found(scene: Scene) -> list[tuple[Any, ...]]:
        looked.clear()
        said = [
            (r.row.owner, r.row.component, r.with_) for r in checked_model(scene, MPI.COMM_SELF)[1]
        ]
        return said

    monkeypatch.setattr(redundancy, "_dependent", spy)
    assert not found(linkage(closed=False, hanging=7)) and sum(looked) == 0
    loop = found(linkage(closed=True, hanging=0))
    size = sum(looked)
    assert len(loop) == 3 and size > 0
    assert found(linkage(closed=True, hanging=7)) == loop and sum(looked) == size
    # all of them looked through find the same
    monkeypatch.setattr(redundancy.tied, "looped", lambda rows, *_: rows)
    assert found(linkage(closed=True, hanging=7)) == loop and sum(looked) > 2 * size
