"""Wheels, spheres and blades: closed forms, orders, no work, no slip that adds up."""

import math
import pathlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.observers.forces.joints import JointForces
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Beam,
    CircularSection,
    Driver,
    Gravity,
    InitialVelocity,
    InPlane,
    Isotropic,
    KnifeEdge,
    Line,
    PointForce,
    Rectangle,
    Revolute,
    RigidBody,
    Rolling,
    Scene,
    Shell,
    Solver,
    Spherical,
    Weld,
)
from shellmb.scene.multibody.joints import Joint
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.mechanisms.rolling import Disc, Sleigh, ball_on_turntable, rolling_disc

SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
# in CI; the others share their kernels
SOME = [
    SCHEMES[0],
    *SCHEMES[2:4],
    *(pytest.param(*SCHEMES[k], marks=pytest.mark.slow) for k in (1, 4)),
]
# order of positions and of velocities at the ends of steps in large motions
ORDERS = {"ep": 2, "ed": 2, "ep4": 4, "ed3": 3}
Z = (0.0, 0.0, 1.0)
G = 9.81
DISC = Disc(2.0, axial=0.09, across=0.045, radius=0.3, gravity=G)


class Path(BaseObserver):
    """Position and velocity of a rigid body's centre, and what the joint 'contact' says."""

    def __init__(self, body: str, *columns: str) -> None:
        self._body, self._columns, self._forces = body, columns, JointForces()
        self.t: list[float] = []
        self.x: list[np.ndarray] = []
        self.v: list[np.ndarray] = []
        self.read: list[list[float]] = []

    def start(self, simulation: Simulation) -> None:
        self._forces.start(simulation)
        rigid = simulation.model.rigid
        assert rigid is not None
        self._center = rigid.bodies[rigid.index[self._body]].center
        self._record(simulation)

    def solved(self, simulation: Simulation) -> None:
        self._forces.solved(simulation)

    def accepted(self, simulation: Simulation) -> None:
        self._forces.accepted(simulation)
        self._record(simulation)

    def _record(self, simulation: Simulation) -> None:
        rigid = simulation.model.rigid
        levels, here = simulation.problem.levels[rigid.name], rigid.local(self._body, "u")
        self.t.append(simulation.t)
        self.x.append(self._center + levels.q.x.array[here])
        self.v.append(levels.rates["v"].x.array[here].copy())
        self.read.append([self._forces.values[f"contact.{c}"] for c in self._columns])

    def column(self, name: str) -> np.ndarray:
        """What the joint says, after each step."""
        return np.array(self.read)[1:, self._columns.index(name)]


def inclined(tilt: float) -> np.ndarray:
    """A disc's axes as columns, its axis (the second) inclined in the y-z plane."""
    c, s = math.cos(tilt), math.sin(tilt)
    return np.array([[1, 0, 0], [0, s, -c], [0, c, s]])


