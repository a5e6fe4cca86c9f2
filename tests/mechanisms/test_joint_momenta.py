"""Forces that joints report are the momentum of the step, of every kind and in every scheme.

What a joint is said to exert on its second body is compared with what that body gains of momentum,
from its positions and velocities alone. Bodies turn by half a radian in a step, so that all that is
taken along directions of another instant shows.
"""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import shellmb as sm
from shellmb.model.locations.ends import frame_about
from shellmb.simulate.simulation import BaseObserver, Simulation

AXIS, ACROSS, NORMAL = (0.2, 1.0, 0.3), (1.0, -0.2, 0.0), (0.0, 0.3, 1.0)
KINDS: dict[str, tuple[Any, dict[str, Any]]] = {
    "spherical": (sm.Spherical, {}),
    "revolute": (sm.Revolute, {"axis": AXIS}),
    "universal": (sm.Universal, {"axis": AXIS, "second_axis": ACROSS}),
    "cylindrical": (sm.Cylindrical, {"axis": ACROSS}),
    "prismatic": (sm.Prismatic, {"axis": AXIS}),
    "planar": (sm.Planar, {"normal": NORMAL}),
    "screw": (sm.Screw, {"axis": AXIS, "pitch": 0.4}),
    "weld": (sm.Weld, {}),
    "distance": (sm.Distance, {}),
    "in-plane": (sm.InPlane, {"normal": AXIS}),
    "wheel": (sm.Rolling, {"normal": NORMAL, "axis": (1.0, 0.0, 0.0), "radius": 0.1}),
    "sphere": (sm.Rolling, {"normal": AXIS, "radius": 0.1}),
    "knife edge": (sm.KnifeEdge, {"normal": NORMAL, "direction": (1.0, 0.0, 0.0)}),
}
MASS, INERTIA, DT = 0.7, np.array([2e-2, 3e-2, 4e-2]), 1e-2
EULER = INERTIA.sum() / 2 - INERTIA
# size of the moments that most of the joints exert, N m
MOMENT = 25.0


class Path(BaseObserver):
    """Positions, directors and their velocities of all rigid bodies, by name."""

    def __init__(self) -> None:
        self.rows: dict[str, list[Any]] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the first state."""
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take a state."""
        rigid = simulation.model.rigid
        levels = simulation.problem.levels[rigid.name]
        q, v = levels.q.x.array, levels.rates["v"].x.array
        for body in simulation.scene.rigid_bodies:
            u, w = rigid.local(body.name, "u"), rigid.local(body.name, "w")
            directors = np.eye(3) + q[w].reshape(3, 3)
            row = np.vstack([q[u], v[u], directors, v[w].reshape(3, 3)])
            self.rows.setdefault(body.name, []).append(row)


def _scene(scheme: str, alpha: float | None) -> sm.Scene:
    """A body that spins, and one on it by each kind of joint, at its centre of mass."""
    bodies, joints = [sm.RigidBody("hub", 20.0, (2.0, 3.0, 4.0))], []
    for k, (kind, (made, more)) in enumerate(KINDS.items()):
        at = np.array([0.4 * np.cos(k), 0.4 * np.sin(k), 0.05 * k])
        bodies.append(sm.RigidBody(kind, MASS, tuple(INERTIA), position=tuple(at)))
        ends: dict[str, Any] = {"at": tuple(at)}
        if kind == "distance":
            ends = {"at": (0.1, 0.0, 0.0), "second_at": tuple(at)}
        elif made is sm.Rolling:
            # what it rolls on is a radius below its centre
            n = np.array(more["normal"]) / np.linalg.norm(more["normal"])
            down = n
            if "axis" in more:
                axis = np.array(more["axis"])
                down = n - (n @ axis) * axis
                down /= np.linalg.norm(down)
            ends = {"at": tuple(at - more["radius"] * down), "second_at": tuple(at)}
        joints.append(made(kind, "hub", kind, **ends, **more))
    return sm.Scene(
        "carousel",
        rigid_bodies=bodies,
        joints=joints,
        initial=sm.InitialVelocity(spin=(8.0, 15.0, -40.0), about=(0.0, 0.0, 0.0)),
        scheme=scheme,
        dt=DT,
        t_end=4 * DT,
        **({} if alpha is None else {"alpha": alpha}),
    )


