"""The picture of `python -m tests.bench --effects`: the time of a step without each effect."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shellmb.observers.drawing import picture
from tests.bench.effects.record import EffectRecord

# bars beyond are cut, and their lengths written at the cut [%]
LONGEST = 200.0


def draw(found: Sequence[EffectRecord], path: Path) -> None:
    """Bars of the time without an effect, in per cent of that with it, a colour for each group."""
    groups = list(dict.fromkeys(r.group for r in found))
    places = np.arange(len(found))
    with picture(path, 8.0, 1.2 + 0.24 * len(found)) as made:
        axes = made.add_subplot()
        for k, group in enumerate(groups):
            some = [i for i, r in enumerate(found) if r.group == group]
            left = [100 * (1 - found[i].saved) for i in some]
            half = [50 * found[i].spread for i in some]
            axes.barh(places[some], left, color=f"C{k}", xerr=half, label=group, ecolor="0.5")
        axes.axvline(100.0, color="k", lw=0.8)
        names = [f"{r.effect}, {r.scheme} {r.mesh}".removesuffix(" -") for r in found]
        axes.set_yticks(places, names, fontsize=7)
        axes.set_ylim(len(found) - 0.4, -0.6)
        end = min(axes.get_xlim()[1], LONGEST)
        axes.set_xlim(0.0, end)
        for place, r in zip(map(float, places), found, strict=True):
            text = f" {1e3 * r.having.step_s:.3g} → {1e3 * r.lacking.step_s:.3g} ms"
            axes.text(0.0, place, text, va="center", fontsize=6)
            share = 100 * (1 - r.saved)
            if share > end:
                axes.text(end, place, f"{share:.0f} % → ", va="center", ha="right", fontsize=6)
        axes.set_xlabel("time of a step without the effect, % of that with it; lines: spread")
        axes.legend(fontsize=7, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
