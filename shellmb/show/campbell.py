"""A Campbell diagram drawn: frequencies and damping over the rate, with lines of its orders."""

import math
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from shellmb.arrays import Floats
from shellmb.observers.drawing import STYLE, figure

# lines of orders: 1P, 2P, ..., no more than these
ORDERS = 8
# damping ratios below this are not shown: they are round-off
DAMPED = 1e-6


def campbell_figure(table: Path) -> Figure:
    """Frequencies along their branches over the rate of rotation, unstable ones marked.

    Lines `kP` are the frequencies of `k` periods in a turn, by which what stands still in space
    excites what turns. Where there is damping, damping ratios stand below.

    Args:
        table: The file `campbell.csv`.
    """
    columns = np.genfromtxt(table, delimiter=",", names=True)
    rates, branches = columns["rate_rad_per_s"], columns["branch"]
    damped = bool(np.any(np.abs(columns["damping_ratio"]) > DAMPED))
    with mpl.rc_context(STYLE):
        made = figure(7.0, 6.2 if damped else 4.4)
        every = made.subplots(2 if damped else 1, 1, sharex=True, squeeze=False)[:, 0]
        plots = ("frequency_hz", "damping_ratio")
        for name, axes in zip(plots, every, strict=False):
            for branch in np.unique(branches):
                own = branches == branch
                axes.plot(rates[own], columns[name][own], ".-", lw=1.2, ms=4)
            shaky = columns["stable"] == 0
            axes.plot(rates[shaky], columns[name][shaky], "x", color="C3", ms=7, label="unstable")
            if shaky.any():
                axes.legend()
        _orders(every[0], rates, columns["frequency_hz"])
        every[0].set_ylabel("frequency in the frame [Hz]")
        if damped:
            every[1].set_ylabel("damping ratio")
        every[-1].set_xlabel("rate of rotation [rad/s]")
    return made


def _orders(axes: mpl.axes.Axes, rates: Floats, found: Floats) -> None:
    """Lines through the origin at multiples of the rate, as far as there are frequencies."""
    last, top = float(rates.max()), 1.05 * float(found.max()) or 1.0
    axes.set_ylim(0.0, top)
    if not last > 0:
        return
    for order in range(1, ORDERS + 1):
        end = order * last / (2 * math.pi)
        axes.plot([0, last], [0, end], ":", color="0.6", lw=0.8, zorder=0)
        x, y = (last, end) if end <= top else (last * top / end, top)
        axes.annotate(f"{order}P", (x, y), color="0.4", fontsize=8, ha="left", va="center")
