"""Shells that are thrown: laws of mechanics say what they have and keep, whatever the scheme.

The kind: free bodies, curved, flat, or joined at an angle; dead forces at points and along edges;
all schemes, long steps. Values come from `demos/references/flight.py`, which sees displacements and
momenta of the history only.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from shellmb.demos import flying_l_plate, short_cylinder
from shellmb.demos.references import flight
from shellmb.running.execute import execute
from shellmb.scene import Scene

# not round-off: what Newton's method leaves of a step
LEFT = 1e-10


def thrown(scene: Scene, scheme: str) -> Any:
    chosen = replace(scene, scheme=scheme, alpha=None)
    return execute(chosen, watched=False).history


def test_impulse_of_a_hat() -> None:
    """Against sums over fine steps."""
    t = np.linspace(0.0, 3.0, 3001)
    hat = np.interp(t, (0.0, 1.0, 2.0), (0.0, 5.0, 0.0))
    summed = np.concatenate([[0.0], np.cumsum((hat[1:] + hat[:-1]) / 2 * np.diff(t))])
    np.testing.assert_allclose(flight.impulse(t, 5.0, 2.0), summed, atol=1e-12)


@pytest.mark.parametrize("scheme", ["ep", "ed3", "ed", "ep4"])
def test_a_tube_thrown_by_point_forces(scheme: str) -> None:
    tube = short_cylinder
    history = thrown(tube.scene((8, 1), dt=0.1, t_end=1.3), scheme)
    found = flight.flight(history, tube.PULSE)
    assert flight.distance(flight.vectors(history, "momentum_")[-1], tube.IMPULSE) < LEFT
    assert found["energy_rise"] < LEFT
    given = flight.turned(history, tube.PLACES, tube.FORCES, tube.PEAK, tube.PULSE)[-1]
    angular = flight.vectors(history, "angular_momentum_")[-1]
    if scheme in ("ep", "ep4"):
        assert found["energy_variation"] < LEFT
        # EP4 keeps angular momentum to its order
        assert found["angular_drift"] < (LEFT if scheme == "ep" else 1e-5)
        # the mean of the places at both ends is what EP uses, and a rule of second order
        assert flight.distance(angular, given) < (LEFT if scheme == "ep" else 1e-2)
    # four-node elements of OpenSees, and a mesh of eight elements of ours with long steps
    assert tube.from_opensees(history) < 0.1


@pytest.mark.parametrize(("fold", "scheme"), [(90.0, "ep"), (0.0, "ed3"), (40.0, "ep4")])
def test_an_l_plate_thrown_by_edge_forces(fold: float, scheme: str) -> None:
    history = thrown(flying_l_plate.scene(1, fold, dt=2e-3, t_end=0.03), scheme)
    found = flight.flight(history, flying_l_plate.PULSE)
    linear = flight.vectors(history, "momentum_")[-1]
    assert flight.distance(linear, flying_l_plate.IMPULSE) < LEFT
    assert found["energy_rise"] < LEFT
    if scheme != "ed3":
        assert found["energy_variation"] < LEFT
        assert found["angular_drift"] < (LEFT if scheme == "ep" else 1e-5)
