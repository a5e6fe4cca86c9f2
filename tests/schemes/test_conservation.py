"""Energy law, momenta and constraints of every dynamic scheme."""

from typing import Any

import numpy as np
import pytest

from shellmb.scene import (
    Clamped,
    Cylinder,
    Driven,
    EdgeForce,
    FollowerEdgeForce,
    Gravity,
    InitialVelocity,
    Pressure,
    Scene,
    Shell,
)
from shellmb.schemes.base import has_energy_law
from shellmb.simulate.simulation import Simulation
from tests.scenes import SOFT

# Newton leaves an error of the order of the square of its tolerance; what is seen is round-off
ROUND_OFF = 1e-11


def test_free_motion(scheme, tumbling, history, account, make) -> None:
    object_ = make(*scheme)
    Simulation(tumbling(*scheme)).run([account, history])
    energy = np.array(history.total)
    if has_energy_law(object_):
        assert account.relative_error < ROUND_OFF
    assert history.director < 1e-11
    drift = np.ptp(history.linear, axis=0)
    assert np.max(drift) < ROUND_OFF * np.linalg.norm(history.linear[0])
    if "angular momentum" in object_.conserves:
        drift = np.ptp(history.angular, axis=0)
        assert np.max(drift) < ROUND_OFF * np.linalg.norm(history.angular[0])
    # the motion has strained the plate: there was something to conserve
    assert account.values["strain_energy"] > 1e-4 * energy[0]
    if "energy" in object_.conserves:
        assert np.ptp(energy) < ROUND_OFF * energy[0]
    elif not has_energy_law(object_):
        # what exactness is for: in this motion it makes and loses energy
        assert np.any(np.diff(energy) > 1e-4 * energy[0])
        assert np.any(np.diff(energy) < -1e-4 * energy[0])
    else:
        assert np.all(np.diff(energy) < 0)
        assert account.values["dissipation"] > 1e-10 * energy[0]


LOADS = {
    "dead": (EdgeForce("right", (0.02, 0.0, 0.05), time=lambda t: np.sin(3 * t)), Gravity()),
    "follower": (FollowerEdgeForce("right", (0.0, 0.01, 0.05)), Pressure(0.02)),
}


@pytest.mark.parametrize("loads", LOADS)
def test_the_work_of_loads_is_accounted_for(lawful, loads, plate, account) -> None:
    scene = plate(*lawful, dt=0.2, t_end=2.0, supports=Clamped("left"), loads=LOADS[loads])
    Simulation(scene).run([account])
    assert account.relative_error < ROUND_OFF
    assert abs(account.values["work_loads"]) > 1e-3


def test_the_work_of_a_prescribed_motion_is_accounted_for(lawful, plate, account) -> None:
    drive = Driven("left", axis=(0, 1, 0), rotation=lambda t: 0.6 * np.sin(t) ** 2)
    Simulation(plate(*lawful, dt=0.2, t_end=2.0, supports=drive)).run([account])
    assert account.relative_error < ROUND_OFF
    assert account.values["work_supports"] > 1e-4


def test_a_motion_that_begins_at_speed_drives_at_that_speed(scheme, plate) -> None:
    """The edge moves on a straight line from the first instant: so its velocity is constant."""
    speed = 0.3
    drive = Driven("left", translation=lambda t: (0.0, 0.0, speed * t))
    simulation = Simulation(plate(*scheme, dt=0.2, t_end=1.0, supports=drive))
    simulation.run()
    body = simulation.model.shells["plate"]
    v = simulation.problem.levels["plate"].rates["v"].x.array
    edge = np.isclose(body.mixed.nodes("u")[:, 0], 0)
    found = v[body.mixed.dofs["u"]].reshape(-1, 3)[edge]
    np.testing.assert_allclose(found, [[0, 0, speed]] * len(found), atol=1e-7)


@pytest.mark.slow
def test_a_thousand_steps(lawful, tumbling, history, account, make) -> None:
    """The long run of `test_free_motion`: errors accumulate no faster than round-off does."""
    Simulation(tumbling(*lawful, t_end=200.0)).run([account, history])
    energy = np.array(history.total)
    assert account.relative_error < 1e-9
    assert history.director < 1e-11
    assert np.max(np.ptp(history.linear, axis=0)) < 1e-9
    if "angular momentum" in make(*lawful).conserves:
        assert np.max(np.ptp(history.angular, axis=0)) < 1e-9
    if "energy" in make(*lawful).conserves:
        assert np.ptp(energy) < 1e-9 * energy[0]
    else:
        assert np.all(np.diff(energy) < ROUND_OFF * energy[0])


def test_static_schemes_keep_no_account(plate, account) -> None:
    scene: Any = plate(
        "static", dt=0.5, supports=Clamped("left"), loads=EdgeForce("right", (0, 0, 1e-4))
    )
    Simulation(scene).run([account])
    assert account.values["strain_energy"] > 0
    assert account.values["energy_balance"] == 0


@pytest.mark.parametrize(("name", "alpha"), [("ep4", 0.0), ("ed3", 1.0)])
def test_curved_triangles_that_turn_far(name, alpha, account) -> None:
    """Membrane forces that are linear on an element, shear forces that are vectors, and bubbles."""
    panel = Shell("panel", Cylinder(1.0, 1.0, angles=(0.0, 60.0)), SOFT, mesh=(2, 2), cell="tri")
    thrown = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(1.2, 1.6, -0.8))
    simulation = Simulation(
        Scene("thrown", panel, initial=thrown, scheme=name, alpha=alpha, dt=0.2, t_end=1.0)
    )
    simulation.run([account])
    assert account.relative_error < ROUND_OFF
    assert account.values["strain_energy"] > 1e-3 * account.values["total_energy"]
    assert (account.values["dissipation"] > 0) == (alpha > 0)
