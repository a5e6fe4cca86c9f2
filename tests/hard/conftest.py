"""What hard cases share: a run that is watched, small scenes, and the table of worst values.

With the environment variable `SHELLMB_HARD_TABLE=hard.csv` every test adds its worst values to that
file; `python tests/hard/table.py hard.csv` makes the table of docs/evidence/hard.md of it. The
scenes are few and small, and parameters are constants of the forms: most cases share their
compiled kernels.
"""

import csv
import os
from collections.abc import Callable
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import pytest

from shellmb.observers.account.constraints import Constraints
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import Isotropic, Scene
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.scenes import plate_scene

# what the project asks of every run: violation of the energy law relative to the largest energy,
# and of constraints relative to lengths
ENERGY, CONSTRAINT = 1e-9, 1e-10

# wave speed one, natural frequencies of a plate 1 x 0.5 from 0.2 to about 20 rad/s
# every case runs in all schemes; those that are quadratic in time have larger systems, and stay
# among the slow tests where bodies are flexible
LATER = [pytest.param(*pair, marks=pytest.mark.slow) for pair in (("ep4", 0.0), ("ed3", 1.0))]
EVERY = [("ep", 0.0), ("ed", 1.0), *LATER]
RIGID = [("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 1.0)]

SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0)

Worst = Callable[[str, float, float], None]


@pytest.fixture
def worst(request: pytest.FixtureRequest) -> Worst:
    """`worst(what, value, bound)` asserts `value < bound` and keeps the value for the table."""
    path = os.environ.get("SHELLMB_HARD_TABLE")

    def keep(what: str, value: float, bound: float) -> None:
        if path:
            with open(path, "a", newline="") as file:
                csv.writer(file).writerow([request.node.name, what, repr(float(value)), bound])
        assert value < bound, f"{what}: {value:.3g}, asked for less than {bound:.3g}"

    return keep


class Watched(BaseObserver):
    """A dynamic scene run to its end, with what the energy law and the constraints say.

    Attributes:
        simulation: The simulation.
        energy: The energy account.
        constraints: Violations of constraints.
        total: Energy at the start and after every step, J.
        given: Work done on the system up to then, J.
        rejected: Number of rejected steps.
    """

    def __init__(self, scene: Scene, *observers: Any) -> None:
        self.simulation = Simulation(scene)
        self.energy, self.constraints = EnergyAccount(), Constraints()
        self.total: list[float] = []
        self.given: list[float] = []
        self.simulation.run([self.energy, self.constraints, self, *observers])
        self.rejected = self.simulation.size.rejected

    def start(self, simulation: Simulation) -> None:
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        values = self.energy.values
        self.total.append(values["total_energy"])
        self.given.append(sum(values[f"work_{k}"] for k in ("loads", "terms", "supports")))

    @property
    def produced(self) -> float:
        """Largest energy from nowhere so far: more than at any time before and was put in, J."""
        free = [total - given for total, given in zip(self.total, self.given, strict=True)]
        lowest, most = free[0], 0.0
        for value in free:
            lowest, most = min(lowest, value), max(most, value - min(lowest, value))
        return most

    def check(self, worst: Worst, energy: float = ENERGY, constraint: float = CONSTRAINT) -> None:
        """The laws that every motion obeys."""
        assert self.energy.relative_error is not None
        assert self.constraints.constraint_max is not None
        worst("energy law", self.energy.relative_error, energy)
        worst("energy from nowhere", self.produced / self.energy.largest, energy)
        worst("constraints", self.constraints.constraint_max, constraint)


@pytest.fixture
def watch() -> type[Watched]:
    """Run a scene with the observers that judge it."""
    return Watched


@pytest.fixture
def plate() -> Callable[..., Scene]:
    """Make a plate."""
    return plate_scene
