"""Steps that are tried and taken back leave no trace; inputs and their work; what is refused.

The kind: any motion with a memory beside its state, so first guesses, step sizes, controllers,
latches, contact pairs, accounts, and any scheme and Newton's method.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.demos.own_body import fall
from shellmb.observers.account.momentum import Momentum
from shellmb.scene.control.signals import named_inputs

STEEL = sm.Isotropic(E=1e7, nu=0.3, thickness=0.01, density=1000.0)


def strip(scheme: str = "ep", **more: Any) -> sm.Scene:
    """A clamped strip, pushed at its tip."""
    push = sm.PointForce((1.0, 0.0, 0.0), (0, 0, 1.0), time=sm.Input("push", linear=True))
    return sm.Scene(
        "strip",
        sm.Shell("strip", sm.Rectangle(1.0, 0.2), STEEL, mesh=(4, 1)),
        supports=sm.Clamped("left"),
        loads=[push, sm.Gravity()] if "linear" not in scheme else push,
        probes=sm.Probe("tip", (1.0, 0.0, 0.0)),
        scheme=scheme,
        **{"dt": 0.01, "t_end": 1.0, **more},
    )


def arm(scheme: str = "ep", **more: Any) -> sm.Scene:
    """An arm with a controller, a motor, a latch and a driven second link, all by inputs."""
    acting: dict[str, Any] = {
        "loads": sm.Gravity(),
        "drivers": sm.Driver("drive", "wrist", rotation=sm.Input("turn", linear=True)),
        "locks": sm.Lock("hinge", when=sm.Sensor("hinge.rotation") <= -0.02),
        "force_elements": [
            sm.Motor("motor", "shoulder", command=sm.Command("pid")),
            sm.Motor("more", "shoulder", command=sm.Input("torque", 1.0, unit="N.m")),
        ],
        "controllers": sm.PID(
            "pid",
            sm.Sensor("shoulder.rotation"),
            target=sm.Input("aim"),
            kp=80.0,
            ki=100.0,
            kd=15.0,
            period=0.01,
        ),
    }
    return sm.Scene(
        "arm",
        rigid_bodies=[
            sm.RigidBody("arm", 2.0, (1e-3, 0.17, 0.17), com=(0.5, 0, 0)),
            sm.RigidBody("tool", 0.5, (1e-3, 0.01, 0.01), com=(1.2, 0, 0)),
            sm.RigidBody("flap", 0.5, (1e-3, 0.01, 0.01), com=(1.2, 0, 1)),
        ],
        joints=[
            sm.Revolute("shoulder", sm.GROUND, "arm", at=(0, 0, 0), axis=(0, -1, 0)),
            sm.Revolute("wrist", "arm", "tool", at=(1, 0, 0), axis=(0, -1, 0)),
            sm.Revolute("hinge", sm.GROUND, "flap", at=(1, 0, 1), axis=(0, -1, 0)),
        ],
        scheme=scheme,
        **{**acting, "dt": 5e-3, "t_end": 1.0, **more},
    )


def bare(scheme: str, motor: Any = None, **more: Any) -> sm.Scene:
    """The arm with one motor, without controller and latch."""
    motor = motor or arm().force_elements[1]
    return arm(scheme, controllers=(), locks=(), force_elements=motor, **more)


def drop(scheme: str = "ep", **more: Any) -> sm.Scene:
    """A small plate falls on a strip whose faces it touches."""
    return sm.Scene(
        "drop",
        [
            sm.Shell("strip", sm.Rectangle(1.0, 0.3), STEEL, mesh=(4, 1)),
            sm.Shell(
                "plate", sm.Rectangle(0.2, 0.2, origin=(0.4, 0.05, 0.006)), STEEL, mesh=(1, 1)
            ),
        ],
        supports=[sm.Clamped("left", body="strip"), sm.Clamped("right", body="strip")],
        contacts=sm.Contact("touch", sm.Faces("strip", 0.01), 1e6, body="plate", smoothing=1e-4),
        loads=[
            sm.Gravity(body="plate"),
            sm.SurfaceForce((0, 0, -10.0), body="plate", time=sm.Input("push")),
        ],
        scheme=scheme,
        **{"dt": 5e-3, "t_end": 1.0, **more},
    )


def followed(make: Callable[[], sm.Scene], tries: Any, dt: float) -> Any:
    """States and outputs of some steps, before each of which others are tried and rejected."""
    motion = sm.SceneMotion(make())
    found = []
    for k in range(6):
        before = motion.outputs
        for number, length in enumerate(tries):
            for name in motion.inputs:
                motion.inputs[name] = 0.5 + 0.1 * number
            motion.trial(length)
            if number:
                motion.reject()
                np.testing.assert_array_equal(list(motion.outputs.values()), list(before.values()))
        for name in motion.inputs:
            motion.inputs[name] = 0.05 * math.sin(k + 1)
        motion.trial(dt)
        motion.accept()
        arrays = {n: a.copy() for n, a in motion.simulation.arrays().items()}
        found.append((motion.outputs, arrays))
    return found, motion


@pytest.mark.parametrize(
    ("make", "dt"),
    [
        (lambda: strip("ep", solver=sm.Solver(newton="full")), 0.01),
        (lambda: strip("ed3"), 0.02),
        (lambda: strip("linear-dynamics"), 0.015),
        (lambda: arm("ep4"), 0.01),
        (lambda: arm("ed", step_control=sm.StepControl(step_error=1e-4)), 0.015),
        (lambda: drop("ep"), 0.02),
    ],
    ids=["full", "quadratic", "linear", "controlled", "by its error", "contact"],
)
def test_rejected_steps_leave_no_trace(make: Callable[[], sm.Scene], dt: float) -> None:
    plain, _ = followed(make, (), dt)
    tried, _ = followed(make, (dt / 2, 2 * dt, dt, 1.3 * dt), dt)
    for (outputs, arrays), (others, there) in zip(plain, tried, strict=True):
        assert list(outputs) == list(others)
        np.testing.assert_array_equal(list(outputs.values()), list(others.values()))
        assert list(arrays) == list(there)
        for name, array in arrays.items():
            np.testing.assert_array_equal(array, there[name], err_msg=name)
    last = plain[-1][0]
    assert last["t"] == pytest.approx(6 * dt, rel=1e-14)
    # round-off of the energies that are exchanged, 0.1 to 10 J
    assert abs(last["energy_balance"]) < 1e-11


def test_an_impact_that_is_tried_twice_counts_once() -> None:
    """A lock begins to act in a step that is taken back: its impulse is that of the step taken."""
    drifts = []
    for tries in (1, 3):
        motion = sm.SceneMotion(arm("ep", locks=sm.Lock("hinge", active=(0.02, 1.0))))
        for _ in range(5):
            for _ in range(tries):
                motion.trial(0.01)
                # books the step
                assert motion.outputs["t"] == motion.time
            motion.accept()
        (momentum,) = (o for o in motion._observers if isinstance(o, Momentum))
        drifts.append(momentum.drift)
    assert drifts[1] == drifts[0]
    assert max(drifts[0].values()) < 1e-10


@pytest.mark.parametrize("scheme", ["ep", "ed3"])
def test_own_bodies_take_steps_back(scheme: str) -> None:
    def followed(tries: tuple[float, ...]) -> tuple[Any, dict[str, float], float]:
        motion = fall(scheme, 0.5 if scheme == "ed3" else 0.0, 0.01, 2)
        for _ in range(3):
            before = motion.energies, motion.u("chain").x.array.copy()
            for dt in tries:
                motion.trial(dt)
                motion.reject()
                assert motion.energies == before[0]
                np.testing.assert_array_equal(motion.u("chain").x.array, before[1])
            motion.trial(0.01)
            motion.accept()
        return motion.u("chain").x.array, motion.energies, motion.time

    plain, tried = followed(()), followed((0.005, 0.02))
    np.testing.assert_array_equal(plain[0], tried[0])
    assert plain[1:] == tried[1:]
    # steps after a trial that was rejected stay, and have the motion's own length
    mixed = fall(scheme, 0.5 if scheme == "ed3" else 0.0, 0.01, 2)
    mixed.trial(0.005)
    with pytest.raises(sm.SceneError, match=r"step: there is a trial; call accept\(\)"):
        mixed.step()
    mixed.reject()
    mixed.step(3)
    assert mixed.time == plain[2]
    there = mixed.u("chain").x.array
    mixed.trial(0.005)
    mixed.reject()
    np.testing.assert_array_equal(mixed.u("chain").x.array, there)
    # the steps of `step` are the same ones
    steps = fall(scheme, 0.5 if scheme == "ed3" else 0.0, 0.01, 5)
    assert steps.time == plain[2]
    np.testing.assert_allclose(plain[0], steps.u("chain").x.array, rtol=0, atol=1e-13)


def test_exchanged_steps_are_those_of_a_run() -> None:
    """Three substeps each, by another program's step: the history of `sm.run` to round-off."""
    run = sm.run(strip("ep4", t_end=0.12), pictures=False)
    motion = sm.SceneMotion(strip("ep4", t_end=0.12))
    for k in range(4):
        motion.trial(0.03)
        motion.accept()
        row = run.history.iloc[3 * (k + 1)]
        assert motion.time == pytest.approx(row["t"], rel=1e-14)
        for name in ("tip", "kinetic_energy", "strain_energy", "work_loads"):
            # energies of 1e-3 J are sums of terms of 1 J
            assert motion.outputs[name] == pytest.approx(row[name], rel=1e-10, abs=1e-13)
    with pytest.raises(sm.SceneError, match=r"ends after t_end of the scene, which is 0.12"):
        motion.trial(0.01)


