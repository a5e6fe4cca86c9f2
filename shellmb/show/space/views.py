"""From where pictures are taken, and how much larger displacements are shown."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from shellmb.arrays import Floats
from shellmb.scene.types import Finite, Positive, explained
from shellmb.scene.units import Units
from shellmb.scene.values.validate import described
from shellmb.show.space.shapes import Shape, State

ELEVATION, AZIMUTH = 24.0, -58.0
# a scene thinner than this part of its size along one axis only is planar and seen across it
PLANAR = 1e-6
# towards the eye, and what is up, for scenes without extent along x, y, z
ACROSS = (((1, 0, 0), (0, 0, 1)), ((0, -1, 0), (0, 0, 1)), ((0, 0, 1), (0, 1, 0)))
# displacements smaller than this part of the scene are shown larger, up to about that part of it
SMALL, SHOWN = 0.03, 0.12
# heights of pictures, parts of their width, and room for title and scale, pixels
LOWEST, HIGHEST, MARGIN, ROOM = 0.3, 0.8, 0.15, 90
# corners nearer to zero than this part of the longest side are at zero
ZERO = 1e-6


@dataclass(frozen=True)
class Theme:
    """Colours of what is no body.

    Args:
        paper: The background.
        ink: Texts and axes.
        faint: What is less important.
    """

    paper: str
    ink: str
    faint: str


THEMES = {
    "light": Theme("white", "black", "#666666"),
    "dark": Theme("#14171c", "#f0f0f0", "#a8adb5"),
}
# sides of the box as parts of the longest one, and how many numbers are at them
SPACED = ((0.6, 5), (0.25, 3), (0.0, 2))
LEAST_WIDTH, MOST_WIDTH = 100, 8000


CAMERA = "it must be an elevation from -90 to 90 and an azimuth, degrees"
Elevation = Annotated[float, Field(ge=-90, le=90)]


@described("picture")
class Appearance:
    """Choices of how a picture in space looks.

    Args:
        camera: Elevation above the xy plane and azimuth from the x axis, towards the eye,
            degrees; None: by the scene.
        width: Width, pixels; None: the usual one.
        theme: "light" or "dark".
        enlarge: Factor by which displacements are shown; None: 1, or more for small ones.
        axes: Whether a box of axes with numbers and units is drawn around all.
    """

    camera: Annotated[tuple[Elevation, Finite] | None, explained(CAMERA)] = None
    width: Annotated[int, Field(ge=LEAST_WIDTH, le=MOST_WIDTH)] | None = None
    theme: Literal["light", "dark"] = "light"
    enlarge: Positive | None = None
    axes: bool = False


@dataclass(frozen=True)
class View:
    """A box in space.

    Args:
        low: Lower corner, shape (3,).
        high: Upper corner, shape (3,).
        planar: Axis along which a planar scene has no extent, seen across it; None: it is not.
        camera: Elevation and azimuth, degrees.
    """

    low: Floats
    high: Floats
    planar: int | None = None
    camera: tuple[float, float] = (ELEVATION, AZIMUTH)

    @property
    def size(self) -> float:
        """Diagonal of the box."""
        return float(np.linalg.norm(self.high - self.low))

    def height(self, width: int) -> int:
        """Height of a picture of some width in which the box leaves little empty, pixels.

        Args:
            width: The width, pixels.
        """
        across, up = self._extent()
        part = MARGIN + up / across if across > 0 else HIGHEST
        return round(width * min(max(part, LOWEST), HIGHEST)) + ROOM

    def _extent(self) -> tuple[float, float]:
        """Width and height of the box as it is seen."""
        toward, up = directions(self)
        right = np.cross(up, toward)
        right /= np.linalg.norm(right)
        upward = np.cross(toward, right)
        corners = np.array(list(itertools.product(*zip(self.low, self.high, strict=True))))
        return float(np.ptp(corners @ right)), float(np.ptp(corners @ upward))


def view_of(points: Floats, camera: tuple[float, float] | None = None) -> View:
    """The view that shows all points.

    Args:
        points: Positions, shape (n, 3).
        camera: From where; None: by the scene.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    if camera is not None:
        return View(low, high, None, camera)
    longest = float(np.max(high - low))
    thin = np.flatnonzero(high - low <= PLANAR * longest)
    return View(low, high, int(thin[0]) if len(thin) == 1 else None)


def size_and_motion(
    shapes: Mapping[str, Shape], states: Sequence[Mapping[str, State]]
) -> tuple[float, float]:
    """Diagonal of the box around bodies in the reference, and their largest displacement.

    Args:
        shapes: Bodies.
        states: Their states.
    """
    nodes = np.concatenate([shape.reference for shape in shapes.values()])
    moved = ((state[n].position - s.reference) for state in states for n, s in shapes.items())
    largest = max(float(np.linalg.norm(u, axis=1).max()) for u in moved)
    return float(np.linalg.norm(np.ptp(nodes, axis=0))), largest