def disc_scene(tilt: float, spin: Any, scheme: str, alpha: float, dt: float, t_end: float) -> Scene:
    """A disc whose axis has the angle `tilt` with the vertical, y inwards."""
    axes = inclined(tilt)
    height = DISC.radius * math.sin(tilt)
    body = RigidBody(
        "disc",
        DISC.mass,
        (DISC.across, DISC.axial, DISC.across),
        position=(0, 0, height),
        rotation=axes.tolist(),
    )
    axis = tuple(axes[:, 1])
    arm = DISC.radius * np.array([0.0, axis[2], -axis[1]])
    return Scene(
        "disc",
        rigid_bodies=body,
        joints=Rolling(
            "contact", GROUND, "disc", at=(0, 0, 0), normal=Z, axis=axis, radius=DISC.radius
        ),
        loads=Gravity((0, 0, -G)),
        initial=InitialVelocity(tuple(np.cross(arm, spin)), tuple(spin), (0, 0, height)),
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=t_end,
    )


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_order_of_a_disc_that_wobbles(scheme: str, alpha: float, watch) -> None:
    """Positions and velocities against the equations of motion in the rotation alone."""
    tilt, spin, t_end, errors = 1.2, (0.5, 5.0, 1.0), 0.4, []
    for count in (20, 40):
        path = Path("disc", "slip")
        watch(disc_scene(tilt, spin, scheme, alpha, t_end / count, t_end), path).check()
        x, v = rolling_disc(DISC, inclined(tilt)[:, 1], spin, path.t)
        # the reference counts from above the point of contact
        gap = np.array(path.x) - (x - x[0] + path.x[0])
        errors.append([np.abs(gap).max(), np.abs(np.array(path.v) - v).max()])
        if scheme != "ep":
            # an equation of these schemes; slip of EP is of its order
            assert path.column("slip").max() < 1e-12
    orders = np.log2(np.divide(*errors))
    # 0.1 and 0.05 rad in a step: the next order is still seen
    assert orders == pytest.approx(ORDERS[scheme], abs=0.1)


@pytest.mark.parametrize(
    ("scheme", "alpha", "count"),
    [
        ("ep", 0.0, 200),
        ("ed", 0.0, 200),
        ("ep4", 0.0, 200),
        *(pytest.param(*scheme, 10_000, marks=pytest.mark.slow) for scheme in SCHEMES),
    ],
)
def test_nothing_drifts(scheme: str, alpha: float, count: int, watch) -> None:
    """A disc that wobbles on and on: energy, constraints, and slip at the ends of steps."""
    path, dt = Path("disc", "slip"), 0.02
    spin = (0.5, 5.0, 1.0)
    watched = watch(disc_scene(1.2, spin, scheme, alpha, dt, count * dt), path)
    assert watched.energy.relative_error is not None
    assert watched.energy.relative_error < 1e-12
    assert watched.constraints.constraint_max is not None
    assert watched.constraints.constraint_max < 1e-10
    slip = path.column("slip")
    if scheme != "ep":
        assert slip.max() < 1e-12
    else:
        # of second order in the step, 0.1 rad: it comes and goes
        assert slip.max() < 0.05 * np.linalg.norm(path.v, axis=1).max()
        assert slip[-count // 4 :].max() < 1.5 * slip[: count // 4].max()


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_steady_precession_of_a_disc(scheme: str, watch) -> None:
    """The closed form for tilt, circle and rate; the weight, and friction that keeps it round."""
    tilt, circle = 1.1, 0.5
    rate, spin = DISC.rate(tilt, circle), DISC.spin(tilt, circle)
    axis = inclined(tilt)[:, 1]
    path = Path("disc", "F1", "F2", "F3")
    turn, count = 2 * math.pi / rate, 80
    omega = rate * np.array(Z) + spin * axis
    watch(disc_scene(tilt, omega, scheme, 0.0, turn / count, turn), path).check()
    x = np.array(path.x)
    # the middle of the circle is behind the axis
    middle = x[0] - circle * np.array([0.0, 1.0, 0.0])
    angle = rate * np.array(path.t)
    exact = middle + circle * np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])
    # 0.16 rad of spin in a step: measured 3.3e-2 and 4.8e-5, with half of it a fourth and a 16th
    assert np.abs(x - exact).max() < {"ep": 4e-2, "ep4": 6e-5}[scheme]
    # forces of EP alternate and are of first order, means of a force that turns of second order
    # friction is along F2, on the left of the way as the disc turns about its axis
    pull, small = DISC.mass * rate**2 * circle, {"ep": 6e-2, "ep4": 3e-4}[scheme]
    assert np.abs(path.column("F3") / (DISC.mass * G) - 1).max() < small
    assert np.abs(path.column("F2") / pull + 1).max() < small
    assert np.abs(path.column("F1")).max() < small * pull


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_chaplygins_sleigh(scheme: str, watch) -> None:
    """Speed, spin and the blade's force in closed form; two pads hold it upright."""
    ideal = Sleigh(mass=3.0, inertia=0.2, ahead=0.3, speed=-0.4, spin=2.0)
    pads = [InPlane(f"pad {y}", GROUND, "sleigh", at=(0.7, y, 0.0), normal=Z) for y in (-0.2, 0.2)]
    start = (ideal.speed, 0.0, 0.0)
    scene = Scene(
        "sleigh",
        rigid_bodies=RigidBody(
            "sleigh", ideal.mass, (0.1, 0.2, ideal.inertia), com=(ideal.ahead, 0.0, 0.2)
        ),
        joints=[
            KnifeEdge("contact", GROUND, "sleigh", at=(0, 0, 0), normal=Z, direction=(1, 0, 0)),
            *pads,
        ],
        loads=Gravity((0, 0, -G)),
        initial=InitialVelocity(linear=start, spin=(0, 0, ideal.spin)),
        scheme=scheme,
        dt=0.02,
        t_end=2.0,
    )
    path = Path("sleigh", "F2")
    watch(scene, path).check()
    v, w, angle, _ = ideal.motion(path.t)
    along = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    across = np.cross(Z, along)
    exact = v[:, None] * along + (w * ideal.ahead)[:, None] * across
    # 0.04 rad in a step: measured 2.5e-4 and 1.7e-8, with half of it a fourth and a 16th;
    # not round-off
    assert np.abs(path.v - exact).max() < {"ep": 3e-4, "ep4": 2e-8}[scheme]
    t = np.array(path.t)
    force = ideal.motion((t[1:] + t[:-1]) / 2)[3]
    # of first order in EP; the mean over a step against the value at its middle: of second
    small = {"ep": 3e-2, "ep4": 3e-4}[scheme]
    assert np.abs(path.column("F2") - force).max() < small * np.abs(force).max()


