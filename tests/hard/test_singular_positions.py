"""Dead points of slider-cranks, change points of a parallelogram, joints that are nearly redundant.

There constraints depend on one another for an instant. Steps pass over it. Where one that would end
near it fails, shorter ones only come nearer, so longer ones come last (`StepSize.lengthen`).
"""

from typing import Any

import numpy as np
import pytest

from shellmb.errors import ConvergenceError, SceneError
from shellmb.observers.probes import Probes
from shellmb.scene import (
    GROUND,
    InitialVelocity,
    Prismatic,
    Probe,
    Revolute,
    RigidBody,
    Scene,
    StepControl,
)
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.stepping import StepInfo, TimeSteps
from shellmb.simulate.stepsize import StepSize
from tests.hard.conftest import RIGID

Z = (0.0, 0.0, 1.0)
RATE = 3.0
# EP turns a body by `2 atan(RATE dt / 2)` in a step: the 40th ends at the change point
AT_CHANGE_POINT = 2 * np.tan((np.pi - 0.3) / 40 / 2) / RATE
Point = tuple[float, float, float]


def rod(name: str, a: Point, b: Point, mass: float = 1.0) -> RigidBody:
    """A rod in the x-y plane from its point "a" to its point "b"."""
    along = np.subtract(b, a)
    length = float(np.linalg.norm(along))
    angle = float(np.arctan2(along[1], along[0]))
    across = mass * length**2 / 12
    ends = {"a": (-length / 2, 0.0, 0.0), "b": (length / 2, 0.0, 0.0)}
    middle = tuple(np.add(a, b) / 2)
    return RigidBody(
        name, mass, (across / 10, across, across), middle, rotation=(0, 0, angle), points=ends
    )


def at(radius: float, angle: float) -> Point:
    """A point of a circle."""
    return radius * np.cos(angle), radius * np.sin(angle), 0.0


def slider_crank(coupler: float, angle: float, **more: Any) -> Scene:
    """A crank of 0.3, free to turn by its inertia, moves a slider by a coupler."""
    origin, pin = (0.0, 0.0, 0.0), at(0.3, angle)
    end = (pin[0] + np.sqrt(coupler**2 - pin[1] ** 2), 0.0, 0.0)
    return Scene(
        "slider_crank",
        rigid_bodies=[
            rod("crank", origin, pin),
            rod("coupler", pin, end, 0.5),
            RigidBody("slider", 0.3, (1e-3, 1e-3, 1e-3), position=end),
        ],
        joints=[
            Revolute("bearing", GROUND, "crank", at=origin, axis=Z),
            Revolute("pin", "crank", "coupler", at=pin, axis=Z),
            Revolute("wrist", "coupler", "slider", at=end, axis=Z),
            Prismatic("guide", GROUND, "slider", at=end, axis=(1, 0, 0)),
        ],
        initial=InitialVelocity(spin=(0, 0, 4.0), body="crank"),
        **more,
    )


def parallelogram(angle: float, **more: Any) -> Scene:
    """Two equal cranks of 0.3 on a base of 1, and a coupler of 1 between them."""
    base = np.array([1.0, 0.0, 0.0])
    origin, pin = (0.0, 0.0, 0.0), at(0.3, angle)
    other, away = tuple(base), tuple(base + pin)
    return Scene(
        "parallelogram",
        rigid_bodies=[
            rod("crank", origin, pin),
            rod("coupler", pin, away, 0.5),
            rod("rocker", away, other),
        ],
        joints=[
            Revolute("A", GROUND, "crank", at=origin, axis=Z),
            Revolute("B", "crank", "coupler", at=pin, axis=Z),
            Revolute("C", "coupler", "rocker", at=away, axis=Z),
            Revolute("D", "rocker", GROUND, at=other, axis=Z),
        ],
        # consistent: both cranks turn, the coupler goes round without turning
        initial=[
            InitialVelocity(spin=(0, 0, RATE), body="crank"),
            InitialVelocity(spin=(0, 0, RATE), about=other, body="rocker"),
            InitialVelocity(linear=(-RATE * pin[1], RATE * pin[0], 0), body="coupler"),
        ],
        **more,
    )


class Crank(BaseObserver):
    """Angle of the crank, whole turns counted, and what a closed chain may not open by."""

    def __init__(self) -> None:
        self.probes = Probes()
        self.angles: list[float] = []

    def accepted(self, simulation: Simulation) -> None:
        at = self.probes.measure()
        angle = float(np.arctan2(at["y"], at["x"]))
        before = self.angles[-1] if self.angles else angle
        self.angles.append(before + (angle - before + np.pi) % (2 * np.pi) - np.pi)

    @property
    def turned(self) -> float:
        """Angle from the first step to the last, rad."""
        return self.angles[-1] - self.angles[0]


