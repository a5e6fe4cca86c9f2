"""Advance of a scheme after a solved step, transposed.

States and rates at the end of a step are combinations of those at its start and of the unknown
states, number by number; what jumps of velocities leave out along directors (ED) depends on the
state, node by node. The combinations are found by asking the scheme for units.
"""

from __future__ import annotations

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.body import Body
from shellmb.preprocessing.bodyfields import kinematic_dofs, resultant_dofs
from shellmb.schemes.base import END
from shellmb.sensitivity.adjoint.transposed import Covector
from shellmb.simulate.problem import Problem

# a state, rates by name, and unknown states by stage
Given = tuple[Floats, dict[str, Floats], dict[str, Floats]]
# shares of states, by their kind and name, and that of a jump
Shares = tuple[dict[tuple[str, str], tuple[Floats, ...]], Floats | None]


class Advance:
    """The end of a step of one body, transposed.

    Args:
        problem: The problem.
        body: The body.
    """

    def __init__(self, problem: Problem, body: Body) -> None:
        self._name, self._levels = body.name, problem.levels[body.name]
        self._scheme, self._forms = problem.scheme, problem.steps[body.name]
        self._kinematic, self._resultants = kinematic_dofs(body), resultant_dofs(body)
        self._tangent_back = body.manifold.tangent_back
        self._kept: dict[str, tuple[float, Shares]] = {}

    def __call__(
        self, ends: Covector, starts: Covector, unknown: dict[str, Floats], dt: float
    ) -> None:
        """Add what covectors of the end are at the start and in the unknown states.

        Args:
            ends: Of the end of the step.
            starts: Of its start.
            unknown: Of the unknown states, by stage.
            dt: Length of the step, s.
        """
        name, levels = self._name, self._levels
        of_q = ends[name, "q"].copy()
        rows, of_rows = self._resultants, of_q[self._resultants].copy()
        of_q[rows] = 0.0
        unknown[END] += of_q
        one, zero = np.ones(len(rows)), np.zeros(len(rows))
        zeros = {stage: zero for stage in levels.unknown}
        starts[name, "q"][rows] += self._scheme.resultants(one, zeros) * of_rows
        for stage in levels.unknown:
            unknown[stage][rows] += self._scheme.resultants(zero, zeros | {stage: one}) * of_rows
        if not levels.rates:
            return
        for rate in levels.rates:
            w = np.zeros_like(of_q)
            w[self._kinematic] = ends[name, rate][self._kinematic]
            self._of_rate(rate, w, starts, unknown, dt)

    def _of_rate(
        self, rate: str, w: Floats, starts: Covector, unknown: dict[str, Floats], dt: float
    ) -> None:
        shares, weight = self._shares(rate, dt)
        by_jump = by_middle = np.zeros(0)
        if weight is not None:
            levels, seen = self._levels, list[tuple[Floats, Floats]]()
            rates = {k: f.x.array for k, f in levels.rates.items()}
            states = {s: f.x.array for s, f in levels.unknown.items()}
            self._advanced(rate, (levels.q.x.array, rates, states), dt, seen)
            by_jump, by_middle = self._tangent_back(*seen.pop(), weight * w)
        for (kind, name), (plain, jump, middle) in shares.items():
            target = unknown[name] if kind == "unknown" else starts[self._name, name]
            target += plain * w
            if weight is not None:
                target += jump * by_jump + middle * by_middle

    def _advanced(
        self, rate: str, given: Given, dt: float, seen: list[tuple[Floats, Floats]]
    ) -> Floats:
        """A rate at the end without jumps of velocities, which `seen` gets with their middles."""

        def unseen(b: Floats, middle: Floats) -> Floats:
            seen.append((b, middle))
            return np.zeros_like(b)

        return np.asarray(self._forms.advance(*given, dt, unseen)[rate])

    def _shares(self, rate: str, dt: float) -> Shares:
        """Shares of all states in a rate at the end, in the jump and in the middle state of that.

        They are linear combinations, of which units tell the shares; kept as long as the step is.

        Returns:
            Them by kind and name of the state; and the share of the jump in the rate, if there is.
        """
        kept = self._kept.get(rate)
        if kept is not None and kept[0] == dt:
            return kept[1]
        levels, size = self._levels, len(self._levels.q.x.array)
        zero, one = np.zeros(size), np.ones(size)

        def only(kind: str, name: str) -> Given:
            rates, states = (
                {k: one if (kind, name) == (of, k) else zero for k in names}
                for of, names in (("rate", levels.rates), ("unknown", levels.unknown))
            )
            return one if kind == "q" else zero, rates, states

        found: dict[tuple[str, str], tuple[Floats, ...]] = {}
        keys = [("q", "q")]
        keys += [("rate", k) for k in levels.rates] + [("unknown", k) for k in levels.unknown]
        seen: list[tuple[Floats, Floats]] = []
        for key in keys:
            plain = self._advanced(rate, only(*key), dt, seen)
            found[key] = (plain, *(seen.pop() if seen else (zero, zero)))
        jumps: list[Floats] = []

        def jump(b: Floats, middle: Floats) -> Floats:
            jumps.append(b)
            return one

        made = np.asarray(self._forms.advance(*only("", ""), dt, jump)[rate])
        self._kept[rate] = dt, (found, made if jumps else None)
        return self._kept[rate][1]
