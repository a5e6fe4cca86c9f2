"""Natural modes drawn: all of them in one picture, or one of them as an animation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.observers.files.described import Described
from shellmb.show.fields import Fields
from shellmb.show.space.scenery import Showing, images, showing, side_by_side
from shellmb.show.space.views import SHOWN, size_and_motion, view_of

if TYPE_CHECKING:
    from PIL.Image import Image

COLUMNS, WIDTH = 3, 520
# states of one period
PERIOD = 24
# imaginary part of a complex mode, whose real part is its displacement
IMAGINARY = "displacement_imaginary"


def _mode(fields: Fields, described: Described, mode: int) -> Showing:
    """A mode, its largest displacement a part of the scene."""
    what = showing(fields, described, [mode], "displacement", factor=1.0)
    (state,) = what.states
    nodes = np.concatenate([shape.reference for shape in what.shapes.values()])
    size, largest = size_and_motion(what.shapes, what.states)
    factor = SHOWN * size / (largest or 1.0)
    ends = [
        s.reference + sign * factor * (state[n].position - s.reference)
        for n, s in what.shapes.items()
        for sign in (-1, 1)
    ]
    return replace(what, factor=factor, view=view_of(np.concatenate([nodes, *ends])))


def captions(described: Described, summary: Mapping[str, Any]) -> list[str]:
    """Caption of each mode: its frequency or its load factor.

    Args:
        described: The scene.
        summary: Summary of the modes.
    """
    if "load_factors" in summary:
        return [f"load factor {factor:.4g}" for factor in summary["load_factors"]]
    time, rigid = described.labels.of("time"), summary["rigid_modes"]
    unit = {"s": "Hz", "ms": "kHz"}.get(time, f"1/{time}" if time else "")
    numbers = enumerate(summary["frequencies_hz"], start=1)
    return ["rigid" if k <= rigid else f"{f:.4g} {unit}".rstrip() for k, f in numbers]


def modes_image(fields: Fields, described: Described, summary: Mapping[str, Any]) -> Image:
    """All modes, with the same largest displacement.

    Args:
        fields: Their shapes.
        described: The scene.
        summary: Their summary.
    """
    drawn: list[Image] = []
    for k, text in enumerate(captions(described, summary), start=1):
        what = replace(_mode(fields, described, k), caption=f"mode {k}: {text}", bar=False)
        drawn += images(what, WIDTH)
    return side_by_side(drawn, min(COLUMNS, len(drawn)))


def animate_mode(fields: Fields, described: Described, mode: int, file: Path) -> Path:
    """One period of a mode.

    Args:
        fields: Shapes of the modes.
        described: The scene.
        mode: Its number, from 1.
        file: The GIF or MP4 file.

    Raises:
        SceneError: If there is no such mode.
    """
    from shellmb.show.space.animation import write

    if mode not in fields.times:
        raise SceneError(f"mode is {mode}; it must be one of 1 to {len(fields.times)}")
    what = _mode(fields, described, mode)
    (state,) = what.states
    # of complex modes, which are not all in phase
    late = {
        name: fields[name][IMAGINARY].sel({fields.along: mode}).values
        for name in what.shapes
        if IMAGINARY in fields[name]
    }
    period = []
    for phase in np.arange(PERIOD) * 2 * np.pi / PERIOD:
        s, c = float(np.sin(phase)), float(np.cos(phase))
        swung = {}
        for name, shape in what.shapes.items():
            u = s * (state[name].position - shape.reference)
            if name in late:
                # Re((a + i b) exp(i (phase - pi/2)))
                u = u + c * late[name]
            swung[name] = replace(
                state[name], position=shape.reference + u, arrays={"displacement": u}
            )
        period.append(swung)
    whole = replace(what, states=period, caption=f"mode {mode}", bar=False)
    write(list(images(whole, 640, finer=1)), file, duration=2.0)
    return file
