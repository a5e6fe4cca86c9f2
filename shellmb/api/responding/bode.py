"""Bode plots of frequency responses, and densities of random ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from shellmb.arrays import Floats
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
    labels = ["amplitude\n[output/input]", "phase [deg]"]
    labels += [] if psd is None else ["density\n[output²/Hz]"]
    with mpl.rc_context(STYLE):
        made = figure(7.0, 2.2 * len(labels))
        plots = made.subplots(len(labels), 1, sharex=True)
        for o, i in zip(*np.nonzero(np.any(frf, axis=2)), strict=True):
            plots[0].semilogy(f, np.abs(frf[o, i]), label=f"{outputs[o]} / {inputs[i]}")
            plots[1].plot(f, _broken(np.degrees(np.angle(frf[o, i]))))
        plots[1].set(ylim=(-190, 190), yticks=range(-180, 181, 90))
        if psd is not None:
            plots[2].semilogy(f, psd.T, label=outputs)
        for axes, name in zip(plots, labels, strict=True):
            axes.set_ylabel(name)
            if axes.get_legend_handles_labels()[1]:
                axes.legend()
        plots[-1].set_xlabel("frequency [Hz]")
    return made


def _broken(phase: Floats) -> Floats:
    """A phase without a line where it begins again at the other end."""
    jumps = np.abs(np.diff(phase, prepend=phase[0])) > 180
    return np.where(jumps, np.nan, phase)