RATE, BALL, BEGIN = 7.0, np.array([0.2, 0.0, 0.1]), np.array([0.3, 0.5, 0.0])


def turntable(scheme: str, dt: float, t_end: float) -> Scene:
    """A ball that rolls on a table which turns evenly."""
    radius, under = 0.1, np.cross((0, 0, RATE), BALL)
    joints: list[Joint] = [
        Revolute("pivot", GROUND, "table", at=(0, 0, 0), axis=Z),
        Rolling("contact", "table", "ball", at=(0, 0, 0), normal=Z, radius=radius),
    ]
    spin = tuple(np.cross(Z, BEGIN - under) / radius)
    return Scene(
        "turntable",
        rigid_bodies=[
            RigidBody("table", 1.0, (1.0, 1.0, 2.0)),
            RigidBody("ball", 1.0, (0.4 * radius**2,) * 3, position=tuple(BALL)),
        ],
        joints=joints,
        drivers=Driver("motor", "pivot", rotation=lambda t: RATE * t),
        loads=Gravity((0, 0, -G)),
        initial=[
            InitialVelocity(spin=(0, 0, RATE), body="table"),
            InitialVelocity(tuple(BEGIN), spin, tuple(BALL), "ball"),
        ],
        scheme=scheme,
        dt=dt,
        t_end=t_end,
    )


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_ball_on_a_turntable(scheme: str, watch) -> None:
    """Circles at 2/7 of the turntable's rate: a plane that moves."""
    scene = turntable(scheme, 0.02, 1.0)
    path = Path("ball", "track1", "track2", "F3")
    watch(scene, path).check()
    gap = np.abs(path.x - ball_on_turntable(RATE, BALL, BEGIN, path.t)).max()
    # the ball turns by 0.2 rad in a step: measured 3.0e-2 and 1.6e-4, with half of it a fourth
    # and a 16th; the circle's radius is 0.29 m
    assert gap < {"ep": 4e-2, "ep4": 2e-4}[scheme]
    assert path.column("F3") == pytest.approx(G, rel=1e-9)
    # the point of contact in the table's axes, below the ball
    track = np.hypot(path.column("track1"), path.column("track2"))
    assert track == pytest.approx(np.linalg.norm(np.array(path.x)[1:, :2], axis=1), rel=1e-9)


