"""Stiff beams that turn in schemes quadratic in time: velocities along their fibres stay small.

The stress acts as a constraint does in its limit, eq. (Q4), on positions and velocities. Forces on
the mean strain `<e>` alone hold the strain and let the velocity along a fibre grow, by
`(1 - alpha)/(1 + alpha) e^theta` in a step that turns by `theta`.
"""

from dataclasses import replace

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.demos import spin_up_beam
from shellmb.running.execute import execute
from shellmb.scene import Beam, InitialVelocity, Line, Scene
from shellmb.simulate.simulation import Simulation

SPIN, LENGTH = 4.0, 8.0
# 0.16 rad in a step, of which a fibre's fastest vibrations take 1/250
SPINNING = Scene(
    "spinning",
    beams=Beam("beam", Line((0, 0, 0), (LENGTH, 0, 0)), spin_up_beam.SECTION, elements=2),
    initial=InitialVelocity(spin=(0, 0, SPIN)),
    scheme="ep4",
    dt=0.04,
    t_end=3.2,
)


@pytest.mark.parametrize(("scheme", "alpha"), [("ep4", 0.0), ("ed3", 0.05)])
def test_velocities_along_a_fibre_do_not_grow(scheme: str, alpha: float) -> None:
    """Eighty steps: by `e^theta` in each they would grow by 3e5, to the velocity of the tip."""
    simulation = Simulation(replace(SPINNING, scheme=scheme, alpha=alpha))
    simulation.run()
    body, levels = simulation.model.meshed["beam"], simulation.problem.levels["beam"]
    dofs, x = body.mixed.dofs["u"], body.mixed.nodes("u")
    order = np.argsort(x[:, 0])
    place = (x + levels.q.x.array[dofs].reshape(-1, 3))[order]
    velocity = levels.rates["v"].x.array[dofs].reshape(-1, 3)[order]
    fibre = np.diff(place, axis=0)
    fibre /= np.linalg.norm(fibre, axis=1)[:, None]
    rate = np.abs(np.sum(np.diff(velocity, axis=0) * fibre, axis=1)).max()
    # 3e-4 of the tip's velocity without dissipation: the start, from a beam that is not stretched
    assert rate < 1e-3 * SPIN * LENGTH / 2


def test_spin_up() -> None:
    """The history of the literature with the demo's step; it turns by 0.15 rad in the last ones."""
    run = execute(replace(spin_up_beam.scene(elements=3, t_end=13.0), scheme="ep4"))
    results = spin_up_beam.results(run)
    assert run.warnings == ()
    assert results["energy_balance_error"] < 1e-9
    # what the demo allows
    assert results["deflection_difference"] < 0.01
