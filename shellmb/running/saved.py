"""Reads what a run goes on with, and says what is damaged."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

from mpi4py import MPI

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from shellmb.errors import SceneError, alike
from shellmb.files.reading import Damaged, read_bytes, read_json, undamaged
from shellmb.files.writing import checksum, is_intact
from shellmb.observers.files.checkpoint import FORMAT, STATE_FILE, Saved
from shellmb.observers.history import read_rows
from shellmb.running.standard import HISTORY, STATE, SUMMARY
from shellmb.simulate.start.stored import read_arrays

Count = Annotated[int, Field(ge=0)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Seconds = Annotated[Finite, Field(ge=0)]
# the shortest of no steps is infinite
Size = Annotated[float, Field(ge=0)] | bool
ANEW = "start the run again in another directory"


class _Table(BaseModel):
    """Values of a JSON file."""

    model_config = ConfigDict(strict=True, extra="allow")


class _History(_Table):
    rows: Annotated[int, Field(ge=1)]
    sha256: str


class _Frames(_Table):
    times: list[Seconds]
    sha256: dict[str, str]


class _Observers(_Table):
    history: _History
    # of a scene beside a run there may be none
    frames: _Frames | None = None


class _Counters(_Table):
    """Counters of where a simulation is."""

    t: Seconds
    step: Count
    iterations: Count
    step_seconds: Seconds
    size: dict[str, Size]


class _State(_Table):
    """`state.json`."""

    ranks: Annotated[int, Field(ge=1)]
    scene: dict[str, Any]
    arrays: Annotated[str, StringConstraints(pattern=r"^step-\d{8,}$")]
    arrays_sha256: list[str]
    cells_sha256: list[str] = Field(default_factory=list)
    simulation: _Counters
    observers: _Observers


def has_begun(directory: Path) -> bool:
    """Decide whether a run has computed anything: it is killed before its first state, or goes on.

    Args:
        directory: The run directory.

    Raises:
        SceneError: If it has, and its state is missing.
    """
    file, history = directory / STATE / STATE_FILE, directory / HISTORY
    if file.exists():
        return True
    rows = history.read_bytes().count(b"\n") - 1 if history.is_file() else 0
    if rows > 1 or (directory / SUMMARY).exists():
        raise SceneError(f"resume: {file} is missing, though the run has made steps; {ANEW}")
    return False


def read_saved(directory: Path, comm: MPI.Comm, spread: bool = False) -> Saved:
    """The last state of a run, with all that it counts on checked.

    Args:
        directory: The run directory.
        comm: Communicator; the call is collective.
        spread: Whether it may be the state of another number of ranks.

    Raises:
        SceneError: If there is no state, it was written by another number of ranks or version, or
            anything is damaged.
    """
    folder, found, arrays = directory / STATE, dict[str, Any](), dict[str, Any]()
    ranks: tuple[tuple[dict[str, Any], dict[str, Any]], ...] = ()
    with alike(comm), _resuming():
        if comm.rank == 0:
            found = _read_state(folder / STATE_FILE, None if spread else comm.size)
            _check_history(directory / HISTORY, found)
    found = comm.bcast(found)
    with alike(comm), _resuming():
        if found["ranks"] == comm.size:
            arrays = _read_arrays(folder, found, comm.rank)
        else:
            ranks = _read_ranks(folder, found)
    return Saved(arrays, found["simulation"], found["observers"], found["scene"], ranks)


@contextmanager
def _resuming() -> Iterator[None]:
    """Context in which a damaged file says what follows for the run."""
    try:
        yield
    except Damaged as error:
        raise SceneError(f"resume: {error}, so the run cannot continue from it; {ANEW}") from None


def _read_state(file: Path, ranks: int | None) -> dict[str, Any]:
    if not file.is_file():
        raise SceneError(f"resume: there is no state {file}; give the directory of a run")
    values = read_json(file)
    version = values.get("format")
    if version != FORMAT and isinstance(version, int) and 0 < version < FORMAT:
        raise SceneError(
            f"resume: the state in {file.parent} has format {version}; this version of shellmb "
            f"reads format {FORMAT}, so start the run again"
        )
    if not is_intact(values):
        raise Damaged(f"{file} is damaged or was edited (its checksum differs)")
    with undamaged(file):
        state = _State.model_validate(values)
    if ranks is not None and state.ranks != ranks:
        raise SceneError(
            f"resume: the run was made on {state.ranks} ranks, not {ranks}; resume it with "
            f"`mpiexec -n {state.ranks}`"
        )
    return values


def _read_arrays(folder: Path, state: dict[str, Any], rank: int) -> dict[str, Any]:
    file = folder / f"{state['arrays']}-rank{rank}.npz"
    return read_arrays(file, state["arrays_sha256"][rank])


def _read_ranks(
    folder: Path, state: dict[str, Any]
) -> tuple[tuple[dict[str, Any], dict[str, Any]], ...]:
    """Read what each rank of the run has saved, and where it belongs."""
    count, sums = state["ranks"], state.get("cells_sha256", [])
    if len(sums) != count:
        raise SceneError(
            f"resume: the run was made on {count} ranks by a version of shellmb whose runs resume "
            f"on the same number only; resume it with `mpiexec -n {count}`"
        )
    files = [folder / f"cells-of-{count}-rank{k}.npz" for k in range(count)]
    numbers = [read_arrays(file, known) for file, known in zip(files, sums, strict=True)]
    return tuple((_read_arrays(folder, state, k), numbers[k]) for k in range(count))


def _check_history(file: Path, state: dict[str, Any]) -> None:
    """The rows that a state counts on."""
    history, now = state["observers"]["history"], state["simulation"]
    count = history["rows"]
    with undamaged(file):
        lines = read_bytes(file).split(b"\n")[: count + 1]
        rows = read_rows(b"\n".join(lines).decode(), count)
    if checksum(b"\n".join([*lines, b""])) != history["sha256"]:
        raise Damaged(f"{file} is damaged or was edited (its checksum differs)")
    if rows[-1]["step"] != now["step"] or rows[-1]["t"] != now["t"]:
        raise Damaged(f"{file} does not end where the state is, at step {now['step']}")
