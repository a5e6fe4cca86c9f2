"""Steps near positions where constraints nearly depend on one another, where round-off stalls them.

The kind: multipliers are badly determined, and the round-off of the equations' own terms changes
them by more than any tolerance with each iteration. That is as good as a solution gets.
"""

from typing import Any

import numpy as np
import pytest
import ufl
from scipy.integrate import solve_ivp

import shellmb as sm
from shellmb.diagnostics import unknown_forces
from shellmb.diagnostics.unknown_forces import Undetermined
from shellmb.errors import ConvergenceError
from shellmb.scene import (
    GROUND,
    Gravity,
    InitialVelocity,
    Probe,
    Revolute,
    RigidBody,
    Scene,
    Solver,
    StepControl,
)
from shellmb.simulate.simulation import Simulation
from shellmb.system.newton import convergence

CELLS, G, Z = 5, 9.81, (0.0, 0.0, 1.0)
# angle of the cranks to the base at the start, rad, and how fast they come down, rad/s
ANGLE, SPIN = 0.06, 2.0


def at_foot(k: int) -> np.ndarray:
    return np.array([k, 0.0, 0.0])


# far below what round-off leaves of multipliers near singular positions, 1e-9 of their size
STRICT = Solver(tolerance=1e-12)


def parallelograms(
    scheme: str, solver: Solver, dt: float = 5e-3, t_end: float = 0.05, **more: Any
) -> Scene:
    """A row of them, of rods of 1 m and 1 kg, which fall through the line of their base."""
    rod = (1e-4, 1 / 12, 1 / 12)
    tip, turned = np.array([np.cos(ANGLE), np.sin(ANGLE), 0.0]), (0.0, 0.0, ANGLE)
    bodies, joints, initial = [], [], []
    for k in range(CELLS + 1):
        foot, crank = (float(k), 0.0, 0.0), f"crank{k}"
        at = tuple((foot + tip / 2).tolist())
        bodies.append(RigidBody(crank, 1.0, rod, position=at, rotation=turned))
        joints.append(Revolute(f"foot{k}", GROUND, crank, at=foot, axis=Z))
        initial.append(InitialVelocity(spin=(0, 0, -SPIN), about=foot, body=crank))
    for k in range(CELLS):
        bar, left, right = f"bar{k}", at_foot(k) + tip, at_foot(k + 1) + tip
        bodies.append(RigidBody(bar, 1.0, rod, position=tuple(((left + right) / 2).tolist())))
        joints.append(Revolute(f"left{k}", f"crank{k}", bar, at=tuple(left.tolist()), axis=Z))
        joints.append(Revolute(f"right{k}", f"crank{k + 1}", bar, at=tuple(right.tolist()), axis=Z))
        speed = tuple(np.cross((0, 0, -SPIN), tip).tolist())
        initial.append(InitialVelocity(linear=speed, body=bar))
    return Scene(
        "parallelograms",
        rigid_bodies=bodies,
        joints=joints,
        loads=Gravity((0.0, -G, 0.0)),
        initial=initial,
        redundant="drop",
        scheme=scheme,
        dt=dt,
        t_end=t_end,
        solver=solver,
        **more,
    )


def fallen(t: float) -> float:
    """Angle of the cranks, which turn as one pendulum."""
    inertia, weight = (CELLS + 1) / 3 + CELLS, ((CELLS + 1) / 2 + CELLS) * G
    motion = solve_ivp(
        lambda t, y: [y[1], -weight / inertia * np.cos(y[0])],
        (0, t),
        [ANGLE, -SPIN],
        rtol=1e-11,
        atol=1e-13,
    )
    return float(motion.y[0, -1])


def crank_angle(simulation: Simulation) -> float:
    rigid = simulation.model.rigid
    assert rigid is not None
    u = simulation.problem.state(rigid.name).x.array[rigid.local("crank0", "u")]
    at = np.array([np.cos(ANGLE), np.sin(ANGLE)]) / 2 + u[:2]
    return float(np.arctan2(at[1], at[0]))


