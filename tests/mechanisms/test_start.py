"""What happens before the first step: redundant joints, open joints, velocities, equilibrium."""

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.scene import (
    GROUND,
    Arc,
    Beam,
    Clamped,
    Distance,
    Driver,
    Gravity,
    InitialVelocity,
    Isotropic,
    JointSpring,
    Line,
    Prismatic,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Spherical,
    Weld,
)
from shellmb.simulate.simulation import Simulation

Y = (0.0, 1.0, 0.0)
A, B, C, D = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.2, 0.0, 1.3), (1.2, 0.0, 0.0)
SCHEMES = [("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
HINGES = (("lower", A, (0.0, 0.0, 1.0)), ("upper", B, (0.01, 0.0, 1.0)))
MOTION = {"dt": 0.01, "t_end": 0.2, "scheme": "ep"}


def _four_bar(rod: Any, **more: Any) -> Scene:
    """A closed chain in the x-z plane with revolute joints only: three of 20 are redundant."""
    bars = {"crank": (A, B), "coupler": (B, C), "rocker": (C, D)}
    order = [GROUND, *bars, GROUND]
    return Scene(
        "four_bar",
        rigid_bodies=[rod(name, *ends) for name, ends in bars.items()],
        joints=[
            Revolute(name, first, second, at=at, axis=Y)
            for name, first, second, at in zip(
                "ABCD", order[:-1], order[1:], (A, B, C, D), strict=True
            )
        ],
        loads=Gravity((0, 0, -9.81)),
        initial=InitialVelocity(spin=(0, 1.0, 0), body="crank"),
        **(MOTION | more),
    )


def test_redundant_constraints_are_named(rod) -> None:
    with pytest.raises(SceneError) as error:
        Simulation(_four_bar(rod))
    said = str(error.value)
    # found last, so blamed on the joint that closes the loop; how many of how many is Gruebler's
    assert "3 of the constraints are redundant" in said
    assert "joint 'D'" in said and "'A'" in said and "redundant='drop'" in said


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_redundant_constraints_can_be_dropped(scheme: str, alpha: float, rod, watch) -> None:
    watched = watch(_four_bar(rod, redundant="drop", scheme=scheme, alpha=alpha))
    watched.check()
    # also the constraints that were dropped hold: the bodies stay in their plane
    simulation = watched.simulation
    rigid = simulation.model.rigid
    q = simulation.problem.levels[rigid.name].q.x.array
    for name in ("crank", "coupler", "rocker"):
        u = q[rigid.local(name, "u")]
        assert abs(u[1]) < 1e-12 < 0.01 < np.linalg.norm(u)


def test_contradicting_drivers_are_named(rod) -> None:
    drivers = [
        Driver("left", "A", rotation=lambda t: 0.5 * t),
        Driver("right", "D", rotation=lambda t: 3.0 * t),
    ]
    scene = replace(_four_bar(rod, redundant="drop"), initial=(), drivers=drivers)
    with pytest.raises(SceneError, match="contradict") as error:
        Simulation(scene)
    assert "'D" in str(error.value) and "'A" in str(error.value)


def test_an_open_joint_is_named_or_closed(rod, watch) -> None:
    scene = _four_bar(rod, redundant="drop")
    crank, coupler, rocker = scene.rigid_bodies
    # the rocker stands off its place by a centimetre, with its joints where its ends are meant
    moved = replace(rocker, position=tuple(np.add(rocker.position, (0.01, 0.0, 0.004))))
    joints = [
        replace(joint, at=joint.at if joint.name in "AB" else "b", second_at=second_at)
        for joint, second_at in zip(scene.joints, (None, None, "a", D), strict=True)
    ]
    joints[3] = replace(joints[3], first="rocker", second=GROUND, at="b")
    scene = replace(scene, rigid_bodies=(crank, coupler, moved), joints=joints)
    with pytest.raises(SceneError, match=r"joint '[CD]': it is open by 0\.0.*assemble=True"):
        Simulation(scene)
    watched = watch(replace(scene, assemble=True))
    watched.check()
    assert max(watched.constraints.joints.values()) < 1e-10


def _chain(rod: Any, count: int, **more: Any) -> Scene:
    """Rods that stick out along x, one after the other, on revolute joints about y."""
    ends = [(0.5 * k, 0.0, 0.0) for k in range(count + 1)]
    names = [GROUND, *(f"rod{k}" for k in range(count))]
    return Scene(
        "chain",
        rigid_bodies=[rod(names[k + 1], ends[k], ends[k + 1]) for k in range(count)],
        joints=[
            Revolute(f"joint{k}", names[k], names[k + 1], at=ends[k], axis=Y) for k in range(count)
        ],
        loads=Gravity((0, 0, -9.81)),
        **(MOTION | more),
    )


@pytest.mark.parametrize("stiffness", [20.0, 200.0])
def test_equilibrium_of_a_chain_with_springs(stiffness: float, rod, watch) -> None:
    count = 3
    springs = [JointSpring(f"s{k}", f"joint{k}", stiffness) for k in range(count)]
    scene = _chain(rod, count, force_elements=springs, start="equilibrium")
    watched = watch(scene)
    watched.check()
    rigid = watched.simulation.model.rigid
    levels = watched.simulation.problem.levels[rigid.name]
    # it hangs still
    assert np.abs(levels.rates["v"].x.array).max() < 1e-6
    q = levels.q.x.array
    centers = [rigid.bodies[rigid.index[f"rod{k}"]].center for k in range(count)]
    x = np.array([c + q[rigid.local(f"rod{k}", "u")] for k, c in enumerate(centers)])
    # a rod's angle with x from its axis d1, which was along x
    turned = [rigid.bodies[rigid.index[f"rod{k}"]].axes[:, 0] for k in range(count)]
    along = [d + q[rigid.local(f"rod{k}", "w")][:3] for k, d in enumerate(turned)]
    angles = np.array([np.arctan2(-d[2], d[0]) for d in along])
    assert angles[0] > 0.05
    joints = x - 0.25 * np.array(along)
    for k in range(count):
        # the spring carries the moment of all that hangs beyond it
        moment = 9.81 * np.sum(x[k:, 0] - joints[k, 0])
        turn = angles[k] - (angles[k - 1] if k else 0.0)
        assert stiffness * turn == pytest.approx(moment, rel=1e-6)


@pytest.mark.parametrize("dt", [1e-3, 1e-6, 1e-8])
def test_an_equilibrium_does_not_depend_on_the_step(dt: float) -> None:
    """Kind: steps so short that masses hold everything, as nothing moves in one by its weight."""
    scene = Scene(
        "hung",
        rigid_bodies=RigidBody("bob", 2.0, (1.0,) * 3),
        joints=Prismatic("rail", GROUND, "bob", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=JointSpring("spring", "rail", stiffness=2 * 9.81 / 0.01),
        loads=Gravity((0, 0, -9.81)),
        start="equilibrium",
        scheme="ep",
        dt=dt,
        t_end=2 * dt,
    )
    simulation = Simulation(scene)
    simulation.run()
    rigid = simulation.model.rigid
    place = simulation.problem.levels[rigid.name].q.x.array[rigid.local("bob", "u")]
    np.testing.assert_allclose(place, [0.0, 0.0, -0.01], atol=1e-10)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_a_hanging_chain_stays_at_rest(scheme: str, alpha: float, rod, watch) -> None:
    ends = [(0.0, 0.0, -0.5 * k) for k in range(4)]
    names = [GROUND, "a", "b", "c"]
    scene = Scene(
        "hanging",
        rigid_bodies=[rod(names[k + 1], ends[k], ends[k + 1]) for k in range(3)],
        joints=[Spherical(f"{k}", names[k], names[k + 1], at=ends[k]) for k in range(3)],
        loads=Gravity((0, 0, -9.81)),
        dt=0.02,
        t_end=1.0,
        scheme=scheme,
        alpha=alpha,
    )
    simulation = Simulation(scene)
    simulation.run()
    levels = simulation.problem.levels[simulation.model.rigid.name]
    assert np.abs(levels.q.x.array[simulation.model.rigid.mixed.dofs["u"]]).max() < 1e-12
    assert np.abs(levels.rates["v"].x.array).max() < 1e-11


def _energy(simulation: Simulation) -> float:
    from shellmb.observers.account.energy import EnergyAccount

    account = EnergyAccount()
    account.start(simulation)
    return account.values["kinetic_energy"]


def test_velocities_are_projected_on_the_joints(rod) -> None:
    """A rod on a hinge that is given the velocity of a free flight.

    Only the rotation about the hinge's axis remains, and of it what keeps the moment of momentum
    about the hinge: an impact of the hinge on the rod.
    """
    mass, length, radius, v = 1.0, 0.5, 0.1, (3.0, 0.7, -2.0)
    scene = replace(_chain(rod, 1), initial=InitialVelocity(linear=v), t_end=0.01)
    simulation = Simulation(scene)
    inertia = mass * (radius**2 / 4 + length**2 / 12) + mass * length**2 / 4
    # moment of momentum about y through the hinge: m (z v_x - x v_z), x = length / 2
    momentum = -mass * v[2] * length / 2
    rate = momentum / inertia
    rigid = simulation.model.rigid
    velocity = simulation.problem.levels[rigid.name].rates["v"].x.array
    assert velocity[rigid.local("rod0", "u")] == pytest.approx(
        [0, 0, -rate * length / 2], abs=1e-12
    )
    assert _energy(simulation) == pytest.approx(inertia * rate**2 / 2, rel=1e-12)
    # consistent velocities stay what they are
    again = replace(scene, initial=InitialVelocity(spin=(0, rate, 0)))
    assert _energy(Simulation(again)) == pytest.approx(inertia * rate**2 / 2, rel=1e-12)


def test_velocities_that_nothing_is_left_of_are_said(rod) -> None:  # type: ignore[no-untyped-def]
    """A door on hinges out of line is locked: it stood still without a word."""
    hinges = [Revolute(n, GROUND, "door", at=at, axis=axis) for n, at, axis in HINGES]
    door = Scene(
        "door",
        rigid_bodies=rod("door", A, D),
        joints=hinges,
        initial=InitialVelocity(spin=(0.0, 0.0, 1.0), body="door"),
        redundant="drop",
        **MOTION,
    )
    with pytest.warns(ShellmbWarning, match="do not allow the velocities that are given"):
        Simulation(door)
    Simulation(replace(door, joints=hinges[:1]))


PLATE = Isotropic(E=1e9, nu=0.3, thickness=0.01, density=100.0)
BAR = RectangularSection(E=1e9, nu=0.3, width=0.1, height=0.1, density=100.0)
# a body of 1 kg with its end at the origin, moment of inertia J about it in y and z, is given a
# velocity V; what joints there leave of its energy
J, V = 0.02 + 0.5**2, (1.0, 2.0, 3.0)
LEFT = {
    "revolute": (Revolute("j", GROUND, "b", at=A, axis=Y), (0.5 * 3) ** 2 / J / 2),
    "spherical": (Spherical("j", GROUND, "b", at=A), 0.5**2 * (3**2 + 2**2) / J / 2),
    "prismatic": (Prismatic("j", GROUND, "b", at=A, axis=Y), 2**2 / 2),
    "weld": (Weld("j", GROUND, "b", at=A), 0.0),
    "distance": (
        Distance("j", GROUND, "b", at=(0.5, 0, -1), second_at=(0.5, 0, 0)),
        (1**2 + 2**2) / 2,
    ),
}


@pytest.mark.parametrize("joint", LEFT)
@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_velocities_that_joints_replace_are_said(joint: str, scheme: str) -> None:
    """With both energies: by impacts that keep what the joint leaves free."""
    held, left = LEFT[joint]
    body = RigidBody("b", 1.0, (0.02,) * 3, com=(0.5, 0, 0))
    initial = InitialVelocity(linear=V)
    scene = Scene(
        "b", rigid_bodies=body, joints=held, initial=initial, **MOTION | {"scheme": scheme}
    )
    with pytest.warns(ShellmbWarning, match="do not allow the velocities that are given") as said:
        Simulation(scene)
    words = str(said[0].message).split("kinetic energy was ")[1].split(", is ")
    assert [float(w) for w in words] == pytest.approx([7.0, left], rel=1e-5, abs=1e-12)


@pytest.mark.parametrize("kind", ["shell", "beam"])
def test_velocities_that_supports_replace_are_said(kind: str) -> None:
    """Of nodes that are held; what is given as it can be is not said."""
    plate: dict[str, Any] = {
        "shells": Shell("s", Rectangle(1.0, 0.5), PLATE, mesh=(2, 1)),
        "supports": Clamped("left"),
    }
    rod: dict[str, Any] = {
        "beams": Beam("s", Line(A, D), BAR, elements=2),
        "joints": Revolute("j", GROUND, "s", at=A, axis=Y),
    }
    scene = Scene("s", **(plate if kind == "shell" else rod), **MOTION)
    initial = InitialVelocity(linear=(0, 0, 2.0))
    mass = 100 * 0.01 * 0.5 if kind == "shell" else 100 * 0.1**2 * 1.2
    with pytest.warns(ShellmbWarning, match=rf"energy was {mass * 2.0**2 / 2:.6g}, is "):
        Simulation(replace(scene, initial=initial))
    if kind == "beam":
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            Simulation(replace(scene, initial=InitialVelocity(spin=(0, 2.0, 0))))


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_energy_counts_from_the_projected_state(scheme: str, alpha: float, rod, watch) -> None:
    scene = _chain(rod, 2, scheme=scheme, alpha=alpha)
    far = Distance("tether", "rod1", GROUND, at="b", second_at=(1.0, 0.0, -2.0))
    scene = replace(
        scene, joints=(*scene.joints, far), initial=InitialVelocity(linear=(1.0, 2.0, 3.0))
    )
    watched = watch(scene)
    watched.check()


def test_joint_on_directors_without_inertia_is_refused() -> None:
    section = RectangularSection(E=1e9, nu=0.3, width=0.1, height=0.1, density=1e3)
    beam = Beam("arm", Line(A, B), section, elements=1, rotary_inertia=False)
    pin = Revolute("pin", GROUND, "arm", at=A, axis=Y)
    scene = Scene("arm", beams=beam, joints=pin, **MOTION)
    with pytest.raises(SceneError, match="'pin': the directors of 'arm' have no inertia"):
        Simulation(scene)
    # a joint of positions alone asks nothing of the directors; a straight arm would spin about
    # itself as it likes
    curved = replace(beam, curve=Arc(A, (0.1, 0.0, 0.5), B))
    ball = Spherical("ball", GROUND, "arm", at=A)
    Simulation(replace(scene, beams=curved, joints=ball)).advance()
