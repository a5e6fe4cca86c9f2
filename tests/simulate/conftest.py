"""Scenes that several tests use."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from shellmb.scene import Scene
from shellmb.simulate.simulation import Simulation


@pytest.fixture
def run() -> Callable[[Scene], Simulation]:
    """Run a scene to its end."""

    def to_end(scene: Scene, *observers: Any) -> Simulation:
        simulation = Simulation(scene)
        simulation.run(observers)
        return simulation

    return to_end


@pytest.fixture
def at() -> Callable[..., np.ndarray]:
    """Displacement of the node of a shell at a point."""

    def displacement(simulation: Simulation, shell: str, point: tuple[float, ...]) -> np.ndarray:
        body = simulation.model.shells[shell]
        nodes = body.mixed.nodes("u")
        distance = np.linalg.norm(nodes - np.asarray(point), axis=1)
        node = int(np.argmin(distance))
        assert distance[node] < 1e-9
        u = simulation.problem.levels[shell].unknown["f"].x.array[body.mixed.dofs["u"]]
        return u.reshape(-1, 3)[node].copy()

    return displacement
