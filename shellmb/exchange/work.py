"""Work of the inputs of a scene: what a partner puts into it."""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

import numpy as np

from shellmb.observers.account.energy import present, work_forms
from shellmb.scene.control.signals import Input, inputs_of
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.system.assembly.functionals import functionals

# what inputs are set to for a moment, at both ends of a step
NOTHING, SOMETHING = (0.0, 0.0), (1.0, 2.0)


class PartnerWork(BaseObserver):
    """Sums the work that inputs do through loads, motors, supports and drivers.

    It is that of the same step without them taken from the work that is done: loads and motors are
    linear in their inputs. Supports and drivers that have inputs work by their reactions.

    Args:
        inputs: All inputs of the scene.

    Attributes:
        work: It, J; part of the work of loads, terms and supports in the energy balance.
    """

    remembered = ("work",)

    def __init__(self, inputs: Sequence[Input]) -> None:
        self._inputs, self.work = list(inputs), 0.0

    def start(self, simulation: Simulation) -> None:
        """Find what inputs act on."""
        problem, scene = simulation.problem, simulation.scene
        stores = simulation.model.stores
        bodies = [body for body in simulation.model.bodies if body not in stores]
        parts = {"loads": scene.loads, "terms": scene.force_elements}
        kinds = [kind for kind, items in parts.items() if any(True for _ in inputs_of(items))]
        forms = [form for kind in kinds for form in present(work_forms(simulation, kind, bodies))]
        comm = simulation.model.comm
        self._forces = functionals([forms], comm) if forms else None
        given, lines = [], [one.line for one in self._inputs]
        for values in (NOTHING, SOMETHING):
            self._take(simulation, [(0.0, simulation.size.dt, *values)] * len(lines))
            problem.prepare(0.0, simulation.size.dt)
            problem.system.update_fixed_values()
            given.append(problem.system.fixed_values().copy())
        self._moved = given[0] != given[1]
        self._drives = comm.allreduce(bool(np.any(self._moved)), op=MPI.LOR)
        self._take(simulation, lines)

    def _take(
        self, simulation: Simulation, lines: Sequence[tuple[float, float, float, float]]
    ) -> None:
        for one, line in zip(self._inputs, lines, strict=True):
            one.take(*line)
        simulation.model.mechanism.command(simulation.model.signals)

    def _sample(self, simulation: Simulation, t: float, dt: float) -> None:
        problem = simulation.problem
        for stages in problem.forms.values():
            for forms in stages.values():
                for sample in forms.samples:
                    sample.update(t, dt, problem.start_factor)

    def _work(self, simulation: Simulation, t: float, dt: float) -> float:
        self._sample(simulation, t, dt)
        assert self._forces is not None
        return float(self._forces()[0])

    def solved(self, simulation: Simulation) -> None:
        """Add the work of a step."""
        last = simulation.last
        assert last is not None
        if self._drives:
            self.work += simulation.problem.support_work(self._moved)
        if self._forces is None:
            return
        every = self._work(simulation, last.t, last.dt)
        lines = [one.line for one in self._inputs]
        self._take(simulation, [(last.t, last.dt, *NOTHING)] * len(lines))
        others = self._work(simulation, last.t, last.dt)
        self._take(simulation, lines)
        self._sample(simulation, last.t, last.dt)
        self.work += every - others

    def measure(self) -> dict[str, float]:
        """Columns of the outputs."""
        return {"work_inputs": self.work}