SOLVERS = [
    Solver(),
    Solver(newton="full"),
    Solver(backend="snes"),
    Solver(backend="snes", newton="full"),
]


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda s: f"{s.backend}-{s.newton}")
@pytest.mark.parametrize("scheme", ["ep", "ed", "ep4", "ed3"])
def test_cranks_fall_through_the_line_of_their_base(scheme: str, solver: Solver) -> None:
    simulation = Simulation(parallelograms(scheme, solver))
    simulation.run()
    assert simulation.size.rejected == 0
    # the mid-point rule is off by (2.4 * 0.005)^2/12 of an angle of 0.12
    assert crank_angle(simulation) == pytest.approx(fallen(0.05), abs=5e-6)


@pytest.mark.parametrize("dt", [5e-3, 1e-3, 2e-4])
def test_smaller_steps_pass_as_well(dt: float) -> None:
    """They come nearer to the line."""
    scene = parallelograms("ep4", Solver(), dt, t_end=0.034)
    simulation = Simulation(scene)
    simulation.run()
    assert simulation.size.rejected == 0
    assert crank_angle(simulation) == pytest.approx(fallen(0.034), abs=1e-7)


@pytest.mark.parametrize("metre", [1e-9, 1e-3, 1.0])
def test_units_decide_nothing(metre: float) -> None:
    """ED gave up in small ones, as its changes of velocities have the round-off of positions."""
    base, w = np.array([metre, 0.0, 0.0]), (0.0, 0.0, -1e-3)
    tip = metre * np.array([np.cos(3e-4), np.sin(3e-4), 0.0])
    rod = (1e-4 * metre**2, metre**2 / 12, metre**2 / 12)
    bodies, joints, initial = [], [], []
    for name, foot in (("crank", 0 * base), ("rocker", base)):
        at = {"position": tuple(foot + tip / 2), "rotation": (0.0, 0.0, 3e-4)}
        bodies.append(RigidBody(name, 1.0, rod, **at))
        joints.append(Revolute(f"foot of {name}", GROUND, name, at=tuple(foot), axis=Z))
        joints.append(Revolute(f"tip of {name}", name, "bar", at=tuple(foot + tip), axis=Z))
        initial.append(InitialVelocity(spin=w, about=tuple(foot), body=name))
    scene = Scene(
        "flat",
        rigid_bodies=[*bodies, RigidBody("bar", 1.0, rod, position=tuple(tip + base / 2))],
        joints=joints,
        loads=Gravity((0.0, 0.0, -G * metre)),
        initial=[*initial, InitialVelocity(linear=tuple(np.cross(w, tip)), body="bar")],
        redundant="drop",
        scheme="ed",
        dt=0.1,
        t_end=0.2,
        step_control=StepControl(min_dt=0.1),
    )
    simulation = Simulation(scene)
    simulation.run()
    rigid = simulation.model.rigid
    assert rigid is not None
    u = simulation.problem.state(rigid.name).x.array[rigid.local("crank", "u")]
    # gravity is normal to the plane: the cranks keep their rate. Directors have digits of 1e-16,
    # and velocities follow from angles of 1e-4 over a step of 0.1
    assert 2 * u[1] / metre == pytest.approx(np.sin(1e-4) - np.sin(3e-4), abs=1e-9)


def test_a_state_that_is_no_solution_is_no_round_off() -> None:
    """A millionth of a millionth off in one unknown is seen, and the solution is not."""
    simulation = Simulation(parallelograms("ep4", Solver()))
    simulation.advance()
    iteration, system = simulation.problem.iteration, simulation.problem.system
    simulation.problem.prepare(simulation.t, 5e-3)
    simulation.problem.solve(5e-3)
    x = system.x.copy()
    iteration.residual(x, system.b)
    assert iteration.roundoff.left(system.b) < convergence.NOISE
    x.array[0] += 1e-12
    iteration.residual(x, system.b)
    assert iteration.roundoff.left(system.b) > 10 * convergence.NOISE


