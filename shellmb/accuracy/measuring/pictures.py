"""The common look of pictures of measurements."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from shellmb.observers.drawing import STYLE, figure, save_figure


@contextmanager
def picture(
    path: Path, width: float, height: float, style: Mapping[Any, Any] | None = None
) -> Iterator[Figure]:
    """A figure to draw on, which is written then.

    Args:
        path: PNG file; its folder is made if it is not there.
        width: Width, inches.
        height: Height, inches.
        style: Parameters of matplotlib beside the usual ones.
    """
    with mpl.rc_context({**STYLE, **(style or {})}):
        made = figure(width, height)
        yield made
        path.parent.mkdir(parents=True, exist_ok=True)
        save_figure(made, path)
