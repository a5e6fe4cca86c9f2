"""Unknowns at both sides of a run are the same by calls of C and by NumPy.

The kind: what one process does in one call is what any number of ranks do step by step.
"""

import itertools
from collections.abc import Callable

from mpi4py import MPI  # noqa: F401  (before petsc4py)

import numpy as np
import pytest

import shellmb as sm
from shellmb.sensitivity.parameters import STEP, differentiated
from shellmb.sensitivity.perturbed_run import PerturbedRun
from shellmb.sensitivity.tangent import Pair, Tangents
from shellmb.simulate.simulation import Simulation
from shellmb.system.two_sided import Kind, SerialTwoSided, Sizes, TwoSided
from tests.sensitivity import scenes

# round-off of unknowns over their distance, which is 1e-5 of them, is 1e-11: 3e-12 was seen
CLOSE = 1e-10


@pytest.mark.parametrize(
    ("make", "scheme", "name"),
    # directors; directors with rates on a path; frames and joints
    [
        (scenes.plate, "ep", "length"),
        pytest.param(scenes.vault, "ep4", "radius", marks=pytest.mark.slow),
        pytest.param(scenes.mechanism, "ep4", "arm", marks=pytest.mark.slow),
    ],
)
def test_calls_of_c_are_those_of_numpy(
    make: Callable[..., sm.Scene], scheme: str, name: str
) -> None:
    made = differentiated(make, None, scheme=scheme, newton="auto")
    base = made.scene()

    def pairs(run: Simulation) -> list[Pair]:
        (p,) = made.parameters((name,))
        sides = (PerturbedRun(Simulation(s, like=run), [], False) for s in made.beside(base, p))
        return [Pair(p, *sides)]

    run, tangents = Simulation(base), Tangents(pairs)
    tangents.start(run)
    for _ in range(2):
        run.advance([tangents])
    (pair,) = tangents.pairs
    linear = run.problem.iteration.linear
    assert pair.both.is_one
    for side in pair.sides:
        side.begin(run.t, run.last.dt)
    system = run.problem.system
    u, sizes = np.array(system.x.array_r), Sizes(system)
    # a change that turns directors off their sphere, too
    d = STEP * np.random.default_rng(0).standard_normal(len(u)) + pair.both.d
    d[system.fixed] = 0.0
    found = []
    for make_both in (SerialTwoSided, TwoSided):
        both: TwoSided = make_both(pair.sides, u, sizes, STEP)
        both.d[:] = d
        rest, change, every = system.x.duplicate(), system.x.duplicate(), []
        both.keep()
        for kind, taken in itertools.product(Kind, (False, True)):
            solution = linear.in_c()
            assert solution is not None
            if both.is_one:
                share = both.update(kind, taken, solution)
            else:
                both.rest(kind, rest)
                assert linear.solve_many([rest], [change]) is None
                share = both.move(change, taken)
            every += [both.d.copy(), np.array(share)]
        both.hold()
        every += [array.copy() for side in pair.sides for array in side.system.arrays]
        found.append(every)
    for a, b in zip(*found, strict=True):
        assert np.abs(a).max() > 0
        assert np.abs(a - b).max() <= CLOSE * np.abs(a).max()
