"""Fit parameters of a scene to measurements, by scipy's least squares with our Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd

from shellmb.api.fitting.data import END, Data, data_of
from shellmb.api.fitting.fitted import Fit
from shellmb.api.sensitivity.run import sensitivities
from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError, SceneError
from shellmb.options.described import options_of, takes
from shellmb.options.run import Options
from shellmb.scene import Scene
from shellmb.scene.lookup import listed
from shellmb.sensitivity.parameters import Parameter, differentiated

if TYPE_CHECKING:
    from shellmb.api.sensitivity.record import Sensitivities

# change of the sum of squares, or of parameters, relative to them, at which a fit ends
TOLERANCE = 1e-6


@takes(*options_of(Options))
def fit(
    scene: Callable[..., Scene] | str,
    data: pd.DataFrame,
    parameters: Sequence[str],
    *,
    noise: float | Mapping[str, Any] | None = None,
    values: Mapping[str, Any] | None = None,
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
    scales: Mapping[str, float] | None = None,
    runs: int = 30,
    tell: Callable[[str], None] | None = None,
    **options: Any,
) -> Fit:
    """Fit parameters of a scene to measurements.

    Each iteration is one run with its derivatives (`sensitivities`).

    Args:
        scene: A function that makes the scene from its parameters, the name of a bundled scene, or
            the path of a Python file.
        data: Measured columns of the history over times; times are its column `t`, or its index. A
            value that was not measured is NaN.
        parameters: Names of the parameters, which begin at their values in the scene.
        noise: Standard deviation of the noise of all columns, or of each by its name: a number, or
            one for each row of the data. None: it is found from what is left, as the same share of
            the size of each column.
        values: Values of parameters of the scene that replace its defaults.
        bounds: Least and largest values of parameters, None where there is no bound.
        scales: Sizes of parameters, where their values do not tell.
        runs: Largest number of runs.
        tell: Callback for a line of progress per run.
        **options: Choices that replace the scene's, as `shellmb run` has them.

    Returns:
        Values, their covariance, what is left, and warnings.

    Raises:
        SceneError: If the scene, a parameter or the data are impossible.
        ConvergenceError: If the first run fails.
    """
    from scipy.optimize import least_squares

    if runs < 1:
        raise SceneError(f"fit: runs is {runs}; it must be at least 1")
    made = differentiated(scene, values, **options)
    chosen = made.parameters(parameters, scales)
    base = made.scene()
    if base.path is not None:
        raise SceneError(
            f"fit: scene '{base.name}' follows a static path, whose points have no times; fit load "
            "steps (path=None), or minimise with the derivatives of `sensitivities`"
        )
    found = data_of(data, noise, base, len(chosen))
    sizes = np.array([p.size for p in chosen])
    low, high = _bounds(chosen, bounds or {})
    probes = {p.name for p in base.probes}
    columns: Literal["all", "probes"] = "probes" if set(found.values) <= probes else "all"

    def run(at: Floats) -> Sensitivities:
        given = {p.name: float(x) for p, x in zip(chosen, at * sizes, strict=True)}
        return sensitivities(
            scene,
            parameters,
            values={**(values or {}), **given},
            scales={p.name: float(size) for p, size in zip(chosen, sizes, strict=True)},
            columns=columns,
            fields=False,
            **options,
        )

    search = _Search(run, found, chosen, sizes, tell)
    start = np.array([p.value for p in chosen]) / sizes
    solution = least_squares(
        search.residual,
        start,
        search.jacobian,
        bounds=(low / sizes, high / sizes),
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        gtol=1e-12,
        max_nfev=runs,
    )
    best, residual, jacobian = search.at(solution.x)
    return Fit(
        best,
        found,
        residual,
        jacobian / sizes,
        runs=search.count,
        converged=bool(solution.status > 0),
        at_bounds=tuple(p.name for p, on in zip(chosen, solution.active_mask, strict=True) if on),
        start={p.name: p.value for p in chosen},
        impossible=search.impossible,
    )


@dataclass
class _Search:
    """Runs for the residuals and their derivatives; one run gives both.

    Args:
        run: Runs the scene at parameters over their sizes.
        data: The measurements.
        parameters: The parameters.
        sizes: Their sizes.
        tell: Callback for a line of progress per run.

    Attributes:
        count: Number of runs.
        impossible: Sentence of the last one that was impossible or failed; None: none was.
    """

    run: Callable[[Floats], Sensitivities]
    data: Data
    parameters: Sequence[Parameter]
    sizes: Floats
    tell: Callable[[str], None] | None
    count: int = 0
    impossible: str | None = None
    _kept: list[tuple[Floats, tuple[Sensitivities, Floats, Floats]]] = field(default_factory=list)

    def at(self, x: Floats) -> tuple[Sensitivities, Floats, Floats]:
        """The run at some parameters, its residuals, and derivatives by parameters over sizes."""
        for known, found in self._kept:
            if np.array_equal(known, x):
                return found
        try:
            made = self.run(x)
        except (SceneError, ConvergenceError) as error:
            if not self._kept:
                raise
            raise SceneError(
                f"run {self.count + 1} with {self._said(x)} is impossible: {error}"
            ) from error
        self.count += 1
        history = made.run.history
        t = history["t"].to_numpy(dtype=float)
        for name in self.data.values:
            if name not in history:
                raise SceneError(
                    f"fit: data has the column '{name}', which the run does not find; its history "
                    f"has {listed(history.columns)}"
                )
        last = float(self.data.times.max())
        if last > t[-1] * (1 + END):
            raise SceneError(
                f"fit: run {self.count} with {self._said(x)} ends with an event at t = {t[-1]:g}, "
                f"and data go on to {last:g}; leave such rows out, or begin elsewhere"
            )
        data = self.data
        cuts = 1 + np.flatnonzero(np.isin(t[1:-1], made.events["time"]))
        run = {name: history[name].to_numpy(dtype=float) for name in data.values}
        there = {name: data.at(t, column, cuts) for name, column in run.items()}
        for name, column in there.items():
            unknown = np.isnan(column) & ~np.isnan(data.values[name])
            if unknown.any():
                raise SceneError(
                    f"fit: column '{name}' of the run has no value at t = "
                    f"{data.times[unknown][0]:g}, and data have one; leave it out"
                )
        residual = data.weighted(there, measured=True)
        slopes = []
        for p, size in zip(self.parameters, self.sizes, strict=True):
            table = made.history[p.name]
            moved = table["t"].to_numpy(dtype=float) if "t" in table else np.zeros(len(t))
            by = {
                name: data.at(t, run[name], cuts, (table[name].to_numpy(dtype=float), moved))
                for name in run
            }
            slopes.append(size * data.weighted(by, measured=False))
        if self.tell is not None:
            self.tell(
                f"run {self.count}: {self._said(x)}, misfit {np.sqrt(np.mean(residual**2)):.4g}"
            )
        # the last point and the best one: steps that are rejected go back
        best = sorted(self._kept, key=lambda known: float(known[1][1] @ known[1][1]))[:1]
        self._kept = [*best, (x.copy(), (made, residual, np.array(slopes).T))]
        return self._kept[-1][1]

    def _said(self, x: Floats) -> str:
        """Values of the parameters in words."""
        both = zip(self.parameters, x * self.sizes, strict=True)
        return ", ".join(f"{p.name} = {v:.6g}" for p, v in both)

    def residual(self, x: Floats) -> Floats:
        """Misfits over their noise; NaN where there is no run, from where the search turns.

        A combination that the data do not determine leads it to impossible scenes, and to those
        whose steps fail.
        """
        try:
            return self.at(x)[1]
        except SceneError as error:
            if not self._kept:
                raise
            self.impossible = str(error)
            return np.full(self.data.count, np.nan)

    def jacobian(self, x: Floats) -> Floats:
        """Their derivatives."""
        return self.at(x)[2]


def _bounds(
    parameters: Sequence[Parameter], given: Mapping[str, tuple[float | None, float | None]]
) -> tuple[Floats, Floats]:
    """Least and largest values.

    Raises:
        SceneError: If a parameter is unknown, or its value is outside.
    """
    for name in given:
        if name not in (names := [p.name for p in parameters]):
            raise SceneError(
                f"fit: bounds of '{name}', which is not fitted; fitted are {listed(names)}"
            )
    low, high = np.full(len(parameters), -np.inf), np.full(len(parameters), np.inf)
    for k, p in enumerate(parameters):
        both = given.get(p.name, (None, None))
        try:
            least, most = both
            low[k] = -np.inf if least is None else float(least)
            high[k] = np.inf if most is None else float(most)
        except (TypeError, ValueError):
            raise SceneError(
                f"fit: bounds of '{p.name}' are {both!r:.60}; they must be two numbers, the least "
                "and the largest value, or None where there is no bound"
            ) from None
        if not low[k] < high[k]:
            raise SceneError(
                f"fit: bounds of '{p.name}' are {both!r:.60}; the least value must be below the "
                "largest one"
            )
        if not low[k] < p.value < high[k]:
            raise SceneError(
                f"fit: parameter '{p.name}' begins at {p.value:g}; it must be between its bounds "
                f"{low[k]:g} and {high[k]:g}"
            )
    return low, high
