"""Advance of a scheme after a solved step, transposed.

States and rates at the end of a step are combinations of those at its start and of the unknown
states, number by number; what jumps of velocities leave out along directors (ED) depends on the
state, node by node. The combinations are found by asking the scheme for units.
"""

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.body import Body
from shellmb.preprocessing.bodyfields import kinematic_dofs, resultant_dofs
from shellmb.schemes.base import END
from shellmb.sensitivity.adjoint.transposed import Covector
from shellmb.simulate.problem import Problem

# states by kind and name: "q", a "rate", or an "unknown" one
States = dict[tuple[str, str], Floats]
# shares of these in a rate at the end, in the jump and in the middle state of that
Shares = dict[tuple[str, str], tuple[Floats, Floats, Floats]]


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
        levels, self._states = self._levels, States()
        self._states["q", "q"] = levels.q.x.array
        self._states |= {("rate", k): f.x.array for k, f in levels.rates.items()}
        self._states |= {("unknown", k): f.x.array for k, f in levels.unknown.items()}
        # of each rate the length of the step, the shares, and that of the jump
        self._kept: dict[str, tuple[float, Shares, Floats]] = {}

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
        for rate in levels.rates:
            w = np.zeros_like(of_q)
            w[self._kinematic] = ends[name, rate][self._kinematic]
            self._of_rate(rate, w, starts, unknown, dt)

    def _of_rate(
        self, rate: str, w: Floats, starts: Covector, unknown: dict[str, Floats], dt: float
    ) -> None:
        shares, weight = self._shares(rate, dt)
        jumps, by_jump, by_middle = weight.any(), w, w
        if jumps:
            _, b, middle = self._advanced(rate, self._states, dt)
            by_jump, by_middle = self._tangent_back(b, middle, weight * w)
        for (kind, name), (plain, jump, middle) in shares.items():
            target = unknown[name] if kind == "unknown" else starts[self._name, name]
            target += plain * w
            if jumps:
                target += jump * by_jump + middle * by_middle

    def _advanced(
        self, rate: str, given: States, dt: float, unit: float = 0.0
    ) -> tuple[Floats, Floats, Floats]:
        """A rate at the end with a given size of what jumps leave; the jump, and its middle state.

        Both are zero where velocities do not jump.
        """
        seen = [np.zeros_like(given["q", "q"])] * 2

        def left(b: Floats, middle: Floats) -> Floats:
            seen[:] = b, middle
            return np.full_like(b, unit)

        rates, unknown = (
            {k: v for (kind, k), v in given.items() if kind == of} for of in ("rate", "unknown")
        )
        made = self._forms.advance(given["q", "q"], rates, unknown, dt, left)
        return np.asarray(made[rate]), seen[0], seen[1]

    def _shares(self, rate: str, dt: float) -> tuple[Shares, Floats]:
        """Shares of all states, and of a jump, in a rate at the end; zero where there is no jump.

        They are linear combinations, of which units tell the shares; kept as long as the step is.
        """
        kept = self._kept.get(rate)
        if kept is None or kept[0] != dt:
            zeros = {key: np.zeros_like(values) for key, values in self._states.items()}
            units = {key: zeros | {key: np.ones_like(values)} for key, values in zeros.items()}
            shares = {key: self._advanced(rate, unit, dt) for key, unit in units.items()}
            kept = self._kept[rate] = dt, shares, self._advanced(rate, zeros, dt, 1.0)[0]
        return kept[1:]