def enlargement(shapes: Mapping[str, Shape], states: Sequence[Mapping[str, State]]) -> float:
    """Factor by which displacements are shown: 1; for small ones 1, 2 or 5 times a power of 10.

    Args:
        shapes: Bodies.
        states: Their states.
    """
    size, largest = size_and_motion(shapes, states)
    if largest <= 0 or largest > SMALL * size:
        return 1.0
    wanted = SHOWN * size / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in (1, 2, 5) if step * power <= wanted))


def look(plotter: Any, view: View, scale: int = 1) -> None:
    """Point the camera of a plotter at a box.

    Args:
        plotter: A Plotter of pyvista's.
        view: What is seen.
        scale: Factor on the sizes of texts.
    """
    low, high = _rounded(view)
    sides = high - low
    longest = float(sides.max()) or 1.0
    bounds = np.stack([low, high], axis=1).ravel().tolist()
    toward, up = directions(view)
    centre = (low + high) / 2
    camera = plotter.camera
    camera.focal_point = centre.tolist()
    camera.position = (centre + 4 * longest * toward).tolist()
    camera.up = up.tolist()
    camera.parallel_projection = view.planar is not None
    # from afar: what is near is hardly larger
    camera.view_angle = 15.0
    plotter.reset_camera(bounds=bounds, render=False)
    _fit(camera, view, plotter.window_size, ROOM * scale)


def axes(
    plotter: Any, view: View, units: Units, theme: Theme, box: View | None = None, scale: int = 1
) -> None:
    """Draw the directions of the axes, and write the extent of the box, or number its sides.

    Args:
        plotter: A Plotter of pyvista's.
        view: What numbers are of.
        units: Units of the labels.
        theme: Their colours.
        box: What is seen, to be drawn as a box with numbers at its sides; None: no box.
        scale: Factor on the sizes of texts and the widths of lines.
    """
    low, high = _rounded(view)
    plotter.add_axes(
        line_width=2 * scale,
        color=theme.ink,
        viewport=(0.0, 0.0, 0.14, 0.14 * plotter.window_size[0] / plotter.window_size[1]),
    )
    unit = units.of("length")
    if box is not None:
        corners, options = np.stack(_rounded(box), axis=1), dict[str, Any]()
        sides = np.ptp(corners, axis=1)
        for name, side, numbered in zip("xyz", sides, high > low, strict=True):
            # few numbers at short sides, none where there is one number only
            count = next(n for least, n in SPACED if side >= least * sides.max())
            options[f"{name}title"] = f"{name} [{unit}]" if unit else name
            options |= {f"n_{name}labels": count, f"show_{name}axis": bool(numbered)}
        plotter.show_bounds(
            bounds=corners.ravel().tolist(),
            axes_ranges=np.stack([low, high], axis=1).ravel().tolist(),
            color=theme.ink,
            font_size=9 * scale,
            fmt="%.3g",
            location="outer",
            **options,
        )
        return
    text = "\n".join(f"{n} {a:.3g} ... {b:.3g}" for n, a, b in zip("xyz", low, high, strict=True))
    plotter.add_text(
        f"{text} {unit}".rstrip(), position="upper_left", font_size=7 * scale, color=theme.faint
    )


def _rounded(view: View) -> tuple[Floats, Floats]:
    """Corners of the box without round-off."""
    small = ZERO * float((view.high - view.low).max())
    low, high = (np.where(np.abs(x) < small, 0.0, x) for x in (view.low, view.high))
    return low, high


def _fit(camera: Any, view: View, window: Sequence[int], texts: float) -> None:
    """Bring the box as near as title, scale and numbers allow; it hangs a little lower."""
    across, up = view._extent()
    width, height = window
    seen = 2 * camera.parallel_scale
    if view.planar is None:
        seen = 2 * camera.distance * np.tan(np.radians(camera.view_angle) / 2)
    room = max(
        up / (1 - texts / height) / (1 - MARGIN), across / (1 - 1.4 * MARGIN) * height / width
    )
    if room > 0:
        camera.zoom(seen / room)


def directions(view: View) -> tuple[Floats, Floats]:
    """Unit vectors towards the eye, and up.

    Args:
        view: What is seen.
    """
    if view.planar is not None:
        toward, up = ACROSS[view.planar]
        return np.array(toward, dtype=float), np.array(up, dtype=float)
    e, a = np.radians(view.camera)
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    # up is what rises with the elevation: it is also known straight above
    return eye, np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])
