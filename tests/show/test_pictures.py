"""Pictures in space: what is near hides what is far, and what colours and arrows show."""

import os
import subprocess
import sys

import numpy as np
import pytest

import shellmb as sm
from shellmb.observers.drawing import figure
from shellmb.observers.files.described import describe
from shellmb.observers.files.gridfiles import Grid, GridFiles
from shellmb.show.fields import Fields
from shellmb.show.plots import draw_curves
from shellmb.show.space.colours import colouring
from shellmb.show.space.display import why_not
from shellmb.show.space.scenery import images, showing
from shellmb.show.space.shapes import deformation
from shellmb.show.space.views import AZIMUTH, ELEVATION, Appearance, view_of

needs_drawing = pytest.mark.skipif(why_not() is not None, reason=str(why_not()))

QUAD = 9


def wall(name, distance):
    """A square across the line of sight, so far towards the eye."""
    a, e = np.radians([AZIMUTH, ELEVATION])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    up = np.cross(eye, right)
    corners = [distance * eye + i * right + j * up for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    cells, types = np.array([4, 0, 1, 2, 3]), np.array([QUAD], dtype=np.uint8)
    return Grid(name, np.array(corners), cells, types)


def two_walls(folder, names, values):
    """Fields of two walls, the first one nearer, one state."""
    for name, distance, value in zip(names, (1.0, -1.0), values, strict=True):
        files = GridFiles(folder, wall(name, distance), {})
        heat = np.full(4, value)
        files.write(0, {"displacement": np.zeros((4, 3)), "heat": heat})
        files.list([0.0])
    bodies = [sm.RigidBody(n, 1.0, (1, 1, 1)) for n in names]
    scene = sm.Scene("walls", rigid_bodies=bodies, scheme="ep", dt=1, t_end=1)
    described = describe(scene)
    return Fields(folder, described.bodies, described.labels), described


@needs_drawing
@pytest.mark.parametrize("names", [("a", "b"), ("b", "a")])
def test_the_nearer_wall_hides_the_other(tmp_path, names) -> None:
    """Whichever is drawn first; a painter that sorts bodies or pieces gets boxes wrong."""
    fields, described = two_walls(tmp_path, names, (0.0, 1.0))
    what = showing(fields, described, [0.0], "heat")
    (image,) = images(what, 400)
    pixels = np.asarray(image)
    # viridis: the near wall is dark violet (zero), the far one is yellow; a little off the middle,
    # where no outline of an element is
    near = pixels[int(0.45 * len(pixels)), int(0.45 * pixels.shape[1])].astype(int)
    assert near[0] < 100 and near[1] < 60 and near[2] > 40, near


@needs_drawing
def test_the_far_wall_is_seen_where_the_near_one_is_not(tmp_path) -> None:
    """The same with the walls' values exchanged: that the pixel above says anything."""
    fields, described = two_walls(tmp_path, ("a", "b"), (1.0, 0.0))
    (image,) = images(showing(fields, described, [0.0], "heat"), 400)
    pixels = np.asarray(image)
    near = pixels[int(0.45 * len(pixels)), int(0.45 * pixels.shape[1])].astype(int)
    assert near[0] > 180 and near[1] > 170 and near[2] < 100, near


@needs_drawing
@pytest.mark.parametrize("marks", [True, False])
def test_each_state_has_a_picture_of_its_own(tmp_path, marks) -> None:
    files = GridFiles(tmp_path, wall("a", 0.0), {})
    for k in range(3):
        files.write(k, {"displacement": np.tile([0.0, 0.0, 0.5 * k], (4, 1))})
    files.list([0.0, 1.0, 2.0])
    body = sm.RigidBody("a", 1.0, (1, 1, 1))
    described = describe(sm.Scene("wall", rigid_bodies=body, scheme="ep", dt=1, t_end=2))
    fields = Fields(tmp_path, described.bodies, described.labels)
    what = showing(fields, described, [0.0, 1.0, 2.0])
    drawn = [np.asarray(image) for image in images(what, 300, marks=marks)]
    # its highest point in colour: text and reference are grey, the scale is below
    top = [np.flatnonzero((np.ptp(image, axis=2) > 60).any(axis=1)).min() for image in drawn]
    assert top[0] > top[1] + 10 > top[2] + 20


def test_nothing_has_no_scale(tmp_path) -> None:
    """Before anything has moved a scale would have numbers of round-off."""
    fields, described = two_walls(tmp_path, ("a", "b"), (1.0, 0.0))
    assert not showing(fields, described, [0.0], "displacement").bar
    assert showing(fields, described, [0.0], "heat").bar


def test_fields_that_are_not_there(tmp_path) -> None:
    fields, described = two_walls(tmp_path, ("a", "b"), (1.0, 0.0))
    with pytest.raises(sm.SceneError, match=r"field is 'N'; the run has .*'heat'.*'deformation'"):
        colouring(fields, described, "N")
    with pytest.raises(sm.SceneError, match="component is 3; 'displacement' has '1', '2', '3'"):
        colouring(fields, described, "displacement", 3)
    assert colouring(fields, described, "displacement", "z").component == 2
    assert colouring(fields, described).field == "displacement"


def test_deformation_is_without_the_motion_of_the_body() -> None:
    rng = np.random.default_rng(2)
    X, (turn, _) = rng.normal(size=(20, 3)), np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = X @ turn.T + [5.0, -3.0, 1.0]
    # round-off is none, and has no colours
    assert deformation(X, moved).max() == 0.0
    assert deformation(X, np.concatenate([moved[:1] + 0.1, moved[1:]]))[0] > 0.05


@pytest.mark.parametrize(
    ("nodes", "planar"),
    [
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0)], 2),
        ([(0, 0, 0), (1, 0, 0), (1, 0, 1)], 1),
        ([(0, 0, 0), (1, 0, 0), (1, 1, 1)], None),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], None),
    ],
)
def test_a_planar_scene_is_seen_across_its_plane(nodes, planar) -> None:
    assert view_of(np.array(nodes, dtype=float)).planar == planar


