"""Runs from Python: just computed, read back, failed; and what they say of themselves."""

import gc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import shellmb as sm

SMALL = str(Path(__file__).parents[1] / "run" / "scene_small.py")


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    return sm.run(SMALL, tmp_path_factory.mktemp("run") / "small", pictures=False)


def test_a_run_read_back_is_the_run(computed) -> None:
    read = sm.load(computed.directory)
    assert computed.computed is not None and read.computed is None
    assert read.history.equals(computed.history)
    # and that is what was computed, to the last digit
    rows = computed.computed.rows
    assert list(read.history.columns) == list(rows[0])
    for name in read.history:
        np.testing.assert_array_equal(read.history[name], [row[name] for row in rows])
    assert read.summary == computed.summary
    assert read.results == computed.results == {"tip": rows[-1]["tip_z"]}
    assert read.warnings == computed.warnings
    assert read.account == computed.account
    assert list(read.fields) == list(computed.fields) == ["plate"]
    for name, data in computed.fields.items():
        assert read.fields[name].identical(data)
    assert repr(read) == repr(computed)


def test_fields_are_what_was_computed(computed) -> None:
    from shellmb.observers.fields.nodal import nodal_values

    simulation = computed.computed.simulation
    values = nodal_values(simulation, "plate")
    plate = sm.load(computed.directory).fields["plate"]
    assert dict(plate.sizes) == {"t": 3, "node": len(values.reference), "axis": 3, "cell": 12}
    last = plate.isel(t=-1)
    assert float(last["t"]) == simulation.t
    # files have the nodes in the order of the mesh as it was made
    there, here = (
        np.lexsort(np.round(x, 9).T) for x in (plate["reference"].values, values.reference)
    )
    for name in ("position", "displacement", "director", "velocity"):
        np.testing.assert_array_equal(last[name].values[there], getattr(values, name)[here])
    np.testing.assert_array_equal(plate["reference"].values[there], values.reference[here])
    # one number of one state, and all states of one node, as read from the files
    tip = int(np.argmax(plate["reference"].values[:, 0]))
    whole = plate["displacement"].values
    assert float(plate["displacement"].sel(axis="z")[-1, tip]) == whole[-1, tip, 2]
    np.testing.assert_array_equal(plate["displacement"][:, tip], whole[:, tip])
    np.testing.assert_array_equal(plate["displacement"][1:, [tip, 0]], whole[1:, [tip, 0]])
    np.testing.assert_array_equal(computed.frame()["plate"].points, last["position"])


def test_frames_and_columns_by_name(computed) -> None:
    assert computed.frame(0.0029).field_data["t"][0] == pytest.approx(0.003)
    assert [a.get_ylabel() for a in computed.plot().axes] == ["displacement", "velocity"]
    with pytest.raises(sm.SceneError, match="there is no column 'tip'; there are 'step', 't'"):
        computed.plot("tip")
    with pytest.raises(sm.SceneError, match="there is no body 'wing'; there are 'plate'"):
        computed.fields["wing"]


@pytest.mark.parametrize("t", [0.006, -1e-3, float("nan"), "end"])
def test_times_outside_of_the_run_are_said(computed, t) -> None:
    """Not answered by the state at its end, in any reader of states."""
    for read in (computed.frame, computed.picture, computed.view):
        with pytest.raises(sm.SceneError, match=f"t is {t!r}; it must be from 0 to 0.005, as"):
            read(t=t)
    # round-off of the last time is none
    assert computed.frame(0.005 * (1 + 1e-12)).field_data["t"][0] == 0.005


def test_what_it_shows_in_a_notebook(computed) -> None:
    page = computed._repr_html_()
    assert "<img" in page and "energy balance error" in page
    assert repr(computed).startswith("<Run 'small': ep, 5 steps to t = 0.005")


def test_a_scene_that_is_made_already(tmp_path) -> None:
    scene = replace(sm.load_scene(SMALL), units="mm, t, s")
    run = sm.run(scene, scheme="static", t_end=1.0)
    assert run.scene.scheme == "static" and run.described.units == "mm, t, s"
    assert run.fields["plate"]["position"].attrs == {"units": "mm"}
    assert run.plot().axes[0].get_ylabel() == "displacement [mm]"
    # a temporary directory lives as long as its run
    folder, fields = run.directory, run.fields
    assert folder.is_dir()
    del run
    gc.collect()
    assert not folder.exists()
    with pytest.raises(sm.SceneError, match="is gone; a run without a folder keeps its files as"):
        fields.times  # noqa: B018


def test_bad_calls() -> None:
    with pytest.raises(sm.SceneError, match="there is no scene 'sudden'"):
        sm.run("sudden")
    with pytest.raises(sm.SceneError, match="scene is a int; it must be a Scene, the name"):
        sm.run(3)
    with pytest.raises(sm.SceneError, match="there is no parameter 'forse'"):
        sm.run(SMALL, parameters={"forse": 1.0})
    with pytest.raises(sm.SceneError, match="parameters are force; they must be left out"):
        sm.run(sm.load_scene(SMALL), parameters={"force": 1.0})
    with pytest.raises(
        sm.SceneError, match="there is no directory /nowhere; give the directory of a run"
    ):
        sm.load("/nowhere")