@pytest.mark.slow
def test_what_ed_damps_too_much_is_said() -> None:
    """With alpha = 1 and long steps a ball leaves its circle, and the run warns; not with half."""
    far, near = (execute(turntable("ed", dt, 8.0)) for dt in (0.02, 0.01))
    assert {"turning", "angular momentum"} <= {c.watch for c in far.warnings}
    assert near.warnings == ()
    # no further from the axis than the circle reaches: 0.450 m
    ends = np.array([ball_on_turntable(RATE, BALL, BEGIN, t) for t in near.history["t"]])
    reach = np.hypot(*ends.T[:2]).max()
    track = np.hypot(near.history["contact.track1"], near.history["contact.track2"])
    assert track.max() == pytest.approx(reach, rel=0.03)


@pytest.mark.parametrize(("scheme", "alpha"), SOME)
def test_contacts_on_a_platform_that_moves(scheme: str, alpha: float, rod, watch) -> None:
    """A wheel, a sphere and a blade on a rigid platform that swings: no work, no violation."""
    wheel = RigidBody("wheel", 0.5, (0.002, 0.004, 0.002), position=(0.4, 0, 0.1))
    ball = RigidBody("ball", 0.5, (0.002, 0.003, 0.002), position=(-0.4, 0.2, 0.1))
    skate = RigidBody("skate", 0.5, (0.002, 0.003, 0.002), position=(0.0, -0.4, 0.1))
    platform = RigidBody("platform", 2.0, (0.3, 0.3, 0.5))
    plane: dict[str, Any] = {"first": "platform", "at": (0, 0, 0), "normal": Z}
    joints: list[Joint] = [
        Spherical("pivot", GROUND, "platform", at=(0, 0, 0.5)),
        Rolling("wheel", second="wheel", axis=(0, 1, 0.2), radius=0.1 / math.cos(0.197), **plane),
        Rolling("ball", second="ball", radius=0.1, **plane),
        KnifeEdge("skate", "platform", "skate", at=(0, -0.4, 0), normal=Z, direction=(1, 0.3, 0.1)),
    ]
    scene = Scene(
        "platform",
        rigid_bodies=[platform, wheel, ball, skate],
        joints=joints,
        loads=Gravity((0, 0, -G)),
        initial=InitialVelocity(spin=(0.5, 1.0, -3.0)),
        assemble=True,
        scheme=scheme,
        alpha=alpha,
        dt=0.02,
        t_end=0.24,
    )
    watched = watch(scene)
    watched.check()
    if scheme == "ep4":
        # every unknown and every row
        full = watch(replace(scene, solver=Solver(solve="full")))
        for name, levels in watched.simulation.problem.levels.items():
            other = full.simulation.problem.levels[name].q.x.array
            assert levels.q.x.array == pytest.approx(other, abs=1e-8)
    assert watched.work.exchanged > 1e-2 * watched.energy.largest
    assert (watched.energy.values["dissipation"] > 0) == (alpha > 0 and scheme in ("ed", "ed3"))


def test_a_contact_that_pulls_is_said_so() -> None:
    """Thrown up, a wheel would fly; on its own weight it stays silent."""
    thrown = disc_scene(1.2, (0.0, 0.0, 0.0), "ep", 0.0, 0.01, 0.05)
    up = [Gravity((0, 0, -G)), PointForce("center", (0, 0, 2 * DISC.mass * G), body="disc")]
    (caution,) = [c for c in execute(replace(thrown, loads=up)).warnings if c.watch == "lifting"]
    assert caution.body == "disc"
    assert "rolling joint 'contact' pulls at 'disc' by up to" in caution.says
    assert not [c for c in execute(thrown).warnings if c.watch == "lifting"]


