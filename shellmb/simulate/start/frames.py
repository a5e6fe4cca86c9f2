"""A stored frame of another run: positions and directors of its nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.files.reading import read_series
from shellmb.scene import Scene
from shellmb.scene.lookup import said

FOLDER, SERIES, RIGID = "fields", ".vtu.series", "rigid_bodies"
# a frame is at a time, and a node is at a position, that differs by less than this part of both
SAME = 1e-9


class StoredFrame:
    """A frame of a run.

    Args:
        directory: The run directory.
        at: Its time, s; of a path its arc length.
        who: Who asks, for messages.

    Raises:
        SceneError: If there is no frame at that time.
    """

    def __init__(self, directory: Path, at: float, who: str) -> None:
        self._folder, self._at, self._who = directory / FOLDER, at, who
        if not self._folder.is_dir():
            raise SceneError(f"{who}: it has no frames; run it with a directory, or leave out at")

    def nodes(
        self, scene: Scene, name: str, X: Floats, count: int, moving: bool
    ) -> list[tuple[Floats, Floats]]:
        """Displacements (n, 3) and directors (n, count, 3) of a body's nodes, then their rates.

        Args:
            scene: The scene, which has the body.
            name: Name of the body.
            X: Reference positions of the nodes, shape (n, 3).
            count: Number of directors of each.
            moving: Whether rates are read, too.

        Raises:
            SceneError: If the frame has no such body, other nodes, or fields are missing.
        """
        body = scene.body(name)
        rigid = body in scene.rigid_bodies
        grid, file = self._grid(RIGID if rigid else name.replace(" ", "_"), said(body))
        keys = ["director"] if count == 1 else ["d1", "d2", "d3"]
        rates = [f"{key}_velocity" for key in keys]
        pairs = [("displacement", keys)] + [("velocity", rates)] * moving
        fields = dict.fromkeys(("reference", "displacement", *keys), "director")
        if moving:
            fields |= {"velocity": "velocity", **dict.fromkeys(rates, "director_velocity")}
        for key, field in fields.items():
            if key not in grid:
                right = f"the run's output must have the field '{field}'"
                more = ", or velocities must be False" if "velocity" in field else ""
                raise SceneError(
                    f"{self._who}: its frames have no {key} of {said(body)}; {right}{more}"
                )
            if not np.isfinite(grid[key]).all():
                raise SceneError(
                    f"{self._who}: {file} is damaged (its array '{key}' has a value that is not "
                    "finite); run it again"
                )
        rows = np.arange(len(grid["reference"]))
        if rigid:
            # the first point of each body is its centre
            rows = rows[grid["name"].astype(str) == name][:1]
        found = rows[self._matched(grid["reference"][rows], X, said(body))]
        return [
            (grid[points][found], np.stack([grid[key] for key in vectors], axis=1)[found])
            for points, vectors in pairs
        ]

    def _matched(self, known: Floats, X: Floats, body: str) -> npt.NDArray[np.intp]:
        """Find which of the known positions each node has."""
        # a run without such a start does not load it
        from scipy.spatial import cKDTree

        if not len(X):
            return np.zeros(0, dtype=np.intp)
        length = max(float(np.max(np.ptp(X, axis=0))), SAME)
        if known.shape == X.shape and np.max(np.abs(known - X)) < SAME * length:
            return np.arange(len(X))
        away, found = cKDTree(known).query(X, k=min(2, len(known)))
        nearest = np.reshape(away, (len(X), -1))
        if np.max(nearest[:, 0]) > SAME * length:
            raise SceneError(
                f"{self._who}: {body} has other nodes there (one is {np.max(nearest[:, 0]):.3g} "
                "away from the next); both must have the same mesh and degree"
            )
        if nearest.shape[1] > 1 and np.min(nearest[:, 1]) < SAME * length:
            raise SceneError(
                f"{self._who}: {body} has two nodes at one place, in another order; leave out at, "
                "or run both on as many ranks"
            )
        return np.asarray(np.reshape(found, (len(X), -1))[:, 0])

    def _grid(self, stem: str, body: str) -> tuple[dict[str, npt.NDArray[Any]], Path]:
        """The arrays of a body's file at that time, and the file."""
        from shellmb.files.grids import numbers, read_grid

        series = self._folder / f"{stem}{SERIES}"
        if not series.is_file():
            raise SceneError(
                f"{self._who}: it has no {body}; it must have all bodies of this scene"
            )
        found = {t: file for file, t in read_series(series).items()}
        times = np.array(sorted(found))
        nearest = float(times[np.argmin(np.abs(times - self._at))])
        if not abs(nearest - self._at) <= SAME * max(1.0, float(times[-1])):
            near = sorted(times[np.argsort(np.abs(times - self._at))[:2]].tolist())
            raise SceneError(
                f"{self._who}: at is {self._at:g}, and there is no frame; it must be one of the "
                f"frames' times, the nearest of which are {' and '.join(map(repr, near))}"
            )
        file = found[nearest]
        points = read_grid(file).GetPointData()
        arrays = {}
        for k in range(points.GetNumberOfArrays()):
            array = points.GetAbstractArray(k)
            if points.GetArray(k):
                arrays[array.GetName()] = numbers(array)
            else:
                texts = map(array.GetValue, range(array.GetNumberOfValues()))
                arrays[array.GetName()] = np.array([*texts])
        return arrays, file