def _half_way(first: Any, second: Any) -> Any:
    """Frames, as rows, half of the rotation from the first to the second."""
    turn = Rotation.from_matrix(second.T @ first).as_rotvec()
    return first @ Rotation.from_rotvec(turn / 2).as_matrix().T


@pytest.mark.parametrize(
    ("scheme", "alpha", "bound"),
    # not round-off, but what a scheme itself takes of the angular momentum of a body, of order 4, 3
    # and 2; what was reported was off by 2e-2 in ep4 and ed3
    [
        ("ep", None, 1e-12),
        ("ep4", None, 4e-4),
        pytest.param("ed", 0.5, 0.3, marks=pytest.mark.slow),
        pytest.param("ed3", 0.5, 2e-2, marks=pytest.mark.slow),
    ],
)
def test_what_a_joint_exerts_is_what_its_body_gains(
    scheme: str, alpha: float | None, bound: float
) -> None:
    path, scene = Path(), _scene(scheme, alpha)
    run = sm.run(scene, observers=[path])
    hub = np.array(path.rows["hub"])[:, 2:5]
    for kind, (_, more) in KINDS.items():
        rows = np.array(path.rows[kind])
        v, directors, rates = rows[:, 1], rows[:, 2:5], rows[:, 5:]
        angular = np.einsum("k,tkc->tc", EULER, np.cross(directors, rates))
        gained = [MASS * np.diff(v, axis=0) / DT, np.diff(angular, axis=0) / DT]
        reported = [
            np.column_stack([run.history[f"{kind}.{c}{k}"] for k in (1, 2, 3)])[1:] for c in "FM"
        ]
        if kind in ("wheel", "knife edge"):
            # along a way that turns in the plane
            gained, reported = (
                [np.linalg.norm(x, axis=1) for x in some] for some in (gained, reported)
            )
        elif kind not in ("spherical", "distance"):
            e = np.eye(3) if kind == "weld" else frame_about(more.get("axis", more.get("normal")))
            if kind == "sphere":
                along = np.eye(3)[0] - AXIS[0] * np.array(AXIS) / np.dot(AXIS, AXIS)
                along /= np.linalg.norm(along)
                e = np.array([along, np.cross(e[2], along), e[2]])
            for k in range(len(hub) - 1):
                axes = _half_way(e @ hub[k], e @ hub[k + 1])
                for rows in reported:
                    rows[k] = rows[k] @ axes
        force, moment = (np.abs(a - b).max() for a, b in zip(gained, reported, strict=True))
        assert force < 1e-12 * np.abs(gained[0]).max(), kind
        assert moment < bound * MOMENT, kind


def _nut(scheme: str, more: dict[str, Any]) -> Any:
    """Last row of a nut of 2 kg on a vertical screw that turns with its driver, lock or spring."""
    timed = {"dt": 0.5, "t_end": 0.5} if scheme == "static" else {"dt": 2e-3, "t_end": 0.02}
    scene = sm.Scene(
        "nut",
        rigid_bodies=sm.RigidBody("nut", 2.0, (1e-3,) * 3),
        joints=sm.Screw("s", sm.GROUND, "nut", at=(0, 0, 0), axis=(0, 0, 1), pitch=0.02),
        loads=sm.Gravity((0, 0, -9.81), time=lambda t: 1.0),
        scheme=scheme,
        **timed,
        **more,
    )
    return sm.run(scene).history.iloc[-1]


@pytest.mark.parametrize("scheme", ["static", "ep", "ep4", "ed3"])
@pytest.mark.parametrize("held", ["lock", "driver", "spring and motor"])
def test_a_screw_carries_along_and_about_its_axis(held: str, scheme: str) -> None:
    """The thread alone: what holds or drives the nut is not the joint's, whatever it is."""
    arm, weight = 0.02 / (2 * np.pi), 2.0 * 9.81
    turn = 0.0 if scheme == "static" else 40.0
    more: dict[str, Any] = {
        "lock": {"locks": sm.Lock("s", active=(0.0, 1.0), coordinate="rotation")},
        "driver": {"drivers": sm.Driver("d", "s", rotation=lambda t: turn * t**2 / 2)},
        "spring and motor": {
            "force_elements": [
                sm.JointSpring("k", "s", stiffness=1e6, coordinate="rotation"),
                sm.Motor("m", "s", lambda x, v, t: 0.01 + 0 * x, coordinate="rotation"),
            ]
        },
    }[held]
    last = _nut(scheme, more)
    force = weight + (2.0 * arm * turn if held == "driver" else 0.0)
    # a stiff spring vibrates about its rest by next to nothing
    size = pytest.approx(force, rel=1e-9 if held != "spring and motor" else 0.02)
    assert last["s.F3"] == size
    # one is of the momentum, the other works on the angle: in ep they differ by its square
    assert last["s.M3"] == pytest.approx(-last["s.F3"] * arm, rel=1e-6)
    if held == "driver":
        torque = arm * force + 1e-3 * turn
        assert last["d.torque"] == pytest.approx(torque, rel=1e-6)


