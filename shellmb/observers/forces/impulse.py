"""Impulses of all that acts from outside, as the balance of momentum of a step sees them.

The row of the state at the end of a step (eq. 29), tested with a rigid translation and with a rigid
rotation of its mid-point configuration. Internal forces and those of joints between bodies do no
work there. What does is assembled into the nodes and summed up: loads and added terms; and what
supports, drivers and joints to ground hold, which are the residuals at the fixed unknowns, and the
multipliers of planes that are not axis-parallel.

Over a step that is quadratic in time the rows P0 and P1 of eq. (Q2) have the mean of a force,
`f_0`, and its first moment in time, `f_1 = <P1 f>`. The moment of a force linear in time about the
path is `<r x f> = <r> x f_0 + 3 <P1 r> x f_1 = <r> x f_0 + D/2 x f_1`, as it is of inertia.
"""

from functools import partial

import numpy as np
import ufl
from ufl import Form

from shellmb.arrays import Floats
from shellmb.model.body import Body
from shellmb.native.kernels import compile_all
from shellmb.observers.deferred_observer import STEPS, SharedTable, StepValues
from shellmb.observers.forces.reactions import HeldForces, gathered
from shellmb.schemes.residuals.residual import StageForms
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.meshgroups import residuals_of_fields

# numbers of local dofs of all steps that are added up together: more are no quicker
TOGETHER = 100_000


def last_middle(simulation: Simulation, body: str) -> Floats:
    """Dofs of a body where forces acted that balance the momentum of the step just solved."""
    return simulation.problem.steps[body].middle()


class Impulse:
    """Impulse and moment of impulse about the origin of everything that acts from outside.

    Args:
        simulation: The simulation; the call is collective.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._rows = [
            _BalanceRow(simulation, stage, first=number == 0)
            for number, stage in enumerate(simulation.scheme.balance)
        ]
        size = len(simulation.problem.system.numbering.local_to_global)
        self._together = max(1, TOGETHER // max(size, 1))
        # of each step: impulses over its length, and that
        self._means = SharedTable(simulation.model.comm, (13,))
        self._dt = np.zeros((STEPS, 1))

    def take(self, dt: float, step: int) -> None:
        """Take what acts in the step just solved; collective.

        Args:
            dt: Its length, s.
            step: Which of the steps that are added up together.
        """
        for row in self._rows:
            row.take(step)
        self._dt[step] = dt
        self._means.take(step, self._find)

    def _find(self, steps: slice, means: Floats) -> None:
        for begin in range(0, len(means), self._together):
            some = slice(begin, min(begin + self._together, len(means)))
            for row in self._rows:
                row.add(slice(steps.start + some.start, steps.start + some.stop), means[some])

    def of_steps(self, steps: slice) -> Floats:
        """Exchange of some steps with the outside, shape (n, 13).

        Of each step impulse and moment of impulse of loads and added terms, then those of supports,
        drivers and joints to ground, and the sum of the sizes of all nodal impulses, N s, of those
        that cancel one another, too.

        Args:
            steps: Which of those taken.
        """
        return np.asarray(self._means.of(steps, self._find) * self._dt[steps])


class _BalanceRow:
    """Forces in one of the rows that balance the momentum of a step.

    Args:
        simulation: The simulation.
        stage: The row.
        first: Whether it has means of forces, and not their first moments in time.
    """

    def __init__(self, simulation: Simulation, stage: str, first: bool) -> None:
        problem = simulation.problem
        self._first, self._system = first, problem.system
        # loads and added terms; all of what potentials exert comes from outside, and what volumes
        # exert on lids, which are no bodies; residuals are against it
        self._acting: list[tuple[float, slice, StepValues]] = []
        for body in simulation.model.bodies:
            row, outside = problem.forms[body.name][stage], body in simulation.model.outside
            if forms := row.residual if outside else _work(row, body):
                number = problem.number(body.name, stage)
                find = residuals_of_fields(self._system, {number: compile_all(forms)})
                where = self._system.numbering.slice(number)
                self._acting.append((-1.0 if outside else 1.0, where, StepValues(find)))
        self._held = HeldForces(problem, simulation.model, stage)
        arms = (
            problem.steps[c.name].middle if first else partial(problem.half_chord, c.name)
            for c in self._held.carriers
        )
        self._arms = [StepValues(arm) for arm in arms]

    def take(self, step: int) -> None:
        """Take forces and where they act."""
        for _, _, works in self._acting:
            works.take(step)
        self._held.take(step)
        for arms in self._arms:
            arms.take(step)

    def add(self, steps: slice, sums: Floats) -> None:
        """Add the resultants of this rank to those of `Impulse.of_steps`, by time."""
        forces = [self._nodal(steps), self._held.nodal(steps)]
        there = [(k, f) for k, f in enumerate(forces) if f is not None]
        for carrier, arms in zip(self._held.carriers, self._arms, strict=True):
            whole = 1.0 if self._first else 0.0
            found, gross = carrier.resultants(arms.of(steps), whole, [f for _, f in there])
            # the first moment of a force in time is no impulse
            first = 0 if self._first else 3
            for (k, _), rows in zip(there, found, strict=True):
                sums[:, 6 * k + first : 6 * k + 6] += rows[:, first:]
            if self._first:
                sums[:, 12] += gross

    def _nodal(self, steps: slice) -> Floats | None:
        """Nodal forces on this rank in some steps; None without any; collective."""
        if not self._acting:
            return None
        size = len(self._system.numbering.local_to_global)
        local = np.zeros((len(range(*steps.indices(STEPS))), size))
        for sign, where, works in self._acting:
            local[:, where] = sign * works.of(steps)
        return gathered(self._system, local)


def _work(row: StageForms, body: Body) -> list[Form]:
    """Virtual work of loads and added terms on a body."""
    dq = ufl.TestFunction(body.mixed.space)
    work = (f for s in row.samples for f in (s.of_loads(dq), s.of_terms(body, dq)))
    return [form for form in work if form is not None and not form.empty()]
