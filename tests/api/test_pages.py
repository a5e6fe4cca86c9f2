"""Modes, pages and commands that show what a directory holds."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import shellmb as sm
from shellmb.cli import app
from shellmb.show.space.display import has_display, why_not

SMALL = str(Path(__file__).parents[1] / "run" / "scene_small.py")
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")
needs_drawing = pytest.mark.skipif(why_not() is not None, reason=str(why_not()))


def command(*arguments):
    result = CliRunner().invoke(app, [*map(str, arguments)])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("pages") / "small"
    return sm.run(SMALL, place, pictures=False).directory


@needs_drawing
def test_a_report_is_one_file(folder) -> None:
    result = command("report", folder)
    assert result.exit_code == 0, result.output
    page = (folder / "report.html").read_text()
    for part in ("energy balance error", "No warnings.", "plate (shell)", "OfflineLocalView"):
        assert part in page
    # nothing is fetched
    assert 'src="http' not in page and 'href="http' not in page
    # the scene in space is in it as data that its viewer reads
    assert page.count("data:image/png") >= 4 and page.count("data:image/gif") == 1


@needs_drawing
@pytest.mark.skipif(BROWSER is None, reason="there is no Chromium (Debian's package chromium)")
def test_the_shape_of_a_report_appears_in_a_browser(folder, tmp_path) -> None:
    assert command("report", folder, "--out", tmp_path / "whole.html").exit_code == 0
    # without the other pictures, so that colours are those of the shape that can be turned
    page = re.sub(r"<img [^>]*>", "", (tmp_path / "whole.html").read_text())
    (tmp_path / "page.html").write_text(page)
    options = [
        *("--headless=new", "--no-sandbox", "--use-angle=swiftshader"),
        *("--enable-unsafe-swiftshader", "--virtual-time-budget=10000", "--window-size=1100,2000"),
        *("--enable-logging=stderr", f"--user-data-dir={tmp_path / 'profile'}"),
        *(f"--screenshot={tmp_path / 'seen.png'}", (tmp_path / "page.html").as_uri()),
    ]
    done = subprocess.run(
        [str(BROWSER), *options], capture_output=True, text=True, timeout=120, check=True
    )
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert not [s for s in said if "ERROR" in s or "Uncaught" in s], said
    pixels = np.asarray(Image.open(tmp_path / "seen.png").convert("RGB")).astype(int)
    # text, frames and outlines are grey
    coloured = np.ptp(pixels, axis=2) > 60
    assert coloured.sum() > 2000


@needs_drawing
def test_pictures_are_drawn_anew(folder, tmp_path) -> None:
    result = command("plot", folder, "--out", tmp_path / "all")
    assert result.exit_code == 0, result.output
    names = {path.name for path in (tmp_path / "all").iterdir()}
    assert names == {"shape.png", "probes.png", "energy.png", "steps.png", "animation.gif"}
    arguments = ("--field", "velocity", "--component", "z", "--out", tmp_path / "one")
    gif = tmp_path / "v.gif"
    assert command("plot", folder, *arguments, "--animation", gif).exit_code == 0
    assert [path.name for path in (tmp_path / "one").iterdir()] == ["velocity.png"]
    assert gif.stat().st_size > 0
    wrong = command("plot", folder, "--field", "N")
    assert wrong.exit_code == 2 and "name it in Output(fields=...)" in wrong.stderr


@pytest.mark.skipif(has_display(), reason="there is a display")
def test_a_view_without_a_display_says_what_else(folder) -> None:
    result = command("view", folder)
    assert result.exit_code == 1
    assert "there is no display; use `shellmb report RUN`" in result.stderr


def test_a_directory_without_a_run(tmp_path) -> None:
    result = command("plot", tmp_path)
    assert result.exit_code == 2 and "holds no scene.json; give the directory" in result.stderr


def in_order(x: np.ndarray) -> np.ndarray:
    """Rows of points by their coordinates."""
    return np.lexsort(np.round(x, 9).T)


@needs_drawing
def test_modes_read_back(tmp_path) -> None:
    found = sm.modes(SMALL, tmp_path / "modes", 3)
    read = sm.load(tmp_path / "modes")
    assert isinstance(read, sm.ModeShapes)
    np.testing.assert_array_equal(read.frequencies, found.computed.frequencies)
    shape = read.fields["plate"]["displacement"].sel(mode=2)
    # files have the nodes in the order of the mesh as it was made
    there = read.fields["plate"]["reference"].values
    here = found.computed.model.meshed["plate"].mixed.nodes("u")
    np.testing.assert_array_equal(
        shape.values[in_order(there)], found.computed.shapes[1]["plate"][in_order(here)]
    )
    assert (tmp_path / "modes" / "modes.png").stat().st_size > 0
    assert read.animate(1).suffix == ".gif"
    assert "mode 3" in read._repr_html_()
    with pytest.raises(sm.SceneError, match="mode is 4; it must be one of 1 to 3"):
        read.animate(4)
    assert json.loads((tmp_path / "modes" / "scene.json").read_text())["name"] == "small"


def test_a_study_from_python() -> None:
    found = sm.study(SMALL, dt=[2.5e-3, 1.25e-3], quantity="tip_z:end", parameters={"steps": 5})
    table = found.table
    assert table["dt"].tolist() == [2.5e-3, 1.25e-3]
    # of second order: a quarter of the error, with what is known of the reference
    assert 0.1 < table["error"][1] / table["error"][0] < 0.5
    assert "configurations" in repr(found)
    with pytest.raises(sm.SceneError, match="clock is 'sun'; it must be 'wall' or 'cpu'"):
        sm.study(SMALL, clock="sun")


def pendulum(length=1.0):
    rod = sm.RigidBody("rod", 1.0, (0.1, 0.1, 0.1), com=(length, 0, 0))
    return sm.Scene(
        "pendulum",
        rigid_bodies=rod,
        joints=sm.Spherical("pin", sm.GROUND, "rod", at=(0, 0, 0)),
        loads=sm.Gravity(),
        probes=sm.Probe("height", "center", component=2),
        scheme="ep",
        dt=0.02,
        t_end=0.2,
        results=lambda run: {"lowest": float(run.history["height"].min())},
    )


def test_a_study_of_scenes_at_hand(tmp_path) -> None:
    steps = {"dt": [0.02, 0.01], "quantity": ["lowest", "height:end"]}
    of_function = sm.study(pendulum, parameters={"length": 2.0}, out=tmp_path / "all", **steps)
    table = of_function.table
    assert not table["failed"].any() and len(table) == 4
    of_scene = sm.study(pendulum(length=2.0), **steps)
    np.testing.assert_array_equal(of_scene.table["error"], table["error"])
    # a study goes on where it was, and is not mixed with that of another scene
    again = sm.study(pendulum, parameters={"length": 2.0}, out=tmp_path / "all", **steps)
    np.testing.assert_array_equal(again.table["time_s"], table["time_s"])
    with pytest.raises(sm.SceneError, match="another"):
        sm.study(pendulum, parameters={"length": 1.0}, out=tmp_path / "all", **steps)
    with pytest.raises(sm.SceneError, match="width"):
        sm.study(pendulum, parameters={"width": 1.0}, **steps)
    with pytest.raises(sm.SceneError, match="parameters are length; they must be left out"):
        sm.study(pendulum(), parameters={"length": 1.0}, **steps)
    with pytest.raises(sm.SceneError, match="scene is a int; it must be a Scene, a function"):
        sm.study(3)
