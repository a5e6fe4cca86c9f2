"""Fields of a run, or of modes, as they are in its files: body by body, read when used."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.files.reading import read_series
from shellmb.scene.fields import FIELDS, MANY, FieldKind
from shellmb.scene.lookup import listed
from shellmb.scene.types import number_or_nan
from shellmb.scene.units import Units

if TYPE_CHECKING:
    import pyvista as pv
    import xarray as xr


SERIES = ".vtu.series"
REFERENCE, NAMES = "reference", "name"
XYZ = ("x", "y", "z")
# round-off of times, over that between the first and the last state
OUTSIDE = 1e-6


class Fields(Mapping[str, "xr.Dataset"]):
    """Datasets by the names of bodies, with "rigid bodies" and "joints" as one each.

    Each has the dimensions `t` (or `mode`), `node`, and those of components by their names, so that
    `fields["plate"]["N"].sel(plane="11").isel(t=-1)` is read from one file.

    Args:
        folder: Folder of the files.
        names: Names of the bodies.
        units: Units of the fields.
        along: Name of the dimension of the states.
    """

    def __init__(
        self, folder: Path, names: Mapping[str, str], units: Units, along: str = "t"
    ) -> None:
        self.folder, self.along, self._units = folder, along, units
        stems = {name.replace(" ", "_"): name for name in (*names, "rigid bodies")}
        found = sorted(path.name.removesuffix(SERIES) for path in folder.glob(f"*{SERIES}"))
        there = {stems.get(stem, stem): stem for stem in found}
        # in the order of the scene, what is not of a body behind it
        order = [name for name in names if name in there]
        self._stems = {
            name: there[name] for name in [*order, *(n for n in there if n not in order)]
        }
        self._made: dict[str, xr.Dataset] = {}
        self._listed: dict[str, tuple[int, dict[Path, float]]] = {}

    def __iter__(self) -> Iterator[str]:
        return iter(self._stems)

    def __len__(self) -> int:
        return len(self._stems)

    def __getitem__(self, name: str) -> xr.Dataset:
        if name not in self._made:
            self._made[name] = self._dataset(self.stem(name))
        return self._made[name]

    def __repr__(self) -> str:
        lines = [f"<Fields of {len(self)} part{'s' if len(self) != 1 else ''} in {self.folder}>"]
        for name in self:
            data = self[name]
            fields = ", ".join(str(key) for key in data.data_vars)
            sizes = f"{data.sizes[self.along]} states, {data.sizes['node']} nodes"
            lines.append(f"  {name!r}: {sizes}: {fields}")
        return "\n".join(lines)

    def only(self, names: Iterable[str]) -> Fields:
        """The fields of some bodies.

        Args:
            names: Their names.

        Raises:
            SceneError: If there is no such body.
        """
        some = copy.copy(self)
        some._stems = {name: self.stem(name) for name in names}
        return some

    def stem(self, name: str) -> str:
        """Beginning of the names of a body's files.

        Raises:
            SceneError: If there is no such body.
        """
        if name not in self._stems:
            there = listed(self._stems) or "none: the run wrote no fields"
            raise SceneError(f"fields: there is no body '{name}'; there are {there}")
        return self._stems[name]

    def states(self, name: str) -> dict[Path, float]:
        """Files of a body with their times, or numbers of modes.

        Args:
            name: Name of the body.
        """
        series = self.folder / f"{self.stem(name)}{SERIES}"
        # a run that goes on writes it anew
        try:
            written = series.stat().st_mtime_ns
        except FileNotFoundError:
            raise SceneError(
                f"fields: {series} is gone; a run without a folder keeps its files as long as "
                "itself: it must have a name, as in 'run = sm.run(scene)', or an out directory"
            ) from None
        if name not in self._listed or self._listed[name][0] != written:
            there = {file.name for file in os.scandir(self.folder)}
            found = {f: t for f, t in read_series(series).items() if f.name in there}
            self._listed[name] = (written, found)
        return self._listed[name][1]

    @property
    def times(self) -> Floats:
        """Times of the states, or numbers of the modes."""
        first = next(iter(self), None)
        return np.array([] if first is None else list(self.states(first).values()))

    def nearest(self, t: float | None) -> float:
        """The time of a state nearest to a time; None: the last one.

        Raises:
            SceneError: If there are no states, or the time is outside of theirs.
        """
        times = self.times
        if not len(times):
            raise SceneError(f"fields: there are no states in {self.folder}; the run wrote none")
        at, first, last = number_or_nan(times[-1] if t is None else t), times.min(), times.max()
        if not first - OUTSIDE * (last - first) <= at <= last + OUTSIDE * (last - first):
            raise SceneError(
                f"fields: {self.along} is {t!r:.40}; it must be from {first:g} to {last:g}, as the "
                f"states in {self.folder} are"
            )
        return float(times[np.argmin(np.abs(times - at))])

    def file(self, name: str, t: float) -> Path:
        """The file of a body's state nearest to a time."""
        states = self.states(name)
        return min(states, key=lambda path: abs(states[path] - t))

    def frame(self, t: float | None = None) -> pv.MultiBlock:
        """All bodies at the state nearest to a time, as pyvista has them.

        Args:
            t: The time; None: the last state.
        """
        import pyvista as pv

        from shellmb.files.grids import read_grid

        at = self.nearest(t)
        blocks = pv.MultiBlock({name: pv.wrap(read_grid(self.file(name, at))) for name in self})
        blocks.field_data[self.along] = [at]
        return blocks

    def _dataset(self, stem: str) -> xr.Dataset:
        import pyvista as pv
        import xarray as xr
        from xarray.core import indexing

        from shellmb.files.grids import POSITION, components, read_grid
        from shellmb.show.lazy import OnFiles

        name = next(n for n, s in self._stems.items() if s == stem)
        states = self.states(name)
        files = list(states)
        if not files:
            raise SceneError(f"fields: the files of '{name}' in {self.folder} are lost")
        grid = pv.wrap(read_grid(files[0]))
        if REFERENCE not in grid.point_data:
            raise SceneError(f"{files[0]} is damaged (it has no {REFERENCE})")
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {
            self.along: (self.along, list(states.values())),
            REFERENCE: (("node", "axis"), np.array(grid.point_data[REFERENCE])),
            "axis": ("axis", list(XYZ)),
        }
        for key in [POSITION, *(k for k in grid.point_data if k != REFERENCE)]:
            if key == NAMES:
                coordinates[NAMES] = ("node", np.array(grid.point_data[key]).astype(str))
                continue
            array = grid.GetPoints().GetData() if key == POSITION else grid.point_data.GetArray(key)
            dims, shape = [self.along, "node"], [grid.n_points]
            if named := components(array):
                kind = _kind(key)
                axis = "axis" if kind is None else kind.axis
                coordinates[axis] = (axis, list(XYZ if axis == "axis" else named))
                dims, shape = [*dims, axis], [*shape, len(named)]
            data = indexing.LazilyIndexedArray(OnFiles(files, key, tuple(shape)))
            variables[key] = xr.Variable(dims, data, {"units": self._unit(key)})
        for key in grid.cell_data:
            variables[key] = ("cell", np.array(grid.cell_data[key]))
        return xr.Dataset(variables, coordinates, {"body": name})

    def _unit(self, key: str) -> str:
        known = _kind(key)
        if known is None:
            return self._units.of("length") if key == "position" else ""
        return self._units.of(known.quantity)


def _kind(key: str) -> FieldKind | None:
    """Kind of a field, also of one of many: those of plies have a number behind the name."""
    return FIELDS.get(key) or FIELDS.get(next((k for k in MANY if key.startswith(f"{k}_")), ""))
