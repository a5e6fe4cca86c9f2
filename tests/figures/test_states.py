"""Frames read back from files are those that were written."""

from pathlib import Path

import numpy as np
import pytest
import pyvista

from shellmb.errors import SceneError
from shellmb.observers.files.described import describe
from shellmb.observers.files.frames import Frames
from shellmb.observers.files.gridfiles import Grid
from shellmb.observers.files.output_parts import drawn_parts
from shellmb.scene import (
    AlongEdge,
    Beam,
    Clamped,
    EdgeForce,
    Glue,
    Isotropic,
    Rectangle,
    RectangularSection,
    RigidBody,
    Scene,
    Shell,
    Spherical,
)
from shellmb.show.fields import Fields
from shellmb.show.space.shapes import lattice, read_state, shape_of
from shellmb.simulate.simulation import BaseObserver, Simulation


class Shown(BaseObserver):
    """What is shown in each state: displacements by time and part."""

    def start(self, simulation: Simulation) -> None:
        self.parts, self.displacements = drawn_parts(simulation.model), {}
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        found = {n: part.fields(simulation)["displacement"] for n, part in self.parts.items()}
        self.displacements[simulation.t] = found


@pytest.mark.parametrize("k", [1, 2, 3])
def test_lattice_covers_the_cell_once(k: int) -> None:
    points, pieces, around = lattice(k, 4)
    assert pieces.shape == (k * k, 4)
    # corners belong to one piece, points inside a side to two, those inside to four
    sides = ((points[:, :2] == 0) | (points[:, :2] == 1)).sum(axis=1)
    assert np.array_equal(np.bincount(pieces.ravel()), 4 // 2**sides)
    assert around[0] == around[-1]
    assert sorted(around[:-1]) == np.flatnonzero(sides).tolist()


def test_read_back(tmp_path: Path) -> None:
    shell = Shell(
        "plate", Rectangle(1, 0.5), Isotropic(1e6, 0.3, thickness=0.05, density=100), mesh=(2, 1)
    )
    section = RectangularSection(1e6, 0.3, width=0.05, height=0.05, density=100)
    scene = Scene(
        "small",
        shell,
        beams=Beam("rib", AlongEdge("plate", "right"), section),
        glues=Glue("rib", "plate"),
        rigid_bodies=RigidBody("weight", 1.0, (0.1, 0.1, 0.1), position=(1, 0, -0.2)),
        joints=Spherical("ball", "weight", "rib", at=(1, 0, 0)),
        supports=Clamped("left", body="plate"),
        loads=EdgeForce("right", (0, 0, 1.0), body="plate"),
        scheme="ep",
        dt=0.01,
        t_end=0.02,
    )
    frames, shown = Frames(tmp_path / "fields"), Shown()
    Simulation(scene).run([frames, shown])
    described = describe(scene)
    read = Fields(tmp_path / "fields", described.bodies, described.labels)
    assert set(read) == set(shown.parts)
    assert list(read.times) == list(shown.displacements)
    for name, part in shown.parts.items():
        grid = part.grid
        assert grid is not None
        other = shape_of(read, name)
        # files hold single or double precision alike: positions of size 1
        np.testing.assert_allclose(other.reference, grid.nodes, atol=1e-7)
        cells = _cells(grid)
        assert _sets(other.dots) == _sets(cells[0]), name
        fine = other.fine
        x = fine.at(grid.nodes)
        # from end to end of each line, around each cell once, and over all of it
        ends = _places(x[fine.lines[:, [0, -1]]]) if len(fine.lines) else []
        assert ends == _places(grid.nodes[[cell[:2] for cell in cells[1]]]), name
        assert len(fine.outlines) == len(cells[2]), name
        corners = [cell[: 4 if len(cell) in (4, 9) else 3] for cell in cells[2]]
        for around, cell in zip(x[fine.outlines], corners, strict=True):
            assert {*map(tuple, grid.nodes[cell].round(9))} <= {*map(tuple, around.round(9))}, name
        if corners:
            assert _area(x[fine.faces]) == pytest.approx(_area(grid.nodes[np.array(corners)])), name
        for t, displacements in shown.displacements.items():
            moved = read_state(read.file(name, t), t).arrays["displacement"]
            np.testing.assert_allclose(moved, displacements[name], atol=1e-7)
    assert read.nearest(0.012) == pytest.approx(0.01)
    assert list(read.only(["rib"])) == ["rib"]
    with pytest.raises(SceneError, match="there is no body 'rob'"):
        read.only(["rob"])


def _places(pairs: np.ndarray) -> list[list[tuple[float, ...]]]:
    """Pairs of positions, each pair in one order."""
    return sorted(sorted(map(tuple, pair)) for pair in pairs.round(9).tolist())


def _area(faces: np.ndarray) -> float:
    """Area of flat pieces."""
    across = np.cross(faces[:, 2] - faces[:, 0], faces[:, -1] - faces[:, 1])
    return float(np.linalg.norm(across, axis=1).sum() / 2)


def _cells(grid: Grid) -> dict[int, list[list[int]]]:
    """Nodes of the cells that a run shows, by the dimension of the cells."""
    shown = pyvista.UnstructuredGrid(grid.vtk_cells, grid.vtk_types, grid.nodes)
    found: dict[int, list[list[int]]] = {0: [], 1: [], 2: []}
    for cell in shown.cell:
        found[cell.dimension].append(cell.point_ids)
    return found


def _sets(cells: np.ndarray) -> list[list[int]]:
    """Cells whatever their direction and order."""
    return sorted(sorted(map(int, np.atleast_1d(c))) for c in cells)