def test_work_of_inputs_is_that_of_what_they_act_on() -> None:
    """Of loads, a motor and a driver: each alone, then all, beside the terms of the balance."""
    motion = sm.SceneMotion(
        arm("ep4", loads=(), controllers=(), force_elements=arm().force_elements[1])
    )
    for k in range(6):
        motion.inputs["torque"] = 2.0 + k
        motion.inputs["turn"] = 0.1 * math.sin(k + 1)
        motion.trial(0.01)
        motion.accept()
    out = motion.outputs
    both = out["work_terms"] + out["work_supports"]
    assert abs(out["work_terms"]) > 1e-3
    assert abs(out["work_supports"]) > 1e-3
    assert out["work_inputs"] == pytest.approx(both, rel=1e-11)
    # torque over the turned angle, where the torque is the same
    motion = sm.SceneMotion(
        arm("ep", controllers=(), locks=(), force_elements=arm().force_elements[1])
    )
    motion.inputs["torque"] = 3.0
    motion.trial(0.05)
    angle = motion.outputs["shoulder.rotation"]
    assert motion.outputs["work_inputs"] == pytest.approx(3.0 * angle, rel=1e-10)
    # a force over the way of its point, where other loads work, too
    motion = sm.SceneMotion(strip("ep"))
    motion.inputs["push"] = 2.0
    motion.trial(0.01)
    motion.accept()
    before = motion.outputs
    motion.trial(0.01)
    after = motion.outputs
    # from then on it is constant
    moved = after["tip"] - before["tip"]
    assert after["work_inputs"] - before["work_inputs"] == pytest.approx(2.0 * moved, rel=1e-11)
    assert abs(after["work_loads"] - after["work_inputs"]) > 1e-5


