"""Pictures of the gallery's cards: one size, bodies fill the frame, a bar with name and unit."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.font_manager import findfont
from PIL import Image, ImageChops, ImageDraw, ImageFont
from scipy.spatial import ConvexHull, QhullError

from shellmb.arrays import Floats
from shellmb.observers.files.described import Described, read_described
from shellmb.scene.units import parse_units
from shellmb.show.fields import Fields
from shellmb.show.pictures import shown_shape
from shellmb.show.space.colours import MARKS
from shellmb.show.space.display import canvas
from shellmb.show.space.scenery import JOINTS, OBSTACLES, RIGID, THIN, Showing, Stage, showing
from shellmb.show.space.shapes import Pieces
from shellmb.show.space.views import ACROSS, Appearance, directions, view_of

# a card and the band below it with the bar, pixels; drawn larger by so much, and reduced
WIDTH, HEIGHT, BAND, FINER = 640, 480, 64, 3
# empty part of the frame, and directions towards the eye that are tried, degrees
MARGIN = 0.07
# least thickness of bodies, over that in a run's pictures
LARGER = 1.5
# what moved less than this part of the view is drawn once
STILL = 0.03
ELEVATIONS, AZIMUTHS = (15, 25, 35), (-155, -145, -135, -125, -115, -65, -55, -45, -35, -25)
# earlier states
GHOST = {"opacity": 0.22, "smooth_shading": True}


@dataclass(frozen=True)
class Look:
    """What a card shows.

    Args:
        t: Time; None: the state of largest displacement.
        ghosts: Number of states before it that are drawn faintly; 0: the reference's outline.
        field: What the colours show; None: as in a run's pictures.
        factor: By which displacements are shown larger; None: as in a run's pictures.
        camera: Elevation and azimuth, degrees; None: the direction in which bodies fill most of
            the frame.
    """

    t: float | None = None
    ghosts: int = 0
    field: str | None = None
    factor: float | None = None
    camera: tuple[float, float] | None = None


class _Card(Stage):
    """Bodies without texts, and without the reference where earlier states are drawn."""

    ghosts: tuple[dict[str, Any], ...] = ()

    def __init__(self, what: Showing, plotter: Any, ghosts: tuple[dict[str, Any], ...]) -> None:
        self.ghosts = ghosts
        super().__init__(what, plotter, marks=False, scale=FINER)
        for state in ghosts:
            for name in what.shapes:
                marks = name in MARKS and (name != "solids" and "solids" in what.shapes)
                moved = np.abs(state[name].position - what.states[0][name].position).max()
                if name not in (OBSTACLES, JOINTS) and not marks and moved > STILL * what.view.size:
                    self._ghost(what, name, state)

    def _reference(self, pv: Any, name: str, X: Floats, fine: Pieces) -> None:
        if not self.ghosts:
            super()._reference(pv, name, X, fine)

    def _ghost(self, what: Showing, name: str, state: dict[str, Any]) -> None:
        import pyvista as pv

        shape = what.shapes[name]
        fine, x = shape.fine, what.place(name, state[name])
        if len(fine.faces):
            mesh = pv.PolyData.from_regular_faces(fine.at(x), fine.faces.astype(int))
            self._plotter.add_mesh(mesh, color=RIGID if name == "solids" else "#2a6f97", **GHOST)
        elif len(fine.lines):
            rows = np.insert(fine.lines, 0, fine.lines.shape[1], axis=1).ravel()
            radius = max(shape.thickness / 2, THIN * what.view.size)
            tube = pv.PolyData(fine.at(x), lines=rows).tube(radius=radius, n_sides=16)
            self._plotter.add_mesh(tube, color="#2a6f97", culling="back", **GHOST)


def _axes(toward: Floats, up: Floats) -> Floats:
    """Unit vectors to the right and up in a picture, shape (2, 3)."""
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right)])


def _scale(flat: Floats) -> float:
    """Half of the height that a frame of a card needs for points, shape (n, 2)."""
    wide, high = np.ptp(flat, axis=0)
    return float(max(wide * (HEIGHT - BAND) / WIDTH, high)) / 2 / (1 - 2 * MARGIN)


def _filled(flat: Floats) -> float:
    """Part of the frame that the hull of points fills."""
    try:
        area = float(ConvexHull(flat).volume)
    except QhullError:
        return 0.0
    return area / _scale(flat) ** 2


def _direction(points: Floats, look: Look) -> tuple[Floats, Floats]:
    """Unit vectors towards the eye, and up."""
    plain = view_of(points)
    if look.camera is None and plain.planar is not None:
        toward, up = ACROSS[plain.planar]
        return np.array(toward, dtype=float), np.array(up, dtype=float)
    cameras = [look.camera] if look.camera else itertools.product(ELEVATIONS, AZIMUTHS)
    tried = [directions(replace(plain, planar=None, camera=c)) for c in cameras]
    return max(tried, key=lambda d: _filled(points @ _axes(*d).T))


def _aim(plotter: Any, points: Floats, look: Look) -> None:
    """Point a plotter's camera so that points fill its frame."""
    toward, up = _direction(points, look)
    axes = _axes(toward, up)
    flat = points @ axes.T
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
    centre = middle @ axes + toward * float((points @ toward).mean())
    far = 4 * float(np.linalg.norm(np.ptp(points, axis=0)))
    camera = plotter.camera
    camera.focal_point = centre.tolist()
    camera.position = (centre + far * toward).tolist()
    camera.up = up.tolist()
    camera.parallel_projection = True
    camera.parallel_scale = _scale(flat)


