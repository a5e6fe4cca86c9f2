"""The pages of the schemes are what is compiled: a number of a row, edited, acts."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from shellmb.forms.steps.path import PAIRS
from shellmb.running.execute import execute
from shellmb.schemes import interval, quadratic
from shellmb.schemes.notation import D, H
from tests.golden.scenes import shell

# relative; what is edited changes by a tenth
CLOSED = 1e-12


def run(scheme: str) -> tuple[np.ndarray, float]:
    """Position of the free corner, and the violation of the energy law over the energy."""
    rows = execute(shell(scheme)).rows
    found = np.array([[row[f"position_{axis}"] for axis in "xyz"] for row in rows])
    balance, energy = (np.abs([row[c] for row in rows]) for c in ("energy_balance", "total_energy"))
    return found, float(np.max(balance) / np.max(energy))


@pytest.fixture(scope="module")
def as_printed() -> Callable[[str], tuple[np.ndarray, float]]:
    """Runs of the pages as they stand."""
    found: dict[str, Any] = {}
    return lambda scheme: found.setdefault(scheme, run(scheme))


def strain(beta: float) -> Any:
    """The strain of eq. (22) with 0.6 and 0.4 of the strains at the ends in place of halves."""
    return 0.6 * interval.e(interval.A) + 0.4 * interval.e(interval.B)


def row(k: int, **changes: Any) -> tuple[Any, str, Any]:
    """A row of `quadratic` with changes."""
    name = f"P{k}"
    return quadratic, name, getattr(quadratic, name)._replace(**changes)


P0, P1 = quadratic.P0, quadratic.P1
EDITS = {
    # the stress is not that whose work is the change of the energy
    "(22) of EP": ("ep", (interval, "averaged", strain), False),
    "(Q3), the mean": ("ep4", (quadratic, "MEAN", 1.1 * quadratic.MEAN), False),
    "(Q2), what S_1 acts on": (
        "ep4",
        row(1, stresses=(H(D) / 6, 1.1 * P1.stresses[1])),
        False,
    ),
    # inertia that is not that of the kinetic energy
    "(Q2), the inertia": ("ep4", row(0, inertia=lambda p: 1.1 * P0.inertia(p)), False),
    # another load, whose work is counted
    "(Q2), the load": ("ep4", row(1, load=lambda tau: 2.2 * tau - 1.1), True),
}


@pytest.mark.parametrize("what", EDITS)
def test_an_edited_number_acts(what: str, as_printed, monkeypatch) -> None:
    scheme, edit, closed = EDITS[what]
    before, error = as_printed(scheme)
    assert error < CLOSED
    monkeypatch.setattr(*edit)
    after, error = run(scheme)
    # not round-off: tenths of what is some per cent of the plate's length
    assert np.abs(after - before).max() > 1e-6
    assert error < CLOSED if closed else error > 1e-6


@pytest.mark.parametrize("alpha", [0.0, 1.0])
def test_the_page_closes_the_account_of_a_spring(alpha: float) -> None:
    """(Q5) of a scalar with a quadratic strain, from the page alone, with random numbers."""
    rng = np.random.default_rng(1)
    page = quadratic.QuadraticInTime(alpha).page
    q = rng.normal(size=(4, 3))
    L, Q = rng.normal(size=3), rng.normal(size=(3, 3))
    Q = Q + Q.T
    states = page.states(alpha) @ q
    S = [np.array(moment(m, states, L, Q)) for m in page.strains(alpha)]
    path = page.path_of(q[0], q[2], q[1], q[3], alpha)
    forces = [
        sum(
            s * (slope[0] * L + Q @ (slope[1:] @ states))
            for s, slope in zip(S, r.stresses, strict=True)
        )
        for r in page.rows
    ]
    work = sum(f @ w for f, w in zip(forces, path.moved, strict=True))
    first, last = (L @ ends + ends @ Q @ ends / 2 for ends in (q[0], q[2]))
    lost = alpha * moment(page.bow, states, L, Q) ** 2 / 2
    assert work == pytest.approx((last**2 - first**2) / 2 + lost, rel=1e-11)


def moment(m: Any, states: np.ndarray, L: np.ndarray, Q: np.ndarray) -> float:
    """Value of a moment of a measure `L q + q.Q q/2`."""
    pairs = zip(PAIRS, m[4:], strict=True)
    return float(m[:4] @ states @ L + sum(w * states[a] @ Q @ states[b] for (a, b), w in pairs))
