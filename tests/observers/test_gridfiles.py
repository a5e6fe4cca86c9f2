"""Files are read by VTK as what was written, state after state, and so are their lists."""

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest
import pyvista

from shellmb.files import writing
from shellmb.observers.files.gridfiles import Grid, GridFiles, Lists


def test_what_is_read_is_what_was_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    nodes = rng.normal(size=(6, 3))
    # a point, a line, a quadrilateral and a triangle
    cells = np.array([1, 5, 2, 4, 5, 4, 0, 1, 2, 3, 3, 3, 2, 4])
    types = np.array([1, 3, 9, 5], dtype=np.uint8)
    size = np.arange(4.0)
    files = GridFiles(tmp_path, Grid("g", nodes, cells, types), {"size": size})
    for number in range(3):
        # a triple's column is no row of numbers in memory
        fields = {"displacement": rng.normal(size=(6, 3)), "d1": rng.normal(size=(6, 3, 3))[:, 1]}
        files.write(number, fields)
        read = pyvista.read(files.file(number))
        assert np.array_equal(read.cells, cells) and np.array_equal(read.celltypes, types)
        assert np.array_equal(read.points, nodes + fields["displacement"])
        assert set(read.point_data.keys()) == {"reference", "displacement", "d1"}
        assert np.array_equal(read.point_data["reference"], nodes)
        for name, values in fields.items():
            assert np.array_equal(read.point_data[name], values)
        assert np.array_equal(read.cell_data["size"], size)
        sums = files.checksums(number + 1)
        assert len(sums) == number + 1
        other = GridFiles(tmp_path, Grid("g", nodes, cells, types), {"size": size})
        assert not other.find(number, {}) and not other.has(number)
        assert other.find(number, sums) and other.has(number)


def point(folder: Path, name: str) -> GridFiles:
    grid = Grid(name, np.zeros((1, 3)), np.array([1, 0]), np.array([1], dtype=np.uint8))
    return GridFiles(folder, grid, {})


@pytest.mark.parametrize("change", [writing._CHANGE, None, lambda *given: -1])
def test_lists_are_whole_at_any_time(
    change: Callable[..., int] | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kind: a reader, or a kill, while they grow: each list there has all states of before.

    With files that change places, without, and where a file system knows no such thing.
    """
    monkeypatch.setattr(writing, "_CHANGE", change)
    files = {name: point(tmp_path, name) for name in ("first one", "second")}
    lists, over, counts = Lists(tmp_path, files), Event(), list[tuple[int, int]]()

    def read() -> tuple[int, int]:
        series = json.loads((tmp_path / "first_one.vtu.series").read_text())["files"]
        return len(series), len(list(ET.parse(tmp_path / "all.pvd").iter("DataSet")))

    def look() -> None:
        while not over.is_set():
            counts.append(read())

    reader = Thread(target=look)
    for k in range(200):
        for of in files.values():
            of.write(k, {"displacement": np.zeros((1, 3))})
        lists.write([0.1 * n for n in range(k + 1)])
        if k == 0:
            reader.start()
        # of both parts; the second reading is of a list that is not older
        assert read() == (k + 1, 2 * (k + 1))
    over.set()
    reader.join()
    assert counts == sorted(counts) and counts[0][0] >= 1
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("there", ["a link", "a link to nothing", "nothing"])
def test_lists_take_the_place_of_what_is_no_file(there: str, tmp_path: Path) -> None:
    """What a link points to is left alone, also by files that change places."""
    theirs, ours = tmp_path / "theirs", tmp_path / "first.vtu.series"
    if there == "a link":
        theirs.write_text("theirs")
    if there != "nothing":
        ours.symlink_to(theirs)
    files = point(tmp_path, "first")
    files.write(0, {"displacement": np.zeros((1, 3))})
    files.list([0.5])
    assert not ours.is_symlink()
    assert json.loads(ours.read_text())["files"] == [{"name": "first_0000.vtu", "time": 0.5}]
    assert not theirs.exists() or theirs.read_text() == "theirs"
