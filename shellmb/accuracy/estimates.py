"""Errors of discretisation from comparison runs, and how much of an observed order to use.

*Step.* A quantity differs by `d1` from the one with three times the step, and this by `d2` from the
one with nine times it. If errors go with `h^p`,

    p = log(d2/d1)/log(3),      error = F d1/(3^p - 1)

(P. J. Roache, J. Fluids Eng. 116 (1994) 405-413, with the factor of safety F). Under sudden loads
orders of large steps are those of no other, so of orders above 1 half an order less is believed (or
1), and one half at least. A difference that is smaller, by chance, than what the order of the
scheme allows by a good deal is taken as large as that. Steps nine times as large may be too large
to tell anything: where they are off by more than a hundredth of the quantity, and errors seem to
shrink faster than the scheme's order allows, a whole order less than that is believed.

An extreme of a curve depends on where steps lie beside it, which is another place in each
comparison run. An order is taken as at most one less than observed.

A curve whose comparison runs differ by more than a hundredth of it, and hardly less with smaller
steps, is not resolved: its phase is one of many, as after a snap. Its end and its extremes are then
right or wrong by chance: the end has at least the error of the curve, and each extreme the largest
error of both and of the end.

Where comparison runs are other motions, as of chaos, differences are no larger than motions are
apart. Where the larger steps are off by half of the quantity, and smaller ones by a tenth, the
least order is believed.

*Mesh.* Coarser meshes come close to the right answer by chance, and their orders are not those of
finer ones (clamped corners). The difference from a better mesh needs no order: it is the error but
for that of the better mesh, and a factor covers it. Twice the elements, and degree 3 in place of 2,
differ from the run by about the same. Resultants are derivatives, and less regular: of them a third
mesh tells whether differences fall, and how fast.

*No limit.* Where differences do not fall from one level to the next, there is no error: the moment
under a point force, or in a re-entrant corner, grows with each finer mesh, and chaos with any step.

`python -m tests.bench errors` measures what these factors cover.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, log
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.running.results import write_summary

# factor between the steps of companions
RATIO = 3.0
# factor of safety of the extrapolation, what is taken off an observed order, the least believed,
# and how far beyond the scheme's order differences have vanished by chance
SAFETY, CAUTION, LOWEST, SLACK = 1.25, 0.5, 0.5, 2.0
# error over the difference from larger steps where smaller ones do not help: both are off
GROWING = 1.75
# part of the quantity beyond which the differences of steps are no powers of them
COARSE = 0.01
# part of the quantity beyond which a companion with larger steps is another motion
UNRESOLVED = 0.5
# and beyond which the next one may be so for a part of the time
PARTLY = 0.1
# error of a mesh over its difference from a better one, of first order at least
BETTER = 2.0
# the same over the difference of a coarser mesh from the run's, of order 1.6 at least
COARSER = 0.5
# a difference over the one of the level before, beyond which it does not fall
FALLS = 0.7


@dataclass(frozen=True)
class Estimate:
    """An error that is estimated, in the unit of the quantity.

    Args:
        error: Its size; infinite where it is not known.
        order: The observed order; None where there is none.
        rough: Whether comparison runs are too far from the run to show an order.
        resolved: Whether errors of a quantity that is this far off shrink with the step.
        far: Whether the comparison run with the largest steps is another motion.
        damped: Whether it is that of vibrations that the scheme has damped.
        converges: Whether differences of the levels fall; else the size is only what the next
            level is chosen by.
    """

    error: float
    order: float | None = None
    rough: bool = False
    resolved: bool = True
    far: bool = False
    damped: bool = False
    converges: bool = True

    @property
    def known(self) -> float:
        """The error; infinite of what does not converge."""
        return self.error if self.converges else inf

    @property
    def believed(self) -> float:
        """The order that errors of finer runs are predicted by."""
        return LOWEST if self.order is None else max(self.order - CAUTION, LOWEST)


NONE, UNKNOWN = Estimate(0.0), Estimate(inf)


def step_error(
    differences: Sequence[float],
    highest: float,
    size: float,
    ratio: float = RATIO,
    caution: float = CAUTION,
    scale: float = 0.0,
) -> Estimate:
    """Error of the step of a run.

    Args:
        differences: Of the run from the one with `ratio` times the step, of this from the one with
            the square of it; the second one may be missing.
        highest: Order of the scheme.
        size: Size of the quantity.
        ratio: Factor between steps; that of a single comparison run may be below 1.
        caution: What is taken off the observed order.
        scale: Size of the curve that the quantity is a point of.

    Returns:
        The estimate. With one difference, the order is taken as 1; where differences grow as steps
        become smaller, the larger one is the error.
    """
    if not differences:
        return UNKNOWN
    fine = differences[0]
    if ratio < 1:
        return Estimate(SAFETY * fine / (1 - ratio))
    coarse = differences[1] if len(differences) > 1 else 0.0
    if coarse == 0.0:
        return Estimate(SAFETY * fine / (ratio - 1))
    possible = highest + SLACK
    order = log(coarse / fine) / log(ratio) if fine > 0 else inf
    rough = order > highest and coarse > COARSE * size
    scale = max(scale, size)
    resolved, far = order >= LOWEST or fine <= COARSE * scale, coarse > UNRESOLVED * scale
    if order <= 0:
        return Estimate(GROWING * fine, order, resolved=resolved, far=far, converges=resolved)
    if order > possible:
        fine, order = coarse / ratio**possible, possible
    caution += CAUTION if rough else 0.0
    believed = max(min(order, highest) - caution, min(order, 1.0), LOWEST)
    if far and fine > PARTLY * scale:
        believed = LOWEST
    error = SAFETY * fine / (ratio**believed - 1)
    return Estimate(error, order, rough, resolved, far, converges=resolved)


def mesh_error(
    difference: float | None,
    better: bool = True,
    levels: tuple[float, float] | None = None,
    size: float = 0.0,
) -> Estimate:
    """Error of the mesh of a run.

    Args:
        difference: To its comparison run with other elements; None: not known.
        better: Whether that run has the better elements.
        levels: Differences of a coarser level from the next one, and of this from the one after
            it; None: not known.
        size: Size of the quantity.
    """
    if difference is None:
        return UNKNOWN
    error = BETTER * difference if better else difference
    if levels is None:
        return Estimate(error)
    coarse, fine = levels
    falls = fine <= max(FALLS * coarse, COARSE * size)
    # what all finer levels change if each changes so much of what the one before did
    rest = error / (BETTER * (1.0 - min(fine / coarse, FALLS))) if coarse > 0 else 0.0
    error = SAFETY * max(error, rest, COARSER * coarse)
    return Estimate(error, resolved=falls, converges=falls)


def model_error(difference: float | None, share: float = 1.0) -> Estimate:
    """Error of something that a comparison run has less of.

    Args:
        difference: To the comparison run; None: not known.
        share: Part of the error that the comparison run does not have.
    """
    return UNKNOWN if difference is None else Estimate(SAFETY * difference / share)


@dataclass(frozen=True)
class ErrorEstimate:
    """A number with its error.

    Args:
        value: The number: a result, or the size (root mean square) of a history.
        parts: What the error is due to: "mesh", "step", "newton", "model", "contact".
    """

    value: float
    parts: Mapping[str, Estimate]

    @property
    def mesh(self) -> Estimate:
        """Error of the mesh."""
        return self.parts["mesh"]

    @property
    def step(self) -> Estimate:
        """Error of the step."""
        return self.parts["step"]

    @property
    def error(self) -> float:
        """The sum of all; infinite where one is not known, or does not converge."""
        return sum(part.known for part in self.parts.values())

    def to_dict(self) -> dict[str, float | None]:
        """Plain values: what is not known is None."""
        errors = {f"error_{name}": _finite(part.known) for name, part in self.parts.items()}
        orders = {f"order_{name}": self.parts[name].order for name in ("mesh", "step")}
        converges = {"converges": all(part.converges for part in self.parts.values())}
        return {"value": self.value, "error": _finite(self.error)} | errors | orders | converges


@dataclass(frozen=True)
class Errors:
    """Errors of a run, or of modes.

    Args:
        results: By the names of the results.
        others: By the names of columns and norms, "tip:l2", or of frequencies, "f1".
        remarks: What is not in the errors, each a sentence.
        kind: What the others are called in a summary: "probes" or "modes".
    """

    results: dict[str, ErrorEstimate]
    others: dict[str, ErrorEstimate]
    remarks: tuple[str, ...]
    kind: str = "probes"

    def write(self, summary: dict[str, Any], out: Path | None, comm: MPI.Comm) -> None:
        """Put them into a summary, also the one on disk; collective.

        In the summary, `results` then has a table for each number, and `errors` those of the
        others.

        Args:
            summary: The summary.
            out: Directory of the run or the modes; None: nothing is written.
            comm: Their communicator.
        """
        plain = {k: f.to_dict() for k, f in self.others.items()}
        summary["results"] = {k: f.to_dict() for k, f in self.results.items()}
        summary["errors"] = {self.kind: plain, "remarks": list(self.remarks)}
        write_summary(summary, out, comm)
        comm.Barrier()


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None
