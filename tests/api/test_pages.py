"""Modes, pages and commands that show what a directory holds."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import shellmb as sm
from shellmb.cli import app
from shellmb.show.space.display import has_display, why_not

SMALL = str(Path(__file__).parents[1] / "run" / "scene_small.py")
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


@needs_drawing
def test_modes_read_back(tmp_path) -> None:
    found = sm.modes(SMALL, tmp_path / "modes", 3)
    read = sm.load(tmp_path / "modes")
    assert isinstance(read, sm.ModeShapes)
    np.testing.assert_array_equal(read.frequencies, found.computed.frequencies)
    shape = read.fields["plate"]["displacement"].sel(mode=2)
    np.testing.assert_array_equal(shape, found.computed.shapes[1]["plate"])
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
