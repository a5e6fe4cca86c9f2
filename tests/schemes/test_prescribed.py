"""Every dynamic scheme at dofs with a prescribed motion, against exact solutions.

What is carried along at one end, under a gravity that gives every particle the acceleration of that
end, moves as a whole: `u(x, t) = s(t)` everywhere, whatever the body is made of. A scheme that does
not take the prescribed motion at all its states as its own equations ask for sets off waves there.
"""

import math
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    Beam,
    Driven,
    Fixed,
    GeneralSection,
    Gravity,
    Line,
    RigidBody,
    Scene,
    Solver,
    Spherical,
)
from shellmb.schemes.base import has_energy_law
from shellmb.simulate.simulation import BaseObserver, Simulation

STEPS = (0.2, 0.1, 0.05)
# Newton leaves an error of the order of the square of its tolerance; what is seen is round-off
ROUND_OFF = 1e-11
AWAY = np.array([0.3, -0.2, 0.6])
SIZE, RATE = 0.05, 1.5


def way(t: float) -> float:
    """Smooth, and zero at the beginning with three derivatives."""
    return SIZE * math.sin(RATE * t) ** 4


def speed(t: float) -> float:
    return 4 * SIZE * RATE * math.sin(RATE * t) ** 3 * math.cos(RATE * t)


def acceleration(t: float) -> float:
    s, c = math.sin(RATE * t), math.cos(RATE * t)
    return 4 * SIZE * RATE**2 * s**2 * (3 * c**2 - s**2)


CARRIED: dict[str, Any] = {
    "supports": Driven("left", translation=lambda t: AWAY * way(t)),
    "loads": Gravity(tuple(AWAY), time=acceleration),
    # errors of the fourth order in the step are seen down to 1e-9
    "solver": Solver(tolerance=1e-12),
}
# of wave speed one
BAR = GeneralSection(
    (1.0, 0.4, 0.4, 2e-3, 4e-3, 4e-3), mass_per_length=1.0, second_moments=(4e-3, 0.0, 4e-3)
)


def hanging(scheme: str, alpha: float, dt: float) -> Scene:
    """A beam whose start is carried along, with a rigid body on a spherical joint at its end."""
    components = tuple(lambda t, c=c: c * way(t) for c in AWAY)
    carried = CARRIED | {"supports": Fixed("start", displacement=components)}
    return Scene(
        "hanging",
        beams=Beam("beam", Line((0, 0, 0), (1, 0, 0)), BAR, elements=1),
        rigid_bodies=RigidBody("mass", 0.5, (0.01, 0.01, 0.01), position=(1.0, 0.0, 0.0)),
        joints=Spherical("hook", "beam", "mass", at=(1.0, 0.0, 0.0)),
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=1.0,
        **carried,
    )


class Errors(BaseObserver):
    """Largest errors of displacements, and of velocities where they are prescribed."""

    def __init__(self) -> None:
        self.displacement = self.velocity = 0.0

    def accepted(self, simulation: Simulation) -> None:
        for body in simulation.model.bodies:
            # places of joints are those of bodies
            if "u" not in body.mixed.dofs:
                continue
            levels, dofs = simulation.problem.levels[body.name], body.mixed.dofs["u"]
            away = levels.q.x.array[dofs].reshape(-1, 3) - AWAY * way(simulation.t)
            self.displacement = max(self.displacement, float(np.abs(away).max()))
            held = np.intersect1d(dofs, np.concatenate([[], *(f.dofs for f in body.fixed)]))
            if len(held):
                found = levels.rates["v"].x.array[held.astype(int)].reshape(-1, 3)
                off = found - AWAY * speed(simulation.t)
                self.velocity = max(self.velocity, float(np.abs(off).max()))


def errors(scene: Scene) -> Errors:
    found, account = Errors(), EnergyAccount()
    Simulation(scene).run([found, account])
    # what the weight does is the kinetic energy, whatever works at prescribed dofs
    assert account.relative_error < ROUND_OFF
    assert account.largest > 1e-4
    return found


def observed(found: list[float]) -> float:
    return float(np.polyfit(np.log(STEPS), np.log(found), 1)[0])


@pytest.mark.parametrize("body", ["plate", "joint"])
def test_what_is_carried_along_follows(scheme, body, plate, make) -> None:
    """A plate on a driven edge; and a mechanism, whose jump of velocities is an unknown."""
    if not has_energy_law(make(*scheme)):
        pytest.skip("what works at prescribed dofs is not the kinetic energy without an energy law")
    runs = [
        errors(
            plate(*scheme, dt=dt, t_end=1.0, **CARRIED)
            if body == "plate"
            else hanging(*scheme, dt=dt)
        )
        for dt in STEPS
    ]
    wanted = make(*scheme).order - 0.25
    assert observed([r.displacement for r in runs]) > wanted
    velocities = [r.velocity for r in runs]
    # ED ends a step with the motion's own velocity; its difference formula leaves round-off
    assert max(velocities) < 1e-9 or observed(velocities) > wanted
