"""Options of a study, for the command line and Python alike."""

from __future__ import annotations

from dataclasses import dataclass

from shellmb.options.described import option, positive, several
from shellmb.options.run import Options

# what a study without a word about it does
REPEAT, REFINE = 3, 2


@dataclass(frozen=True, kw_only=True)
class StudyOptions:
    """Axes and references of a study; an empty axis keeps the scene's choice."""

    dt: tuple[float, ...] = several(Options, "dt", "S,S,...", positive)
    mesh: tuple[tuple[int, int], ...] = several(Options, "mesh", "NxM,...")
    scheme: tuple[str, ...] = several(Options, "scheme", "ep,ed,...")
    alpha: tuple[float, ...] = several(Options, "alpha", "A,A,...")
    degree: tuple[int, ...] = several(Options, "degree", "2,3", int)
    cell: tuple[str, ...] = several(Options, "cell", "quad,tri")
    divide: tuple[int, ...] = several(Options, "divide", "1,2,...", int)
    model: tuple[str, ...] = several(Options, "model", "exact,rigid,...")
    solve: tuple[str, ...] = several(Options, "solve", "reduced,full")
    step_error: tuple[float, ...] = several(Options, "step_error", "E,E,...", positive)
    newton_tolerance: tuple[float, ...] = several(Options, "newton_tolerance", "T,T,...", positive)
    exact: float | None = option(
        "Exact value of the quantity. Without it a finer run is the reference."
    )
    reference: str | None = option(
        "Scheme of the reference run: ep4, or else ed with the smallest alpha, if they are swept."
    )
    refine: int = option(
        "Refinement of the reference run, in steps and in elements per side.", REFINE
    )
    repeat: int = option("Number of rounds over all runs, for the times.", REPEAT)
