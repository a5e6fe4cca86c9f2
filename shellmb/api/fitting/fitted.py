"""Results of a fit: values, their uncertainty, and residuals."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from shellmb.api.fitting.data import Data
from shellmb.arrays import Floats

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from shellmb.api.fitting.band import Band
    from shellmb.api.sensitivity.record import Sensitivities


# relative standard deviation of a combination of parameters from which on data do not see it, and
# the least share of a parameter in it that is named
UNSEEN, SHARE = 0.5, 0.1
# relative standard deviation beyond which a combination is not seen at all: the derivatives have
# seven digits
BLIND = 1e4
# value over the size of a parameter below which it is near zero
NEAR = 0.1
# what correlations of residuals may be off before the model is doubted, in standard deviations of
# those of white noise (by Fisher's transformation, without which few values are never beyond);
# and how many values apart they are at most
DOUBT, APART = 4.5, 20
# residuals over the largest value, below which they are what Newton's method leaves: such data are
# the model's own, and no noise is expected in them
EXACT = 1e-9
# the sum of squares is doubted where noise has one that is as far off so seldom
SELDOM = 1e-6
# deviations to the least misfit within which a search has found it; where it ends by itself, far
# fewer are left
SHORT = 0.5


class Fit:
    """Parameters fitted to measurements.

    Args:
        found: The run with its derivatives at the fitted values.
        data: The measurements.
        residual: Misfits over their noise.
        jacobian: Their derivatives by the parameters.
        runs: Number of runs.
        converged: Whether the fit came to its end.
        at_bounds: Parameters that are at a bound.
        start: Values at which parameters began.
        impossible: Why the last run that failed was none, if one did.

    Attributes:
        sensitivities: The run with its derivatives at the fitted values.
        values: Fitted values by name.
        runs: Number of runs.
        converged: Whether the fit came to its end.
        warnings: What the fit and its derivatives say against themselves, each a sentence.
    """

    def __init__(
        self,
        found: Sensitivities,
        data: Data,
        residual: Floats,
        jacobian: Floats,
        *,
        runs: int,
        converged: bool,
        at_bounds: tuple[str, ...] = (),
        start: Mapping[str, float] | None = None,
        impossible: str | None = None,
    ) -> None:
        self.sensitivities, self.runs, self.converged = found, runs, converged
        self._data, self._residual = data, residual
        self.values = {p.name: p.value for p in found.parameters}
        self._start, free = dict(start or {}), len(residual) - len(self.values)
        # of noise that is not known: what is left tells its size
        self.noise_factor = 1.0 if data.known else float(np.sqrt(residual @ residual / free))
        # a value near zero has the size that it began with
        self._sizes = np.array(
            [abs(p.value) if abs(p.value) >= NEAR * p.size else p.size for p in found.parameters]
        )
        # there are as many values as parameters, or more
        sides, self._singular, self._directions = np.linalg.svd(
            jacobian * self._sizes, full_matrices=False
        )
        # what the least misfit of a linear model would take from residuals, by combination
        self._left = residual @ sides
        own = [*self._unfinished(at_bounds, impossible), *self._unseen(), *self._doubts()]
        self.warnings = (*own, *found.warnings)

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of the values; infinite for combinations that the data do not determine."""
        names = list(self.values)
        with np.errstate(divide="ignore", invalid="ignore"):
            scaled = self._directions.T / self._singular
            terms = scaled[:, None] * scaled
        # a parameter that has no part in what is not determined at all
        terms[np.isnan(terms)] = 0.0
        found = self.noise_factor**2 * terms.sum(axis=-1) * np.outer(self._sizes, self._sizes)
        return pd.DataFrame(found, index=names, columns=names)

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of each value."""
        variances = np.diag(self.covariance.to_numpy())
        return dict(zip(self.values, np.sqrt(variances).tolist(), strict=True))

    @property
    def correlation(self) -> pd.DataFrame:
        """Correlation of the values."""
        covariance = self.covariance
        sizes = np.sqrt(np.diag(covariance.to_numpy()))
        return covariance.div(sizes, axis=0).div(sizes, axis=1)

    @property
    def table(self) -> pd.DataFrame:
        """Values, standard deviations and starts, a row for each parameter."""
        rows = {"value": self.values, "deviation": self.deviations, "start": self._start}
        return pd.DataFrame(rows)

    @property
    def residuals(self) -> pd.DataFrame:
        """Run minus data, in the units of the data, over their times; NaN where there are none."""
        found = {name: rest * self._data.noise[name] for name, rest in self._over_noise.items()}
        return pd.DataFrame(found, index=pd.Index(self._data.times, name="t"))

    @cached_property
    def _over_noise(self) -> dict[str, Floats]:
        """Residuals over their noise by column, shape (n,); NaN where there are none."""
        found, first = {}, 0
        for name, values in self._data.values.items():
            there = ~np.isnan(values)
            found[name] = np.full(len(values), np.nan)
            last = first + int(there.sum())
            found[name][there], first = self._residual[first:last], last
        return found

    def band(self) -> Band:
        """Error bands of the run's histories that follow from the uncertainty of the values."""
        return self.sensitivities.band(self.covariance)

    def _unfinished(self, at_bounds: tuple[str, ...], impossible: str | None) -> list[str]:
        found = [
            f"'{name}' is at its bound {self.values[name]:g}: its deviation says nothing"
            for name in at_bounds
        ]
        if not self.converged:
            more = f"give more, or bounds: {impossible}" if impossible else "give more"
            found.append(f"the fit did not end in {self.runs} runs: values may change; {more}")
        elif impossible and self._is_short() and not at_bounds:
            found.append(
                "the search stopped before the least misfit, beside values that are impossible, so "
                f"that deviations say nothing; begin elsewhere, or give bounds: {impossible}"
            )
        return found

    def _is_short(self) -> bool:
        """Decide whether values are short of the least misfit, as far as data determine them."""
        seen = self._singular > self.noise_factor
        left = float(np.linalg.norm(self._left[seen]))
        exact = all(self._is_exact(name) for name in self._data.values)
        return left > SHORT * self.noise_factor and not exact

    def _is_exact(self, name: str) -> bool:
        """Decide whether residuals of a column are what Newton's method leaves of its values."""
        left = np.nanmax(np.abs(self._over_noise[name] * self._data.noise[name]))
        return bool(left <= EXACT * np.nanmax(np.abs(self._data.values[name])))

    def _unseen(self) -> list[str]:
        """Combinations of parameters that the data do not see."""
        said = []
        for size, direction in zip(self._singular, self._directions, strict=True):
            if self.noise_factor >= UNSEEN * size:
                direction = direction * np.sign(direction[np.argmax(np.abs(direction))])
                parts = " ".join(
                    f"{name}^{part:+.2g}"
                    for name, part in zip(self.values, direction, strict=True)
                    if abs(part) >= SHARE
                )
                blind = self.noise_factor >= BLIND * size
                seen = "at all" if blind else f"to {100 * self.noise_factor / size:.2g} %"
                said.append(
                    f"the data do not determine the combination {parts} "
                    f"({'not' if blind else 'only'} {seen}): fix one of its parameters, or measure "
                    "something else"
                )
        return said

    def _doubts(self) -> list[str]:
        """Find what residuals have that noise has not."""
        from scipy.stats import chi2

        said = []
        for name, column in self._over_noise.items():
            if self._is_exact(name):
                continue
            rest = column[~np.isnan(column)]
            apart, correlation = _correlation(rest)
            if np.arctanh(min(abs(correlation), 1 - 1e-12)) * np.sqrt(len(rest)) > DOUBT:
                those = "neighbours" if apart == 1 else f"values {apart} rows apart"
                said.append(
                    f"residuals of '{name}' are not white: {those} correlate by "
                    f"{correlation:.2f}; the model lacks something, and deviations are too small"
                )
        free = len(self._residual) - len(self.values)
        squares = float(self._residual @ self._residual)
        if self._data.known and free > 0:
            for kind, chance in (("larger", chi2.sf), ("smaller", chi2.cdf)):
                if chance(squares, free) < SELDOM:
                    said.append(
                        f"residuals are {kind} than the noise by a factor of "
                        f"{np.sqrt(squares / free):.3g}: the noise differs from the given one, or "
                        "the model lacks something"
                    )
        return said

    def plot(self) -> Figure:
        """Plot data and run over time, and below them the residuals over the noise."""
        from shellmb.observers.drawing import figure
        from shellmb.show.plots import column_label

        run, names = self.sensitivities.run.history, list(self._data.values)
        described = self.sensitivities.run.described
        made = figure(7.0, 4.5 * len(names))
        rows, ratios = 2 * len(names), [2, 1] * len(names)
        axes = made.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=ratios)
        for k, name in enumerate(names):
            above, below = axes[2 * k, 0], axes[2 * k + 1, 0]
            above.plot(self._data.times, self._data.values[name], ".", ms=3, label="data")
            above.plot(run["t"], run[name], lw=1, label="run")
            above.set_ylabel(column_label(described, name))
            above.legend()
            below.plot(self._data.times, self._over_noise[name] / self.noise_factor, ".", ms=3)
            below.axhline(0, lw=0.5)
            below.set_ylabel("run - data\n/ noise [-]")
        # the others have no ticks of their own
        axes[-1, 0].set_xlabel(described.time_label)
        return made

    def __repr__(self) -> str:
        deviations = self.deviations
        rows = ", ".join(f"{n} = {v:.6g} +- {deviations[n]:.2g}" for n, v in self.values.items())
        said = "".join(f"\n  warning: {sentence}" for sentence in self.warnings)
        return f"<Fit in {self.runs} runs: {rows}>{said}"


def _correlation(rest: Floats) -> tuple[int, float]:
    """Rows by which residuals are apart that correlate most, and their correlation.

    A vibration of four values to a period, say, has no correlation of neighbours.
    """
    count, power = len(rest), float(rest @ rest)
    if count < 10 or power == 0.0:
        return 1, 0.0
    found = [
        (apart, float(rest[apart:] @ rest[:-apart]) / power)
        for apart in range(1, min(count // 2, APART) + 1)
    ]
    return max(found, key=lambda each: abs(each[1]))
