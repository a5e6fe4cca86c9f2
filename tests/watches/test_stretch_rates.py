"""Stiff bodies that turn under schemes that do not hold velocities along their fibres."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from shellmb.demos import spin_up_beam
from shellmb.observers.summary import Sources
from shellmb.observers.turning import Turning
from shellmb.scene import Beam, InitialVelocity, Line, Scene
from shellmb.simulate.simulation import Simulation
from shellmb.watches.stretch_rates import StretchRates

# 0.16 rad in a step; axial vibrations of the beam's elements turn by 200 rad and more
SPINNING = Scene(
    "spinning",
    beams=Beam("beam", Line((0, 0, 0), (8, 0, 0)), spin_up_beam.SECTION, elements=2),
    initial=InitialVelocity(spin=(0, 0, 4.0)),
    scheme="ep4",
    dt=0.04,
    t_end=2.4,
)


def warnings_of(scene: Scene) -> list[str]:
    simulation, turning = Simulation(scene), Turning()
    watch = StretchRates(cast(Sources, SimpleNamespace(turning=turning)))
    simulation.run([turning, watch])
    return [caution.says for caution in watch.cautions(simulation)]


def test_a_beam_whose_velocities_along_it_grow() -> None:
    (sentence,) = warnings_of(SPINNING)
    assert "beam 'beam' is stiff for its step of 0.04 s and turns by 0.16 rad" in sentence
    assert (
        "use --scheme ed3 with an alpha well beyond 0.08, or a step of at most 0.018 s" in sentence
    )


@pytest.mark.parametrize(
    "change",
    [{"scheme": "ed3", "alpha": 0.09}, {"dt": 0.0165}, {"scheme": "ep"}],
    ids=lambda change: "-".join(map(str, change.values())),
)
def test_what_is_beyond_the_bounds_that_it_names(change) -> None:
    """The bounds themselves: a tenth beyond them nothing grows."""
    assert warnings_of(replace(SPINNING, **change)) == []


def test_a_little_dissipation_is_not_enough() -> None:
    """The growth that is expected is the one that is found: `kept e^theta` in a step."""
    scene = replace(SPINNING, scheme="ed3", alpha=0.05)
    rates = {}
    for steps in (50, 75):
        simulation = Simulation(replace(scene, t_end=steps * scene.dt))
        simulation.run()
        body, levels = simulation.model.meshed["beam"], simulation.problem.levels["beam"]
        dofs = body.mixed.dofs["u"]
        x = body.mixed.nodes("u")
        order = np.argsort(x[:, 0])
        place = (x + levels.q.x.array[dofs].reshape(-1, 3))[order]
        velocity = levels.rates["v"].x.array[dofs].reshape(-1, 3)[order]
        fibre = np.diff(place, axis=0)
        fibre /= np.linalg.norm(fibre, axis=1)[:, None]
        rates[steps] = np.abs(np.sum(np.diff(velocity, axis=0) * fibre, axis=1)).max()
    found = np.log(rates[75] / rates[50]) / 25
    # of what oscillates at the same time; without growth it would be -0.1
    assert found == pytest.approx(0.16 + np.log(0.95 / 1.05), abs=0.02)
