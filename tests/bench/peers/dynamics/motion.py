"""Request to a code: a motion with a mesh and a step, and the runs of a study of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from tests.bench.peers.dynamics.history import TipHistory


class Motion(Protocol):
    """A run of one code; hashable, since runs are told apart by what they are.

    Attributes:
        code: The code that runs it.
    """

    code: ClassVar[str]

    @property
    def mesh(self) -> tuple[int, int]:
        """Elements along and across."""
        ...

    @property
    def dt(self) -> float:
        """Time step, s."""
        ...

    @property
    def how(self) -> str:
        """Time scheme in words, and its element where there are several."""
        ...

    def run(self) -> TipHistory:
        """Solve; set-up is not timed.

        Raises:
            SceneError: If the code is not installed.
        """
        ...


@dataclass(frozen=True)
class Runs:
    """Runs in one code.

    Args:
        fine: Converged answers, the finest first; the others check it.
        motions: Runs of the study.
    """

    fine: Sequence[Motion]
    motions: Sequence[Motion]


@dataclass(frozen=True)
class Study:
    """A motion in several codes.

    Args:
        name: Of its files.
        title: What it is.
        every: What is run, by code, ours first.
        quick: What a test can wait for.
        asked: Errors that times are compared at.
    """

    name: str
    title: str
    every: Mapping[str, Runs]
    quick: Mapping[str, Runs]
    asked: tuple[float, ...] = (1e-2, 1e-3)


def title(motion: Motion) -> str:
    """Mesh, step and scheme."""
    return f"{motion.mesh[0]}x{motion.mesh[1]}, dt = {motion.dt:g} s, {motion.how}"
