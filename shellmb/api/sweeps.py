"""Sweeps: a scene run for many values of its parameters, one process for each, into one table."""

from __future__ import annotations

import hashlib
import inspect
import itertools
import json
import multiprocessing
import os
import pickle
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import pandas as pd

from shellmb.api.runs import path_of, run
from shellmb.errors import RunError, SceneError, ShellmbError
from shellmb.files.writing import write_text
from shellmb.options.described import options_of, takes
from shellmb.options.run import AccuracyOptions, Options
from shellmb.running.error_origin import user_failures
from shellmb.running.loader import check_function, check_names, check_values, load, scene_of
from shellmb.scene import Scene

# files of a sweep, and of one of its cases
ABOUT, CASE = "sweep.json", "case.json"
# numbers of a summary that are columns beside the results
COUNTED = ("steps", "rejected_steps", "energy_balance_error", "constraint_max", "wall_s")

type SceneFunction = Callable[..., Scene] | str
type Measure = Callable[..., Mapping[str, float]]


@takes()
def sweep(
    scene: SceneFunction,
    parameters: Iterable[Mapping[str, Any]] | Mapping[str, Sequence[Any]],
    executor: Executor | None = None,
    *,
    out: Path | str | None = None,
    measure: Measure | None = None,
    options: Mapping[str, Any] | None = None,
) -> pd.DataFrame:
    """Run a scene for many values of parameters.

    A case that fails is a row with the column `failed`; the others go on. With `out` each case is a
    run directory, `load` reads it, and what is finished there is not run again: a sweep that was
    stopped, or gets more values, goes on. Runs there that failed are run again.

    Args:
        scene: A function that makes the scene from the parameters, importable by other processes;
            or the name of a bundled scene, or the path of a Python file.
        parameters: Values by parameter, all combinations of which are run, as
            `{"force": [1, 2], "thickness": [1e-3, 2e-3]}`; or the combinations themselves.
        executor: Runs the cases, any of `concurrent.futures`; None: as many processes as there are
            processors for this one.
        out: Directory of the runs; None: only the table is left.
        measure: `measure(run) -> dict` of numbers that become columns, evaluated where the case
            runs; None: the results of the scene.
        options: What replaces choices of the scene, as of `run`: {"scheme": "ed", "dt": 1e-3}.

    Returns:
        A row for each case in the order of the parameters: their values, the results, the numbers
        of the energy balance, `failed` and the run's `directory`.

    Raises:
        SceneError: If there are no cases, a parameter is unknown, `out` is another sweep's, or
            other processes cannot import `scene` or `measure`.
        RunError: If a process ends by itself, as in a script without `if __name__ == "__main__":`.
    """
    cases = _cases(scene, parameters)
    if not (measure is None or callable(measure)):
        raise SceneError(f"sweep: measure is {measure!r:.60}; it must be a function of a run")
    folder = None if out is None else path_of(out)
    chosen = dict(options or {})
    known = [one.name for kind in (Options, AccuracyOptions) for one in options_of(kind)]
    for name in chosen:
        if name not in known:
            raise SceneError(
                f"sweep: options has '{name}', which run does not take; it must be one of "
                f"{', '.join(known)}"
            )
    if folder is not None:
        _claim(folder, scene, measure, chosen)
    places = [None if folder is None else folder / _name(case) for case in cases]
    done = {n: _finished(place) for n, place in enumerate(places) if place is not None}
    rows = {n: row for n, row in done.items() if row is not None}
    jobs = [n for n in range(len(cases)) if n not in rows]
    if jobs:
        own = executor is None
        if own:
            _check_sendable(scene=scene, measure=measure, options=chosen, parameters=cases)
        workers = executor or _processes(len(jobs))
        try:
            running = {
                workers.submit(run_case, scene, cases[n], places[n], measure, chosen): n
                for n in jobs
            }
            for future in as_completed(running):
                rows[running[future]] = future.result()
        except BrokenExecutor as error:
            raise RunError(
                "sweep: a process ended before its case did. In a script, call sweep under "
                f"`if __name__ == '__main__':`, as each process reads the script, too ({error})"
            ) from None
        finally:
            if own:
                workers.shutdown(cancel_futures=True)
    return pd.DataFrame([cases[n] | rows[n] for n in range(len(cases))])


def run_case(
    scene: SceneFunction,
    case: Mapping[str, Any],
    place: Path | None,
    measure: Measure | None,
    options: Mapping[str, Any],
) -> dict[str, Any]:
    """Run one case, in a process of its own or not.

    Args:
        scene: As of `sweep`.
        case: Values of the parameters.
        place: Its run directory; None: a temporary one.
        measure: As of `sweep`.
        options: As of `sweep`.

    Returns:
        The columns of its row but the parameters.
    """
    row: dict[str, Any] = {"failed": ""}
    try:
        if place is not None and place.exists():
            # what a case that was stopped, or failed, has left
            shutil.rmtree(place)
        made, named = (
            (scene, case)
            if isinstance(scene, str)
            else (scene_of(scene, case, "sweep", "the scene function"), None)
        )
        found = run(made, place, parameters=named, pictures=False, **options)
        with user_failures(RunError, "sweep: measure fails"):
            row |= found.results if measure is None else dict(measure(found))
        row |= {name: found.summary[name] for name in COUNTED}
        row["warnings"] = len(found.warnings)
    except ShellmbError as error:
        row["failed"] = str(error)
    if place is not None and place.is_dir():
        row["directory"] = str(place)
        write_text(place / CASE, json.dumps({"case": dict(case), "row": row}, default=_plain))
    return row


