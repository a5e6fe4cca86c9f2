"""What tests of mechanisms share: rods, a run with its observers, the work of constraints."""

from collections.abc import Callable
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest
from dolfinx import fem

from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.native.kernels import compiled
from shellmb.observers.account.constraints import Constraints
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import RigidBody, Scene
from shellmb.simulate.simulation import BaseObserver, Simulation


class ConstraintWork(BaseObserver):
    """Work of the forces of all constraints between bodies, step by step.

    Attributes:
        worst: Largest work of a group of constraints in any step, J.
        exchanged: Largest work that a constraint's force did on one of the bodies it ties, J: what
            cancels in `worst`.
    """

    def __init__(self) -> None:
        self.worst, self.exchanged = 0.0, 0.0

    def start(self, simulation: Simulation) -> None:
        problem = simulation.problem
        self._groups = [
            # impulses of an unknown jump of velocities, too
            (body, {s: [compiled(f) for f in forms.residual] for s, forms in stages.items()})
            for body in simulation.model.bodies
            if isinstance(body, ConstraintGroup)
            for stages in [problem.forms[body.name]]
        ]
        assert self._groups

    def solved(self, simulation: Simulation) -> None:
        for body, stages in self._groups:
            levels = simulation.problem.levels[body.name]
            scaled = {rate: f.x.array for rate, f in levels.scaled.items()}
            unknown = {stage: f.x.array for stage, f in levels.unknown.items()}
            moved = simulation.scheme.moved(levels.q.x.array, scaled, unknown)
            total = 0.0
            for stage, forms in stages.items():
                force = np.zeros_like(levels.q.x.array)
                for form in forms:
                    fem.assemble_vector(force, form)
                # rows of the multipliers are equations, not forces
                force[body.mixed.dofs["mu"]] = 0.0
                work = force * moved[stage]
                total += float(work.sum())
                self.exchanged = max(self.exchanged, float(np.abs(work).max()))
            self.worst = max(self.worst, abs(total))


class Watched:
    """A scene run to its end, with what the energy law and the constraints say.

    Attributes:
        simulation: The simulation.
        energy: The energy account.
        constraints: Violations.
        work: Work of the constraints.
    """

    def __init__(self, scene: Scene, *observers: Any) -> None:
        self.simulation = Simulation(scene)
        self.energy, self.constraints = EnergyAccount(), Constraints()
        self.work = ConstraintWork()
        self.simulation.run([self.energy, self.constraints, self.work, *observers])

    def check(self) -> None:
        """The laws that every mechanism obeys, with the bounds that the project sets itself."""
        assert self.constraints.constraint_max is not None
        assert self.constraints.constraint_max < 1e-10
        assert self.energy.relative_error is not None
        assert self.energy.relative_error < 1e-9
        assert self.work.worst < 1e-10 * self.energy.largest


def _rod(name: str, a: Any, b: Any, mass: float = 1.0, radius: float = 0.1) -> RigidBody:
    """A homogeneous round rod from `a` to `b`, which are its points "a" and "b"."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    length = float(np.linalg.norm(b - a))
    x = (b - a) / length
    y = np.cross((0.3, 0.2, 1.0), x)
    y /= np.linalg.norm(y)
    along, across = mass * radius**2 / 2, mass * (radius**2 / 4 + length**2 / 12)
    return RigidBody(
        name,
        mass=mass,
        inertia=(along, across, across),
        position=tuple(a),
        rotation=np.column_stack([x, y, np.cross(x, y)]),
        com=(length / 2, 0.0, 0.0),
        points={"a": (0.0, 0.0, 0.0), "b": (length, 0.0, 0.0)},
    )


@pytest.fixture
def rod() -> Callable[..., RigidBody]:
    """Make a rod."""
    return _rod


@pytest.fixture
def watch() -> Callable[..., Watched]:
    """Run a scene with all observers."""
    return Watched
