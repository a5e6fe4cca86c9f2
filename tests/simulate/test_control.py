"""Step control: halving where Newton fails, growing back, following the jump; failures in words."""

import numpy as np
import pytest

from shellmb.errors import ConvergenceError
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Isotropic,
    Rectangle,
    Scene,
    Shell,
    Solver,
    StepControl,
)
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.stepsize import JUMP_ORDER, StepSize

SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.1, density=1.0)
STRIP = Shell("strip", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1))


def scene(scheme: str = "ed", **more: object) -> Scene:
    choices: dict[str, object] = {"dt": 0.1, "t_end": 1.0, "supports": Clamped("left")}
    choices |= {"alpha": 1.0} if scheme == "ed" else {}
    choices |= {"loads": EdgeForce("right", (0.0, 0.0, 5e-3))}
    return Scene("strip", STRIP, scheme=scheme, **(choices | more))  # type: ignore[arg-type]


class Steps(BaseObserver):
    """Lengths and jumps of the accepted steps."""

    def __init__(self) -> None:
        self.dt: list[float] = []
        self.jump: list[float | None] = []

    def solved(self, simulation: Simulation) -> None:
        assert simulation.last is not None
        self.dt.append(simulation.last.dt)
        self.jump.append(simulation.last.jump)


def test_step_size_shrinks_and_grows_back() -> None:
    size = StepSize(StepControl(min_dt=0.1, patience=2), nominal=1.0)
    assert size.reject(size.dt)
    assert size.reject(size.dt)
    assert (size.dt, size.rejected) == (0.25, 2)
    dts = []
    for _ in range(5):
        size.accept(None)
        dts.append(size.dt)
    assert dts == [0.25, 0.5, 0.5, 1.0, 1.0]


def test_step_size_gives_up_at_the_smallest() -> None:
    size = StepSize(StepControl(min_dt=0.4), nominal=1.0)
    assert size.reject(size.dt)
    assert size.reject(size.dt)
    assert size.dt == 0.4
    assert not size.reject(size.dt)


def test_step_size_survives_a_restart() -> None:
    first = StepSize(StepControl(), nominal=1.0)
    first.reject(first.dt)
    first.accept(None)
    second = StepSize(StepControl(), nominal=1.0)
    second.restore(first.state())
    assert second.state() == first.state()


def test_a_failed_step_is_halved_and_grows_back() -> None:
    """One step of the whole load needs more iterations than are allowed, smaller ones do not."""
    control = StepControl(patience=2)
    strip = scene(
        "static",
        dt=1.0,
        t_end=1.0,
        loads=EdgeForce("right", (0.0, 0.0, 3e-4)),
        solver=Solver(max_iterations=4),
        step_control=control,
    )
    steps = Steps()
    simulation = Simulation(strip)
    simulation.run([steps])
    assert simulation.size.rejected > 0
    assert sum(steps.dt) == pytest.approx(1.0, rel=1e-12)
    assert min(steps.dt) < 0.6
    # the same end as with all the iterations it takes
    whole = Simulation(scene("static", dt=1.0, loads=strip.loads))
    whole.run()
    a, b = (s.problem.levels["strip"].q.x.array for s in (simulation, whole))
    np.testing.assert_allclose(a, b, atol=1e-8)


def test_a_failure_names_time_step_and_field() -> None:
    strip = scene(
        "static", dt=1.0, solver=Solver(max_iterations=2), step_control=StepControl(min_dt=0.5)
    )
    simulation = Simulation(strip)
    with pytest.raises(ConvergenceError, match=r"t = 0, step 1, dt = 0\.5: .*strip") as caught:
        simulation.run()
    assert caught.value.field is not None
    assert caught.value.norms


def test_the_last_step_ends_at_the_end() -> None:
    steps = Steps()
    simulation = Simulation(scene("ep", dt=0.3))
    simulation.run([steps])
    np.testing.assert_allclose(steps.dt, [0.3, 0.3, 0.3, 0.1], rtol=1e-12)
    assert simulation.t == 1.0


def test_the_jump_has_the_order_that_the_control_assumes() -> None:
    jumps = []
    dts = (0.1, 0.05, 0.025)
    for dt in dts:
        steps = Steps()
        strip = scene(dt=dt, loads=EdgeForce("right", (0, 0, 5e-3), time=lambda t: np.sin(t) ** 4))
        Simulation(strip).run([steps])
        jumps.append(steps.jump[-1])
    order = np.polyfit(np.log(dts), np.log(jumps), 1)[0]
    assert order == pytest.approx(JUMP_ORDER, abs=0.3)


def test_the_accuracy_follows_the_tolerance_of_the_jump() -> None:
    load = EdgeForce("right", (0, 0, 5e-3), time=lambda t: np.sin(2 * t) ** 4)
    ends, counts = [], []
    for tolerance in (1e-3, 1e-4, 1e-5):
        control = StepControl(jump_tolerance=tolerance, min_dt=1e-4)
        steps = Steps()
        simulation = Simulation(scene(dt=0.2, t_end=1.0, loads=load, step_control=control))
        simulation.run([steps])
        assert max(steps.jump) <= tolerance
        counts.append(len(steps.dt))
        ends.append(simulation.problem.levels["strip"].q.x.array.copy())
    fine = Simulation(scene(dt=0.01, t_end=1.0, loads=load))
    fine.run()
    body = fine.model.shells["strip"]
    exact = fine.problem.levels["strip"].q.x.array
    place = body.mixed.dofs["u"]
    errors = [float(np.max(np.abs(end[place] - exact[place]))) for end in ends]
    assert counts[0] < counts[1] < counts[2]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-4
