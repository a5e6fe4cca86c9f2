"""When factorisations are kept, and when an iteration has converged."""

from types import SimpleNamespace
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import pytest

from shellmb.system.assembly.fields import Part
from shellmb.system.newton.convergence import IDLE, Convergence
from shellmb.system.newton.refactorisation import FAR, REFRESH, RESTS, Modified

TOLERANCE = 1e-9


def iterate(policy: Modified, rho: float, first: float = 1e-4, moved: float = 0.0) -> list[float]:
    """Updates that contract by `rho`, each until a factorisation is wanted or all is done."""
    updates, size = [], first
    for _ in range(60):
        if policy.wanted():
            policy.factorised(8.0)
        updates.append(size)
        if policy.converged(size, moved, size, TOLERANCE):
            return updates
        if policy.wanted():
            return updates
        size *= rho
    raise AssertionError("neither converged nor stopped")


def test_fast_contraction_needs_one_factorisation_for_many_solutions() -> None:
    policy = REFRESH["auto"]()
    assert isinstance(policy, Modified)
    policy.begin("a")
    assert policy.wanted()
    for _ in range(3):
        updates = iterate(policy, 0.05)
        # the error left behind, and not the last update, is small; sizes by hand, not round-off
        assert updates[-1] * 0.05 / 0.95 <= 1e-6 * TOLERANCE
        policy.begin("a")
        assert not policy.wanted()


def test_another_system_is_factorised_anew() -> None:
    policy = REFRESH["auto"]()
    policy.begin("a")
    policy.factorised(8.0)
    policy.begin("b")
    assert policy.wanted()


def test_modified_factorises_once_in_each_solution() -> None:
    policy = REFRESH["modified"]()
    for _ in range(2):
        policy.begin("a")
        assert policy.wanted()
        policy.factorised(8.0)
        assert not policy.wanted()


@pytest.mark.parametrize("rho", [0.3, 0.6, 2.0])
def test_slow_contraction_asks_for_a_factorisation(rho: float) -> None:
    policy = REFRESH["auto"]()
    policy.begin("a")
    assert len(iterate(policy, rho)) <= 3
    assert policy.wanted()


@pytest.mark.parametrize(
    ("cost", "rho", "anew"),
    [(5.0, 0.1, True), (30.0, 0.1, False), (8.0, 0.3, True), (1000.0, 0.3, True)],
)
def test_costly_factorisations_are_kept_for_longer(cost: float, rho: float, anew: bool) -> None:
    """But not for as many iterations as make a solution fail."""
    policy = REFRESH["auto"]()
    policy.begin("a")
    policy.factorised(cost)
    for update in (1e-4, rho * 1e-4):
        assert not policy.converged(update, 0.0, update, TOLERANCE)
    # 1e-15 is 10 and 20 iterations away
    assert policy.wanted() is anew


def solve(policy: Modified, *rhos: float, first: float = 1e-4) -> int:
    """A solution whose updates contract by these in turn; how many it takes, and whether ended."""
    policy.begin("a")
    if policy.wanted():
        policy.factorised(8.0)
    size = first
    for n in range(60):
        if policy.converged(size, 0.0, size, TOLERANCE):
            return n + 1
        if policy.wanted():
            return -(n + 1)
        size *= rhos[n % len(rhos)]
    raise AssertionError("neither converged nor stopped")


def test_contractions_that_alternate_are_judged_by_two_of_them() -> None:
    """As those of plates do: 0.5 in one update and a thousandth in the next."""
    policy = REFRESH["auto"]()
    for _ in range(3):
        # what is usual for the factorisation is known from its second solution on
        assert solve(policy, 0.1, 0.001) > 3
    assert solve(policy, 0.55, 0.001) > 3
    # what the last two tell counts, whatever was usual
    assert solve(policy, 0.4, 0.6) == -3


def test_a_bad_contraction_of_two_is_not_taken_for_round_off() -> None:
    """A first guess below the tolerance, whose next update is as large: the one after is not."""
    policy = REFRESH["auto"]()
    for _ in range(3):
        assert solve(policy, 0.1, 0.001) > 3
    assert solve(policy, 0.6, 0.001, first=TOLERANCE / 3) > 2


