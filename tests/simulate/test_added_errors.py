"""What errors of steps that follow a tolerance add up to over a motion: kept, or said."""

from dataclasses import replace
from functools import cache

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.demos.verification.problems.mechanisms import RigidPath, double_pendulum
from shellmb.diagnostics.steps import ADDED, StepErrors
from shellmb.scene import (
    Beam,
    CircularSection,
    Clamped,
    InitialVelocity,
    Line,
    PointForce,
    RigidBody,
    Scene,
    StepControl,
)
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.stepsize import ErrorSize


@pytest.mark.parametrize("scheme", ["ep4", "ed3"])
def test_small_tolerances_are_kept_over_a_few_radians(scheme: str) -> None:
    """Kind: a number that high orders miss by what motions have of radians.

    A pendulum of two arms falls for a second, against steps of a three-hundredth, whose
    error is of 1e-11.
    """
    exact, alpha = RigidPath("b"), 0.3 if scheme == "ed3" else 0.0
    Simulation(double_pendulum("ep4", 0.0, 300, t_end=1.0)).run([exact])
    scene = double_pendulum(scheme, alpha, 400, t_end=1.0)
    for tolerance in (1e-6, 1e-7)[: 1 if scheme == "ed3" else 2]:
        control = StepControl(step_error=tolerance, max_dt=1.0)
        path, simulation = RigidPath("b"), Simulation(replace(scene, step_control=control))
        simulation.run([path])
        missed = np.max(np.abs(path.positions[-1] - exact.positions[-1]))
        # found 0.05 (ep4) and 0.5; twice the tolerance without the share of a radian
        assert missed < 1.2 * tolerance, tolerance
        assert isinstance(simulation.size, ErrorSize)
        assert simulation.size.total < ADDED * tolerance


def test_higher_orders_are_asked_for_more_radians_at_no_more_than_half_the_steps_again() -> None:
    for order in (1, 2, 3, 4):
        size = ErrorSize(StepControl(step_error=1e-3), 1.0, t_end=100.0, order=order)
        assert (size.radians > 2.5) == (order > 2)
        assert size.radians ** (1 / order) < 1.5
        # what is more than its share is rejected
        assert size.too_large(1.01e-3 / size.radians) and not size.too_large(0.99e-3 / size.radians)


@cache
def spun() -> np.ndarray:
    """Directors at the end; with half the step they are the same to 2e-8."""
    return directors(spinning("ep4", None, 1e-2))


def directors(simulation: Simulation) -> np.ndarray:
    rigid = simulation.model.rigid
    assert rigid is not None
    return simulation.problem.state(rigid.name).x.array[rigid.local("body", "w")].copy()


# the motion that a tolerance is for
RADIANS = {"ep": "a radian", "ep4": "3.8 radians", "ed3": "2.7 radians"}


def spinning(scheme: str, tolerance: float | None, dt: float) -> Simulation:
    """A free body that turns about an axis near its stablest one: 36 radians and more."""
    control = StepControl(step_error=tolerance)
    scene = Scene(
        "free",
        rigid_bodies=RigidBody("body", 1.0, (1.0, 2.0, 3.0)),
        initial=InitialVelocity(spin=(0.1, 0.1, 3.0)),
        scheme=scheme,
        dt=dt,
        t_end=12.0,
        step_control=control,
    )
    simulation = Simulation(scene)
    watch = StepErrors(sources=None)  # type: ignore[arg-type]
    simulation.run([watch])
    said = [caution.says for caution in watch.cautions(simulation)]
    assert len(said) == (tolerance is not None)
    assert all(f"is for {RADIANS[scheme]} of motion" in words for words in said)
    assert all(("spinning bodies lag" in words) == (scheme == "ed3") for words in said)
    return simulation


@pytest.mark.parametrize(
    ("scheme", "tolerance"), [("ep", 1e-3), ("ep4", 1e-5), ("ep4", 1e-7), ("ed3", 1e-5)]
)
def test_what_errors_add_up_to_is_known(scheme: str, tolerance: float) -> None:
    """Kind: a number that is missed over a long motion and not said. The bound is one."""
    simulation = spinning(scheme, tolerance, 5e-3)
    error, size = float(np.max(np.abs(directors(simulation) - spun()))), simulation.size
    assert isinstance(size, ErrorSize)
    assert size.total > ADDED * tolerance
    bound = size.total + (size.lag if scheme == "ed3" else 0.0)
    # the component that is worst, at the end: between a tenth of it and all of it
    assert 0.1 * bound < error < 1.5 * bound


@pytest.mark.parametrize("scheme", ["ep4", pytest.param("ed3", marks=pytest.mark.slow)])
def test_first_steps_are_short_enough_for_forces_that_begin_to_act(scheme: str) -> None:
    """Kind: there are no steps before the first ones by which their error is known."""
    section = CircularSection(E=1e4, nu=0.3, radius=0.05, density=100.0)
    beam = Beam("arm", Line((0, 0, 0), (1, 0, 0)), section, elements=2)

    def end(name: str, dt: float, tolerance: float | None) -> float:
        scene = Scene(
            "arm",
            beams=beam,
            supports=Clamped("start"),
            loads=PointForce("end", (0, 0, 0.5), time=lambda t: float(np.sin(2 * t))),
            scheme=name,
            dt=dt,
            t_end=1.0,
            step_control=StepControl(
                step_error=tolerance, max_dt=None if tolerance is None else 1.0
            ),
        )
        simulation = Simulation(scene)
        simulation.run()
        body = simulation.model.beams["arm"]
        q = simulation.problem.levels["arm"].q.x.array
        return float(np.abs(q[body.mixed.dofs["u"]]).max())

    # twice the tolerance, and more the smaller it is, if the first step is the scene's
    missed = abs(end(scheme, 0.1, 1e-6) - end("ep4", 5e-3, None))
    # found 0.09 (ep4) and 0.34
    assert missed < 1e-6
