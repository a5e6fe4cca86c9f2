"""Joints of a user's own and distances over time: motions of others, momenta, and what is refused.

The kind: constraints that a user writes, with values that are functions of time. What decides is
the motion of textbooks and of other joints, the order at half the step, the impulse of what a joint
exerts, and the work of what moves it.
"""

from typing import Any

import numpy as np
import pytest
import ufl
from scipy.integrate import solve_ivp

import shellmb as sm
from shellmb.forms.constraints.joints import KINDS, JointKind
from shellmb.model.locations.ends import frame_about
from shellmb.scene.values.validate import described

G, END = 9.81, 0.4
ORDERS = {"ep": 2, "ed": 2, "ep4": 4, "ed3": 3}
AT = {"at": (0.0, 0.0, 0.0), "second_at": (1.0, 0.0, 0.0)}


def rope(a: Any, b: Any, length: Any) -> list[Any]:
    r = b.x - a.x
    return [(ufl.dot(r, r) - length**2) / 2]


def length(t: float) -> float:
    return float(1.0 - 0.3 * np.sin(t) ** 2)


def exact() -> tuple[float, float]:
    """Place of a bob on a winch at the end: l phi'' = g cos phi - 2 l' phi'."""

    def motion(t: float, state: Any) -> tuple[float, float]:
        angle, rate = state
        return rate, (G * np.cos(angle) + 0.6 * np.sin(2 * t) * rate) / length(t)

    angle = solve_ivp(motion, (0, END), (0, 0), rtol=1e-11, atol=1e-12).y[0, -1]
    return length(END) * np.cos(angle), -length(END) * np.sin(angle)


def winch(joint: sm.Joint, scheme: str, dt: float) -> sm.Run:
    bob = sm.RigidBody("bob", 2.0, (1e-3, 1e-3, 1e-3), position=(1.0, 0.0, 0.0))
    probes = [sm.Probe(f"x{k}", "center", "position", k) for k in (0, 2)]
    loads = sm.Gravity((0.0, 0.0, -G))
    scene = sm.Scene("winch", rigid_bodies=bob, joints=joint, loads=loads, probes=probes)
    return sm.run(scene.with_options(scheme=scheme, dt=dt, t_end=END), pictures=False)


def bob(joints: Any, **more: Any) -> sm.Scene:
    body = sm.RigidBody("bob", 2.0, (0.1, 0.2, 0.3), position=(1.0, 0.0, 0.0))
    options: Any = {"scheme": "ep", "dt": 0.01, "t_end": 0.1}
    return sm.Scene("bob", rigid_bodies=body, joints=joints, **options | more)


def own(constraints: Any, *values: Any, **more: Any) -> sm.OwnJoint:
    places = {**AT, **more}
    return sm.OwnJoint("mine", sm.GROUND, "bob", constraints=constraints, values=values, **places)


@pytest.mark.parametrize("scheme", ORDERS)
def test_a_winch_moves_its_bob_as_in_textbooks(scheme: str) -> None:
    """By a distance over time and by a function of the user; the work of the winch is booked."""
    joints: list[sm.Joint] = [
        sm.Distance("rope", sm.GROUND, "bob", length=length, **AT),
        own(rope, length),
    ]
    errors = []
    for joint, dt in zip(joints, (0.04, 0.02), strict=True):
        run = winch(joint, scheme, dt)
        here = run.history[["x0", "x2"]].iloc[-1].to_numpy()
        errors.append(float(np.linalg.norm(here - exact())))
        assert abs(np.hypot(*here) - length(END)) < 1e-12
        # round-off; its work is energy and loss of the scheme
        assert run.summary["energy_balance_error"] < 1e-11
        assert run.history["work_supports"].iloc[-1] > 0.3
        assert run.warnings == ()
    if scheme == "ed":
        # that of the larger step passes zero
        assert max(errors) < 2e-6
    else:
        assert np.log2(errors[0] / errors[1]) == pytest.approx(ORDERS[scheme], abs=0.3)


@pytest.mark.parametrize("scheme", ORDERS)
def test_a_direction_over_time_turns_as_a_driver_does(scheme: str) -> None:
    """Its row is of directors alone; positions, energies and works are those of the driver."""

    def turn(t: float) -> float:
        return 0.8 * t**2

    hinge = sm.Revolute("hinge", sm.GROUND, "bob", at=(0, 0, 0), axis=(0, 0, 1))
    told = own(lambda a, b, s: [ufl.dot(a.e[1], b.e[0]) - s], lambda t: np.sin(turn(t)))
    options: Any = {"scheme": scheme, "t_end": 0.2, "dt": 0.05}
    first = sm.run(bob([hinge, told], **options), pictures=False)
    driver = sm.Driver("drive", "hinge", rotation=turn)
    second = sm.run(bob([hinge], drivers=driver, **options), pictures=False)
    columns = ["kinetic_energy", "work_supports", "angular_momentum_z"]
    # how the coordinate goes between the ends of a step is another way
    near = 1e-9 if scheme == "ep" else 2e-3
    for column in columns:
        there = second.history[column].to_numpy()
        assert first.history[column].to_numpy() == pytest.approx(
            there, abs=near * np.abs(there).max()
        )
    assert first.summary["energy_balance_error"] < 1e-11


