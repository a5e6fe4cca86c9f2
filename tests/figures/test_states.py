"""Frames read back from files are those that were written."""

from pathlib import Path

import numpy as np
import pytest

from shellmb.figures.states import _vtk_points, read_states
from shellmb.observers.files.frames import Frames
from shellmb.observers.files.grid import lattice
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
from shellmb.simulate.simulation import Simulation


@pytest.mark.parametrize("k", [1, 2, 3])
def test_lattice_covers_the_cell_once(k: int) -> None:
    pieces, around = lattice(_vtk_points(k))
    assert pieces.shape == (k * k, 4)
    # corners belong to one piece, nodes inside a side to two, those inside to four
    counts = np.bincount(pieces.ravel(), minlength=(k + 1) ** 2)
    assert list(counts[:4]) == [1] * 4
    assert list(counts[4 : 4 * k]) == [2] * (4 * k - 4)
    assert list(counts[4 * k :]) == [4] * (k - 1) ** 2
    assert around[0] == around[-1]
    assert sorted(around[:-1]) == list(range(4 * k))


def test_read_back(tmp_path: Path) -> None:
    shell = Shell("plate", Rectangle(1, 0.5), Isotropic(1e6, 0.3, 0.05, 100), mesh=(2, 1))
    section = RectangularSection(1e6, 0.3, 0.05, 0.05, 100)
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
    frames = Frames(tmp_path / "fields")
    Simulation(scene).run([frames])
    read = read_states(tmp_path)
    # files have no spaces in their names
    assert set(read.grids) == {name.replace(" ", "_") for name in frames.grids}
    assert [f.t for f in read.frames] == [f.t for f in frames.frames]
    for name, grid in frames.grids.items():
        file = name.replace(" ", "_")
        other = read.grids[file]
        # files hold single or double precision alike: positions of size 1
        np.testing.assert_allclose(other.nodes, grid.nodes, atol=1e-7)
        for part in ("faces", "outlines", "lines", "dots"):
            assert _sets(getattr(other, part)) == _sets(getattr(grid, part)), (name, part)
        for a, b in zip(read.frames, frames.frames, strict=True):
            np.testing.assert_allclose(a.displacement[file], b.displacement[name], atol=1e-7)
    assert read.at(0.012).t == pytest.approx(0.01)
    assert set(read.only(["rib"]).frames[0].displacement) == {"rib"}


def _sets(cells: np.ndarray) -> list[list[int]]:
    """Cells whatever their direction and order."""
    return sorted(sorted(map(int, np.atleast_1d(c))) for c in cells)
