"""Records of a study's runs, in a file that grows by whole runs and survives a stop."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.measuring.records import plain
from shellmb.accuracy.studies.choice import Choice
from shellmb.errors import SceneError
from shellmb.files.writing import write_text

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
        self._found: dict[tuple[Choice, int], Record] = {}
        for line in self._lines[1:]:
            self._keep(Record.from_dict(json.loads(line)))

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

    def _keep(self, record: Record) -> None:
        self._found[record.choice, record.round] = record

    def find(self, choice: Choice, round_: int = 0) -> Record | None:
        """The record of a run, if it is finished."""
        return self._found.get((choice, round_))

    def rounds(self, choice: Choice) -> list[Record]:
        """All records of a choice."""
        found = [key for key in self._found if key[0] == choice]
        return [self._found[key] for key in sorted(found, key=itemgetter(1))]

    def add(self, record: Record) -> None:
        """Keep a finished run; the file is whole before and after."""
        self._keep(record)
        self._lines.append(json.dumps(plain(record), allow_nan=False))
        if self._path is None:
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        write_text(self._path, "\n".join(self._lines) + "\n")
