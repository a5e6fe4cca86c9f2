"""Error bands of a run's history and results from uncertain parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from shellmb.arrays import Floats, reals
from shellmb.errors import SceneError
from shellmb.scene.lookup import listed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# standard deviations that a band is drawn to
WIDTH = 2.0
# size of a plot, inches
WIDE, HIGH = 7.0, 3.0


class Band:
    """Standard deviations of histories and results, to first order in the parameters.

    Args:
        found: The run with its derivatives, which are `Sensitivities`.
        covariance: Covariance of the parameters: a DataFrame by their names, an array in their
            order, or standard deviations by name, of parameters that do not depend on each other.

    Attributes:
        covariance: It, an array in the order of the parameters.

    Raises:
        SceneError: If it is none, or of other parameters.
    """

    def __init__(self, found: Any, covariance: Any) -> None:
        self._found = found
        self.covariance = covariance_of([p.name for p in found.parameters], covariance)

    def _deviations(self, slopes: Sequence[Floats]) -> Floats:
        """Standard deviations of numbers from their derivatives by each parameter."""
        J = np.array(slopes)
        return np.sqrt(np.maximum(np.einsum("i...,ij,j...->...", J, self.covariance, J), 0.0))

    @cached_property
    def history(self) -> pd.DataFrame:
        """Standard deviation of each column over time."""
        table, names = self._found.history, [p.name for p in self._found.parameters]
        columns = list(table[names[0]].columns)
        found = self._deviations([table[name][columns].to_numpy(dtype=float) for name in names])
        return pd.DataFrame(found, index=table.index, columns=columns)

    @cached_property
    def results(self) -> pd.Series:
        """Standard deviation of each result."""
        table = self._found.results
        found = self._deviations([table[name].to_numpy(dtype=float) for name in table])
        return pd.Series(found, index=table.index)

    def plot(self, columns: str | Sequence[str] | None = None) -> Figure:
        """Histories with a band of two standard deviations at each side.

        Args:
            columns: Columns of the history; None: the probes.

        Raises:
            SceneError: If there is no such column, or none is named and there are no probes.
        """
        from shellmb.observers.drawing import figure
        from shellmb.show.plots import column_label

        run, described = self._found.run.history, self._found.run.described
        # rows of events are at times that move
        fixed = np.ones(len(run), bool)
        if "t" in self.history:
            fixed = self.history["t"].to_numpy() == 0
        wanted = [columns] if isinstance(columns, str) else list(columns or ())
        wanted = wanted or [p.name for p in described.probes]
        if not wanted:
            raise SceneError("band: the run has no probes; name columns of its history")
        for name in wanted:
            if name not in self.history:
                raise SceneError(
                    f"band: there is no column '{name}'; there are {listed(self.history.columns)}"
                )
        made = figure(WIDE, HIGH * len(wanted))
        axes = made.subplots(len(wanted), 1, squeeze=False)
        for ax, name in zip(axes[:, 0], wanted, strict=True):
            value, wide = run[name].to_numpy(dtype=float), WIDTH * self.history[name].to_numpy()
            low, high = (value - wide)[fixed], (value + wide)[fixed]
            ax.fill_between(run["t"][fixed], low, high, alpha=0.3, label="2 deviations")
            ax.plot(run["t"], value, label=name)
            ax.set_xlabel(described.time_label)
            ax.set_ylabel(column_label(described, name))
            ax.legend()
        return made


def covariance_of(names: Sequence[str], given: Any) -> Floats:
    """A covariance as an array in the order of parameters.

    Args:
        names: Names of the parameters.
        given: As of `Band`.

    Raises:
        SceneError: If it is none, or of other parameters.
    """
    try:
        if isinstance(given, Mapping):
            _check_names(names, list(given))
            deviations = np.array([float(given[name]) for name in names])
            found = np.diag(np.where(deviations >= 0, deviations, np.nan) ** 2)
        elif hasattr(given, "loc"):
            _check_names(names, list(given.columns))
            found = reals(given.loc[list(names), list(names)])
        else:
            found = reals(given)
    except (TypeError, ValueError, KeyError, AttributeError):
        found = np.array(np.nan)
    if not np.isfinite(found).all():
        raise SceneError(
            f"band: covariance is {given!r:.60}; it must be finite numbers: a covariance, or "
            "standard deviations by name, which are not negative"
        )
    shape = (len(names), len(names))
    if found.shape != shape:
        raise SceneError(
            f"band: covariance has the shape {found.shape}; it must be {shape}, for {listed(names)}"
        )
    sizes = np.sqrt(np.abs(np.diag(found)))
    products = np.outer(sizes, sizes)
    # what is known exactly has no size
    scaled = found / np.where(products > 0, products, 1.0)
    # round-off of an inverse
    wrong = not np.allclose(scaled, scaled.T, atol=1e-6)
    if wrong or np.linalg.eigvalsh((scaled + scaled.T) / 2).min() < -1e-6:
        raise SceneError(
            "band: covariance is not symmetric and positive; give variances and covariances, or "
            "standard deviations by name"
        )
    return found


def _check_names(names: Sequence[str], given: Sequence[str]) -> None:
    if set(given) != set(names):
        raise SceneError(
            f"band: covariance is of {listed(given)}; it must be of the parameters {listed(names)}"
        )
