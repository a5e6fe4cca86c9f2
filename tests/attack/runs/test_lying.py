"""Runs read back whose files are cut, lie or have no end: a sentence each, and nothing crashes."""

import io
import json
import math
import os
import re
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

import shellmb as sm
from shellmb.api.runs import load
from shellmb.errors import RunError, SceneError, ShellmbWarning
from shellmb.files.grids import check_grid, read_grid
from shellmb.files.reading import check_archive, read_bytes
from shellmb.files.writing import seal_grid
from shellmb.running.execute import execute
from shellmb.running.loader import load as load_scene
from shellmb.simulate.simulation import BaseObserver, Simulation

SCENE = str(Path(__file__).with_name("scene_pendulum.py"))
GRID = "fields/rigid_bodies_0001.vtu"


def replaced(old: str, new: str):
    def change(content: bytes) -> bytes:
        made, count = re.subn(old.encode(), new.encode(), content, count=1)
        assert count == 1
        return made

    return change


LIES = {
    "more points": replaced('NumberOfPoints="[0-9]+"', 'NumberOfPoints="99"'),
    "points without end": replaced('NumberOfPoints="[0-9]+"', 'NumberOfPoints="99999999999999"'),
    "fewer than none": replaced('NumberOfPoints="[0-9]+"', 'NumberOfPoints="-1"'),
    "fewer points": replaced('NumberOfPoints="[0-9]+"', 'NumberOfPoints="1"'),
    "more cells": replaced('NumberOfCells="[0-9]+"', 'NumberOfCells="77"'),
    "another offset": replaced('offset="[1-9][0-9]*"', 'offset="1000000"'),
    "an offset before": replaced('offset="[1-9][0-9]*"', 'offset="-100"'),
    "components": replaced('NumberOfComponents="3"', 'NumberOfComponents="4"'),
    "no components": replaced('NumberOfComponents="3"', 'NumberOfComponents="0"'),
    "another type": replaced('type="Float64"', 'type="Int8"'),
    "no type": replaced('type="Float64"', 'type="Bit"'),
    "written otherwise": replaced('format="appended"', 'format="ascii"'),
    "another packing": replaced("vtkZLibDataCompressor", "vtkLZ4DataCompressor"),
    "another header": replaced('header_type="UInt64"', 'header_type="UInt32"'),
    "entities": replaced("<VTKFile", '<!DOCTYPE x [<!ENTITY a "b">]><VTKFile'),
    "text": lambda content: b"no grid",
    "nothing": lambda content: b"",
}


@pytest.mark.parametrize("lie", LIES)
def test_a_lying_file_of_a_state_is_refused(lie: str, made: Path, tmp_path: Path) -> None:
    content = (made / GRID).read_bytes()
    file = tmp_path / "state.vtu"
    file.write_bytes(LIES[lie](content))
    with pytest.raises(SceneError, match=r"state.vtu is damaged \(.*; it must be as the run wrote"):
        check_grid(file)


def test_wherever_it_is_cut_or_spoilt_it_is_refused(made: Path, tmp_path: Path) -> None:
    content = (made / GRID).read_bytes()
    file = tmp_path / "state.vtu"
    for size in range(0, len(content), 7):
        file.write_bytes(content[:size])
        with pytest.raises(SceneError):
            check_grid(file)
    for place in range(0, len(content), 5):
        spoilt = bytearray(content)
        spoilt[place] ^= 0x41
        file.write_bytes(spoilt)
        with pytest.raises(SceneError, match="damaged"):
            read_grid(file)
    file.write_bytes(content)
    assert read_grid(file).GetNumberOfPoints() == 2


def wrong(key: str, value: object):
    def change(file: Path) -> None:
        values = json.loads(file.read_text())
        values[key] = value
        file.write_text(json.dumps(values))

    return change


TYPES = {
    "scene.json": ["name", "units", "probes", "joints", "bodies", "dynamic"],
    "summary.json": ["steps", "warnings", "t", "failed", "results", "versions"],
}
ENDLESS = ["scene.json", "summary.json", "history.csv", GRID, "fields/rigid_bodies.vtu.series"]


@pytest.mark.parametrize("value", [3.5, [7], {"a": 1}])
@pytest.mark.parametrize(("name", "key"), [(n, k) for n, keys in TYPES.items() for k in keys])
def test_wrong_types_are_named(name: str, key: str, value: object, run: Path) -> None:
    wrong(key, value)(run / name)
    try:
        found = load(run)
        repr(found), found.account, found.warnings, found.results
    except SceneError as error:
        assert f"{name} is damaged" in str(error)
    else:
        # some of them are right by chance
        assert (key, type(value)) in {("t", float), ("bodies", dict)} or key == "results"


