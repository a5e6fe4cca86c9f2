"""Bode plots of frequency responses, and densities of random ones."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from shellmb.files.writing import drafted
from shellmb.observers.drawing import STYLE, figure

if TYPE_CHECKING:
    from shellmb.api.responding.response import Response


def bode_figure(found: Response) -> Figure:
    """Amplitude and phase over the frequency, and densities below.

    Args:
        found: The response.
    """
    densities: Any = () if found.psd is None else found.psd
    count = 2 + bool(len(densities))
    with mpl.rc_context(STYLE):
        made = figure(7.0, 2.2 * count)
        plots = made.subplots(count, 1, sharex=True)
        for o, output in enumerate(found.outputs):
            for i, name in enumerate(found.inputs):
                values = found.frf[o, i]
                if np.any(values):
                    plots[0].semilogy(found.frequencies, np.abs(values), label=f"{output} / {name}")
                    plots[1].plot(found.frequencies, np.degrees(np.angle(values)))
        for output, values in zip(found.outputs, densities, strict=False):
            plots[2].semilogy(found.frequencies, values, label=output)
        for axes, name in zip(plots, ("amplitude", "phase [deg]", "density [1/Hz]"), strict=False):
            axes.set_ylabel(name)
            if axes.get_legend_handles_labels()[1]:
                axes.legend()
        plots[-1].set_xlabel("frequency [Hz]")
    return made


def draw_bode(found: Response, file: Path) -> Path:
    """Draw the plot into a file, on a stack of its own as all pictures (`pictures`).

    Args:
        found: The response.
        file: The picture.
    """

    def draw() -> None:
        with drafted(file) as draft:
            bode_figure(found).savefig(draft)

    with ThreadPoolExecutor(max_workers=1) as thread:
        thread.submit(draw).result()
    return file
