"""Derivatives of a run by parameters of its scene, just computed or read back."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from shellmb.api.record import Run
from shellmb.errors import SceneError
from shellmb.files.reading import read_json, undamaged
from shellmb.files.writing import write_text
from shellmb.sensitivity.parameters import Parameter

if TYPE_CHECKING:
    import xarray as xr

    from shellmb.api.fitting.band import Band
    from shellmb.running.execute import RunResult

# names in a directory of sensitivities
ABOUT, RUN, SIDES = "sensitivities.json", "run", ("above", "below")
# change of a number between both sides, over the number, below which it is round-off of the steps
ROUND_OFF = 1e-13
# columns of a history that say how a step was made
OF_STEPS = ("step", "t", "dt", "iterations", "rejected", "jump", "wall_s")


def side_folder(name: str, side: str) -> Path:
    """Folder of a scene beside the run.

    Args:
        name: Name of the parameter.
        side: "above" or "below".
    """
    return Path(f"by-{name}") / side


class Row(NamedTuple):
    """A number with its derivative.

    Args:
        name: What it is.
        value: Its value.
        derivative: Its derivative.
    """

    name: str
    value: float
    derivative: float


class Sensitivities:
    """A run with its derivatives by parameters.

    Args:
        directory: Its directory.
        computed: What computed the run, in this process; None: it is read back.

    Attributes:
        run: The run itself.
        parameters: The parameters with their values.
        warnings: What the derivatives say against themselves, each a sentence.

    Raises:
        SceneError: If the directory holds no sensitivities.
    """

    def __init__(self, directory: Path | str, computed: RunResult | None = None) -> None:
        self.directory = Path(directory)
        file = self.directory / ABOUT
        if not file.is_file():
            raise SceneError(f"{self.directory} holds no {ABOUT}: the run did not come to its end")
        with undamaged(file):
            about = read_json(file)
            self.parameters = tuple(Parameter(**p) for p in about["parameters"])
            self.warnings = tuple(map(str, about["warnings"]))
            # what nothing depends on has derivatives that are zero, whatever round-off there is
            self._independent = frozenset(map(str, about.get("independent", ())))
            self._points: Mapping[str, list[float | None]] = about.get("points", {})
        self.run = Run(self.directory / RUN, computed)

    @cached_property
    def _sides(self) -> dict[str, list[Run]]:
        """Runs above and below each parameter."""
        return {
            p.name: [Run(self.directory / side_folder(p.name, side)) for side in SIDES]
            for p in self.parameters
        }

    def _width(self, parameter: Parameter) -> float:
        """Distance of both sides by which differences are divided."""
        return np.inf if parameter.name in self._independent else parameter.width

    def _slopes(self, of: Callable[[Run], Any]) -> dict[str, Any]:
        """Derivatives of what runs have by each parameter."""
        found = {}
        for p in self.parameters:
            above, below = map(of, self._sides[p.name])
            found[p.name] = (above - below) / self._width(p)
        return found

    @cached_property
    def history(self) -> pd.DataFrame:
        """Derivatives of the history over time, columns by parameter and column of the history.

        `history["thickness"]["tip_z"]` is that of the column `tip_z` by the thickness. All rows are
        at fixed times, but those of events: their column `t` has the derivative of the time.
        """
        left = set(OF_STEPS) - ({"t"} if self.run.summary.get("events") else set())

        def columns(run: Run) -> pd.DataFrame:
            return run.history[[c for c in run.history.columns if c not in left]]

        table = pd.concat(self._slopes(columns), axis=1, names=["parameter", "column"])
        return table.set_index(pd.Index(self.run.history["t"], name="t"))

    @cached_property
    def logarithmic(self) -> pd.DataFrame:
        """Relative changes of the history over relative changes of parameters, `p/y dy/dp`."""
        table = self.history.copy()
        run = self.run.history
        for p in self.parameters:
            for name in table[p.name].columns:
                value = run[name].to_numpy(dtype=float)
                with np.errstate(divide="ignore", invalid="ignore"):
                    scaled = table[p.name, name].to_numpy() * p.value / value
                table[p.name, name] = np.where(np.isfinite(scaled), scaled, np.nan)
        return table

    @cached_property
    def results(self) -> pd.DataFrame:
        """Derivatives of the results, a row for each result and a column for each parameter."""
        found = self._slopes(lambda run: pd.Series(run.results, dtype=float))
        return pd.DataFrame(found).reindex(list(self.run.results))

    @cached_property
    def reserves(self) -> pd.DataFrame:
        """Least reserve factors over the run with their derivatives, a row for each `Reserve`.

        Columns are the factor, and its derivative by each parameter at the critical step. At places
        or plies that are equally critical, it is the mean of the derivatives to both sides.
        """
        found = self.run.reserves.reindex(columns=["factor"])
        critical = self.run.summary.get("reserves", {})
        for p in self.parameters:
            table = self.history[p.name]
            slopes = [table[name].iloc[each["step"]] for name, each in critical.items()]
            found[p.name] = -(found["factor"] ** 2) * slopes
        return found

    @cached_property
    def path(self) -> pd.DataFrame:
        """Limit points and bifurcations of a static path, a row for each.

        Columns are its kind, its load factor, and the derivative of that by each parameter. It is
        NaN where there is none, for which `warnings` has the reason.
        """
        points = self.run.summary.get("path", [])
        table = {key: [point[key] for point in points] for key in ("kind", "load_factor")}
        slopes = {name: np.array(found, float) for name, found in self._points.items()}
        return pd.DataFrame(table | slopes)

    @cached_property
    def events(self) -> pd.DataFrame:
        """Times at which events went on and off, a row for each.

        Columns are the event, whether it went "on" or "off", its time in s, and the derivative of
        that by each parameter.
        """

        def times(run: Run) -> list[tuple[str, str, float]]:
            named = run.summary.get("events", {}).items()
            found = [(name, k, t) for name, e in named for k, t in enumerate(e["times"])]
            return [(name, "off" if k % 2 else "on", t) for name, k, t in found]

        table = pd.DataFrame(times(self.run), columns=["event", "goes", "time"])
        slopes = self._slopes(lambda run: np.array([t for *_, t in times(run)]))
        return table.assign(**slopes).sort_values("time", ignore_index=True, kind="stable")

    def band(self, covariance: Any) -> Band:
        """Error bands of histories and results that follow from uncertain parameters.

        Args:
            covariance: Covariance of the parameters, a DataFrame by their names or an array in
                their order; or standard deviations by name.

        Raises:
            SceneError: If it is none, or of other parameters.
        """
        from shellmb.api.fitting.band import Band

        return Band(self, covariance)

    def rows(self, parameter: str) -> list[Row]:
        """Values of the run with their derivatives by a parameter.

        Args:
            parameter: Its name.

        Returns:
            Load factors of limit points and bifurcations, times of events, and the results of the
            scene; those of the probes at the end, if it has none.
        """
        points = [
            Row(f"{point['kind']} {k}, load factor", point["load_factor"], float(point[parameter]))
            for k, point in enumerate(self.path.to_dict("records"), start=1)
        ]
        points += [
            Row(f"{event['event']} {event['goes']}, time", event["time"], float(event[parameter]))
            for event in self.events.to_dict("records")
        ]
        if len(self.results):
            values = self.run.results
            slopes = self.results[parameter]
            found = [(name, values[name], slopes[name]) for name in slopes.index]
        else:
            last = self.run.history.iloc[-1]
            slopes = self.history[parameter].iloc[-1]
            probes = [p.name for p in self.run.described.probes]
            found = [(f"{name} at the end", last[name], slopes[name]) for name in probes]
        return [*points, *(Row(name, float(value), float(slope)) for name, value, slope in found)]

    @property
    def fields(self) -> Mapping[str, FieldDerivatives]:
        """Derivatives of fields by the names of parameters, and then of bodies."""
        return {
            p.name: FieldDerivatives(self._sides[p.name], p.name, self._width(p))
            for p in self.parameters
        }

    def is_round_off(self, parameter: Parameter) -> bool:
        """Decide whether derivatives of all results and probes by a parameter are round-off.

        Args:
            parameter: The parameter.
        """
        run, table = self.run, self.history[parameter.name]
        slopes = self.results[parameter.name].items()
        both: list[tuple[Any, Any]] = [(run.results[str(name)], slope) for name, slope in slopes]
        both += [(run.history[p.name], table[p.name]) for p in run.described.probes]
        return bool(both) and all(
            _largest(slope) * parameter.step <= ROUND_OFF * _largest(value) for value, slope in both
        )

    def write(self) -> None:
        """Write the derivatives as CSV files beside the run."""
        for p in self.parameters:
            write_text(self.directory / f"history_{p.name}.csv", self.history[p.name].to_csv())
        if len(self.events):
            write_text(self.directory / "events.csv", self.events.to_csv(index=False))
        if len(self.path):
            write_text(self.directory / "path.csv", self.path.to_csv(index_label="point"))
        if len(self.results):
            write_text(self.directory / "results.csv", self.results.to_csv(index_label="result"))

    def __repr__(self) -> str:
        names = ", ".join(f"{p.name} = {p.value:g}" for p in self.parameters)
        return f"<Sensitivities of '{self.run.name}' by {names}, {self.directory}>"


class FieldDerivatives(Mapping[str, "xr.Dataset"]):
    """Derivatives of the fields of all bodies by one parameter, computed when they are used.

    Args:
        sides: Runs at both sides of the parameter.
        by: Its name.
        width: Distance of both sides.
    """

    def __init__(self, sides: Sequence[Run], by: str, width: float) -> None:
        self._above, self._below = (side.fields for side in sides)
        self._by, self._width = by, width

    def __iter__(self) -> Iterator[str]:
        return iter(self._above)

    def __len__(self) -> int:
        return len(self._above)

    def __getitem__(self, name: str) -> xr.Dataset:
        above, below = self._above[name], self._below[name]
        numbers = [key for key, data in above.data_vars.items() if data.dtype.kind == "f"]
        made = (above[numbers] - below[numbers]) / self._width
        return made.assign_attrs(by=self._by)


def _largest(values: Any) -> float:
    """Largest size of numbers that are known."""
    return float(np.abs(np.nan_to_num(np.asarray(values, dtype=float))).max())