class Blow(Path):
    """The same states, and those behind the blow."""

    def switched(self, simulation: Simulation) -> None:
        """Take the velocities that have jumped."""
        self.before = {name: rows[-1] for name, rows in self.rows.items()}
        kept, self.rows = self.rows, {}
        self.accepted(simulation)
        self.after = {name: rows[-1] for name, rows in self.rows.items()}
        self.rows = kept


# what has no windows of time: wheels and blades
WINDOWED = [kind for kind in KINDS if kind not in ("wheel", "sphere", "knife edge")]


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_joints_that_begin_to_act_tell_their_impulses(scheme: str) -> None:
    """A body is thrown up, falls back on another one at rest, and is caught there by a joint."""
    g, dt, caught = 10.0, 5e-3, 0.05
    bodies, joints, loads, initial = [], [], [], []
    for k, kind in enumerate(WINDOWED):
        made, more = KINDS[kind]
        at = np.array([2.0 * k, 0.0, 0.0])
        # caught off its centre, on a body that is hit off its own
        bodies.append(sm.RigidBody(f"{kind} b", MASS, tuple(INERTIA), position=tuple(at)))
        place = tuple(at - np.array([0.4, 0.1, 0.2]))
        bodies.append(sm.RigidBody(f"{kind} a", 1.5, (0.1, 0.2, 0.3), position=place))
        ends: dict[str, Any] = {"at": tuple(at + np.array([0.1, 0.2, 0.05]))}
        if kind == "distance":
            ends["second_at"] = tuple(at + np.array([0.2, 0.2, 0.3]))
        joints.append(made(kind, f"{kind} a", f"{kind} b", active=(caught, 1.0), **ends, **more))
        loads.append(sm.Gravity((0, 0, -g), body=f"{kind} b"))
        speed = (0, 0, g * caught / 2)
        initial.append(sm.InitialVelocity(linear=speed, body=f"{kind} b"))
    scene = sm.Scene(
        "caught",
        rigid_bodies=bodies,
        joints=joints,
        loads=loads,
        initial=initial,
        scheme=scheme,
        dt=dt,
        t_end=caught + 2 * dt,
    )
    path = Blow()
    history = sm.run(scene, observers=[path]).history
    row = round(caught / dt) + 1
    for kind, joint in zip(WINDOWED, joints, strict=True):
        more = KINDS[kind][1]
        e = frame_about(more.get("axis", more.get("normal", (0, 0, 1))))
        e = np.eye(3) if kind in ("spherical", "distance", "weld") else e
        told = [
            np.column_stack([history[f"{kind}.{c}{k}_impulse"] for k in (1, 2, 3)]) @ e
            for c in "FM"
        ]
        for some in told:
            assert not np.any(np.delete(some, row, axis=0))
        force, moment = (some[row] for some in told)
        where = np.array(joint.second_at or joint.at)
        for body, sign, mass, inertia in (
            (f"{kind} b", 1, MASS, INERTIA),
            (f"{kind} a", -1, 1.5, np.array([0.1, 0.2, 0.3])),
        ):
            jump = path.after[body] - path.before[body]
            position = np.array(next(b.position for b in bodies if b.name == body))
            # directors as they are at the start: nothing has turned
            angular = np.einsum(
                "k,kc->c", inertia.sum() / 2 - inertia, np.cross(np.eye(3), jump[5:])
            )
            assert np.allclose(sign * force, mass * jump[1], rtol=0, atol=1e-12), kind
            about = sign * (moment + np.cross(where - position, force))
            assert np.allclose(about, angular, rtol=0, atol=1e-12), kind
        assert np.abs(force).max() > 1e-2, kind


