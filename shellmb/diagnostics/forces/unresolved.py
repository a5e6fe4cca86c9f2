"""Functions of time, and laws of motors, that jump within steps or vary faster than they resolve.

All schemes average what acts by Gauss' three points of a step. A jump counts from the next of these
points on: the impulse is off by up to a quarter of a step, and the run is of first order. Three
points in each half of the step show by how much.
"""

from collections.abc import Callable

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, Watch
from shellmb.model.joints.coordinates import COLUMN
from shellmb.model.massless import LawValues
from shellmb.scene.lookup import said
from shellmb.schemes.base import GAUSS_TIMES, GAUSS_WEIGHTS
from shellmb.simulate.simulation import Simulation

# part of an impulse that is said where it is off; of what is smooth in steps it is below 1e-5
MISSED = 1e-3
# points of a step, and what the mean over both halves is more than that over the whole
POINTS = np.concatenate([GAUSS_TIMES, GAUSS_TIMES / 2, 0.5 + GAUSS_TIMES / 2])
MORE = np.concatenate([-GAUSS_WEIGHTS, GAUSS_WEIGHTS / 2, GAUSS_WEIGHTS / 2])
# states at which laws are evaluated together
TOGETHER = 512


class Unresolved(Watch):
    """Looks at the end of a run at what acted between the points of its steps."""

    name = "unresolved in time"

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each load and motor that steps do not resolve."""
        (t,) = self.columns("t")
        if not simulation.scheme.dynamic or len(t) < 2:
            return
        # loads may share a function
        of_time = {id(load.time): (load, load.time) for load in simulation.scene.loads if load.time}
        for load, function in of_time.values():
            # they have no name of their own
            on = f" on '{load.body}'" if getattr(load, "body", None) else ""
            yield from self._caution(f"{said(load)}{on}", t, _factors(simulation, function, t))
        for group in simulation.model.mechanism.element_groups:
            if law := group.by_law(TOGETHER):
                for item in group.items:
                    column = f"{item.coordinate.joint}.{COLUMN[item.coordinate.kind]}"
                    values = _along(law, t, self.columns(column)[0])
                    yield from self._caution(said(item.element), t, values)

    def _caution(self, who: str, t: Floats, values: Floats) -> Cautions:
        """Say what is missed of an impulse, if it is much.

        Args:
            who: What acts.
            t: Ends of steps, shape (n + 1,), s.
            values: What acts at the points of steps, shape (n, points).
        """
        dt = np.diff(t)
        missed, size = np.abs(values @ MORE) * dt, np.abs(values[:, :3]) @ GAUSS_WEIGHTS * dt
        share = float(np.sum(missed) / max(np.sum(size), 1e-300))
        if not share > MISSED:
            return
        worst = int(np.argmax(missed))
        says = (
            f"{who} jumps within steps, or varies faster than they resolve, most from t = "
            f"{t[worst]:.6g} to {t[worst + 1]:.6g}: its impulse is off by about {share:.1%}, and "
            "the run is of first order, whatever the scheme; let a step end at each jump with "
            "StepControl(times=...), or use smaller steps"
        )
        yield self.caution(None, share, MISSED, says)


def _factors(simulation: Simulation, function: Callable[[float], float], t: Floats) -> Floats:
    """Values of a function of time at the points of all steps, shape (n, points)."""
    at = t[:-1, None] + np.diff(t)[:, None] * POINTS
    values = [simulation.problem.start_factor(float(each), function) for each in at.flat]
    return np.reshape(values, at.shape)


def _along(law: LawValues, t: Floats, x: Floats) -> Floats:
    """Values of a law at the points of all steps, along the way between their ends; collective.

    Args:
        law: The law.
        t: Ends of steps, shape (n + 1,), s.
        x: Coordinate there.
    """
    dt, change = np.diff(t)[:, None], np.diff(x)[:, None]
    rates = np.broadcast_to(change / dt, (len(dt), len(POINTS)))
    states = x[:-1, None] + change * POINTS, rates, t[:-1, None] + dt * POINTS
    return law(*(each.ravel() for each in states)).reshape(len(dt), -1)
