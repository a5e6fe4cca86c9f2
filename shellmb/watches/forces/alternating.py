"""Forces that alternate from step to step, which have less to do with those in between."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import Silent, Simulation
from shellmb.watches.base import Caution

Floats = npt.NDArray[np.float64]

# what alternates, as a part of what does not
SHARE = 0.1
# part of the steps whose change is against that of the step before: two thirds, in noise
TURNS = 0.8
# steps from which on that can be told
STEPS = 50
# part of the largest force, or torque: below is round-off
NOTHING = 1e-9


class Alternating(Silent):
    """Looks at the end of a run at forces of joints and efforts of drivers and force elements.

    They are means over a step, or follow from rates at its end. Velocities of EP violate
    constraints a little, by what changes its sign from step to step; and so do the forces of
    whatever vibrates faster than the steps resolve and is not damped.

    Args:
        sources: The observers of the run.
    """

    name = "alternation"

    def __init__(self, sources: Sources) -> None:
        self._history = sources.history

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """What alternates most; nothing where forces at the ends of steps are there."""
        scheme, rows = simulation.scheme, self._history.rows
        if not scheme.dynamic or simulation.scene.output.end_forces or len(rows) <= STEPS:
            return
        units = [_forces(simulation), [[c] for c in rows[0] if c.endswith("torque")]]
        units[0] += [[c] for c in rows[0] if c.endswith("force")]
        found = []
        for unit in units:
            series = {names[0]: _series(rows, names) for names in unit}
            sizes = {name: _size(f) for name, f in series.items()}
            least = NOTHING * max(sizes.values(), default=0.0)
            found += [(_share(f), name) for name, f in series.items() if sizes[name] > least]
        alternate = [(share, name) for share, name in found if share > SHARE]
        if not alternate:
            return
        share, column = max(alternate)
        what = column.removesuffix(".F1")
        others = f", and {len(alternate) - 1} more" if len(alternate) > 1 else ""
        # one that dissipates already has nothing more to damp it with
        damped = scheme.dissipation()[0] > 0
        ways = "a smaller step" if damped else "--scheme ed3 or a smaller step"
        yield Caution(
            self.name,
            None,
            share,
            SHARE,
            f"the force of '{what}'{others} alternates from step to step, by {share:.2g} times "
            "its mean over two: velocities violate constraints a little, or something vibrates "
            f"faster than steps resolve; use {ways}, or --end-forces for values at the ends of "
            "steps",
        )


def _forces(simulation: Simulation) -> list[list[str]]:
    """Columns of the force of each joint."""
    return [[f"{name}.F{k}" for k in (1, 2, 3)] for name in simulation.model.mechanism.joints]


def _series(rows: list[dict[str, float]], names: list[str]) -> Floats:
    """Columns over the steps, shape (n, number of names); from where on all are known."""
    values = np.array([[row[name] for name in names] for row in rows])
    return values[np.all(np.isfinite(values), axis=1)]


def _size(f: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(f**2, axis=1)))) if len(f) else 0.0


def _share(f: Floats) -> float:
    """What alternates over what does not; 0 where too few steps turn back what those before did."""
    change = np.diff(f, axis=0)
    if len(f) <= STEPS or np.mean(np.sum(change[1:] * change[:-1], axis=1) < 0) < TURNS:
        return 0.0
    mean = _size(f[2:] + 2 * f[1:-1] + f[:-2])
    return _size(f[2:] - 2 * f[1:-1] + f[:-2]) / max(mean, 1e-300)
