"""Rankings of parameters: derivatives made comparable, and drawn as bars."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from shellmb.api.sensitivity.record import Sensitivities
from shellmb.errors import SceneError
from shellmb.options.described import takes
from shellmb.scene.lookup import listed

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Ranking:
    """Effects of parameters, in comparable units.

    Args:
        table: Change of each result or history in per cent for one per cent of each parameter, a
            row for each of them and a column for each parameter, the most important one first. Of a
            parameter that is zero it is one per cent of its size in `scales`. Of a history it is
            the root mean square of the change over time, over that of the history, without a sign.
    """

    table: pd.DataFrame

    def plot(self) -> Figure:
        """Bars, one group for each result or history."""
        from shellmb.observers.drawing import figure

        made = figure(7.0, 1.0 + 0.5 * self.table.size)
        ax, wide = made.subplots(), 0.8 / len(self.table.columns)
        places = np.arange(len(self.table))
        for k, name in enumerate(self.table.columns):
            ax.barh(places + k * wide, self.table[name], wide, label=name)
        ax.set_yticks(places + 0.4 - wide / 2, list(self.table.index))
        ax.set_xlabel("change [%] for 1 % of the parameter")
        ax.invert_yaxis()
        ax.legend()
        return made


@takes()
def rank(found: Sensitivities, of: str | Sequence[str] | None = None) -> Ranking:
    """Order parameters by how much they matter.

    Args:
        found: A run with its derivatives.
        of: Results, or columns of the history; None: the results, or the probes if there are none.

    Raises:
        SceneError: If there is no such result or column.
    """
    if not isinstance(found, Sensitivities):
        raise SceneError(
            f"rank: found is a {type(found).__name__}; it must be what `sensitivities` returns"
        )
    wanted = [of] if isinstance(of, str) else list(of or ())
    columns = found.history[found.parameters[0].name].columns
    if not wanted:
        probes = [p.name for p in found.run.described.probes]
        wanted = [name for name in found.results.index if found.run.results[name]] or probes
    if not wanted:
        raise SceneError("rank: it has neither results nor probes; name columns of its history")
    rows = {}
    for name in wanted:
        known = name in found.results.index
        if not known and name not in columns:
            raise SceneError(
                f"rank: there is no result or column '{name}'; there are "
                f"{listed([*found.results.index, *columns])}"
            )
        value = found.run.results[name] if known else _mean(found.run.history[name])
        rows[name] = dict[str, float]()
        for p in found.parameters:
            slope = found.results[p.name][name] if known else _mean(found.history[p.name][name])
            size = (p.value if known else abs(p.value)) or p.size
            rows[name][p.name] = slope * size / (value or float("nan"))
    table = pd.DataFrame(rows).T
    order = table.abs().max().sort_values(ascending=False).index
    return Ranking(table[list(order)])


def _mean(values: pd.Series) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.nanmean(np.square(values.to_numpy(dtype=float)))))
