"""Several parameters at a time have the derivatives that each has by itself.

The kind: solutions that share factors, passes and vectors must not see one another.
"""

from typing import Any

import numpy as np
import pytest

from shellmb.observers.probes import Probes
from shellmb.sensitivity.parameters import differentiated
from shellmb.sensitivity.perturbed_run import PerturbedRun
from shellmb.sensitivity.tangent import Pair, Tangents
from shellmb.simulate.simulation import Simulation

NAMES = ("thickness", "force")


def states(mesh: tuple[int, int], names: tuple[str, ...], steps: int) -> tuple[Simulation, Any]:
    """A run of steps, and differences of the states at both sides of each parameter."""
    made = differentiated("sudden_load", None, mesh=mesh, scheme="ep", newton="auto")
    base = made.scene()

    def make(run: Simulation) -> list[Pair]:
        found = []
        for p in made.parameters(names):
            above, below = (
                PerturbedRun(Simulation(scene, like=run), [Probes()], False)
                for scene in made.beside(base, p)
            )
            found.append(Pair(p, above, below))
        return found

    run, tangents = Simulation(base), Tangents(make)
    tangents.start(run)
    for _ in range(steps):
        run.advance([tangents])
    found = {}
    for pair in tangents.pairs:
        above, below = (next(iter(side.simulation.live().values())) for side in pair.sides)
        found[pair.parameter.name] = above - below
    return run, found


# 6256 reduced unknowns have factors of MUMPS that solve for all at once
@pytest.mark.parametrize("mesh", [(6, 2), pytest.param((32, 12), marks=pytest.mark.slow)])
def test_each_has_the_derivatives_that_it_has_alone(mesh: tuple[int, int]) -> None:
    _, both = states(mesh, NAMES, 4)
    for name in NAMES:
        _, alone = states(mesh, (name,), 4)
        # the iteration ends at 1e-9 of motions and 1e-7 of forces, whose round-off is as large
        assert np.abs(both[name] - alone[name]).max() <= 1e-6 * np.abs(alone[name]).max()


@pytest.mark.slow
def test_solutions_at_once_are_those_one_by_one() -> None:
    run, _ = states((32, 12), ("force",), 3)
    linear, b = run.problem.iteration.linear, run.problem.system.b
    assert linear.solver.many  # type: ignore[attr-defined]
    given, found = ([b.duplicate() for _ in range(3)] for _ in range(2))
    random = np.random.default_rng(0)
    for vector in given:
        vector.array[:] = 1e-6 * random.standard_normal(b.getLocalSize())
    linear.solve_many(given[:2], found[:2])
    linear.solve_many(given, found)
    one = b.duplicate()
    for vector, several in zip(given, found, strict=True):
        linear.solve(vector, one, False)
        error = np.abs(one.array_r - several.array_r).max() / np.abs(one.array_r).max()
        # round-off, which a thin plate enlarges: 1e-14 was seen with 32x32 elements
        assert error <= 1e-13
