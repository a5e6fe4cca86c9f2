"""Momenta of a motion and the lengths of its directors, followed over all steps."""

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from shellmb.observers.account.energy import Scalar, scalar
from shellmb.simulate.simulation import Silent, Simulation

Floats = NDArray[np.float64]


class Momenta(Silent):
    """Drift of the momenta in free flight, and deviation of the directors from unit length.

    Args:
        free_after: Time from which the body flies freely, s.

    Attributes:
        linear: Linear momentum at the accepted steps after that, one (3,) each, kg m/s.
        angular: Angular momentum about the origin, kg m^2/s.
        director: Largest deviation of a director's length from one in all steps.
    """

    def __init__(self, free_after: float = 0.0) -> None:
        self.free_after = free_after
        self.linear: list[Floats] = []
        self.angular: list[Floats] = []
        self.director = 0.0

    def start(self, simulation: Simulation) -> None:
        """Compile the functionals: one of each kind for all three axes."""
        (shell,) = simulation.model.shells.values()
        levels, comm = simulation.problem.levels[shell.name], simulation.model.comm
        v = levels.rates["v"]
        self._axis = fem.Constant(shell.mixed.space.mesh, np.zeros(3))
        self._linear = scalar([shell.momentum(v, self._axis)], comm)
        self._angular = scalar([shell.angular_momentum(levels.q, v, self._axis)], comm)

    def _components(self, functional: Scalar | None) -> Floats:
        assert functional is not None
        components = []
        for k in range(3):
            self._axis.value = np.eye(3)[k]
            components.append(functional())
        return np.array(components)

    def accepted(self, simulation: Simulation) -> None:
        """Take momenta and directors of the new state."""
        (shell,) = simulation.model.shells.values()
        here = shell.constraint_error(simulation.problem.levels[shell.name].q)
        self.director = max(self.director, simulation.model.comm.allreduce(here, op=MPI.MAX))
        if simulation.t >= self.free_after:
            self.linear.append(self._components(self._linear))
            self.angular.append(self._components(self._angular))

    @property
    def linear_drift(self) -> float:
        """Largest change of the linear momentum relative to its size."""
        return _drift(self.linear)

    @property
    def angular_drift(self) -> float:
        """Largest change of the angular momentum relative to its size."""
        return _drift(self.angular)


def _drift(values: list[Floats]) -> float:
    table = np.array(values)
    change = np.linalg.norm(table - table[0], axis=1)
    return float(np.max(change) / np.max(np.linalg.norm(table, axis=1)))
