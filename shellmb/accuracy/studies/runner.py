"""Runs the configurations of a study in turn, and keeps records in a file that survives a stop."""

from __future__ import annotations

import hashlib
import json
import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.family import Steps
from shellmb.accuracy.run_record import keep
from shellmb.accuracy.studies.choice import Choice
from shellmb.accuracy.studies.quantity import Quantity, default_quantity
from shellmb.accuracy.studies.sweep import Grid, Sweep, chain, make_grid
from shellmb.errors import SceneError, ShellmbError
from shellmb.files.writing import plain, write_text
from shellmb.meshes.lifetime import free
from shellmb.running.execute import RunResult, execute
from shellmb.scene.fingerprint import fingerprint

RECORDS = "records.jsonl"


@dataclass(frozen=True)
class Record:
    """One run.

    Args:
        choice: What was chosen.
        round: Which repetition, from 0.
        wall_s: Wall time of the steps with the observers of every run, nothing written, s.
        cpu_s: Processor time of the same, s.
        setup_s: Time to build everything before the first step, s.
        jit_s: Time spent on making forms ready, s.
        steps: Accepted steps.
        rejected: Rejected ones.
        iterations: Newton iterations.
        unknowns: Unknowns of the system.
        jump: Largest jump of ED (its error estimate, see `observers.summary`); None for others.
        taken: What `Quantity.take` kept, by the name of the quantity.
        failed: Why the run ended early; "" if it did not.
    """

    choice: Choice
    round: int
    wall_s: float = 0.0
    cpu_s: float = 0.0
    setup_s: float = 0.0
    jit_s: float = 0.0
    steps: int = 0
    rejected: int = 0
    iterations: int = 0
    unknowns: int = 0
    jump: float | None = None
    taken: dict[str, dict[str, Any]] | None = None
    failed: str = ""

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Record:
        """The record from its plain values."""
        return cls(**{**values, "choice": Choice.from_dict(values["choice"])})


class Store:
    """The records of a study, read by the first rank and known to all.

    Args:
        folder: Where `records.jsonl` is; None: nothing is kept beyond this process.
        about: What the records belong to: they are never mixed with those of something else.
        comm: Communicator.

    Raises:
        SceneError: If the folder holds the records of something else, or no records at all.
    """

    def __init__(self, folder: Path | None, about: Mapping[str, Any], comm: MPI.Comm) -> None:
        self._path = None if folder is None or comm.rank else folder / RECORDS
        self._lines = [json.dumps({"study": dict(about)}, sort_keys=True)]
        read = comm.bcast(self._lines if self._path is None else self._read(self._path))
        if isinstance(read, str):
            raise SceneError(read)
        self._lines = read
        self._found = defaultdict[Choice, list[Record]](list)
        for record in map(Record.from_dict, map(json.loads, self._lines[1:])):
            self._found[record.choice].append(record)

    def _read(self, path: Path) -> list[str] | str:
        """Lines of the file; a sentence if they do not belong here."""
        if not path.is_file():
            folder = path.parent
            if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
                return f"study: out is {folder}, which holds something else; give another directory"
            return self._lines
        lines = path.read_text().splitlines()
        if lines[:1] != self._lines:
            return (
                f"study: out is {path.parent}, which holds the records of another scene, other "
                "parameters or quantities; give another directory, or delete it"
            )
        return lines

    def find(self, choice: Choice, round_: int = 0) -> Record | None:
        """The record of a run, if it is finished."""
        return next((r for r in self._found[choice] if r.round == round_), None)

    def rounds(self, choice: Choice) -> list[Record]:
        """All records of a choice."""
        return self._found[choice]

    def add(self, record: Record) -> None:
        """Keep a finished run; the file is whole before and after."""
        self._found[record.choice].append(record)
        self._lines.append(json.dumps(plain(record), allow_nan=False))
        if self._path is None:
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        write_text(self._path, "\n".join(self._lines) + "\n")


# what of a summary is in a record, and its name there
TOLD = {name: name for name in ("setup_s", "jit_s", "steps", "unknowns")}
TOLD |= {"rejected_steps": "rejected", "newton_iterations": "iterations", "jump_max": "jump"}

type Tell = Callable[[str], None]


@dataclass(frozen=True)
class Measured:
    """A study that has been run.

    Args:
        sweep: What was requested.
        name: Name of the scene.
        quantities: What is judged.
        grid: The configurations.
        chain: Those of the reference, the finest first; empty where the exact value is given.
        store: The records.
    """

    sweep: Sweep
    name: str
    quantities: tuple[Quantity, ...]
    grid: Grid
    chain: tuple[Choice, ...]
    store: Store

    def name_of(self, choice: Choice) -> str:
        """A configuration in words: what is swept, mesh and step."""
        return choice.label(self.grid.named)


