"""Costs of accuracy: levels of a request, the cheapest one for an error, and predictions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, floor, isfinite, log10
from pathlib import Path

from shellmb.accuracy.companions import Change
from shellmb.accuracy.request.choose import choose
from shellmb.accuracy.request.levels import Level
from shellmb.accuracy.request.messages import seconds


@dataclass(frozen=True)
class Offer:
    """Cost of an error.

    Args:
        error: The error, relative.
        seconds: Processor time of the run [s].
        label: Mesh, step and scheme.
        predicted: Whether it was not run.
    """

    error: float
    seconds: float
    label: str
    predicted: bool

    def __str__(self) -> str:
        about = "about " if self.predicted else ""
        return f"{100 * self.error:.2g} %: {about}{seconds(self.seconds)}, {self.label}"


def offers(
    levels: Sequence[Level], accuracy: float, size: float, labelled: Callable[[Change], str]
) -> list[Offer]:
    """Costs of powers of ten of the error, down to a tenth of the required one.

    Args:
        levels: The levels.
        accuracy: The relative error requested.
        size: What errors are relative to.
        labelled: Gives the mesh, the step and the scheme of a level in words.
    """
    known = [level.error for level in levels if isfinite(level.error)]
    worst = max(known, default=0.0) / (size or 1.0)
    first = min(max(ceil(log10(max(worst, accuracy))) - 1, floor(log10(accuracy))), -1)
    last = floor(log10(accuracy * (1 + 1e-9))) - 1
    targets = {10.0**k for k in range(last, first + 1)} | {accuracy, accuracy / 10}
    found = []
    for target in sorted(targets, reverse=True):
        good = [level for level in levels if level.error <= target * size]
        if good:
            best = min(good, key=lambda level: level.seconds)
            found.append(Offer(target, best.seconds, best.label, False))
        elif (choice := choose(list(levels), target * size, farther=True)) is not None:
            found.append(Offer(target, choice.seconds, labelled(choice.change), True))
    return found


def draw(levels: Sequence[Level], found: Sequence[Offer], size: float, file: Path) -> None:
    """Draw error over processor time.

    Args:
        levels: The levels.
        found: Offers; predicted ones are hollow.
        size: What errors are relative to.
        file: The picture.
    """
    from shellmb.accuracy.measuring.pictures import picture

    with picture(file, 6.0, 4.0) as made:
        axes = made.subplots()
        times = [level.seconds for level in levels]
        for name in ("error", "mesh", "step"):
            parts = [getattr(level, name) / (size or 1.0) for level in levels]
            if any(parts):
                style = "o-" if name == "error" else ".--"
                axes.loglog(times, parts, style, label="sum" if name == "error" else name)
        ahead = [offer for offer in found if offer.predicted]
        if ahead:
            at, errors = [o.seconds for o in ahead], [o.error for o in ahead]
            axes.loglog(at, errors, "o", mfc="white", color="C0", label="predicted")
        for level in levels:
            axes.annotate(level.label, (level.seconds, level.error / (size or 1.0)), fontsize=7)
        axes.set(xlabel="processor time of the run [s]", ylabel="relative error [-]")
        axes.legend()
