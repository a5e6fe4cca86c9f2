"""States over time as an animation: GIF, or MP4 where imageio can write it."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from shellmb.errors import RunError
from shellmb.observers.files.described import Described
from shellmb.show.fields import Fields
from shellmb.show.space.scenery import images, showing

if TYPE_CHECKING:
    from PIL.Image import Image

# an animation takes about this long [s]
DURATION = 5.0
WIDTH = 640
# light enough in all channels to be meant white
NEARLY_WHITE = 245
# a state takes so long at least [s]
LEAST = 0.01
# what drawing and storing a state takes, over what drawing it takes
STORED = 1.6


def animate(
    fields: Fields,
    described: Described,
    file: Path,
    budget: float | None = None,
    fewest: int = 2,
    most: int = 100,
    field: str | None = None,
    component: str | int | None = None,
) -> Path:
    """Draw all states, or as many of them as the time allows, evenly over the run.

    Args:
        fields: The fields.
        described: The scene.
        file: The GIF or MP4 file.
        budget: Time [s]; None: as long as it takes.
        fewest: States that are drawn in any case.
        most: States that are drawn at most.
        field: What the colours show, as of `colouring`.
        component: Its component.

    Raises:
        RunError: If this machine cannot draw, or write such a file.
    """
    begin = clock.perf_counter()
    times = fields.times
    at_most = most if budget is None else min(most, fewest + int(max(budget, 0.0) / LEAST))
    some = times[_evenly(len(times), min(len(times), at_most))]
    what = showing(fields, described, some.tolist(), field, component)
    left = None if budget is None else budget - (clock.perf_counter() - begin)
    pictures = list(images(what, WIDTH, _states(what.states, left, fewest)))
    if len(what.states) > 1 and left is not None:
        # the second one has only been for the time
        del pictures[1]
    write(pictures, file)
    return file


def _states[S](states: Sequence[S], budget: float | None, fewest: int) -> Iterator[S]:
    """States to be drawn: when the first two are drawn, it is known how many there can be."""
    if budget is None or len(states) < 2:
        yield from states
        return
    begin = clock.perf_counter()
    yield states[0]
    first = clock.perf_counter()
    yield states[0]
    last = clock.perf_counter()
    count = max(fewest, int((budget - (last - begin)) / (STORED * (last - first))))
    for k in _evenly(len(states), min(count, len(states)))[1:]:
        yield states[k]


def _evenly(many: int, count: int) -> npt.NDArray[np.int64]:
    """Numbers of so many of many, the first and the last one among them."""
    return np.unique(np.linspace(0, many - 1, max(count, 2)).round().astype(np.int64))


def write(pictures: Sequence[Image], file: Path, duration: float = DURATION) -> None:
    """Write pictures as an animation.

    Args:
        pictures: They.
        file: The GIF or MP4 file.
        duration: How long it takes, s.

    Raises:
        RunError: If the file is neither, or there is nothing to write MP4 with.
    """
    delay = max(0.04, duration / len(pictures))
    if file.suffix.lower() == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError:
            raise RunError(
                f"animation: {file.name} cannot be written without the package imageio-ffmpeg; "
                "install it, or write a .gif"
            ) from None
        import imageio

        # encoders want even sides
        even: list[Any] = [np.asarray(p)[: p.height // 2 * 2, : p.width // 2 * 2] for p in pictures]
        imageio.mimwrite(file, even, fps=1 / delay, macro_block_size=2)
        return
    if file.suffix.lower() != ".gif":
        raise RunError(f"animation: the file is {file.name}; its name must end in .gif or .mp4")
    from PIL import Image

    # one palette for all, of what is different: only what changes is stored
    some = pictures[:: max(1, len(pictures) // 4)]
    palette = Image.fromarray(np.concatenate([np.asarray(p) for p in some])).quantize(128)
    table = np.array(palette.getpalette()).reshape(-1, 3)
    # means of nearly white are a grey background
    table[table.min(axis=1) >= NEARLY_WHITE] = 255
    palette.putpalette(table.ravel().tolist())
    small = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    small[0].save(
        file, save_all=True, append_images=small[1:], duration=1000 * delay, loop=0, disposal=1
    )