@pytest.mark.parametrize("scheme", ["ep", "ed", "ep4", "ed3"])
def test_locks_tell_their_impulses(scheme: str) -> None:
    """A clutch between two rotors, and a slide that is stopped, by time and by an event."""
    one, two, w1, w2 = 0.3, 0.2, 10.0, -4.0
    scene = sm.Scene(
        "locks",
        rigid_bodies=[
            sm.RigidBody("a", 1.0, (one,) * 3),
            sm.RigidBody("b", 1.0, (two,) * 3),
            sm.RigidBody("c", 2.0, (0.1,) * 3, position=(1.0, 0, 0)),
        ],
        joints=[
            sm.Revolute("ground", sm.GROUND, "a", at=(0, 0, 0), axis=(0, 0, 1)),
            sm.Revolute("clutch", "a", "b", at=(0, 0, 0), axis=(0, 0, 1)),
            sm.Prismatic("slide", sm.GROUND, "c", at=(1, 0, 0), axis=(0, 1, 0)),
        ],
        locks=[
            sm.Lock("clutch", active=(0.105, 2.0)),
            sm.Lock("slide", when=sm.Sensor("slide.translation") >= 0.3),
        ],
        initial=[
            sm.InitialVelocity(spin=(0, 0, w1), body="a"),
            sm.InitialVelocity(spin=(0, 0, w2), body="b"),
            sm.InitialVelocity(linear=(0, 3.0, 0), body="c"),
        ],
        scheme=scheme,
        dt=0.01,
        t_end=0.2,
        **({"alpha": 0.0} if scheme in ("ed", "ed3") else {}),
    )
    history = sm.run(scene).history
    common = (one * w1 + two * w2) / (one + two)
    for name, right in (
        ("clutch.lock_torque", two * (common - w2)),
        ("slide.lock_force", -6.0),
    ):
        told = history[f"{name}_impulse"]
        # velocities of ep and ed are those of their steps: the angle of one is 0.1 rad
        assert told.sum() == pytest.approx(right, rel=1e-2 if "clutch" in name else 1e-9)
        assert np.count_nonzero(np.abs(told) > 1e-9) == 1
    assert np.abs(history["clutch.F1_impulse"]).max() < 1e-12


@pytest.mark.parametrize("order", [(sm.GROUND, "rotor"), ("rotor", sm.GROUND)])
def test_signs_of_all_that_acts_on_a_coordinate(order: tuple[str, str]) -> None:
    """`J dw/dt` of the second body is what drives less what resists (`docs/theory/forces.md`)."""
    J, dt = 0.3, 1e-3
    names = {"drive": 1, "motor": 1, "spring": -1, "damper": -1, "stop": -1}
    scene = sm.Scene(
        "rotor",
        rigid_bodies=sm.RigidBody("rotor", 1.0, (J,) * 3),
        joints=sm.Revolute("r", *order, at=(0, 0, 0), axis=(0, 0, 1)),
        drivers=sm.Driver("drive", "r", rotation=lambda t: 5.0 * t**2),
        force_elements=[
            sm.Motor("motor", "r", lambda x, v, t: 2.0 + 0 * x),
            sm.JointSpring("spring", "r", stiffness=40.0, rest=-0.1),
            sm.JointDamper("damper", "r", damping=0.7),
            sm.JointStop("stop", "r", upper=0.01, stiffness=300.0),
        ],
        scheme="ep4",
        dt=dt,
        t_end=0.1,
    )
    last = sm.run(scene).history.iloc[-1]
    x, rate = 0.05, 1.0
    closed = {
        "motor": 2.0,
        "spring": 40.0 * (x + 0.1),
        "damper": 0.7 * rate,
        "stop": 300.0 * (x - 0.01),
    }
    for name, right in closed.items():
        # means over a step, beside values at its end
        assert last[f"{name}.torque"] == pytest.approx(right, rel=0.03), name
    # the coordinate is the second body's against the first, whichever of both moves
    assert last["r.rotation"] == pytest.approx(x, rel=1e-9)
    total = sum(sign * last[f"{name}.torque"] for name, sign in names.items())
    assert total == pytest.approx(J * 10.0, rel=1e-6)
