"""Damping with several times deforms a body in shapes that its modes do not have."""

import numpy as np

from shellmb.diagnostics.base import STIFFENED, Cautions, Watch, said_of
from shellmb.observers.fields.modal import ModalState
from shellmb.simulate.simulation import Simulation


class DampedModes(Watch):
    """Watches what bodies in modes do not relax by.

    What strains of one kind resist by their rates the full body shifts to others; its modes cannot.
    """

    name = "damped modes"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """Find the bodies."""
        model = simulation.model
        damped = [d for d in model.modal if d.relaxing is not None and d.relaxing.any()]
        rates = "v" in simulation.scheme.rates
        self._bodies = [(data, ModalState(model, data)) for data in damped] if rates else []
        self.idle = not self._bodies

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for data, state in self._bodies:
            eta, rate = state.now(simulation)[1], state.now(simulation, "v")[1]
            assert data.damping is not None
            assert data.relaxing is not None
            products = [data.stiffness @ eta**2, data.stiffness @ rate**2]
            products += [rate @ matrix @ rate for matrix in (data.damping, data.relaxing)]
            # the largest of each, and when
            before, when = self._largest.get(data.name, (np.zeros(4), 0.0))
            if products[3] > before[3]:
                when = simulation.t
            self._largest[data.name] = np.maximum(before, products).tolist(), when

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that resists otherwise than its modes do."""
        for name, (products, when) in self._largest.items():
            share = _share(*products)
            if share > STIFFENED:
                says = (
                    f"{said_of(simulation, name)} is reduced to modes, and its strains have "
                    "several times of damping: it would relax in shapes that no mode has, and "
                    f"what it resists with is off by about {share:.1%}, at t = {when:g}; use one "
                    "time for all strains, or model='floating-frame'"
                )
                yield self.caution(name, share, STIFFENED, says)


def _share(energy: float, fast: float, damped: float, relaxing: float) -> float:
    """By what share of its size the dynamic stiffness `K + i w D` of modes is off.

    Slowly, `w D` being small beside the stiffness of what relaxes, that is by `w^2 D K^-1 D`, and
    fast by no more than `w D`, when nothing but the modes would resist.

    Args:
        energy: Amplitudes times stiffness times amplitudes; the largest, J.
        fast: The same of the rates: over the first it is the square of `w`.
        damped: Of rates with damping, W.
        relaxing: Of rates with what relaxes, J.
    """
    if not relaxing > 0 or not energy > 0:
        return 0.0
    slow, quick = relaxing / energy, damped / float(np.sqrt(fast * energy))
    return float(slow * quick / (slow + quick) / (1 + quick))