@pytest.mark.parametrize(("floor", "again"), [(5e-13, 5), (5e-11, 6)])
def test_round_off_is_known_from_the_solution_before(floor: float, again: int) -> None:
    """Of a static plate updates end at 5e-13; what is larger may be something else."""
    policy = REFRESH["auto"]()

    def iterations(key: str) -> int:
        policy.begin(key)
        if policy.wanted():
            policy.factorised(30.0)
        updates = [max(5e-5 / 100**n, floor) for n in range(20)]
        return next(n for n, u in enumerate(updates, 1) if policy.converged(u, 0.0, u, TOLERANCE))

    third = int(sum(5e-5 / 100**n > 1.01 * floor for n in range(20))) + 3
    assert iterations("a") == third
    assert iterations("a") == again
    assert iterations("another system") == third


@pytest.mark.parametrize(("then", "anew"), [(5e-9, False), (1e-6, True)])
def test_one_update_may_grow_later_on(then: float, anew: bool) -> None:
    """As of a static plate of 128x128 elements: contracted by a thousandth, and then twice that."""
    policy = REFRESH["auto"]()
    policy.begin("a")
    policy.factorised(24.0)
    for update in (1e-3, 1e-6, 2e-6):
        assert not policy.converged(update, 0.0, update, TOLERANCE)
        assert not policy.wanted()
    policy.converged(then, 0.0, then, TOLERANCE)
    assert policy.wanted() is anew


def test_what_grows_is_not_waited_for() -> None:
    policy = REFRESH["auto"]()
    for _ in range(3):
        assert solve(policy, 0.1, 0.001) > 3
    assert solve(policy, 1.1, 0.001) == -2


def test_ageing_factors_go_when_they_cost_more_than_new_ones() -> None:
    """Iterations grow by one a solution, a factorisation costs 8: the mean is least after four."""
    policy = REFRESH["auto"]()
    policy.begin("a")
    policy.factorised(8.0)
    means, total = [], 0
    for n in range(3, 30):
        if policy.wanted():
            break
        # contractions that need no factorisation by themselves
        policy._updates = [0.5**k for k in range(n)]
        policy._serve(roundoff=False)
        total += n
        means.append((8.0 + total) / (n - 2))
        policy.begin("a")
    assert means.index(min(means)) in (len(means) - 1, len(means) - 2)
    assert len(means) < 20


def test_large_motion_asks_for_a_factorisation_each_time() -> None:
    policy = REFRESH["auto"]()
    policy.begin("a")
    assert len(iterate(policy, 0.01, moved=2 * FAR)) == 1
    assert policy.wanted()


def test_round_off_ends_the_iteration() -> None:
    policy = REFRESH["auto"]()
    policy.begin("a")
    policy.factorised(8.0)
    assert not policy.converged(1e-9, 0.0, 1e-9, TOLERANCE)
    # no contraction any more, and below the tolerance
    assert policy.converged(0.9e-9, 0.0, 0.9e-9, TOLERANCE)


def test_full_newton_ends_by_the_update() -> None:
    policy = REFRESH["full"]()
    policy.begin("a")
    policy.factorised(8.0)
    assert policy.wanted()
    assert not policy.converged(1.1e-9, 0.0, 1.1e-9, TOLERANCE)
    assert policy.converged(0.9e-9, 0.0, 0.9e-9, TOLERANCE)


def test_errors_are_squared_by_factorisations_at_both_states() -> None:
    """The update that is left is known from the last two, and need not be made."""
    policy = REFRESH["auto"]()
    policy.begin("a")
    for update, done in ((1e-3, False), (1e-6, False)):
        policy.factorised(8.0)
        assert policy.converged(update, 0.0, update, TOLERANCE) is done
    policy.factorised(8.0)
    # the next one would change 1e-18
    assert policy.converged(1e-12, 0.0, 1e-12, TOLERANCE)
    policy.begin("b")
    for update, done in ((1e-4, False), (1e-10, True)):
        policy.factorised(8.0)
        assert policy.converged(update, 0.0, update, TOLERANCE) is done


