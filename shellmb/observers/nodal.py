"""Nodal values of a shell at the current time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shellmb.simulate.simulation import Simulation

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class NodalValues:
    """Values at the nodes (owned and ghost) of a shell on this rank, each of shape (n, 3).

    Args:
        reference: Reference positions, m.
        displacement: Displacements, m.
        director: Directors.
        velocity: Velocities, m/s; zero in statics.
    """

    reference: Floats
    displacement: Floats
    director: Floats
    velocity: Floats

    @property
    def position(self) -> Floats:
        """Positions, m."""
        return np.asarray(self.reference + self.displacement)


def state(simulation: Simulation, body: str) -> Floats:
    """Dofs of a body's current state."""
    return np.asarray(simulation.problem.state(body).x.array)


def nodal_values(simulation: Simulation, shell: str) -> NodalValues:
    """Values at the nodes of a shell, in the order of the displacement's space.

    Args:
        simulation: The simulation, between two steps.
        shell: Name of the shell.
    """
    body = simulation.model.shells[shell]
    dofs, q = body.mixed.dofs, state(simulation, shell)
    displacement = q[dofs["u"]].reshape(-1, 3)
    rates = simulation.problem.levels[shell].rates
    velocity = (
        rates["v"].x.array[dofs["u"]].reshape(-1, 3)
        if "v" in rates
        else np.zeros_like(displacement)
    )
    director = body.director.x.array.reshape(-1, 3) + q[dofs["w"]].reshape(-1, 3)
    return NodalValues(body.mixed.nodes("u"), displacement, director, velocity)
