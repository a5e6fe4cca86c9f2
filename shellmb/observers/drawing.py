"""Curves drawn with matplotlib: their style, figures that need no display, and their files."""

import io
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from shellmb.files.writing import drafted

# a file of options that stands in the current folder may be a stranger's
_FOREIGN = not Path(mpl.matplotlib_fname()).is_absolute()
_DEFAULTS = {k: v for k, v in mpl.rcParamsDefault.items() if not k.startswith(("backend", "_"))}
STYLE: dict[Any, Any] = {
    **(_DEFAULTS if _FOREIGN else {}),
    "font.size": 10,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "figure.dpi": 150,
    "savefig.dpi": 150,
    # small and large numbers share one power of ten at the end of their axis
    "axes.formatter.limits": (-3, 5),
}


class Drawn(Figure):
    """A figure that a notebook shows as it is, without pyplot."""

    def _repr_png_(self) -> bytes:
        """The picture."""
        made = io.BytesIO()
        self.savefig(made, format="png")
        return made.getvalue()


def figure(width: float, height: float) -> Figure:
    """A figure that is drawn into memory only.

    Args:
        width: Width, inches.
        height: Height, inches.
    """
    made = Drawn(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    return made


def save_figure(made: Figure, file: Path) -> Path:
    """Write a figure.

    Args:
        made: The figure.
        file: The picture.
    """
    with drafted(file) as draft:
        made.savefig(draft)
    return file


def drawn(plot: Callable[[], Figure], file: Path) -> None:
    """Draw a figure into a file, on a stack of its own as all pictures (`pictures`).

    Args:
        plot: Makes the figure.
        file: The picture.
    """
    with ThreadPoolExecutor(max_workers=1) as thread:
        thread.submit(lambda: save_figure(plot(), file)).result()


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