def test_forces_of_constraints_may_be_less_exact_than_motions() -> None:
    """The error left behind counts weights; contraction is that of whatever contracts slower."""

    def ends(motions: float, weight: float) -> int:
        policy = REFRESH["auto"]()
        policy.begin("a")
        policy.factorised(30.0)
        for n in range(20):
            force, motion = 1e-3 / 1e3**n, 1e-5 * motions**n
            weighted = max(weight * force, motion)
            if policy.converged(max(force, motion), 0.0, weighted, TOLERANCE):
                return n
        raise AssertionError("not converged")

    # forces have 1e-15/0.999 left behind the third update, a little more than the bound
    assert (ends(1e-3, 1.0), ends(1e-3, 0.1)) == (4, 3)
    # motions have 7e-13 left behind the fourth one
    assert (ends(0.02, 1.0), ends(0.02, 0.1)) == (5, 5)


@pytest.mark.parametrize(("force", "weight"), [("multiplier", IDLE), ("stress", 1.0)])
def test_forces_of_constraints_count_less_unless_bodies_have_resultants(
    force: str, weight: float
) -> None:
    """Stiff bodies show in their resultants, and in forces of joints, whether motions are exact."""
    places = [np.array([k], np.int32) for k in range(3)]
    parts = (
        Part("motion", places[0], 1.0, "", bound=1e3),
        Part("multiplier", places[1], 1.0, "", idle=True),
        Part(force, places[2], 1.0, "", idle=force == "multiplier"),
    )
    numbering = SimpleNamespace(own=lambda k, dofs: dofs)
    system: Any = SimpleNamespace(
        comm=MPI.COMM_SELF, fields=[SimpleNamespace(parts=parts)], numbering=numbering
    )
    convergence, x = Convergence(system), PETSc.Vec().createWithArray(np.ones(3))
    for change, found in (((0, 1e-6, 0), weight * 1e-6), ((1e-6, 0, 0), 1e-6)):
        update = PETSc.Vec().createWithArray(np.array(change, float))
        largest, _, weighted = convergence.measure(x, update)
        assert (largest, weighted) == (1e-6, pytest.approx(found, rel=1e-15))


def test_a_solution_that_began_far_away_is_followed_by_a_factorisation() -> None:
    policy = REFRESH["auto"]()
    policy.begin("a")
    policy.factorised(8.0)
    assert not policy.converged(0.1, 2 * FAR, 0.1, TOLERANCE) and policy.wanted()
    policy.factorised(8.0)
    for update in (1e-5, 1e-12, 1e-19):
        policy.converged(update, 0.0, update, TOLERANCE)
    policy.begin("a")
    assert policy.wanted()


def runs(policy: Modified, solutions: int, old: float) -> tuple[int, int]:
    """Updates and factorisations of some solutions, which old ones contract by `old`.

    New ones leave a ten-thousandth. The cost of a factorisation is that of 1.1 iterations.
    """
    updates, made = 0, 0
    for _ in range(solutions):
        policy.begin("a")
        size, rho = 1e-8, old
        for _ in range(40):
            if policy.wanted():
                policy.factorised(1.1)
                made, rho = made + 1, 1e-4
            updates += 1
            if policy.converged(size, 0.0, size, TOLERANCE):
                break
            size *= rho
    return updates, made


def test_old_factorisations_that_do_not_serve_are_tried_ever_more_rarely() -> None:
    """Short steps of small systems: a factorisation each, none of them after useless updates."""
    policy = REFRESH["auto"]()
    assert isinstance(policy, Modified)
    least, _ = runs(REFRESH["modified"](), 200, 0.9)
    updates, made = runs(policy, 200, 0.9)
    # of 200 solutions no more than ten are trials, of two more updates and perhaps a factorisation
    assert made <= 200 + 10 and updates <= least + 20
    # where they serve, they are kept again
    runs(policy, RESTS + 2, 1e-4)
    assert runs(policy, 50, 1e-4)[1] == 0
