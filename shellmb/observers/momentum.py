"""Linear and angular momentum, and how well the scheme conserves them.

Without supports the change of a momentum over a step is the impulse of the loads; the drift is what
is left when that impulse is taken away. The impulse is that of eq. (29): the last row of a scheme,
tested with a rigid translation or with a rigid rotation of the mid-point configuration.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.model.shell import ShellModel
from shellmb.observers.energy import EnergyAccount, Scalar, scalar
from shellmb.observers.impulse import PointImpulse
from shellmb.simulate.simulation import Silent, Simulation

Floats = npt.NDArray[np.float64]

KINDS = {"momentum": "linear", "angular momentum": "angular"}
COLUMNS = {"momentum": "momentum", "angular momentum": "angular_momentum"}

# below this part of m v, with v from the largest kinetic energy, a momentum is as good as zero, and
# its drift is measured by that part instead
SMALL = 1e-3


class Momentum(Silent):
    """Momenta about the origin, and their drift where nothing but loads can change them.

    Args:
        account: The energy account, for the scale of a momentum that is zero.

    Attributes:
        values: "momentum" and "angular momentum", kg m/s and kg m^2/s, each of shape (3,).
        drift: Largest drift so far of those that should be conserved, in the same units.
    """

    def __init__(self, account: EnergyAccount) -> None:
        self.account = account
        self.values: dict[str, Floats] = {}
        self.drift: dict[str, float] = {}
        self._expected: dict[str, Floats] = {}
        self._largest: dict[str, float] = {}
        self._kinetic = 0.0

    def start(self, simulation: Simulation) -> None:
        """Compile the functionals and take the initial momenta."""
        self._dynamic = "v" in simulation.scheme.rates
        if not self._dynamic:
            return
        shells = list(simulation.model.shells.values())
        self._axes = [fem.Constant(s.mixed.space.mesh, np.zeros(3)) for s in shells]
        self._length = simulation.model.length
        self._momenta = self._functionals(simulation, shells)
        free = not simulation.model.supported
        conserved = [k for k in KINDS if free and k in simulation.scheme.conserves]
        self._impulses = {k: self._impulse(simulation, shells, k) for k in conserved}
        points = PointImpulse(simulation) if conserved else None
        self._points = points if points is not None and points.forces else None
        self._mass = self._total_mass(simulation, shells) if conserved else 0.0
        self._take()
        for kind in conserved:
            self._expected.setdefault(kind, self.values[kind].copy())
            self.drift.setdefault(kind, 0.0)
        self._sizes()

    def _functionals(
        self, simulation: Simulation, shells: list[ShellModel]
    ) -> dict[str, Scalar | None]:
        linear: list[Form | None] = []
        angular: list[Form | None] = []
        for shell, axis in zip(shells, self._axes, strict=True):
            levels = simulation.problem.levels[shell.name]
            q, v = levels.q, levels.rates["v"]
            linear.append(shell.momentum(v, axis))
            angular.append(shell.angular_momentum(q, v, axis))
        comm = simulation.model.comm
        return {"momentum": scalar(linear, comm), "angular momentum": scalar(angular, comm)}

    def _impulse(
        self, simulation: Simulation, shells: list[ShellModel], kind: str
    ) -> Scalar | None:
        """Component along the axis of the force or torque of loads and added terms."""
        forms: list[Form | None] = []
        for shell, axis in zip(shells, self._axes, strict=True):
            last = simulation.problem.forms[shell.name][simulation.problem.last]
            mid = last.stage.span.mid
            direction = self._direction(shell, kind, mid, axis)
            if last.loads is not None:
                forms.append(last.loads.virtual_work(mid, direction))
            time = simulation.problem.time(shell.name)
            forms.append(shell.extra(mid, last.stage.velocity, direction, time))
        return scalar(forms, simulation.model.comm)

    def _direction(self, shell: ShellModel, kind: str, mid: Expr, axis: fem.Constant) -> Expr:
        return shell.translation(axis) if kind == "momentum" else shell.rotation(mid, axis)

    def _total_mass(self, simulation: Simulation, shells: list[ShellModel]) -> float:
        """Mass, as the momentum of a unit velocity along that velocity."""
        forms = [
            shell.momentum(shell.translation(axis), axis)
            for shell, axis in zip(shells, self._axes, strict=True)
        ]
        mass = scalar(forms, simulation.model.comm)
        return float(self._vector(mass)[0])

    def _vector(self, functional: Callable[[], float] | None) -> Floats:
        """A functional along each of the three axes."""
        result = np.zeros(3)
        if functional is None:
            return result
        for k in range(3):
            for axis in self._axes:
                axis.value = np.eye(3)[k]
            result[k] = functional()
        return result

    def _take(self) -> None:
        self.values = {kind: self._vector(f) for kind, f in self._momenta.items()}

    def _sizes(self) -> None:
        for kind in self._expected:
            size = float(np.linalg.norm(self.values[kind]))
            self._largest[kind] = max(self._largest.get(kind, 0.0), size)
        self._kinetic = max(self._kinetic, self.account.values["kinetic_energy"])

    def solved(self, simulation: Simulation) -> None:
        """Add the impulses of the step."""
        if not self._dynamic or not self._expected or simulation.last is None:
            return
        for kind, functional in self._impulses.items():
            self._expected[kind] += simulation.last.dt * self._vector(functional)
        if self._points is not None:
            for kind, impulse in self._points.impulse(simulation).items():
                if kind in self._expected:
                    self._expected[kind] += impulse

    def accepted(self, simulation: Simulation) -> None:
        """Take the momenta and see what is left unexplained."""
        if not self._dynamic:
            return
        self._take()
        for kind, expected in self._expected.items():
            drift = float(np.linalg.norm(self.values[kind] - expected))
            self.drift[kind] = max(self.drift[kind], drift)
        self._sizes()

    def relative_drift(self, kind: str) -> float | None:
        """Largest drift relative to the largest momentum; None where it is not conserved.

        Args:
            kind: "momentum" or "angular momentum".
        """
        if kind not in self.drift:
            return None
        size = float(np.sqrt(2 * self._mass * self._kinetic))
        if kind == "angular momentum":
            size *= self._length
        scale = max(self._largest[kind], SMALL * size)
        return self.drift[kind] / scale if scale > 0 else 0.0

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return {
            f"{COLUMNS[kind]}_{axis}": float(vector[k])
            for kind, vector in self.values.items()
            for k, axis in enumerate("xyz")
        }

    def state(self) -> dict[str, Any]:
        """The sums and largest values so far."""
        return {
            "expected": {kind: vector.tolist() for kind, vector in self._expected.items()},
            "drift": dict(self.drift),
            "largest": dict(self._largest),
            "kinetic": self._kinetic,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up saved sums."""
        self._expected = {kind: np.array(vector) for kind, vector in state["expected"].items()}
        self.drift, self._largest = dict(state["drift"]), dict(state["largest"])
        self._kinetic = float(state["kinetic"])