def _points(what: Showing, states: tuple[dict[str, Any], ...], reference: bool) -> Floats:
    """Positions that have to be in the frame."""
    names = [name for name in what.shapes if name != OBSTACLES]
    found = [what.place(name, state[name]) for name in names for state in states]
    if reference:
        found += [what.shapes[name].reference for name in names]
    every = np.concatenate(found)
    thick = max(
        0.0015 * float(np.linalg.norm(np.ptp(every, axis=0))),
        max(what.shapes[n].thickness for n in names) / 2,
    )
    planar = np.ptp(every, axis=0) < 1e-6 * np.ptp(every, axis=0).max()
    shifts = np.concatenate([np.eye(3), -np.eye(3)]) * np.where(planar, 0.0, thick)
    return np.concatenate([every + shift for shift in shifts])


def with_bar(picture: Image.Image, what: Showing, coloured: bool = True) -> Image.Image:
    """A picture with the bar, its name and unit, and the scale of displacements below it."""
    width, k = picture.width, picture.width / WIDTH
    font = ImageFont.truetype(findfont("DejaVu Sans"), round(22 * min(k, 1.2)))
    whole = Image.new("RGB", (width, picture.height + BAND), "white")
    whole.paste(picture, (0, 0))
    pen, top = ImageDraw.Draw(whole), picture.height
    larger = "" if what.factor == 1 else f"displacements x {what.factor:g}"
    if not coloured:
        pen.text((width / 2, top + 44), larger, "black", font, "mm")
        return whole
    low, high = what.limits
    left, right = round(0.19 * width), round(0.81 * width)
    colours = mpl.colormaps[what.colours](np.linspace(0, 1, right - left))[:, :3]
    rows = np.repeat((255 * colours).astype(np.uint8)[None], 14, axis=0)
    whole.paste(Image.fromarray(rows), (left, top + 34))
    pen.rectangle((left - 1, top + 33, right, top + 48), outline="#555555")
    pen.text((left - 8, top + 41), f"{low:.3g}", "black", font, "rm")
    pen.text((right + 8, top + 41), f"{high:.3g}", "black", font, "lm")
    name = f"{what.shown.label}; {larger}" if larger else what.shown.label
    pen.text((width / 2, top + 19), name, "black", font, "mm")
    return whole


def banded(directory: Path, look: Look) -> Image.Image:
    """The card of a run.

    Args:
        directory: Directory of the run.
        look: What it shows.
    """
    described = read_described(directory)
    if described.units is None:
        # every demo is in SI units
        described = replace(described, units="m, kg, s")
    parse_units(described.units)
    along = "mode" if (directory / "modes.csv").is_file() else "t"
    fields = Fields(directory / "fields", described.bodies, described.labels, along)
    t = look.t if look.t is not None else _largest_time(fields, described)
    until = [float(s) for s in fields.times if s <= t + 1e-9]
    before = np.linspace(0, len(until) - 1, look.ghosts + 1).round().astype(int)[:-1]
    times = [until[k] for k in before] + [t]
    what = showing(fields, described, times, look.field, factor=look.factor)
    *ghosts, last = what.states
    one = replace(what, states=[last], force=0.0)
    # colours of this state alone
    alone = showing(fields, described, [t], look.field, factor=what.factor)
    # in a small picture thin bodies and marks are larger parts of it
    points = _points(one, (*ghosts, last), not ghosts)
    middle = points.mean(axis=0)
    view = view_of(middle + LARGER * (points - middle))
    one = replace(one, limits=alone.limits, bar=alone.bar, view=view)
    with canvas(FINER * WIDTH, FINER * (HEIGHT - BAND)) as plotter:
        stage = _Card(one, plotter, tuple(ghosts))
        stage.set(last)
        _aim(plotter, points, look)
        plotter.renderer.ResetCameraClippingRange()
        plotter.render()
        drawn = Image.fromarray(np.asarray(plotter.screenshot(None, return_img=True)))
        coloured = stage._coloured is not None and one.bar
    if along == "mode":
        # the size of a mode means nothing
        shown = replace(one.shown, label="displacement / its largest [-]")
        one = replace(one, factor=1.0, limits=(0.0, 1.0), shown=shown)
    return with_bar(drawn.reduce(FINER), one, coloured)


def _largest_time(fields: Fields, described: Described) -> float:
    state = next(iter(shown_shape(fields, described, Appearance()).states[0].values()))
    return float(state.t)


def drawn(file: Path) -> Image.Image:
    """A picture that a command has drawn, without white around it, in the size of a card.

    Args:
        file: It.
    """
    picture = Image.open(file).convert("RGB")
    box = ImageChops.difference(picture, Image.new("RGB", picture.size, "white")).getbbox()
    picture = picture.crop(box) if box else picture
    picture.thumbnail((WIDTH - 20, HEIGHT - 20), Image.Resampling.LANCZOS)
    whole = Image.new("RGB", (WIDTH, HEIGHT), "white")
    whole.paste(picture, ((WIDTH - picture.width) // 2, (HEIGHT - picture.height) // 2))
    return whole
