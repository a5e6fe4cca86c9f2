"""Linear and angular momentum, and how well the scheme balances them.

The change of a momentum over a step is the impulse of loads and supports (`forces.reactions`); the
drift is what is left when that impulse is taken away. It is round-off where a scheme conserves the
momentum, and the error of the scheme where it does not.
"""

import math
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.observers.account.energy import EnergyAccount, present
from shellmb.observers.deferred import STEPS, Booked, DeferredObserver, Row, StepValues
from shellmb.observers.forces.reactions import Impulse
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.functionals import functionals, vector_of

KINDS = {"momentum": "linear", "angular momentum": "angular"}
COLUMNS = [f"{name}_{axis}" for name in ("momentum", "angular_momentum") for axis in "xyz"]

# below this part of m v, with v from the largest kinetic energy, and of the impulses of single
# nodes, a momentum is as good as zero, and its drift is measured by that part instead: of forces
# that cancel one another round-off remains
SMALL = 1e-3
# motions in a step, relative to the scene, of which a momentum is not known to 1e-6, and an energy
# not to 1e-8: round-off of 1e-16 in positions is a velocity in each step
SLOWEST, STILL = 1e-9, 1e-10


class Momentum(DeferredObserver):
    """Momenta about the origin, what was exchanged of them, and their drift.

    Args:
        account: The energy balance, for the scale of a momentum that is zero.

    Attributes:
        drift: Largest drift so far, in the units of `values`; empty in statics.
    """

    drift = Booked[Row]()
    remembered = ("_initial", "_drift", "_largest", "_gross", "_impulses")

    def __init__(self, account: EnergyAccount) -> None:
        super().__init__()
        self.account = account
        self._drift: dict[str, float] = {}
        # none before the start
        self._initial = np.zeros((0, 3))
        # impulses so far: of loads, of supports, and of impacts at which something begins to act
        self._impulses = np.zeros((3, 2, 3))
        self._largest = dict.fromkeys(KINDS, 0.0)
        self._gross = self._slowest = 0.0

    @property
    def values(self) -> dict[str, Floats]:
        """Momenta by their `KINDS`, kg m/s and kg m^2/s, each of shape (3,)."""
        self.book()
        return dict(zip(KINDS, self._vectors, strict=True)) if self._drift else {}

    @property
    def _vectors(self) -> Floats:
        """Both momenta with all steps booked, shape (2, 3)."""
        return np.reshape([*self._now.values()], (2, 3))

    def start(self, simulation: Simulation) -> None:
        """Make the functionals and take the initial momenta."""
        bodies: list[Any] = [b for b in simulation.model.bodies if hasattr(b, "momentum")]
        # bodies without places have no momenta
        self._dynamic = "v" in simulation.scheme.rates and bool(bodies)
        if not self._dynamic:
            return
        self._length, self._held = simulation.model.length, simulation.model.supported
        now, along = list[Form | None](), list[Form | None]()
        for body in bodies:
            space, levels = body.mixed.space, simulation.problem.levels[body.name]
            axes = vector_of(space.mesh, 6)
            # of small motions about the reference positions
            now.append(_both(body, (levels.reference or levels).q, levels.rates["v"], axes))
            # the displacement of a body; of a place on one "u1"
            unit, part = fem.Function(space), "u" if "u" in body.mixed.dofs else "u1"
            unit.x.array[body.mixed.dofs[part].reshape(-1, 3)[:, 0]] = 1.0
            along.append(_both(body, levels.q, unit, axes))
        self._momenta = StepValues(functionals([present(now)], simulation.model.comm))
        self._impulse = Impulse(simulation)
        # the momentum of a unit velocity along that velocity
        self._mass = float(functionals([present(along)], simulation.model.comm)()[0])
        self._take()
        if not len(self._initial):
            self._initial = self._vectors
        for kind in KINDS:
            self._drift.setdefault(kind, 0.0)
        self._sizes(np.stack([self._vectors, *self._impulses])[:, None])

    def _take(self) -> None:
        self._momenta.take(0)
        self.begin(*_columns(self._momenta.of(slice(0, 1))))

    def _sizes(self, vectors: Floats) -> None:
        """Largest vectors of both kinds.

        Args:
            vectors: Momenta and impulses so far, shape (4, steps, 2, 3).
        """
        squares = np.add.reduce(vectors * vectors, axis=3)
        for kind, square in zip(KINDS, squares.max(axis=(0, 1)).tolist(), strict=True):
            self._largest[kind] = max(self._largest[kind], math.sqrt(square))

    def switched(self, simulation: Simulation) -> None:
        """The impact at which something begins to act: on ground it changes the momenta."""
        super().switched(simulation)
        if not self._dynamic or not self._held:
            # the impact of one body on another changes nothing
            return
        before = self._vectors
        self._take()
        self._impulses[2] += self._vectors - before

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Take the impulses of the step."""
        if not self._dynamic:
            return
        self._impulse.take(simulation.solved.dt, row)
        speed = self._length / simulation.solved.dt
        self._slowest = max(self._slowest, SLOWEST * self._mass * speed)
        self.account.raise_floor(self._mass * (STILL * speed) ** 2 / 2)

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take the momenta."""
        if self._dynamic:
            self._momenta.take(row)

    def book_rows(self, rows: slice) -> list[Row]:
        """Add impulses up, and see what is left unexplained."""
        if not self._dynamic:
            return [{} for _ in range(*rows.indices(STEPS))]
        after = self._momenta.of(rows).reshape(-1, 2, 3)
        before = [*self._impulses[:2].ravel(), self._gross]
        sums = np.add.accumulate(np.vstack([before, self._impulse.of_steps(rows)]))[1:]
        self._gross = float(sums[-1, 12])
        loads, supports = sums[:, :12].reshape(-1, 2, 2, 3).swapaxes(0, 1)
        impacts = np.broadcast_to(self._impulses[2], loads.shape)
        vectors = np.stack([after, loads, supports, impacts])
        left = after - self._initial - np.add.reduce(vectors[1:])
        drift = np.linalg.norm(left, axis=2).max(axis=0)
        for kind, largest in zip(KINDS, drift.tolist(), strict=True):
            self._drift[kind] = max(self._drift[kind], largest)
        self._sizes(vectors)
        self._impulses = vectors[1:, -1].copy()
        return _columns(after)

    def relative_drift(self, kind: str) -> float | None:
        """Largest drift relative to what was there or was exchanged; None in statics.

        Args:
            kind: "momentum" or "angular momentum".
        """
        if kind not in self.drift:
            return None
        size = float(np.sqrt(2 * self._mass * max(self.account.fastest, self.account.floor)))
        least = max(SMALL * (size + self._gross), self._slowest)
        if kind == "angular momentum":
            least *= self._length
        scale = max(self._largest[kind], least)
        return self.drift[kind] / scale if self.drift[kind] > 0 else 0.0


def _columns(momenta: Floats) -> list[Row]:
    """Columns of the history, of momenta of some steps, shape (n, 2, 3)."""
    return [dict(zip(COLUMNS, row, strict=True)) for row in momenta.reshape(-1, 6).tolist()]


def _both(body: Any, q: Expr, v: Expr, axes: Expr) -> Form | None:
    """Linear and angular momentum of a body, in one kernel, as it has both in most cases."""
    along, about = (ufl.as_vector([axes[k + n] for k in range(3)]) for n in (0, 3))
    linear, angular = body.momentum(v, along), body.angular_momentum(q, v, about)
    return angular if linear is None else linear + angular