def _cases(scene: SceneFunction, parameters: Any) -> list[dict[str, Any]]:
    """All combinations, each with names that the scene knows."""
    if isinstance(parameters, Mapping):
        for name, some in parameters.items():
            if isinstance(some, str) or not isinstance(some, Iterable):
                raise SceneError(
                    f"sweep: parameters has {some!r} for '{name}'; it must be a list of values"
                )
        combined = itertools.product(*parameters.values()) if parameters else ()
        cases = [dict(zip(parameters, v, strict=True)) for v in combined]
    else:
        try:
            cases = [dict(case) for case in parameters]
        except (TypeError, ValueError):
            raise SceneError(
                f"sweep: parameters is {parameters!r:.60}; it must be values by parameter, as in "
                "{'force': [1, 2]}, or a list of cases, as in [{'force': 1}]"
            ) from None
    if not cases:
        raise SceneError(
            "sweep: parameters has no case; it must be values by parameter, as in "
            "{'force': [1, 2]}, or the cases themselves"
        )
    if isinstance(scene, str):
        make: Callable[..., Scene] = load(scene).module.scene
    else:
        check_function(scene, "sweep")
        make = scene
    check_names(make, dict.fromkeys(itertools.chain(*cases)), "sweep: the scene")
    for case in cases:
        check_values(make, case, "sweep: the scene", "parameters={{'{name}': [...]}}")
    return cases


def _name(case: Mapping[str, Any]) -> str:
    """Name of a case's directory: its values as far as they are short, and their checksum."""
    text = json.dumps(case, sort_keys=True, default=_plain)
    digest = hashlib.sha256(text.encode()).hexdigest()[:8]
    words = "-".join(f"{k}={v}" for k, v in case.items())
    plain = "".join(c if c.isalnum() or c in "=.-_+" else "_" for c in words)
    return f"{plain[:60]}-{digest}"


def _checksum(made: Callable[..., Any] | str) -> str:
    """Name and source of a scene or function: other code gives other numbers."""
    if isinstance(made, str):
        source = Path(str(load(made).module.__file__)).read_text()
        name = made
    else:
        name = getattr(made, "__qualname__", repr(made))
        try:
            source = inspect.getsource(made)
        except (OSError, TypeError):
            source = ""
    return f"{name} {hashlib.sha256(source.encode()).hexdigest()[:16]}"


def _claim(
    folder: Path, scene: SceneFunction, measure: Measure | None, options: dict[str, Any]
) -> None:
    """Never mix the cases of two sweeps: those of one have code and choices in common."""
    about = {
        "scene": _checksum(scene),
        "measure": None if measure is None else _checksum(measure),
        "options": json.loads(json.dumps(options, default=_plain)),
    }
    file = folder / ABOUT
    if file.is_file():
        then = json.loads(file.read_text())
        if then == about:
            return
        changed = ", ".join(key for key in about if then.get(key) != about[key])
        raise SceneError(
            f"sweep: out is {folder}, in which are runs with other code or choices ({changed}); "
            "give another directory, or delete it"
        )
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise SceneError(f"sweep: out is {folder}, which holds something else; give another one")
    folder.mkdir(parents=True, exist_ok=True)
    write_text(file, json.dumps(about, indent=1) + "\n")


def _finished(place: Path) -> dict[str, Any] | None:
    """The row of a case that was run to its end."""
    file = place / CASE
    if not file.is_file():
        return None
    try:
        row: dict[str, Any] = json.loads(file.read_text())["row"]
    except (ValueError, KeyError):
        # stopped while it was written
        return None
    return None if row["failed"] else row


def _check_sendable(**things: Any) -> None:
    """Check that other processes get what they need, and that this is none of them.

    Raises:
        SceneError: If something has no name by which they can import it.
        SystemExit: If a process of a sweep reads the script of the sweep.
    """
    frames = (each.frame.f_globals.get("__name__") for each in inspect.stack(0))
    if "__mp_main__" in frames:
        # what requested the process tells why
        raise SystemExit(1)
    for name, thing in things.items():
        try:
            pickle.dumps(thing)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise SceneError(
                f"sweep: {name} cannot be sent to other processes ({error}); it must be a function "
                "that stands in a module or script by itself, with values that can be copied"
            ) from None


def _processes(cases: int) -> Executor:
    """Processes that do not inherit MPI, of one thread each."""
    count = min(cases, len(os.sched_getaffinity(0)))
    return ProcessPoolExecutor(
        count, mp_context=multiprocessing.get_context("spawn"), initializer=_one_thread
    )


def _one_thread() -> None:
    os.environ.setdefault("OMP_NUM_THREADS", "1")


def _plain(value: Any) -> Any:
    """Numbers of NumPy as JSON has them, anything else by its words."""
    return value.tolist() if hasattr(value, "tolist") else repr(value)
