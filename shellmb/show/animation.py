"""States over time as an animation: GIF, or MP4 where imageio can write it."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.errors import RunError
from shellmb.observers.described import Described
from shellmb.show.fields import Fields
from shellmb.show.scenery import images, showing

if TYPE_CHECKING:
    from PIL.Image import Image

# an animation takes about this long [s]
DURATION = 5.0
WIDTH = 640
# what reading, drawing and storing a state takes at least: a guess before the first one [s]
GUESS = 0.06


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
    times = fields.times
    count = min(len(times), most)
    if budget is not None:
        # a state's cost is known when one is drawn
        begin = clock.perf_counter()
        first = showing(fields, described, times[[0, -1]].tolist(), field, component)
        drawn = list(images(first, WIDTH))
        cost = max((clock.perf_counter() - begin) / len(drawn) / 2, GUESS / 4)
        count = min(count, max(fewest, int((budget - 2 * cost) / cost)))
    chosen = times[np.unique(np.linspace(0, len(times) - 1, max(count, 2)).round().astype(int))]
    what = showing(fields, described, chosen.tolist(), field, component)
    write(list(images(what, WIDTH)), file)
    return file


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
    small = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    small[0].save(
        file, save_all=True, append_images=small[1:], duration=1000 * delay, loop=0, disposal=1
    )
