"""Beams that several tests use, and what happens at their ends."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import Beam, GeneralSection, Line, Probe, Scene

AXES = "xyz"


def probes(point: str, *quantities: str) -> tuple[Probe, ...]:
    """All components of quantities at a point of the only beam."""
    return tuple(
        Probe(f"{point}_{quantity}_{axis}", point, quantity=quantity, component=k)
        for quantity in quantities
        for k, axis in enumerate(AXES)
    )


@pytest.fixture
def record() -> Callable[..., tuple[Probe, ...]]:
    """All components of quantities at a point of the only beam."""
    return probes


@pytest.fixture
def last() -> Callable[..., np.ndarray]:
    """A probed vector after the last step of a scene's run."""

    def vector(run: Any, point: str = "end", quantity: str = "displacement") -> np.ndarray:
        row = run.history.iloc[-1]
        return np.array([row[f"{point}_{quantity}_{axis}"] for axis in AXES])

    return vector


@pytest.fixture
def solve() -> Callable[..., Any]:
    """Run a static scene of one beam in one load step, both ends probed."""

    def run(beam: Beam, *quantities: str, steps: int = 1, **more: Any) -> Any:
        at_end = probes("end", "displacement", *quantities)
        at_start = probes("start", "force", "moment") if "force" in quantities else ()
        scene = Scene(
            "beam", beams=beam, probes=(*at_end, *at_start), scheme="static", dt=1 / steps, **more
        )
        return execute(scene)

    return run


@pytest.fixture
def coupled() -> np.ndarray:
    """A positive definite stiffness with couplings of all forces and moments."""
    A = np.random.default_rng(5).normal(size=(6, 6))
    scale = np.diag([30.0, 20.0, 20.0, 1.0, 1.0, 1.5])
    return np.asarray(scale @ (np.eye(6) + 0.05 * A @ A.T) @ scale)


@pytest.fixture
def flying() -> Callable[..., Beam]:
    """A soft straight beam with an eccentric, coupled section: what steps of 0.1 can resolve."""

    def make(**more: Any) -> Beam:
        stiffness = np.diag([20.0, 10.0, 10.0, 0.3, 0.3, 0.4])
        stiffness[0, 5] = stiffness[5, 0] = 0.5
        stiffness[3, 4] = stiffness[4, 3] = 0.05
        section = GeneralSection(
            stiffness,
            mass_per_length=1.0,
            first_moments=(0.03, -0.02),
            second_moments=(0.02, 0.002, 0.03),
        )
        return Beam("beam", Line((0, 0, 0), (1, 0, 0)), section, elements=2, **more)

    return make
