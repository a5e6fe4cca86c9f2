"""Advance of a scheme after a solved step, transposed.

States and rates at the end of a step are combinations of those at its start and of the unknown
states, number by number; what jumps of velocities leave out along directors (ED) depends on the
state, node by node. The combinations are found by asking the scheme for units.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.bodyfields import kinematic_dofs, resultant_dofs
from shellmb.model.body import Body
from shellmb.schemes.base import END, Tangent
from shellmb.sensitivity.adjoint.differences import FOURTH
from shellmb.sensitivity.adjoint.transposed import Covector
from shellmb.simulate.problem import Problem

# distance of differences: directors are of unit size, so that error and round-off are both near
# 1e-13
APART = 1e-3


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
        self._tangent = body.manifold.tangent_values
        dofs = [body.mixed.dofs[p] for p in ("u", "w") if p in body.mixed.dofs]
        # of directors only: triples have unknown jumps, which are tangent already
        shell = len({len(d) for d in dofs}) == 1
        self._nodes = [d.reshape(-1, 3) for d in dofs] if shell else []

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
        name, levels = self._name, self._levels
        q, size = levels.q.x.array, len(w)
        zeros: dict[str, Any] = {
            "q": np.zeros(size),
            "rates": {k: np.zeros(size) for k in levels.rates},
            "unknown": {s: np.zeros(size) for s in levels.unknown},
        }
        targets: list[tuple[Floats, dict[str, Any]]] = [
            (starts[name, "q"], zeros | {"q": np.ones(size)})
        ]
        for k in levels.rates:
            given = zeros["rates"] | {k: np.ones(size)}
            targets.append((starts[name, k], zeros | {"rates": given}))
        for s in levels.unknown:
            given = zeros["unknown"] | {s: np.ones(size)}
            targets.append((unknown[s], zeros | {"unknown": given}))

        def advanced(given: dict[str, Any], tangent: Tangent) -> Floats:
            made = self._forms.advance(given["q"], given["rates"], given["unknown"], dt, tangent)
            return np.asarray(made[rate])

        seen: list[tuple[Floats, Floats]] = []

        def unseen(b: Floats, mid: Floats) -> Floats:
            seen.append((b, mid))
            return np.zeros(size)

        by_jump = by_middle = np.zeros(0)
        state = {
            "q": q,
            "rates": {k: f.x.array for k, f in levels.rates.items()},
            "unknown": {s: f.x.array for s, f in levels.unknown.items()},
        }
        advanced(state, unseen)
        if seen:
            jump, middle = seen.pop()
            weight = advanced(zeros, lambda b, mid: np.ones(size))
            by_jump, by_middle = self._of_tangent(jump, middle, weight * w)
        for target, given in targets:
            target += advanced(given, unseen) * w
            if seen:
                share, there = seen.pop()
                target += share * by_jump + there * by_middle

    def _of_tangent(self, jump: Floats, middle: Floats, w: Floats) -> tuple[Floats, Floats]:
        """Covectors of a jump of velocities and of the middle state that its tangent is at."""
        by_jump, by_middle = np.zeros_like(w), np.zeros_like(w)
        per_node = [w[dofs] for dofs in self._nodes]

        def gathered(change: Floats) -> Floats:
            """Sum over each node of what changes there, times its covector."""
            pairs = zip(self._nodes, per_node, strict=True)
            return np.asarray(sum((change[dofs] * of).sum(axis=1) for dofs, of in pairs))

        rest = w.copy()
        for dofs in self._nodes:
            rest[dofs] = 0.0
            for k in range(3):
                unit = np.zeros_like(w)
                unit[dofs[:, k]] = 1.0
                by_jump[dofs[:, k]] += gathered(self._tangent(unit, middle))
                change = np.zeros_like(w)
                for offset, weight in FOURTH:
                    change += weight / APART * self._tangent(jump, middle + offset * APART * unit)
                by_middle[dofs[:, k]] += gathered(change)
        # what is at no node of the surface stays as it is
        return by_jump + rest, by_middle
