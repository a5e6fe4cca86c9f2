"""Measurements that a scene is fitted to: columns over times, each with its noise."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from shellmb.api.sensitivity.record import OF_STEPS
from shellmb.arrays import Floats, reals, reals_or_nan
from shellmb.errors import SceneError
from shellmb.scene import Scene
from shellmb.scene.lookup import listed

# a time beyond the end of the run by less, relative to it, is the end
END = 1e-9


@dataclass(frozen=True)
class Data:
    """Measurements.

    Args:
        times: Times, s, shape (n,).
        values: Measured values by column of the history, shape (n,); NaN where there is none.
        noise: Standard deviation of the noise of each value, by column, shape (n,).
        known: Whether the noise is known; if not, it is the size of each column, and only ratios
            of columns count.
    """

    times: Floats
    values: dict[str, Floats]
    noise: dict[str, Floats]
    known: bool

    @property
    def count(self) -> int:
        """Number of values."""
        return sum(int(np.sum(~np.isnan(v))) for v in self.values.values())

    def at(
        self,
        t: Floats,
        column: Floats,
        cuts: Iterable[int] = (),
        slopes: tuple[Floats, Floats] | None = None,
    ) -> Floats:
        """A column of a run at the times of the data, by cubic splines between its events.

        Args:
            t: Times of the run, s, shape (m,).
            column: Its values, shape (m,).
            cuts: Rows at which the motion has a kink.
            slopes: Derivatives of the values and of the times of the rows by a parameter; then the
                derivative of the column is found, at fixed times.
        """
        from scipy.interpolate import make_interp_spline

        found, ends = np.full(len(self.times), np.nan), [0, *cuts, len(t) - 1]
        for first, last in pairwise(ends):
            rows = np.arange(first, last + 1)
            # what is not known at the start, as forces, is continued
            rows = rows[~np.isnan(column[rows])]
            inside = (self.times >= t[first]) | (first == 0)
            if not inside.any() or not len(rows):
                continue
            degree = min(3, len(rows) - 1)
            spline = make_interp_spline(t[rows], column[rows], k=degree)
            if slopes is not None:
                by, moved = (each[rows] for each in slopes)
                if moved.any():
                    by = by - spline.derivative()(t[rows]) * moved
                spline = make_interp_spline(t[rows], by, k=degree)
            found[inside] = spline(np.clip(self.times[inside], t[rows][0], t[rows][-1]))
        return found

    def weighted(self, columns: Mapping[str, Floats], measured: bool) -> Floats:
        """Columns at all measured values over their noise, one after the other.

        Args:
            columns: Columns of the run, or their derivatives, at the times of the data.
            measured: Whether the measured values are subtracted.
        """
        found = []
        for name, values in self.values.items():
            there, column = ~np.isnan(values), columns[name]
            rest = column - values if measured else column
            found.append(rest[there] / self.noise[name][there])
        return np.concatenate(found)


def data_of(given: pd.DataFrame, noise: Any, scene: Scene, count: int) -> Data:
    """Measurements from a table.

    Args:
        given: Columns of the history over time; times are its column `t`, or its index.
        noise: Standard deviation of the noise of all columns, or of each by its name, a number or
            one for each row of the table; None: not known.
        scene: The scene that is fitted.
        count: Number of parameters.

    Raises:
        SceneError: If the table is of other times than the scene, or has too few values.
    """
    try:
        table = given.set_index("t") if "t" in given.columns else given
        # neighbours in time are neighbours in the table
        times = table.index.to_numpy().astype(float, casting="same_kind")
        order = np.argsort(times, kind="stable")
        times, table = times[order], table.iloc[order]
        values = {str(name): reals(table[name], f"column '{name}'") for name in table.columns}
    except (AttributeError, TypeError, ValueError) as error:
        raise SceneError(
            f"fit: data is no table of numbers ({error}); it must be a pandas DataFrame of columns "
            "of the history over times, in its column t or its index"
        ) from None
    if not table.columns.is_unique:
        twice = table.columns[table.columns.duplicated()][0]
        raise SceneError(
            f"fit: data has the column '{twice}' twice; give all of its values in one column"
        )
    if not values:
        raise SceneError("fit: data has no column; it must have some of the run's history")
    for name, column in values.items():
        if name in OF_STEPS:
            raise SceneError(
                f"fit: data has the column '{name}', which says how a step was made and has no "
                "derivatives; leave it out"
            )
        if np.isinf(column).any():
            raise SceneError(
                f"fit: column '{name}' of data has an infinite value; it must be numbers, or NaN "
                "where nothing was measured"
            )
        if np.isnan(column).all():
            raise SceneError(f"fit: column '{name}' of data has no value; leave it out")
    wrong = times[~((times >= 0) & (times <= scene.t_end * (1 + END)))]
    if len(wrong):
        raise SceneError(
            f"fit: data has the time t = {wrong[0]:g}, and the run lasts from 0 to "
            f"{scene.t_end:g}; leave such rows out, or give the scene another t_end"
        )
    found = Data(times, values, _noise(noise, values, order), noise is not None)
    if found.count < count or (noise is None and found.count == count):
        raise SceneError(
            f"fit: data has {found.count} values for {count} parameters; there must be more values "
            "than parameters"
        )
    return found


def _noise(
    given: Any, values: Mapping[str, Floats], order: npt.NDArray[np.intp]
) -> dict[str, Floats]:
    """Noise of each value of each column.

    Raises:
        SceneError: If one has none, or one that is not positive.
    """
    if given is None:
        sizes = {name: float(np.sqrt(np.nanmean(v**2))) or 1.0 for name, v in values.items()}
        return {name: np.full(len(v), sizes[name]) for name, v in values.items()}
    each = {name: given for name in values} if not isinstance(given, Mapping) else given
    missing = [name for name in values if name not in each]
    if missing:
        raise SceneError(
            f"fit: noise has no value for {listed(missing)}; give one for each column of the data"
        )
    return {name: _noise_of(name, each[name], values[name], order) for name in values}


def _noise_of(name: str, given: Any, values: Floats, order: npt.NDArray[np.intp]) -> Floats:
    """Noise of each value of a column in the order of times."""
    found = reals_or_nan(given)
    if found.ndim and found.shape != values.shape:
        raise SceneError(
            f"fit: noise of '{name}' has the shape {found.shape}, and data have {len(values)} "
            "rows; give a number, or one for each row"
        )
    each = np.broadcast_to(found, values.shape)[order]
    wrong = ~((each > 0) & (each < np.inf))
    if found.ndim:
        # a value that was not measured needs none
        wrong &= ~np.isnan(values)
    if wrong.any():
        shown = each[wrong][0] if found.ndim else given
        raise SceneError(
            f"fit: noise of '{name}' is {shown!s:.40}; it must be positive; a value that is not to "
            "count is NaN in the data"
        )
    return each
