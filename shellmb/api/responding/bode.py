"""Bode plots of frequency responses, and densities of random ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from shellmb.arrays import Floats
from shellmb.files.writing import drafted
from shellmb.observers.drawing import STYLE, figure


def bode_figure(
    f: Floats, frf: Any, psd: Floats | None, inputs: Sequence[str], outputs: Sequence[str]
) -> Figure:
    """Amplitude and phase over the frequency, and densities below.

    Args:
        f: Frequencies, Hz.
        frf: Frequency responses, shape (outputs, inputs, n).
        psd: Densities, shape (outputs, n); None: none.
        inputs: Names of the inputs.
        outputs: Names of the outputs.
    """
    labels = ("amplitude", "phase [deg]", *(() if psd is None else ("density [1/Hz]",)))
    with mpl.rc_context(STYLE):
        made = figure(7.0, 2.2 * len(labels))
        plots = made.subplots(len(labels), 1, sharex=True)
        for o, i in zip(*np.nonzero(np.any(frf, axis=2)), strict=True):
            plots[0].semilogy(f, np.abs(frf[o, i]), label=f"{outputs[o]} / {inputs[i]}")
            plots[1].plot(f, np.degrees(np.angle(frf[o, i])))
        if psd is not None:
            plots[2].semilogy(f, psd.T, label=outputs)
        for axes, name in zip(plots, labels, strict=True):
            axes.set_ylabel(name)
            if axes.get_legend_handles_labels()[1]:
                axes.legend()
        plots[-1].set_xlabel("frequency [Hz]")
    return made


def drawn(plot: Callable[[], Figure], file: Path) -> None:
    """Draw a figure into a file, on a stack of its own as all pictures (`pictures`).

    Args:
        plot: Makes the figure.
        file: The picture.
    """

    def draw() -> None:
        with drafted(file) as draft:
            plot().savefig(draft)

    with ThreadPoolExecutor(max_workers=1) as thread:
        thread.submit(draw).result()