def test_what_it_exerts_is_the_change_of_momentum() -> None:
    """Between two free bodies: forces and moments of the rows are what the second one gains."""
    z = (0.3, -0.2, 1.0)
    bodies = [
        sm.RigidBody("first", 1.0, (0.1, 0.2, 0.25)),
        sm.RigidBody("bob", 2.0, (0.1, 0.2, 0.25), position=(1.0, 0.0, 0.0)),
    ]
    joint = sm.OwnJoint(
        "mine",
        "first",
        "bob",
        **AT,
        axis=z,
        constraints=lambda a, b, s: [
            ufl.dot(a.e[2], b.e[0]),
            ufl.dot(a.e[0], b.x - a.x) - s,
        ],
        values=[lambda t: float(frame_about(z)[0][0] + 0.2 * np.sin(5 * t) ** 2)],
    )
    scene = sm.Scene(
        "pair",
        rigid_bodies=bodies,
        joints=joint,
        initial=sm.InitialVelocity(spin=(0.5, 1.0, 2.0)),
        probes=[sm.Probe(f"v{k}", "center", "velocity", k, body="bob") for k in range(3)],
        # keeps the angular momentum exactly
        scheme="ep",
        dt=0.02,
        t_end=0.2,
    )
    run = sm.run(scene, pictures=False)
    history = run.history
    gained = 2.0 * np.diff(history[["v0", "v1", "v2"]].to_numpy(), axis=0)
    told = history[["mine.F1", "mine.F2", "mine.F3"]].to_numpy()[1:] * 0.02
    assert np.linalg.norm(told, axis=1) == pytest.approx(np.linalg.norm(gained, axis=1), rel=1e-9)
    assert run.summary["energy_balance_error"] < 1e-11
    assert run.summary["linear_momentum_drift"] < 1e-11
    assert run.summary["angular_momentum_drift"] < 1e-11
    assert run.warnings == ()


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_directions_in_space_take_moments_from_outside(scheme: str) -> None:
    """Kind: rows that turning everything changes, to ground and between bodies that spin."""

    def two(a: Any, b: Any, height: Any, way: Any) -> list[Any]:
        return [b.x[2] - a.x[2] - height, b.x[0] - a.x[0] - 1 - way]

    lifted = own(two, lambda t: 0.2 * np.sin(3 * t) ** 2, lambda t: t**2)
    between = sm.OwnJoint(
        "level",
        "bob",
        "other",
        at=(1.0, 0.0, 0.0),
        second_at=(2.0, 1.0, 0.0),
        constraints=lambda a, b: [b.x[2] - a.x[2]],
    )
    scene = sm.Scene(
        "level",
        rigid_bodies=[
            sm.RigidBody("bob", 2.0, (0.1, 0.2, 0.3), position=(1.0, 0.0, 0.0)),
            sm.RigidBody("other", 1.0, (0.1, 0.2, 0.3), position=(2.3, 1.0, 0.4)),
        ],
        joints=[lifted, between],
        loads=sm.Gravity((1.0, 2.0, -G)),
        initial=sm.InitialVelocity((0, 1.0, 0)),
        scheme=scheme,
        dt=0.01,
        t_end=0.1,
    )
    run = sm.run(scene, pictures=False)
    assert abs(run.history[["angular_momentum_x"]].to_numpy()).max() > 0.1
    # of order four in EP4; without the moments from outside it is 0.9
    assert run.summary["angular_momentum_drift"] < {"ep": 1e-11, "ep4": 1e-8}[scheme]
    assert run.summary["energy_balance_error"] < 1e-11


def test_in_statics_and_along_paths_values_follow_the_load() -> None:
    strip = sm.Isotropic(E=2e9, nu=0.0, thickness=0.02, density=1000)
    pull = sm.Distance(
        "rope",
        sm.GROUND,
        "strip",
        at=(1.0, 0.0, 1.0),
        second_at=(1.0, 0.0, 0.0),
        length=lambda s: 1.0 - 0.1 * s,
    )
    common: Any = {
        "shells": sm.Shell("strip", sm.Rectangle(1.0, 0.1), strip, mesh=(4, 1)),
        "supports": sm.Clamped("left"),
        "joints": pull,
        "probes": [sm.Probe(f"u{k}", (1.0, 0.0, 0.0), component=k) for k in (0, 2)],
        "scheme": "static",
    }
    for more in ({}, {"path": sm.PathFollowing(load_end=1.0), "t_end": 20.0}):
        run = sm.run(sm.Scene("lift", **common, **more), pictures=False)
        u, w = run.history[["u0", "u2"]].iloc[-1]
        assert np.hypot(u, 1.0 - w) == pytest.approx(0.9, abs=1e-7)
        # the strip bends by 0.1 m under 3 EI w/l^3, stiffer by its sag
        force = np.linalg.norm(run.history[["rope.F1", "rope.F2", "rope.F3"]].iloc[-1])
        assert force == pytest.approx(3 * 2e9 * 0.1 * 0.02**3 / 12 * 0.1, rel=0.05)


