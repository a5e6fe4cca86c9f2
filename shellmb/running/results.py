"""Results of a scene at its end, by functions of the user's that may raise."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.errors import RunError, alike
from shellmb.running.directory import written
from shellmb.running.error_origin import user_failures

type Results = Callable[..., dict[str, float]]


def measured(
    results: Results, made: Any, comm: MPI.Comm, function: str = "results"
) -> dict[str, float]:
    """The results of a run or of modes; those that do not apply to it (None) are left out.

    Args:
        results: The function.
        made: What it gets.
        comm: Communicator; the call is collective.
        function: What the scene's file calls it.

    Raises:
        RunError: If it raises, on any rank, or gives something else than numbers by name.
    """
    then = f"; correct {function}() of the scene"
    if function == "results":
        then += ", and `shellmb resume` evaluates the run"
    says = "everything is computed and saved except the results"
    with alike(comm), user_failures(RunError, says, then):
        found = _numbers(results(made))
    return found


def add_results(
    summary: dict[str, Any],
    out: Path | None,
    results: Results | None,
    made: Any,
    comm: MPI.Comm,
    function: str = "results",
) -> None:
    """Put the results of a run or of modes into its summary, also the one on disk; collective.

    Args:
        summary: The summary.
        out: Directory of the run; None: nothing is written.
        results: As of `measured`; None: there are none.
        made: As of `measured`.
        comm: As of `measured`.
        function: As of `measured`.
    """
    if results is not None:
        summary["results"] = measured(results, made, comm, function)
        write_summary(summary, out, comm)


def write_summary(summary: dict[str, Any], out: Path | None, comm: MPI.Comm) -> None:
    """Write the summary of a run, or of modes, again.

    Args:
        summary: The summary.
        out: Directory of the run; None: nothing is written.
        comm: Communicator of the run.
    """
    # what reads a run back has no use for what observes one
    from shellmb.observers.summary import write_json
    from shellmb.running.standard import SUMMARY

    if out is not None and comm.rank == 0:
        with written(out, comm):
            write_json(out / SUMMARY, summary)


def plain_results(summary: Mapping[str, Any]) -> dict[str, float]:
    """The results of a summary as numbers, without the errors that may stand beside them.

    Args:
        summary: The summary of a run.
    """
    return {
        name: entry["value"] if isinstance(entry, Mapping) else entry
        for name, entry in summary.get("results", {}).items()
    }


def _numbers(given: Any) -> dict[str, float]:
    if not isinstance(given, Mapping):
        raise TypeError(f"it returns {given!r:.60}; it must return a dict of numbers")
    numbers = {}
    for name, value in given.items():
        if value is None:
            continue
        try:
            numbers[str(name)] = float(value)
        except (TypeError, ValueError):
            raise TypeError(f"it gives {value!r:.60} for '{name}'; it must be a number") from None
    return numbers