def test_a_run_has_the_defaults_of_inputs() -> None:
    item = sm.Motor("more", "shoulder", command=sm.Input("torque", 1.0))
    law = sm.Motor("more", "shoulder", law=lambda x, rate, t: 1.0)
    angles = []
    for motor in (item, law):
        run = sm.run(bare("ep", motor, dt=0.01, t_end=0.03, loads=()), pictures=False)
        angles.append(run.history["shoulder.rotation"].iloc[-1])
    assert angles[0] == pytest.approx(angles[1], rel=1e-12)
    assert angles[0] > 0


@pytest.mark.parametrize("start", ["given", "equilibrium", "motor"])
def test_values_from_the_start_on_are_in_place_of_defaults(start: Any) -> None:
    """Kind: loads that would ramp, equilibria, motors and targets; the scene stays as it is."""

    def pushed(default: float) -> sm.Scene:
        push = sm.PointForce(
            (1.0, 0.0, 0.0), (0, 0, 1.0), time=sm.Input("push", default, linear=True)
        )
        motor = sm.Motor("more", "shoulder", command=sm.Input("torque", default))
        made = bare("ep", motor, dt=0.01) if start == "motor" else strip("ep", start=start)
        return made if start == "motor" else replace(made, loads=push)

    scene = pushed(0.25)
    ends = []
    for motion in (
        sm.SceneMotion(scene, start={"torque" if start == "motor" else "push": 0.5}),
        sm.SceneMotion(pushed(0.5)),
        sm.SceneMotion(scene),
    ):
        # nothing that is looked at before the first step finds the default
        for name, places in named_inputs(motion.simulation.scene).items():
            assert [one.line[2:] for one in places] == [(motion.inputs[name],) * 2]
        motion.trial(0.02)
        motion.accept()
        ends.append(motion.outputs)
    assert ends[0] == ends[1]
    assert ends[0] != ends[2]
    if start == "given":
        with pytest.raises(sm.SceneError, match=r"'turn': it starts with 0.5, and moves a support"):
            sm.SceneMotion(arm(), start={"turn": 0.5})
        with pytest.raises(sm.SceneError, match=r"'push': it is nan; it must be a finite number"):
            sm.SceneMotion(scene, start={"push": math.nan})


