"""The work-precision picture: error against time, one curve for each family."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from shellmb.accuracy.studies.advice import TARGETS
from shellmb.accuracy.studies.points import Judged, front
from shellmb.observers.drawing import picture

# an error of nothing is drawn here
LEAST = 1e-14
MARKERS = "os^Dv<>P*X"


def draw(studies: Sequence[tuple[str, Judged]], path: Path) -> None:
    """Error over stepping time, one plot for each quantity, and write it as PNG.

    Points are runs, lines go along what no other run of the family beats, a run being credited with
    no less than the errors of finer ones; hollow points at the upper rim of the grey band have
    errors that the reference cannot tell.
    """
    columns = min(len(studies), 2)
    rows = -(-len(studies) // columns)
    style = {"axes.formatter.limits": (-5, 5), "savefig.dpi": 100}
    families = list(dict.fromkeys(name for _, judged in studies for name in judged.families()))
    with picture(path, 6.0 * columns, 4.2 * rows, style) as made:
        grid = made.add_gridspec(rows, columns)
        for k, (title, judged) in enumerate(studies):
            axes = made.add_subplot(grid[k // columns, k % columns])
            _plot(axes, judged, families)
            axes.set_title(title, fontsize=10)
        shown: dict[str, Artist] = {}
        for axes in made.axes:
            handles, labels = axes.get_legend_handles_labels()
            shown |= dict(zip(labels, handles, strict=True))
        if shown:
            # below all plots, where it hides no curve
            many = min(len(shown), 3 * columns)
            made.legend(
                [*shown.values()], [*shown], loc="outside lower center", ncols=many, fontsize=8
            )


def _plot(axes: Axes, judged: Judged, families: Sequence[str]) -> None:
    uncertainty = judged.reference.uncertainty
    axes.set_xscale("log")
    axes.set_yscale("log")
    # seldom more than a decade: plain numbers, and more of them than powers of ten
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    errors = [max(p.error or 0.0, uncertainty, LEAST) for p in judged.good]
    for family, points in judged.families().items():
        k = families.index(family)
        colour, marker = f"C{k % 10}", MARKERS[k % len(MARKERS)]
        line = front(points, uncertainty)
        times = [p.time_s for p in line]
        axes.plot(times, [max(p.bound(uncertainty), LEAST) for p in line], color=colour)
        for below in (False, True):
            some = [p for p in points if p.below == below]
            axes.plot(
                [p.time_s for p in some],
                [max(p.error or 0.0, uncertainty, LEAST) for p in some],
                linestyle="",
                marker=marker,
                markersize=5,
                color=colour,
                fillstyle="none" if below else "full",
                label=family or None if not below else None,
            )
    if errors:
        low, high = min(errors), max(errors)
        axes.set_ylim(low / 3, high * 3)
        if uncertainty > low / 3:
            axes.axhspan(low / 3, uncertainty, color="0.85", zorder=0)
    for target in TARGETS:
        axes.axhline(target, color="0.5", linewidth=0.8, linestyle=":")
    axes.set_xlabel(f"time of the steps [s] ({judged.clock})")
    axes.set_ylabel(f"relative error of {judged.quantity}")
