"""All pictures of a run directory, from what is in it: at the end of a run, or any time later."""

from __future__ import annotations

import gc
import logging
import time as clock
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import RunError, SceneError
from shellmb.files.reading import read_json
from shellmb.files.writing import drafted
from shellmb.observers.files.described import Described, read_described
from shellmb.scene.lookup import listed
from shellmb.show.account import bands
from shellmb.show.fields import Fields

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image

    from shellmb.show.space.scenery import Showing
    from shellmb.show.space.views import Appearance

# time that pictures may take at the end of a run: so much, or a part of the run's [s]. With that of
# a process that ends with VTK loaded it is 2 s
BUDGET, SHARE = 1.8, 0.2

# of pictures of curves, points per inch: of 150 they take a third more time
RESOLUTION = 110
FORMATS = ("png", "svg", "pdf")

_log = logging.getLogger(__name__)


def draw_directory(
    directory: Path,
    out: Path | None = None,
    budget: float | None = None,
    curves: str = "png",
    appearance: Appearance | None = None,
) -> list[Path]:
    """Draw all pictures that make sense for a run, or for modes.

    The parser in matplotlib leaves exceptions in cycles, when it is imported and with every
    logarithmic axis. They hold the frames of all callers: in the caller's thread they would hold
    a simulation, to be freed later than on the other ranks, which wait for it for ever. So all is
    drawn on a stack of its own.

    Args:
        directory: Directory of the run.
        out: Where the pictures go; None: there.
        budget: Time for it [s], by which an animation has fewer states; None: all of them.
        curves: Format of pictures of curves: one of `FORMATS`.
        appearance: How pictures in space look.

    Returns:
        The files.

    Raises:
        SceneError: If the directory holds no run, or there is no such format.
    """
    if curves not in FORMATS:
        raise SceneError(f"plot: format is '{curves}'; it must be {listed(FORMATS)}")
    # what a run leaves is not looked through again and again while libraries are loaded
    gc.freeze()
    try:
        with ThreadPoolExecutor(max_workers=1) as thread:
            return thread.submit(
                _draw, directory, out or directory, budget, curves, appearance
            ).result()
    finally:
        gc.unfreeze()


def budget_of(wall: float) -> float:
    """Time for the pictures of a run [s].

    Args:
        wall: Wall time of the run, s.
    """
    return max(BUDGET, SHARE * wall)


def _draw(
    directory: Path, out: Path, budget: float | None, curves: str, appearance: Appearance | None
) -> list[Path]:
    begin = clock.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    if (table := directory / "campbell.csv").is_file():
        from shellmb.observers.drawing import save_figure
        from shellmb.show.campbell import campbell_figure

        return [save_figure(campbell_figure(table), out / f"campbell.{curves}")]
    described = read_described(directory)
    file = directory / "summary.json"
    summary = read_json(file) if file.exists() else {}
    along = "mode" if (directory / "modes.csv").is_file() else "t"
    fields = Fields(directory / "fields", described.bodies, described.labels, along)
    try:
        if along == "mode":
            from shellmb.show.modes import modes_image

            image = modes_image(fields, described, summary)
            return [save(image, out / "modes.png")]
        made = []
        if len(fields.times):
            from shellmb.show.space.scenery import images, side_by_side

            what = shown_shape(fields, described, appearance)
            drawn = [*images(what, 960 if len(what.states) == 1 else 720)]
            made = [save(side_by_side(drawn, len(drawn)), out / "shape.png")]
    except RunError as error:
        _log.warning("pictures in space are left out: %s", error)
        made, fields = [], None  # type: ignore[assignment]
        if along == "mode":
            return made
    made += _curves(directory, described, summary, out, _size(fields), curves)
    if fields is not None and described.dynamic and len(fields.times) > 1:
        from shellmb.show.space.animation import animate

        left = None if budget is None else budget - (clock.perf_counter() - begin)
        file = out / "animation.gif"
        made.append(animate(fields, described, file, left, appearance=appearance))
    return made


def shown_shape(
    fields: Fields, described: Described, appearance: Appearance | None = None
) -> Showing:
    """The last state, and where the motion is one, before it the state of largest displacement.

    Args:
        fields: The fields.
        described: The scene.
        appearance: How it looks; None: as usual.
    """
    from shellmb.show.space.scenery import showing

    times = [float(fields.times[-1])]
    if described.dynamic and len(fields.times) > 2:
        times.insert(0, _largest(fields))
    return showing(fields, described, times, appearance=appearance)


def save(image: Image, file: Path) -> Path:
    """Write an image.

    Args:
        image: It.
        file: The file.
    """
    with drafted(file) as draft:
        image.save(draft)
    return file


def _largest(fields: Fields) -> float:
    """Time of the state of the largest displacement."""
    from shellmb.files.grids import read_values

    sizes: dict[float, float] = defaultdict(float)
    for file, t in (state for name in fields for state in fields.states(name).items()):
        u = read_values(file, "displacement")
        sizes[t] = max(sizes[t], float(np.linalg.norm(u, axis=1).max()))
    return max(sizes, key=lambda t: sizes[t])


def _size(fields: Fields | None) -> float:
    """Diagonal of the box around the scene; 1 where nothing is known of it."""
    if fields is None or not len(fields):
        return 1.0
    from shellmb.show.space.shapes import shape_of

    bodies = [name for name in fields if name != "obstacles"]
    nodes = np.concatenate([shape_of(fields, name).reference for name in bodies])
    return float(np.linalg.norm(np.ptp(nodes, axis=0))) or 1.0


def _curves(
    directory: Path,
    described: Described,
    summary: dict[str, Any],
    out: Path,
    size: float,
    kind: str,
) -> list[Path]:
    """Pictures of curves."""
    import matplotlib as mpl

    from shellmb.observers.drawing import STYLE, save_figure
    from shellmb.show import plots

    history = read_table(directory / "history.csv")
    rows = len(history["t"])
    drawn: dict[str, Figure | None] = {}
    with mpl.rc_context({**STYLE, "savefig.dpi": RESOLUTION}):
        if described.probes:
            drawn["probes"] = plots.probes(history, described, bands(summary))
        if described.dynamic:
            drawn["energy"] = plots.energies(history, described)
        # of one step there is no history
        if rows > 2:
            drawn["joints"] = plots.joints(history, described, size)
            drawn["steps"] = plots.steps(history, described)
        if described.path and described.probes and rows > 1:
            drawn["path"] = plots.path(history, described, summary.get("path", []))
        made = ((figure, out / f"{name}.{kind}") for name, figure in drawn.items())
        return [save_figure(figure, file) for figure, file in made if figure is not None]


def read_table(file: Path) -> dict[str, Floats]:
    """Columns of a history; without pandas, which takes longer to load than a picture to draw.

    Args:
        file: The file.

    Raises:
        SceneError: If it is no history.
    """
    from shellmb.observers.history import read_history

    rows = read_history(file)
    return {name: np.array([row[name] for row in rows], dtype=float) for name in rows[0]}
