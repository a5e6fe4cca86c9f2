"""No verdict on constraints depends on the unit of length: positions and directions have their own.

The kind: a number with a unit is compared with one that has another, or none. Scenes are described
in units from a gigametre (1e-9 of them to the metre) to a nanometre.
"""

import numpy as np
import pytest

from shellmb.errors import ConvergenceError, SceneError
from shellmb.observers.account.constraints import Constraints
from shellmb.scene import GROUND, InitialVelocity, Revolute, RigidBody, Scene, Universal
from shellmb.simulate.simulation import Simulation

# units to a metre
UNITS = [1e-9, 1.0, 1e6, 1e9]
Z = (0.0, 0.0, 1.0)
Triple = tuple[float, float, float]


def scaled(values: tuple[float, ...], by: float) -> Triple:
    """Three numbers times another."""
    a, b, c = (by * v for v in values)
    return a, b, c


def two_universals(metre: float, scheme: str) -> Scene:
    """A body on two joints at one point, whose equations for directions agree at the start only."""
    x, y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    at = (0.0, 0.0, 0.0)
    return Scene(
        "two_universals",
        rigid_bodies=RigidBody(
            "body", 1.0, scaled((0.10, 0.12, 0.15), metre**2), points={"far": (metre, 0.0, 0.0)}
        ),
        joints=[
            Universal("one", GROUND, "body", at=at, axis=x, second_axis=y),
            Universal("two", GROUND, "body", at=at, axis=y, second_axis=x),
        ],
        initial=InitialVelocity(spin=(1.0, 1.0, 0.0)),
        scheme=scheme,
        dt=0.01,
        t_end=0.02,
        redundant="drop",
    )


def parallelogram(metre: float, scheme: str, redundant: str, lying: bool = False) -> Scene:
    """Two cranks of 1 m and a coupler that turn with 1 rad/s, upright or at the change point."""
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] if lying else np.eye(3))
    foot, crank = np.array([1.0, 0.0, 0.0]), turn @ (0.0, 1.0, 0.0)
    rods = {"along x": (1e-4, 1 / 12, 1 / 12), "along y": (1 / 12, 1e-4, 1 / 12)}
    inertia = scaled(rods["along x" if lying else "along y"], metre**2)

    def at(x: np.ndarray) -> Triple:
        return scaled(tuple(x), metre)

    places = {"first": crank / 2, "second": foot + crank / 2, "bar": foot / 2 + crank}
    bodies = [
        RigidBody("first", 1.0, inertia, position=at(places["first"])),
        RigidBody("second", 1.0, inertia, position=at(places["second"])),
        RigidBody("bar", 1.0, scaled(rods["along x"], metre**2), position=at(places["bar"])),
    ]
    joints = [
        Revolute("foot", GROUND, "first", at=at(0 * foot), axis=Z),
        Revolute("other foot", GROUND, "second", at=at(foot), axis=Z),
        Revolute("left", "first", "bar", at=at(crank), axis=Z),
        Revolute("right", "second", "bar", at=at(foot + crank), axis=Z),
    ]
    spin = (0.0, 0.0, -1.0)
    initial = [
        InitialVelocity(spin=spin, body="first"),
        InitialVelocity(spin=spin, about=at(foot), body="second"),
        InitialVelocity(linear=at(np.cross(spin, crank)), body="bar"),
    ]
    return Scene(
        "parallelogram",
        rigid_bodies=bodies,
        joints=joints,
        initial=initial,
        scheme=scheme,
        dt=0.02,
        t_end=0.06,
        redundant=redundant,
    )


@pytest.mark.parametrize("metre", UNITS)
@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_a_direction_that_was_dropped_opens_in_every_unit(scheme: str, metre: float) -> None:
    with pytest.raises(ConvergenceError, match=r"joint 'two' opens by 0\.00573 degrees"):
        Simulation(two_universals(metre, scheme)).run()


@pytest.mark.parametrize("metre", UNITS)
def test_a_position_that_was_dropped_opens_in_every_unit(metre: float) -> None:
    with pytest.raises(ConvergenceError, match=r"t = 0\.04: joint 'right' opens by 4\.\d+"):
        Simulation(parallelogram(metre, "ep4", "drop", lying=True)).run()


@pytest.mark.parametrize("metre", UNITS)
@pytest.mark.parametrize("scheme", ["ep", "ed", "ep4", "ed3"])
def test_what_is_always_redundant_moves_in_every_unit(scheme: str, metre: float) -> None:
    simulation, constraints = Simulation(parallelogram(metre, scheme, "drop")), Constraints()
    simulation.run([constraints])
    model = simulation.model
    assert model.rigid is not None
    u = simulation.problem.state(model.rigid.name).x.array[model.rigid.local("bar", "u")]
    # the angle is off by (0.02)^2/12 of it in ep, by less in others
    assert u / metre == pytest.approx([np.sin(0.06), np.cos(0.06) - 1, 0.0], abs=3e-6)
    assert constraints.constraint_max is not None
    # round-off; the worst seen is 2.5e-16
    assert constraints.constraint_max < 1e-14


@pytest.mark.parametrize("metre", UNITS)
def test_what_is_redundant_is_no_question_of_units(metre: float) -> None:
    with pytest.raises(SceneError) as refused:
        Simulation(parallelogram(metre, "ep", "error"))
    assert "constraints are redundant: 3 of joint 'right'" in str(refused.value)


@pytest.mark.parametrize("metre", UNITS)
def test_the_largest_constraint_error_counts_what_was_dropped(metre: float) -> None:
    simulation, constraints = Simulation(two_universals(metre, "ep")), Constraints()
    # nobody stops the run
    simulation.dropped.check = lambda t: None  # type: ignore[method-assign]
    simulation.run([constraints])
    # two turns of 0.02 rad about axes that do not commute
    assert constraints.constraint_max == pytest.approx(0.02**2, rel=2e-2)
    assert constraints.joints["two"] == constraints.constraint_max
    assert constraints.joints["one"] < 1e-14
