"""Products of Jacobians with vectors, cell by cell, are those of their matrices."""

import numpy as np
import pytest

from shellmb.scene import Scene
from shellmb.simulate.simulation import Simulation
from shellmb.system.newton.bordered import Products
from tests.sensitivity import scenes
from tests.sensitivity.path_scenes import bent, frame

# supports and a motion that is given; joints and links; a coupling of two shells
SCENES = {"bent": bent, "frame": frame, "meeting": scenes.meeting}


def moved(scene: Scene) -> Simulation:
    """A simulation at a state that is in no way special."""
    simulation = Simulation(scene)
    simulation.advance()
    system = simulation.problem.system
    system.x.array[:] += 1e-3 * np.random.default_rng(1).normal(size=len(system.x.array_r))
    system.x.array[system.fixed] = system.fixed_values()
    system.scatter(system.x)
    return simulation


@pytest.mark.parametrize("name", SCENES)
def test_products_are_those_of_the_matrix(name: str) -> None:
    system = moved(SCENES[name]()).problem.system
    assert bool(system.couplings) == (name == "meeting")
    given, exact, found = (system.x.duplicate() for _ in range(3))
    given.array[:] = np.random.default_rng(2).normal(size=len(given.array_r))
    products = Products(system)
    for _ in range(2):
        system.jacobian(system.x, system.A)
        system.A.mult(given, exact)
        products(given, found)
        # round-off of sums in another order; 3e-16 was seen
        wrong = np.abs(found.array_r - exact.array_r).max()
        assert wrong <= 1e-14 * np.abs(exact.array_r).max()
        # at another state, and with other loads
        system.x.array[:] *= 1.5
        system.scatter(system.x)