def test_slip_at_the_ends_of_large_steps_is_said() -> None:
    """0.5 rad in a step: EP leaves a tenth of the speed, ep4 nothing."""
    spin = (0.5, 5.0, 1.0)
    found = [execute(disc_scene(1.2, spin, s, 0.0, 0.1, 0.5)).warnings for s in ("ep", "ep4")]
    slipping = [[c for c in cautions if c.watch == "slipping"] for cautions in found]
    assert len(slipping[0]) == 1 and not slipping[1]
    assert "use --scheme ep4" in slipping[0][0].says


def axle() -> Scene:
    """A beam's end and a plate's corner, nodes of one element, on a wheel that rolls, in ED."""
    steel: dict[str, Any] = {"E": 7e10, "nu": 0.3, "density": 2700.0}
    beam = Beam("b", Line((0, 0, 0.2), (0, 0.5, 0.2)), CircularSection(radius=0.01, **steel))
    plate = Shell("p", Rectangle(0.1, 0.1, (0, 0, 0.2)), Isotropic(thickness=5e-3, **steel))
    return Scene(
        "axle",
        replace(plate, mesh=(2, 1)),
        beams=replace(beam, elements=2),
        rigid_bodies=RigidBody("wheel", 2.0, (0.02, 0.04, 0.02), position=(0, 0, 0.2)),
        joints=[
            Rolling("contact", GROUND, "wheel", at=(0, 0, 0), normal=Z, axis=(0, 1, 0), radius=0.2),
            Revolute("bearing", "b", "wheel", at=(0, 0, 0.2), axis=(0, 1, 0)),
            Weld("bolt", "wheel", "p", at=(0, 0, 0.2), second_at="left-bottom"),
        ],
        loads=Gravity((3.0, 0, -G)),
        scheme="ed",
        alpha=0.5,
        dt=2e-3,
        t_end=0.02,
    )


def weigh(run: sm.Run) -> None:
    """Check that the force of the ground is what the momentum does not owe to the weight."""
    history, mass = run.history, 2.0 + 2700 * (0.5 * math.pi * 0.01**2 + 0.1 * 0.1 * 5e-3)
    contact = history[["contact.F1", "contact.F2", "contact.F3"]].to_numpy()[1:]
    momentum = history[["momentum_x", "momentum_y", "momentum_z"]].to_numpy()
    force = np.diff(momentum, axis=0) / 2e-3 - mass * np.array([3.0, 0.0, -G])
    # along the plane and normal to it: the first axis turns with the wheel
    along = np.linalg.norm(force[:, :2], axis=1) - np.linalg.norm(contact[:, :2], axis=1)
    # tolerance of Newton's method: 1e-9 of the largest forces
    assert np.abs(along).max() < 1e-7 and np.abs(force[:, 2] - contact[:, 2]).max() < 1e-7
    assert momentum[-1, 0] > 0.1 and run.summary["energy_balance_error"] < 1e-10


def test_flexible_bodies_on_wheels_in_ed() -> None:
    """Joints act on nodes of one element each: momentum is balanced.

    Multipliers of the directors there were eliminated with that element, which does not have the
    directors' jumps of velocity: ED ended in an error of its own where anything rolled.
    """
    weigh(sm.run(axle(), pictures=False))


@pytest.mark.mpi
def test_flexible_bodies_on_wheels_in_ed_on_two_ranks(mpirun) -> None:
    """There the joints are on another rank than the nodes."""
    program = (
        "import sys; from mpi4py import MPI; import shellmb as sm; sys.path.append(sys.argv[1]);"
        "from tests.mechanisms.test_rolling import axle, weigh; weigh(sm.run(axle()))"
    )
    mpirun(2, "-c", program, pathlib.Path(__file__).parents[2])