def test_curves_on_one_another_are_all_seen() -> None:
    axes = figure(4, 3).subplots()
    t = np.linspace(0, 1, 50)
    draw_curves(axes, t, {"a": t, "b": t + 1e-4, "c": 1 - t, "d": t * (1 + 1e-5)})
    a, b, c, d = axes.lines
    assert a.get_linewidth() > b.get_linewidth() > d.get_linewidth() == c.get_linewidth()
    assert [line.get_linestyle() for line in (a, b, c, d)] == ["-", "--", "-", ":"]


def test_a_machine_that_cannot_draw_says_so(tmp_path, monkeypatch) -> None:
    from shellmb.show.space import display

    fields, described = two_walls(tmp_path, ("a", "b"), (0.0, 1.0))
    monkeypatch.setattr(display, "window_kind", lambda: None)
    with pytest.raises(sm.RunError, match="this machine cannot draw in 3-D"):
        next(iter(images(showing(fields, described, [0.0]))))
    monkeypatch.delenv("DISPLAY", raising=False)
    from shellmb.show.space.scenery import show

    with pytest.raises(sm.RunError, match="there is no display; use `shellmb report RUN`"):
        show(showing(fields, described))


def test_a_device_without_a_driver_is_none() -> None:
    """VTK would end the process where it is told to draw there."""
    code = (
        "from shellmb.show.space.display import canvas, why_not\n"
        "if why_not() is None:\n    with canvas(9, 9) as plotter:\n        plotter.show()"
    )
    without = {"LIBGL_DRIVERS_PATH": "/nonexistent", "GALLIUM_DRIVER": "nothing"}
    subprocess.run([sys.executable, "-c", code], env=os.environ | without, check=True)


def test_a_notebook_shows_a_figure() -> None:
    """Also one in which nobody has imported pyplot."""
    drawn = figure(2.0, 1.0)
    drawn.subplots().plot([1, 2])
    assert drawn._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]


@needs_drawing
def test_what_comes_nearer_than_the_reference_is_not_cut_off(tmp_path) -> None:
    """The camera must see from what is nearest now, and not from what was nearest at first."""
    a, e = np.radians([AZIMUTH, ELEVATION])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    files = GridFiles(tmp_path, wall("a", 0.0), {})
    for k, moved in enumerate((0.0, 6.0)):
        files.write(k, {"displacement": np.tile(moved * eye, (4, 1))})
    files.list([0.0, 1.0])
    body = sm.RigidBody("a", 1.0, (1, 1, 1))
    described = describe(sm.Scene("wall", rigid_bodies=body, scheme="ep", dt=1, t_end=1))
    fields = Fields(tmp_path, described.bodies, described.labels)
    what = showing(fields, described, [0.0, 1.0], "displacement", factor=1.0)
    areas = [
        int((np.asarray(image.convert("L")) < 245).sum())
        for image in images(what, 400, marks=False)
    ]
    # a wall across the line of sight, seen from afar: it grows a little
    assert 0.9 * areas[0] < areas[1] < 2.0 * areas[0], areas


@needs_drawing
def test_pictures_look_as_one_chooses(tmp_path) -> None:
    """Background, width and camera; from behind the far wall hides the near one."""
    fields, described = two_walls(tmp_path, ("a", "b"), (0.0, 1.0))
    look = Appearance(camera=(-ELEVATION, AZIMUTH + 180), width=400, theme="dark", axes=True)
    (image,) = images(showing(fields, described, [0.0], "heat", appearance=look))
    pixels = np.asarray(image)
    assert pixels.shape[1] == 400 and pixels[2, 2].max() < 40
    yellow = pixels[int(0.45 * len(pixels)), int(0.45 * pixels.shape[1])].astype(int)
    assert yellow[0] > 150 and yellow[2] < 120, yellow


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"camera": (100.0, 0.0)}, "elevation from -90 to 90"),
        ({"camera": "above"}, "elevation from -90 to 90"),
        ({"width": 3}, "width is 3; it must be at least 100"),
        ({"theme": "pink"}, "light"),
        ({"enlarge": -1.0}, "greater than 0"),
        ({"enlarge": "much"}, "a number"),
        ({"width": "wide"}, "a whole number"),
        ({"theme": ["dark"]}, "light"),
        ({"colour": "red"}, "picture: there is no parameter colour; its parameters are camera, "),
    ],
)
def test_an_appearance_that_cannot_be(wrong, says) -> None:
    with pytest.raises(sm.SceneError, match=says):
        Appearance(**wrong)
