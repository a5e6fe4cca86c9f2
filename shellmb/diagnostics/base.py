"""Watches: observers with a bound, and a sentence if it is exceeded."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, NamedTuple

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ShellmbWarning
from shellmb.observers.summary import Sources
from shellmb.scene.lookup import said
from shellmb.schemes.base import Scheme, has_energy_law
from shellmb.schemes.registry import SCHEMES
from shellmb.simulate.simulation import BaseObserver, Simulation

# what warns of a scene before it runs
SETUP = "setup"
# share of a stiffness that is said where it is off: frequencies are off by half of it
STIFFENED = 1e-2


# local arrays by names of the system's bodies: of a state, or of a mode
type Parts = Callable[[str], Floats]


class Motion(NamedTuple):
    """An elastic mode.

    Args:
        number: Its number.
        energy: Its strain energy, J.
        parts: Its real part, and its imaginary part if it has one; collective.
    """

    number: int
    energy: float
    parts: Sequence[Parts]


@dataclass(frozen=True)
class RunWarning:
    """A warning at the end of a run.

    Args:
        watch: Name of the watch that gives it.
        body: Name of the body that it is about; None: the scene as a whole.
        value: The number that is out of proportion; None where the sentence alone has it.
        bound: What it must not pass.
        says: The sentence: the body, the number, and what to do.
    """

    watch: str
    body: str | None
    value: float | None
    bound: float | None
    says: str

    def to_dict(self) -> dict[str, Any]:
        """Plain values for `summary.json`."""
        return asdict(self)


type Cautions = Iterator[RunWarning]


class Watch(BaseObserver):
    """Watches one thing over a run. What it finds is the same on all ranks.

    A new one is a class with a name and its cautions, and a line in `registry.WATCHES`. It asks the
    scheme for what it declares, never for its name.

    Args:
        sources: The observers of the run.

    Attributes:
        name: Its name in `summary.json`.
        runs: Whether its cautions take other runs: what failed or was stopped does without.
    """

    name: ClassVar[str] = ""
    runs: ClassVar[bool] = False

    def __init__(self, sources: Sources) -> None:
        self.sources = sources
        # by name the largest of some numbers on this rank, when that was, and what belongs to it
        self._largest: dict[str, tuple[Any, ...]] = {}
        self._begin()

    def _begin(self) -> None:
        """Set what is kept over the run, before it starts or goes on."""

    def _note(self, name: str, size: float, t: float, *more: Any) -> None:
        """Take a number if it is larger than those before.

        Args:
            name: Whose it is.
            size: The number, not negative.
            t: Time, s.
            more: What belongs to it.
        """
        if size > self._noted(name)[0]:
            self._largest[name] = size, t, *more

    def _noted(self, name: str) -> tuple[Any, ...]:
        """The largest number on this rank, and what belongs to it."""
        return self._largest.get(name, (0.0, 0.0))

    def _worst(self, simulation: Simulation, name: str) -> tuple[Any, ...]:
        """The largest number of all ranks, and what belongs to it; collective."""
        found: tuple[Any, ...] = simulation.model.comm.allreduce(self._noted(name), op=MPI.MAX)
        return found

    def columns(self, *names: str) -> Floats:
        """Columns of the history so far, from its start on, shape (names, rows)."""
        rows = self.sources.history.rows
        return np.array([[row[name] for row in rows] for name in names], dtype=float)

    def cautions(self, simulation: Simulation) -> Cautions:
        """Warnings about the run so far; none where it does not apply."""
        raise NotImplementedError

    def caution(
        self, body: str | None, value: float | None, bound: float | None, says: str
    ) -> RunWarning:
        """A warning of this watch; arguments as of `RunWarning`."""
        return RunWarning(self.name, body, value, bound, says)


# what elements do does not come and go: it costs next to nothing to look at every tenth step
EVERY = 10


class Sampled(Watch):
    """Looks at every tenth step; to inherit from."""

    def _look(self, simulation: Simulation) -> None:
        """Take a state; collective."""
        raise NotImplementedError

    def accepted(self, simulation: Simulation) -> None:
        """Look at every tenth step."""
        if simulation.step % EVERY == 0:
            self._look(simulation)


def setup_warnings(sentences: Iterable[str]) -> tuple[RunWarning, ...]:
    """Cautions of what was warned of before the run, each once."""
    return tuple(RunWarning(SETUP, None, None, None, each) for each in dict.fromkeys(sentences))


@contextmanager
def collect_warnings(comm: MPI.Comm) -> Iterator[list[str]]:
    """Collect the project's warnings of what is done in it; they are emitted behind it; collective.

    Args:
        comm: Communicator; what one of its ranks warns of is known to all.

    Yields:
        The sentences, complete when the context ends.
    """
    found: list[str] = []
    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ShellmbWarning)
            yield found
    finally:
        for each in caught:
            warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)
    own = [str(each.message) for each in caught if issubclass(each.category, ShellmbWarning)]
    found += [sentence for rank in comm.allgather(own) for sentence in rank]


def said_of(simulation: Simulation, name: str) -> str:
    """Name of a body in messages, as "shell 'wing'"; "the rigid bodies" together."""
    named = {body.name: said(body) for body in simulation.scene.bodies}
    return named.get(name, f"the {name}")


def remedies(scheme: Scheme, *others: str) -> str:
    """Remedies, as a list in words.

    Args:
        scheme: The scheme of the run; if stiff bodies cannot spin under it, those under which they
            can come first.
        others: What else helps.
    """
    found = list(others)
    if scheme.rotations.stiff_loss > 0:
        made = {name: make(1.0) for name, make in SCHEMES.items()}
        made = {name: s for name, s in made.items() if not s.linear and has_energy_law(s)}
        fit = [name for name, s in made.items() if s.rotations.stiff_loss == 0]
        found = [f"--scheme {name}" for name in fit] + found
    return " or ".join(filter(None, [", ".join(found[:-1]), found[-1]]))