def test_what_nothing_determines_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a reason of its own: smaller steps do not help."""
    monkeypatch.setattr(convergence, "STILL", 0.0)
    with pytest.raises(ConvergenceError, match=r"singular position.*nothing determines it"):
        Simulation(parallelograms("ep4", STRICT, step_control=StepControl(min_dt=5e-3))).run()


def test_forces_that_round_off_decides_are_said() -> None:
    simulation = Simulation(parallelograms("ep4", STRICT))
    watch = Undetermined(sources=None)  # type: ignore[arg-type]
    simulation.run([watch])
    ((change, t, what),) = watch.state()["largest"].values()
    bound = unknown_forces.KNOWN
    assert "multiplier of revolute joints" in what
    # what is less than a millionth is not worth a word
    assert 0 < change < bound
    assert list(watch.cautions(simulation)) == []
    taken = Undetermined(sources=None)  # type: ignore[arg-type]
    taken.restore({"largest": {watch.name: (10 * bound, t, what)}})
    (caution,) = taken.cautions(simulation)
    assert caution.value == 10 * bound
    assert "known to 1.0e-05 of its largest value only, at t = 0.0" in caution.says


@pytest.mark.parametrize("dt", [0.01, 0.012])
def test_every_way_to_factorise_finds_the_same_turn_or_the_run_warns(dt: float) -> None:
    """A wheel turns by 1.2 and 1.4 rad a step; EP4 has a second solution near half a turn."""
    found = []
    for solver in [*SOLVERS, Solver(newton="modified")]:
        scene = Scene(
            "wheel",
            rigid_bodies=RigidBody("wheel", 1.0, (0.03, 0.03, 0.05)),
            joints=Revolute("hub", GROUND, "wheel", at=(0, 0, 0), axis=Z),
            initial=InitialVelocity(spin=(0.0, 0.0, 120.0)),
            probes=Probe("x", (1.0, 0.0, 0.0), component=0, body="wheel"),
            scheme="ep4",
            dt=dt,
            t_end=5 * dt,
            solver=solver,
        )
        run = sm.run(scene)
        if not any("turns by" in str(warning) for warning in run.warnings):
            found.append(1.0 + run.history.x.iloc[-1])
        else:
            assert solver.newton == "modified"
    # the scheme itself is 0.3 % behind at 1.2 rad, 0.6 % at 1.4: of the angle, 7.2 rad at most
    assert found[0] == pytest.approx(np.cos(120.0 * 5 * dt), abs=0.05)
    # each leaves less than the tolerance of 1e-9
    assert np.ptp(found) < 1e-8


@pytest.mark.parametrize("scheme", ["ep", "ep4", "ed", "ed3"])
@pytest.mark.parametrize(
    ("joint", "metre"),
    [("distance", 1.0), ("distance", 1e-3), ("revolute", 1.0), ("spherical", 1e3)],
)
def test_places_far_from_the_origin(scheme: str, joint: str, metre: float) -> None:
    """Two bodies in orbit, 100 m apart at 7e6 m from the origin: the steps that are asked for.

    Round-off of places is 1e-9 m, which a force between the bodies feels, and a body flies 2000
    times the length of the scene in a step. The tension of a tether is `3 n^2 m L/2`.
    """
    r, length, mass, rate = 7e6 * metre, 100.0 * metre, 50.0, 1.0780076e-3
    strength = rate**2 * r**3 * mass

    def gravity(at: Any, p: Any) -> Any:
        return -p["k"] / ufl.sqrt(ufl.dot(at.x, at.x))

    ends = [(r - length / 2, 0.0, 0.0), (r + length / 2, 0.0, 0.0)]
    if joint == "distance":
        tie: Any = sm.Distance("tie", "a", "b", at=ends[0], second_at=ends[1])
    elif joint == "revolute":
        tie = Revolute("tie", "a", "b", at=(r, 0, 0), axis=Z)
    else:
        tie = sm.Spherical("tie", "a", "b", at=(r, 0, 0))
    turn = 2 * np.pi / rate
    orbit = Scene(
        "orbit",
        rigid_bodies=[
            RigidBody(name, mass, (metre**2,) * 3, position=place)
            for name, place in zip("ab", ends, strict=True)
        ],
        potentials=[
            sm.Potential(f"of {name}", gravity, body=name, parameters={"k": strength})
            for name in "ab"
        ],
        joints=tie,
        initial=InitialVelocity(linear=(0, rate * r, 0), spin=(0, 0, rate), about=(r, 0, 0)),
        scheme=scheme,
        alpha=1.0 if scheme in ("ed", "ed3") else None,
        dt=turn / 200,
        t_end=turn / 20,
    )
    history = sm.run(orbit, pictures=False).history
    assert len(history) == 11 and history["rejected"].max() == 0
    if joint == "distance":
        pull = np.linalg.norm(history[[f"tie.F{k}" for k in (1, 2, 3)]].iloc[-1])
        # not round-off: of the second order in the step, and in the length over the distance
        assert pull == pytest.approx(1.5 * rate**2 * mass * length, rel=1e-3)