PROBES = [Probe(n, "b", "position", c, body="crank") for n, c in (("x", 0), ("y", 1))]
RUN: dict[str, Any] = {"redundant": "drop", "probes": PROBES, "dt": 0.02}


@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
@pytest.mark.parametrize(
    ("coupler", "angle", "singular"),
    [(0.8, 0.0, np.pi), (0.301, 0.3, np.pi / 2), (0.3, 0.3, np.pi / 2)],
    ids=["start at the dead point", "nearly equal lengths", "equal lengths"],
)
def test_dead_points_of_a_slider_crank(
    scheme, alpha, coupler, angle, singular, watch, worst
) -> None:
    """With equal lengths crank and coupler fold up over the bearing, where the slider is free."""
    crank = Crank()
    scene = slider_crank(coupler, angle, scheme=scheme, alpha=alpha, t_end=2.0, **RUN)
    watched = watch(scene, crank.probes, crank)
    watched.check(worst)
    # beyond it by a tenth of a radian and more
    assert angle + crank.turned > singular + 0.1


@pytest.mark.parametrize("dt", [0.021, AT_CHANGE_POINT], ids=["between", "at"])
@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
def test_change_points_of_a_parallelogram(scheme, alpha, dt, watch, worst) -> None:
    """It may go on as a parallelogram or as an antiparallelogram; one of the steps ends there."""
    crank = Crank()
    scene = parallelogram(0.3, scheme=scheme, alpha=alpha, t_end=1.2, **{**RUN, "dt": dt})
    watched = watch(scene, crank.probes, crank)
    watched.check(worst)
    assert 0.3 + crank.turned > np.pi + 0.1


def test_steps_pass_a_position_that_none_may_end_at(plate, watch, monkeypatch) -> None:
    """Shorter steps only come nearer to it; a longer one is taken, and the run goes on."""

    def attempt(steps: TimeSteps, t: float, dt: float) -> StepInfo:
        if 0.45 <= t + dt <= 0.5:
            raise ConvergenceError("singular")
        return original(steps, t, dt)

    original = TimeSteps.attempt
    monkeypatch.setattr(TimeSteps, "attempt", attempt)
    motion = InitialVelocity(spin=(0.0, 0.1, 0.0))
    watched = watch(plate("ep", initial=motion, dt=0.1, t_end=1.0))
    assert watched.simulation.t == 1.0
    assert watched.rejected > 10


@pytest.mark.parametrize(("last", "named"), [(40, True), (20, False)])
def test_a_run_that_ends_at_a_change_point_says_so(last, named, monkeypatch) -> None:
    """Kind: some 2 % of runs that land on one to 1e-8 fail there, which round-off decides."""

    def attempt(steps: TimeSteps, t: float, dt: float) -> StepInfo:
        if simulation.step >= last:
            raise ConvergenceError("no solution; try a smaller step")
        return original(steps, t, dt)

    original = TimeSteps.attempt
    monkeypatch.setattr(TimeSteps, "attempt", attempt)
    # within 2e-4 rad of it, where round-off does not decide yet how the motion goes on
    run = {**RUN, "dt": AT_CHANGE_POINT * (1 - 7e-5)}
    simulation = Simulation(parallelogram(0.3, scheme="ep", t_end=1.2, **run))
    with pytest.raises(ConvergenceError) as failed:
        simulation.run()
    found = "of 'D' nearly depends on those of 'A', 'B', 'C'" in str(failed.value)
    assert found == named == ("try a smaller step" not in str(failed.value))


def test_a_start_at_a_change_point_is_told() -> None:
    """There one more constraint seems redundant: without it the chain would open."""
    with pytest.raises(SceneError, match="4 of the constraints are redundant"):
        Simulation(parallelogram(0.0, scheme="ep", dt=0.02, t_end=1.0))
    simulation = Simulation(parallelogram(0.0, scheme="ep", t_end=1.0, **RUN))
    with pytest.raises(ConvergenceError, match=r"t = 0: joint 'D' opens by .*left out as"):
        simulation.run()


def test_longer_steps_are_tried_where_shorter_ones_lead_nowhere() -> None:
    size = StepSize(StepControl(min_dt=0.2), nominal=1.0)
    assert not size.lengthen(), "before anything has failed"
    size.reject(1.0)
    assert not size.lengthen(), "there is no longer step than the one that failed"
    size.accept(None)
    tried = []
    dt = size.dt
    while size.reject(dt) or size.lengthen():
        dt = size.dt
        tried.append(dt)
    # from 0.5, which was accepted and now fails, down; then what is longer than that
    assert tried == [0.25, 0.2, 1.0]
    assert size.failed(dt) == "dt = 1, and those down to 0.2"
    size.accept(None)
    assert size.failed(dt) == "dt = 1"
    assert not size.reject(0.2)