def measure(sweep: Sweep, folder: Path | None = None, tell: Tell = lambda text: None) -> Measured:
    """Run a study, or what is left of it; collective.

    Each configuration is run once, coarse ones first; then the reference; then all again, round by
    round, so that what else the machine does hits all alike.

    Args:
        sweep: What.
        folder: Where the records are kept; None: nowhere.
        tell: Callback for progress messages.

    Raises:
        SceneError: If the scene, a value or a quantity is impossible, or the folder is taken.
    """
    comm, grid = MPI.COMM_WORLD, make_grid(sweep)
    scene = sweep.base.build(grid.choices[0])
    quantities = sweep.quantities or (default_quantity(scene),)
    finer = () if sweep.known else tuple(chain(sweep, grid))
    for choice in finer:
        sweep.base.build(choice)
    store = Store(folder, about(sweep, quantities), comm)
    plan = [(c, 0) for c in (*grid.choices, *reversed(finer))]
    plan += [(c, k) for k in range(1, sweep.repeat) for c in grid.choices]
    todo = [(c, k) for c, k in dict.fromkeys(plan) if store.find(c, k) is None]
    if len(todo) < len(set(plan)):
        tell(f"{len(set(plan)) - len(todo)} of {len(set(plan))} runs are done already")
    for n, (choice, round_) in enumerate(todo):
        first = store.find(choice)
        if round_ and first is not None and first.failed:
            continue
        tell(f"run {n + 1} of {len(todo)}: {choice.label(grid.named)}")
        record = run_once(sweep, choice, quantities, round_, comm)
        if record.failed:
            tell(f"failed: {record.failed}")
        store.add(record)
    return Measured(sweep, scene.name, quantities, grid, finer, store)


def about(sweep: Sweep, quantities: Sequence[Quantity]) -> dict[str, Any]:
    """Origin of records: scene with its source, parameters, end, quantities."""
    module = sweep.base.module
    file = getattr(module.module, "__file__", None)
    # of a scene that is in no file all its fields
    fields = json.dumps(fingerprint(module.build()), sort_keys=True) if file is None else ""
    source = fields.encode() if file is None else Path(file).read_bytes()
    return {
        "scene": module.name,
        "source": hashlib.sha256(source).hexdigest()[:16],
        "parameters": dict(sweep.base.parameters),
        "t_end": sweep.base.t_end,
        "body": sweep.base.body,
        "quantities": [str(q) for q in quantities],
    }


def run_once(
    sweep: Sweep, choice: Choice, quantities: Sequence[Quantity], round_: int, comm: MPI.Comm
) -> Record:
    """One run; what goes wrong in it is recorded.

    Raises:
        SceneError: If a quantity does not exist.
    """
    clock = Steps()
    # what a scene measures may need the whole of its time: it is asked only where it is needed
    needed = any(q.norm is None for q in quantities)
    requested = sweep.base.module.results if needed else lambda run: {}
    scene = sweep.base.build(choice)
    try:
        result = execute(scene, None, [clock], comm=comm, pictures=False, results=requested)
    except ShellmbError as error:
        return Record(choice, round_, cpu_s=clock.seconds, failed=str(error))
    record = _record(choice, round_, clock.seconds, result, quantities)
    del result
    free(comm)
    return record


def _record(
    choice: Choice, round_: int, cpu_s: float, result: RunResult, quantities: Sequence[Quantity]
) -> Record:
    summary, kept = result.summary, keep(result)
    taken = {str(q): kept.take(q) for q in quantities}
    if round_:
        # the curves are those of the first round
        taken = {name: {"value": one["value"]} for name, one in taken.items()}
    bad = [name for name, one in taken.items() if not math.isfinite(one["value"])]
    failed = f"{' and '.join(bad)} is not finite" if bad else ""
    wall_s, told = result.simulation.step_seconds, {name: summary[k] for k, name in TOLD.items()}
    return Record(choice, round_, wall_s, cpu_s, taken=taken, failed=failed, **told)


def known_quantity(record: Record, quantity: Quantity) -> dict[str, Any]:
    """Record of a quantity of a finished run.

    Raises:
        SceneError: If it keeps nothing of it.
    """
    if record.taken is None or str(quantity) not in record.taken:
        raise SceneError(f"study: no record of '{quantity}'")
    return record.taken[str(quantity)]
