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

from __future__ import annotations

from dataclasses import dataclass

from mpi4py import MPI

import numpy as np
import ufl
from ufl import Form

from shellmb.arrays import Floats
from shellmb.model.body import Body
from shellmb.native.kernels import compile_all
from shellmb.observers.forces.reactions import Arms, HeldForces, NodalForces
from shellmb.schemes.residuals.residual import StageForms
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.meshgroups import residuals_of
from shellmb.system.assembly.residuals import Residuals


def last_middle(simulation: Simulation, body: str) -> Floats:
    """Dofs of a body where forces acted that balance the momentum of the step just solved."""
    return simulation.problem.steps[body].middle()


@dataclass(frozen=True)
class Exchange:
    """Impulse and energy that a step exchanged with the outside.

    Args:
        loads: Impulse and moment of impulse about the origin of loads and added terms, (2, 3).
        supports: The same of supports, drivers and joints to ground, shape (2, 3).
        gross: Sum of the sizes of the nodal impulses, N s; of those that cancel one another, too.
    """

    loads: Floats
    supports: Floats
    gross: float


class Impulse:
    """Impulse and moment of impulse about the origin of everything that acts from outside.

    Args:
        simulation: The simulation; the call is collective.
    """

    def __init__(self, simulation: Simulation) -> None:
        problem, model = simulation.problem, simulation.model
        stages = simulation.scheme.balance
        self._rows = [_Acting(simulation, stage) for stage in stages]
        self._held = [HeldForces(problem, model, stage) for stage in stages]

    def of_step(self, simulation: Simulation) -> Exchange:
        """Exchange of the step just solved; collective."""
        assert simulation.last is not None
        sums, scheme = np.zeros(13), simulation.scheme
        for number, (acting, held) in enumerate(zip(self._rows, self._held, strict=True)):
            forces = [acting.nodal(), held.nodal()]
            rows = [k for k, f in enumerate(forces) if f is not None]
            for carrier in held.carriers:
                if number == 0:
                    arms = Arms(last_middle(simulation, carrier.name), whole=1.0)
                else:
                    levels = simulation.problem.levels[carrier.name]
                    unknown = {stage: f.x.array for stage, f in levels.unknown.items()}
                    scaled = {rate: f.x.array for rate, f in levels.scaled.items()}
                    chord = scheme.moved(levels.q.x.array, scaled, unknown)[simulation.problem.last]
                    arms = Arms(np.asarray(chord / 2), whole=0.0)
                found, gross = carrier.resultants(arms, [f for f in forces if f is not None])
                if number:
                    # the first moment of a force in time is no impulse
                    found[:, :3] = gross = 0.0
                sums[:12].reshape(2, 6)[rows] += found
                sums[12] += gross
        if simulation.model.comm.size > 1:
            simulation.model.comm.Allreduce(MPI.IN_PLACE, sums)
        sums *= simulation.last.dt
        return Exchange(sums[:6].reshape(2, 3), sums[6:12].reshape(2, 3), float(sums[12]))


class _Acting(NodalForces):
    """Loads and added terms of a row.

    Args:
        simulation: The simulation.
        stage: The row.
    """

    def __init__(self, simulation: Simulation, stage: str) -> None:
        problem = simulation.problem
        super().__init__(problem.system)
        # all of what potentials exert comes from outside, and what volumes exert on lids, which
        # are no bodies; residuals are against it
        self._forces: list[tuple[float, slice, Residuals]] = []
        for body in simulation.model.bodies:
            row, outside = problem.forms[body.name][stage], body in simulation.model.outside
            forms = row.residual if outside else self._work(row, body)
            if forms:
                number, system = problem.number(body.name, stage), problem.system
                loops = residuals_of(system, number, compile_all(forms))
                where = system.numbering.slice(number)
                self._forces.append((-1.0 if outside else 1.0, where, loops))
        self._local = np.zeros(len(problem.system.numbering.local_to_global))

    @staticmethod
    def _work(row: StageForms, body: Body) -> list[Form]:
        dq = ufl.TestFunction(body.mixed.space)
        work = (f for s in row.samples for f in (s.of_loads(dq), s.of_terms(body, dq)))
        return [form for form in work if form is not None and not form.empty()]

    def nodal(self) -> Floats | None:
        """Nodal forces on this rank; None without any."""
        if not self._forces:
            return None
        self._local[:] = 0.0
        for sign, where, loops in self._forces:
            loops.refresh()
            loops.add(self._local[where])
            self._local[where] *= sign
        return self.gathered(self._local)
