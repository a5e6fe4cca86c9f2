"""Section 6.1: how far the torque rises before the plate buckles, by the size of its imperfection.

The static load of buckling is passed at 0.019 s. From then on a sideways motion grows from the
imperfection, the faster the higher the load, until the plate gives way; so the peak torque falls
with the logarithm of the imperfection. Compared with a linearised beam model computed for this
project, which knows the time and the torque at which mid-span has moved by 2 mm.
"""

from __future__ import annotations

import matplotlib.figure
import numpy as np
from matplotlib.axes import Axes

from demos.paper.example import Figure, Results, Run
from shellmb.demos.lateral_buckling import measured

__all__ = ["GROWTH", "LINEARISED", "growth", "growth_figure"]

# imperfection [m], time at 2 mm [s], torque then [N m]: docs/reference/literature.md,
# examples; a bow like the first buckling mode
LINEARISED = np.array(
    [
        (1e-3, 0.0335, 17.9),
        (1e-4, 0.0523, 27.9),
        (1e-5, 0.0706, 37.6),
        (1e-6, 0.0742, 39.6),
        (1e-8, 0.0827, 44.0),
        (1e-10, 0.0896, 47.7),
        (1e-12, 0.0952, 50.6),
        (1e-14, 0.1003, 53.3),
        (1e-16, 0.1050, 55.8),
    ]
)
SIZES = tuple(float(a) for a in LINEARISED[:, 0])
T_END = 0.14


def _name(size: float) -> str:
    return f"bow-{size:.0e}" if size else "bow-0"


GROWTH = tuple(
    Run(
        _name(size),
        "lateral_buckling",
        {"model": "shell", "imperfection": size},
        {"scheme": "ed", "t_end": T_END},
    )
    for size in (*SIZES, 0.0)
)
NAMES = tuple(run.name for run in GROWTH)


def growth(results: Results) -> np.ndarray:
    """Size [m], time at 2 mm [s], peak torque [N m] of every run with an imperfection, (9, 3)."""
    found = [measured(results[_name(size)].history) for size in SIZES]
    return np.array(
        [(size, f["buckling_time"], f["peak_torque"]) for size, f in zip(SIZES, found, strict=True)]
    )


def growth_figure(number: str) -> Figure:
    """The figure of the study.

    Args:
        number: Its number.
    """
    return Figure(
        number,
        "Ours: peak torque and time of buckling by the size of the imperfection, beside a "
        "linearised model. The paper's plate has none and buckles by round-off at about 60 N.m; "
        "ours without one stays straight.",
        NAMES,
        _draw,
    )


def _draw(made: matplotlib.figure.Figure, results: Results) -> None:
    made.set_size_inches(8.0, 3.8)
    left, right = made.subplots(1, 2)
    ours, perfect = growth(results), measured(results[NAMES[-1]].history)
    _points(left, ours[:, 2], LINEARISED[:, 2], "torque [N m]")
    _points(right, ours[:, 1], LINEARISED[:, 1], "time of 2 mm at mid-span [s]")
    if not perfect["buckled"]:
        said = f"with none symmetry is kept exactly:\nno buckling until {T_END} s"
        right.text(0.03, 0.05, said, transform=right.transAxes, fontsize=8)
    left.axhspan(50, 65, color="C2", alpha=0.12, label="50 to 65 N m")
    for axes in (left, right):
        axes.legend(fontsize=8)


def _points(axes: Axes, ours: np.ndarray, linearised: np.ndarray, label: str) -> None:
    what = "peak, shell model" if "torque" in label else "shell model"
    axes.semilogx(SIZES, ours, "o-", label=what, markersize=4)
    axes.semilogx(SIZES, linearised, "s--", label="linearised model at 2 mm", markersize=4)
    axes.set(xlabel="amplitude of the bow [m]", ylabel=label)
