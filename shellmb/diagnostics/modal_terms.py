"""Added terms on bodies in modes that bend them in shapes which no mode has.

Static modes of terms are those of their forces and stiffness at rest. What acts otherwise, as a gap
or a cubic spring, deforms the exact body in shapes that few modes do not have. By how much tells
the static answer of the body by itself, with its frames fixed, to the forces of terms in states of
the run, less what its modes give: what is left is missing.
"""

from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.diagnostics.base import Cautions, Sampled, said_of
from shellmb.model.reduced.data import ModalBody
from shellmb.observers.fields.modal import ModalNodes
from shellmb.simulate.simulation import Simulation

# states that are kept; of more each second one goes
LOOKS = 40
# part of the deformation: forces are taken as they are, though they change where a body gives way,
# and motions are off by a fifth of this
BOUND = 0.05


class ModalTerms(Sampled):
    """Looks whether modes have the shapes in which terms deform bodies, in states of the run."""

    name = "terms on modes"

    def start(self, simulation: Simulation) -> None:
        """Find the bodies."""
        self._bodies = [data for data in simulation.model.modal if data.lacking is not None]
        names = [name for data in self._bodies for name in data.members]
        self._nodes = {name: ModalNodes(simulation.model, name) for name in names}
        # times with values at the nodes, frames and amplitudes, since the run started or went on
        self._looks: list[tuple[float, dict[str, tuple[Any, ...]]]] = []
        self.idle = not self._bodies

    def _look(self, simulation: Simulation) -> None:
        now = {n: (x.now(simulation), *x.state.now(simulation)) for n, x in self._nodes.items()}
        self._looks.append((simulation.t, now))
        if len(self._looks) > LOOKS:
            del self._looks[1::2]

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body whose modes are too few; collective."""
        if self._bodies:
            self._look(simulation)
        for data in self._bodies:
            share, when = self._missing(simulation, data)
            if share > BOUND:
                says = (
                    f"{said_of(simulation, data.name)} is reduced to modes, and its terms act "
                    f"otherwise than at rest: at t = {when:g} they deform it by shapes that no "
                    f"mode has, up to {share:.0%} of its largest deformation; use more "
                    "modes, or model='floating-frame'"
                )
                yield self.caution(data.name, share, BOUND, says)

    def _missing(self, simulation: Simulation, data: ModalBody) -> tuple[float, float]:
        """Part of the largest deformation that modes lack, and when; collective."""
        largest, missing = 0.0, (0.0, 0.0)
        assert data.lacking is not None
        for t, now in self._looks:
            _, frame, eta = now[data.name]
            nodes = {name: values for name, (values, *_) in now.items()}
            d = np.eye(3) + frame[3:].reshape(3, 3)
            missing = max(missing, (data.lacking(t, nodes, d), t))
            moved = np.concatenate([member.u @ eta for member in data.members.values()])
            far = float(np.max(np.linalg.norm(moved, axis=1), initial=0.0))
            largest = max(largest, simulation.model.comm.allreduce(far, op=MPI.MAX))
        return (missing[0] / largest if largest > 0 else 0.0), missing[1]
