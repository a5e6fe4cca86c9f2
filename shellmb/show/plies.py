"""Stresses and strains of plies at one place of a shell, from the fields of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from shellmb.arrays import Floats, reals_or_nan
from shellmb.errors import SceneError
from shellmb.scene import LinearSection, Scene
from shellmb.scene.lookup import said
from shellmb.scene.shells.lamination import strain_turn, vector_turn
from shellmb.show.fields import REFERENCE, Fields

if TYPE_CHECKING:
    import pandas as pd

# distance from an element, over its size or that of the shell, beyond which a place is not on it
OFF = 1e-2
NEEDED = ("N", "M", "interlaminar_1")


def plies(
    scene: Scene,
    fields: Fields,
    body: str | None,
    at: Any,
    t: float | None = None,
    axes: Literal["ply", "shell"] = "ply",
) -> pd.DataFrame:
    """Stresses and strains of all plies at one place; arguments as of `Run.plies`.

    Raises:
        SceneError: If the place is not on the shell, or the run has not the fields.
    """
    import pandas as pd

    from shellmb.observers.fields.by_section import held_plies, shell_stiffness
    from shellmb.observers.fields.through import SIDES, ply_rows

    shell = scene.shell(body, "plies")
    who = f"plies: {said(shell)}"
    if axes not in ("ply", "shell"):
        raise SceneError(f"{who}: axes is {axes!r}; it must be 'ply' or 'shell'")
    data = fields[shell.name]
    missing = [name for name in NEEDED if name not in data]
    if missing or not isinstance(shell.section, LinearSection):
        raise SceneError(
            f"{who} has no field {missing[0] if missing else 'interlaminar_1'}; the scene must "
            "have Output(fields=('N', 'M', 'interlaminar')), and the section must be linear"
        )
    state = data.sel({fields.along: fields.nearest(t)}, method="nearest")
    place, nodes, weights = _surrounding(fields, shell.name, at, who)

    def read(name: str) -> Floats:
        return np.asarray(weights @ state[name].values[nodes], dtype=float)

    layup = shell.section.at(place, said(shell))
    layup = layup.at_rest if scene.static else layup
    R, beside = np.concatenate([read("N"), read("M")]), []
    for k, shares in enumerate(layup.branches, start=1):
        strain = read(f"branch_strains_{k}")
        beside.append(shell_stiffness(shell, layup)[:6, :6] @ strain)
        R -= shell_stiffness(shell, layup.scaled(shares))[:6, :6] @ strain
    if held_plies(shell):
        beside.append(read("natural_factor")[None])
    found, given = [], np.concatenate([R, *beside])
    for k, rows in enumerate(ply_rows(shell, layup), start=1):
        stress, strain = rows.stress @ given, rows.strain @ given
        across = read(f"interlaminar_{k}").reshape(3, 2)
        slip = across @ rows.slip.T
        if axes == "shell":
            turn, back = strain_turn(-rows.angle), vector_turn(-rows.angle)
            stress, strain = stress @ strain_turn(rows.angle), strain @ turn.T
            across, slip = across @ back.T, slip @ back.T
        numbers = np.concatenate([rows.heights[:, None], stress, across, strain, slip], axis=1)
        found += [(k, side, *row) for side, row in zip(SIDES, numbers, strict=True)]
    parts = ("11", "22", "12", "13", "23")
    names = [f"{what} {part}" for what in ("stress", "strain") for part in parts]
    table = pd.DataFrame(found, columns=["ply", "side", "z", *names])
    return table.set_index(["ply", "side"])


def _surrounding(fields: Fields, name: str, at: Any, who: str) -> tuple[Floats, Any, Floats]:
    """Nearest place on a shell at rest, the nodes of its element, and their weights."""
    import pyvista as pv
    from vtkmodules.vtkCommonCore import mutable

    from shellmb.files.grids import read_grid

    point = reals_or_nan(at)
    if point.shape != (3,):
        raise SceneError(f"{who}: at is {at!r}; it must be a place (x, y, z)")
    grid: Any = pv.wrap(read_grid(fields.file(name, fields.nearest(None))))
    grid.points = np.array(grid.point_data[REFERENCE])
    number, place = grid.find_closest_cell(point, return_closest_point=True)
    cell = grid.GetCell(number)
    count = cell.GetNumberOfPoints()
    weights, local, nearest = [0.0] * count, [0.0] * 3, [0.0] * 3
    cell.EvaluatePosition(place, nearest, mutable(0), local, mutable(0.0), weights)
    nodes = [cell.GetPointId(k) for k in range(count)]
    off = float(np.linalg.norm(place - point)) / grid.length
    # curved elements are continued beyond their sides
    if not max(off, cell.GetParametricDistance(local)) <= OFF:
        near = tuple(round(float(x), 6) for x in grid.points[grid.find_closest_point(point)])
        raise SceneError(
            f"{who}: at is {tuple(point.tolist())}, which is not on it; its nearest node is {near}"
        )
    return np.asarray(place), nodes, np.array(weights)
