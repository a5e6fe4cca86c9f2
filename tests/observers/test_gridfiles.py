"""Files of VTK's are read as what was written, state after state."""

from pathlib import Path

import numpy as np
import pytest
import pyvista

from shellmb.errors import SceneError
from shellmb.observers import vtufile
from shellmb.observers.grid import Grid
from shellmb.observers.gridfiles import GridFiles


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
        assert np.array_equal(files.displacement(number), fields["displacement"])


def test_files_of_others_are_refused_in_words(tmp_path: Path) -> None:
    file = tmp_path / "other.vtu"
    pyvista.Plane(i_resolution=1, j_resolution=1).cast_to_unstructured_grid().save(file)
    with pytest.raises(SceneError, match=r"other\.vtu is of another program"):
        vtufile.read(file)
