"""Files are read by VTK as what was written, state after state."""

from pathlib import Path

import numpy as np
import pyvista

from shellmb.observers.files.gridfiles import Grid, GridFiles


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
