"""Small soft plates in motion, and a probe of their state."""

from collections.abc import Callable
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
from dolfinx import fem

from shellmb.model.body import constraint_error, kinetic_energy, strain_energy
from shellmb.observers.account.energy import EnergyAccount, scalar
from shellmb.scene import Clamped, EdgeForce, InitialVelocity, Scene
from shellmb.schemes.base import has_energy_law
from shellmb.schemes.registry import SCHEMES, make_scheme
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.scenes import plate_scene

ALPHAS = {"ed": (0.0, 0.5, 1.0), "ed3": (0.5, 1.0)}
ALPHAS |= {"generalized-alpha": (0.5,), "ed-printed": (1.0,)}
# every dynamic scheme of the registry with every dissipation that is to be tested
DYNAMIC = [
    (name, alpha)
    for name, make in SCHEMES.items()
    # what is linear takes no large motions: tests/simulate/test_linear_dynamics.py
    if make(1.0).dynamic and not make(1.0).linear
    for alpha in ALPHAS.get(name, (0.0,))
]
# rivals, and what shares its kernels with others of the list, are not for every day
SLOW = [("ed", 0.5), ("ed-printed", 1.0), ("generalized-alpha", 0.5)]


def marked(pairs: list[tuple[str, float]]) -> list[Any]:
    """Parameters of a fixture, some of them slow."""
    return [pytest.param(p, marks=pytest.mark.slow if p in SLOW else ()) for p in pairs]


# those that claim an exact energy law
LAWFUL = [pair for pair in DYNAMIC if has_energy_law(make_scheme(*pair))]


@pytest.fixture(params=marked(LAWFUL), ids=lambda p: f"{p[0]}-{p[1]:g}")
def lawful(request: pytest.FixtureRequest) -> tuple[str, float]:
    """Name and dissipation of each scheme with an energy law."""
    return request.param


@pytest.fixture(params=marked(DYNAMIC), ids=lambda p: f"{p[0]}-{p[1]:g}")
def scheme(request: pytest.FixtureRequest) -> tuple[str, float]:
    """Name and dissipation of each dynamic scheme."""
    return request.param


@pytest.fixture
def make() -> Callable[..., Any]:
    """The scheme object of a pair of name and dissipation."""
    return make_scheme


def soft_plate(
    scheme: Any = "ep", alpha: float = 0.0, dt: float = 0.1, t_end: float = 1.0, **more: Any
) -> Scene:
    return plate_scene(scheme, alpha, dt=dt, t_end=t_end, **more)


@pytest.fixture
def plate() -> Callable[..., Scene]:
    """A plate of 1 x 0.5, free unless supports are given."""
    return soft_plate


@pytest.fixture
def tumbling() -> Callable[..., Scene]:
    """A free plate that turns about all axes, fast enough to bend and stretch it."""

    def make(scheme: Any, alpha: float, dt: float = 0.2, t_end: float = 3.0, **more: Any) -> Scene:
        motion = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(0.4, 0.6, -0.3))
        return soft_plate(scheme, alpha, dt, t_end, initial=motion, **more)

    return make


@pytest.fixture
def swaying() -> Callable[..., Scene]:
    """A cantilever plate under a smooth tip load that begins at zero."""

    def make(scheme: Any, alpha: float, dt: float, size: float, t_end: float = 1.6) -> Scene:
        tip = (0.02 * size, 0.05 * size, 0.25 * size)
        force = EdgeForce("right", tip, time=lambda t: float(np.sin(1.5 * t) ** 4))
        return soft_plate(scheme, alpha, dt, t_end, supports=Clamped("left"), loads=force)

    return make


class History(BaseObserver):
    """Energies, momenta and the directors' lengths after every step."""

    def __init__(self) -> None:
        self.total: list[float] = []
        self.linear: list[np.ndarray] = []
        self.angular: list[np.ndarray] = []
        self.director = 0.0

    def start(self, simulation: Simulation) -> None:
        (body,) = simulation.model.shells.values()
        levels, comm = simulation.problem.levels[body.name], MPI.COMM_WORLD
        axis = fem.Constant(body.mixed.space.mesh, np.zeros(3))
        self._axis, self._body, self._q = axis, body, levels.q
        self._forms = [
            scalar([body.momentum(levels.rates["v"], axis)], comm),
            scalar([body.angular_momentum(levels.q, levels.rates["v"], axis)], comm),
        ]
        self._energy = scalar(
            [kinetic_energy(body, levels.rates["v"]), strain_energy(body, levels.q)], comm
        )
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        for form, history in zip(self._forms, (self.linear, self.angular), strict=True):
            components = []
            for direction in np.eye(3):
                self._axis.value = direction
                components.append(form())
            history.append(np.array(components))
        self.total.append(self._energy())
        self.director = max(self.director, constraint_error(self._body, self._q))


@pytest.fixture
def history() -> History:
    return History()


@pytest.fixture
def account() -> EnergyAccount:
    return EnergyAccount()


@pytest.fixture
def final() -> Callable[[Scene], np.ndarray]:
    """Run a scene; displacement and director change of all nodes at its end."""

    def run(scene: Scene) -> np.ndarray:
        simulation = Simulation(scene)
        simulation.run()
        body = simulation.model.shells["plate"]
        q = simulation.problem.levels["plate"].q.x.array
        return np.concatenate([q[body.mixed.dofs["u"]], q[body.mixed.dofs["w"]]])

    return run