def test_a_failed_step_loses_nothing() -> None:
    """A step of which no part can be solved is refused; a smaller input then goes on."""
    few, short = sm.Solver(max_iterations=6), sm.StepControl(min_dt=5e-3)
    scene = strip("ep", solver=few, step_control=short)
    motion, other = sm.SceneMotion(scene), sm.SceneMotion(scene)
    for each in (motion, other):
        each.trial(0.01)
        each.accept()
    before = motion.outputs
    motion.inputs["push"] = 1e7
    with pytest.raises(sm.ConvergenceError, match=r"t = 0.01"):
        motion.trial(0.02)
    assert motion.outputs == before
    with pytest.raises(sm.SceneError, match="there is no trial"):
        motion.accept()
    for each in (motion, other):
        each.inputs["push"] = 1.0
        each.trial(0.01)
        each.accept()
    assert motion.outputs == other.outputs


def test_refused() -> None:
    motion = sm.SceneMotion(strip())
    with pytest.raises(sm.SceneError, match=r"there is no input 'pull'; the scene has 'push'"):
        motion.inputs["pull"] = 1.0
    for value in (math.nan, math.inf, "1", True, None):
        with pytest.raises(sm.SceneError, match=r"input 'push': it is .*must be a finite number"):
            motion.inputs["push"] = value  # type: ignore[assignment]
    for dt in (0.0, -1.0, math.nan, math.inf, True, "1"):
        with pytest.raises(sm.SceneError, match=r"trial: dt is .*; it must be finite and greater"):
            motion.trial(dt)  # type: ignore[arg-type]
    with pytest.raises(sm.SceneError, match=r"ends after t_end of the scene, which is 1; it must"):
        motion.trial(1.5)
    with pytest.raises(sm.SceneError, match=r"there is no output 'top'; the motion has"):
        motion.outputs["top"]
    with pytest.raises(sm.SceneError, match=r"nodes: there is no body 'top'"):
        motion.nodes("top")
    for act in (motion.accept, motion.reject):
        with pytest.raises(sm.SceneError, match=r"there is no trial; call trial\(dt\) first"):
            act()
    for state in (None, ("a", {}), sm.SceneMotion(strip("ed")).state()):
        with pytest.raises(sm.SceneError, match=r"take_up: state is none of \['"):
            motion.take_up(state)  # type: ignore[arg-type]
    with pytest.raises(sm.SceneError, match=r"scheme is 'static', which has no time"):
        sm.SceneMotion(strip("static"))
    with pytest.raises(sm.SceneError, match=r"prescribes a motion.* must be linear=True"):
        arm(drivers=sm.Driver("drive", "wrist", rotation=sm.Input("turn")))
    with pytest.raises(sm.SceneError, match=r"inputs of one name must be equal"):
        sm.Scene(
            "two",
            sm.Shell("strip", sm.Rectangle(1.0, 0.2), STEEL, mesh=(1, 1)),
            scheme="ep",
            loads=[
                sm.Pressure(1.0, time=sm.Input("p", 1.0)),
                sm.SurfaceForce((0, 0, 1), time=sm.Input("p")),
            ],
            dt=0.1,
            t_end=1.0,
        )

    with pytest.raises(sm.SceneError, match=r"input 'heat': it stands where nothing takes it"):
        sm.Scene(
            "hot",
            sm.Shell(
                "strip",
                sm.Rectangle(1.0, 0.2),
                STEEL,
                mesh=(1, 1),
                natural=sm.NaturalStrain((1e-4, 1e-4, 0.0), time=sm.Input("heat")),
            ),
            scheme="ep",
            dt=0.1,
            t_end=1.0,
        )

    class Law:
        """A function of time with a memory."""

        def __call__(self, t: float) -> float:
            return t

    with pytest.raises(sm.SceneError, match=r"may keep a memory of its own"):
        sm.SceneMotion(_with_law(Law()))


def _with_law(law: Any) -> sm.Scene:
    return sm.Scene(
        "law",
        sm.Shell("strip", sm.Rectangle(1.0, 0.2), STEEL, mesh=(1, 1)),
        loads=sm.Pressure(1.0, time=law),
        scheme="ep",
        dt=0.1,
        t_end=1.0,
    )