@pytest.mark.parametrize("points", ["/dev/zero", "pipe", "folder", "sparse"])
@pytest.mark.parametrize("name", ENDLESS)
def test_files_without_end_are_not_read(name: str, points: str, run: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    with (tmp_path / "sparse").open("wb") as file:
        file.truncate(10**13)
    (run / name).unlink()
    (run / name).symlink_to(tmp_path / points)
    with pytest.raises(SceneError, match=rf"{Path(name).name}"):
        found = load(run)
        repr(found), found.history, found.fields["rigid bodies"]["displacement"].values


def test_frames_with_numbers_that_are_none_are_no_start(tmp_path: Path) -> None:
    """Each array that a start takes, at its last value, in a file that is otherwise as it was."""
    fields = ("director", "velocity", "director_velocity")
    scene = load_scene(SCENE).module.scene(steps=2)
    scene = replace(scene, output=sm.Output(fields=fields, frames=3))
    execute(scene, tmp_path / "run", pictures=False)
    file = tmp_path / GRID.replace("fields", "run/fields")
    start = replace(scene, start=sm.FromRun(tmp_path / "run", at=1e-3))
    Simulation(start)
    taken = {"reference", "displacement", "velocity"}
    taken |= {f"d{k}{rate}" for k in (1, 2, 3) for rate in ("", "_velocity")}
    content = file.read_bytes()
    for name in sorted(taken):
        file.write_bytes(content)
        grid = read_grid(file)
        values = vtk_to_numpy(grid.GetPointData().GetArray(name))
        values.flat[-1] = math.nan
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetInputDataObject(grid)
        writer.SetDataModeToAppended()
        writer.EncodeAppendedDataOff()
        writer.SetFileName(str(file))
        writer.Write()
        file.write_bytes(seal_grid(file.read_bytes()))
        with pytest.raises(SceneError, match=rf"{GRID} is damaged .its array '{name}' has a value"):
            Simulation(start)


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_a_count_of_turns_that_is_no_number_is_not_taken(value: str, run: Path) -> None:
    """A history that cannot be read is said, and turns begin within half a one."""
    lines = [line.split(",") for line in (run / "history.csv").read_text().split("\n")]
    lines[-2][lines[0].index("pin.rotation")] = value
    (run / "history.csv").write_text("\n".join(map(",".join, lines)))
    start = replace(load_scene(SCENE).module.scene(), start=sm.FromRun(run))
    with pytest.warns(ShellmbWarning, match="history.csv.* is missing or cannot be read"):
        simulation = Simulation(start)
    assert all(np.isfinite(array).all() for array in simulation.arrays().values())


def test_archives_that_unpack_to_more_than_they_are_are_refused() -> None:
    packed = io.BytesIO()
    np.savez_compressed(packed, a=np.zeros(10**6))
    with (
        zipfile.ZipFile(packed) as archive,
        pytest.raises(ValueError, match="not as long as it says"),
    ):
        check_archive(archive, len(packed.getvalue()))


def test_a_file_is_read_up_to_a_size(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"12345")
    assert read_bytes(tmp_path / "x", 5) == b"12345"
    with pytest.raises(SceneError, match="it has 5 bytes, and at most 4 are read"):
        read_bytes(tmp_path / "x", 4)


class Removes(BaseObserver):
    """Removes a file of the run after its second step."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def accepted(self, simulation) -> None:
        if simulation.step == 2:
            self.file.unlink()


def test_a_history_removed_meanwhile_is_noticed(tmp_path: Path) -> None:
    out = tmp_path / "run"
    scene = load_scene(SCENE).build()
    with pytest.raises(RunError, match="removed during the run"):
        execute(scene, out, [Removes(out / "history.csv")], pictures=False)


def test_a_list_removed_meanwhile_is_there_again(tmp_path: Path) -> None:
    whole, out = tmp_path / "whole", tmp_path / "run"
    scene = load_scene(SCENE).build()
    execute(scene, whole, pictures=False)
    execute(scene, out, [Removes(out / "fields/all.pvd")], pictures=False)
    for name in ("all.pvd", "rigid_bodies.vtu.series"):
        assert (out / "fields" / name).read_text() == (whole / "fields" / name).read_text()
