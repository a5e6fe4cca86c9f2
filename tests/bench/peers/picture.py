"""The picture of `python -m tests.bench --peer`: error against time."""

from __future__ import annotations

from pathlib import Path

from shellmb.observers.drawing import picture
from tests.bench.peers.codes import EXUDYN, OPENSEES, OURS
from tests.bench.peers.compare import Comparison


def draw(found: Comparison, path: Path) -> None:
    """All runs as points, the best of each code as a line."""
    markers = ("o", "s", "^", "D", "v", "P")
    with picture(path, 9.0, 4.5) as made:
        axes = made.add_subplot()
        for code, colour in ((OURS, "C0"), (EXUDYN, "C3"), (OPENSEES, "C2")):
            some = [p for p in found.points if p.code == code and not p.failed]
            schemes = list(dict.fromkeys(p.scheme for p in some))
            for scheme, marker in zip(schemes, markers, strict=False):
                here = [p for p in some if p.scheme == scheme]
                times, errors = [p.cpu_s for p in here], [found.judged(p) for p in here]
                label = f"{code} {scheme}"
                axes.plot(times, errors, marker, color=colour, alpha=0.5, ms=4, label=label)
            front = found.front(code)
            axes.plot([p.cpu_s for p in front], [found.judged(p) for p in front], color=colour)
        for error in found.asked:
            axes.axhline(error, color="0.5", lw=0.8, ls="--")
        axes.set_xscale("log")
        axes.set_yscale("log")
        # runs that were lost without a word are above
        axes.set_ylim(top=0.2)
        axes.set_xlabel("processor time [s]")
        axes.set_ylabel("error, L2 over time, relative")
        # beside the points, which are everywhere
        axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