def gap(a: Any, b: Any) -> Any:
    return b.x - a.x


REFUSED: dict[str, tuple[Any, str]] = {
    "cubic": (own(lambda a, b: [gap(a, b)[0] ** 3 - 1]), "constraint 0 is not quadratic"),
    "an angle": (
        own(lambda a, b: [gap(a, b)[1], ufl.atan2(b.e[0][2], b.e[0][0])]),
        "constraint 1 is not quadratic",
    ),
    "cubic in a value": (
        own(lambda a, b, s: [gap(a, b)[0] - s**3], lambda t: 1.0 + t),
        "constraint 0 is not quadratic",
    ),
    "a kink": (
        own(lambda a, b: [gap(a, b)[1], abs(gap(a, b)[2])]),
        "constraint 1 is not quadratic",
    ),
    "not finite": (
        own(lambda a, b: [gap(a, b)[0] - np.nan]),
        "has the number nan; it must be finite",
    ),
    "a jump": (
        own(lambda a, b: [ufl.conditional(ufl.gt(b.x[2], 0), 2 * b.x[2], b.x[2])]),
        "constraint 0 is not quadratic",
    ),
    "of no body": (
        own(lambda a, b, s: [s - 1], lambda t: 1.0),
        "constraint 0 does not depend on the places",
    ),
    "no scalars": (own(lambda a, b: "x"), "returns 'x'; it must return a list of scalars"),
    "nothing": (own(lambda a, b: []), r"returns \[\]; it must return a list of scalars"),
    "an error": (own(lambda a, b: b.q), "test_own_joints.py, line .* has no attribute 'q'"),
    "a value too many": (own(lambda a, b: [gap(a, b)[1]], lambda t: t), "were given"),
    "twice the same": (
        own(lambda a, b: [gap(a, b)[1], 2 * gap(a, b)[1]]),
        "1 of the constraints are redundant: 1 of joint 'mine'",
    ),
    "seven rows": (
        own(
            lambda a, b: [
                *(gap(a, b)[k] - (k == 0) for k in range(3)),
                *(ufl.dot(a.e[k], b.e[(k + 1) % 3]) for k in range(3)),
                ufl.dot(a.e[1], b.e[0]),
            ]
        ),
        "1 of the constraints are redundant",
    ),
    "open": (own(lambda a, b: [gap(a, b)[0] - 2]), "it is open by 1 in the given positions"),
    "an open distance": (
        sm.Distance("rope", sm.GROUND, "bob", length=lambda t: 2.0, **AT),
        "joint 'rope': it is open",
    ),
    "a length of nothing": (
        sm.Distance("rope", sm.GROUND, "bob", length=lambda t: t, **AT),
        "value over time gives 0.0 at t = 0; it must give a number greater than 0",
    ),
    "no number": (
        sm.Distance("rope", sm.GROUND, "bob", length=lambda t: np.ones(2), **AT),
        "value over time gives",
    ),
    "a command": (
        sm.Distance("rope", sm.GROUND, "bob", length=sm.Command("c"), **AT),
        "is no value over time; it must be a function of time",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_does_not_fit_is_refused_by_name(case: str) -> None:
    joint, sentence = REFUSED[case]
    with pytest.raises(sm.SceneError, match=sentence):
        sm.run(bob(joint), pictures=False)


def test_kinds_are_looked_through(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kinds that a user adds to the table, with values and without equations."""

    @described("odd joint")
    class Odd(sm.Joint):
        pass

    def odd(rows: int, constraints: Any) -> None:
        monkeypatch.setitem(KINDS, "odd", JointKind(rows, constraints, (0, 0)))
        sm.run(bob(Odd("odd", sm.GROUND, "bob", **AT), t_end=0.02), pictures=False)

    with pytest.raises(sm.SceneError, match="odd joint 'odd': its equations are missing"):
        sm.run(bob(Odd("odd", sm.GROUND, "bob", **AT)), pictures=False)
    with pytest.raises(sm.SceneError, match="has 2 rows, and its function returns 1"):
        odd(2, lambda a, b, length: [gap(a, b)[1]])
    with pytest.raises(sm.SceneError, match="constraint 0 is not quadratic"):
        odd(1, lambda a, b, length: [gap(a, b)[1] ** 3])
    odd(1, lambda a, b, length: [gap(a, b)[1]])
