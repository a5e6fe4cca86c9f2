"""Numbers with their errors, what these are due to, and the summary that gets them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.estimates import Estimate
from shellmb.observers.summary import write_json
from shellmb.running.directory import written
from shellmb.running.standard import SUMMARY


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
    """Errors of a run.

    Args:
        results: By the names of the results.
        probes: By the names of columns and norms, "tip:l2".
        remarks: What is not in the errors, each a sentence.
    """

    results: dict[str, ErrorEstimate]
    probes: dict[str, ErrorEstimate]
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for `summary.json`."""
        return {
            "results": {k: f.to_dict() for k, f in self.results.items()},
            "probes": {k: f.to_dict() for k, f in self.probes.items()},
            "remarks": list(self.remarks),
        }


def write_summary(summary: dict[str, Any], out: Path | None, comm: MPI.Comm) -> None:
    """Write the summary of a run, or of modes, again; collective.

    Args:
        summary: The summary.
        out: Directory of the run; None: nothing is written.
        comm: Communicator of the run.
    """
    if out is not None and comm.rank == 0:
        with written(out, comm):
            write_json(out / SUMMARY, summary)
    comm.Barrier()


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None
