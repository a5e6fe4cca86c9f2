"""What is printed at the end of a command."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from shellmb.cli.failures import tell
from shellmb.show.account import account

if TYPE_CHECKING:
    from shellmb.moving.campbell import Campbell
    from shellmb.moving.state import StateModes
    from shellmb.run.execute import RunResult


# a line about kernels at most that often [s]
PATIENCE = 2.0


def say(text: str) -> None:
    """Print a line as it is."""
    print(text)


@contextmanager
def announced(scene: str, quiet: bool) -> Iterator[None]:
    """Say on stderr what happens before the first step, as it may take a minute.

    Args:
        scene: Name of the scene.
        quiet: Say nothing.
    """
    if quiet:
        yield
        return
    from shellmb.kernels import told

    tell(f"{scene}: building; new kernels are compiled once")
    last = clock.monotonic()

    def tell_now(number: int, count: int) -> None:
        nonlocal last
        if clock.monotonic() - last > PATIENCE:
            last = clock.monotonic()
            tell(f"{scene}: kernel {number} of {count}")

    with told(tell_now):
        yield


def print_list(scenes: Mapping[str, str], kinds: Mapping[str, Sequence[str]]) -> None:
    """The bundled scenes, or studies, by their kinds.

    Args:
        scenes: Description by name.
        kinds: Names by kind.
    """
    width = max(map(len, scenes), default=0)
    for kind, names in kinds.items():
        say(f"{kind}:")
        for name in names:
            say(f"  {name:{width}}  {scenes[name]}")


def print_run(result: RunResult) -> None:
    """The numbers of a run that say whether to trust it, and its results."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table.grid(padding=(0, 2))
    table.add_column()
    table.add_column(justify="right")
    for name, value in account(result.summary).items():
        table.add_row(name, value)
    console = Console(highlight=False)
    console.print(table)
    for caution in result.warnings:
        console.print(f"[bold yellow]warning:[/] {escape(caution.says)}", soft_wrap=True)
    say(f"written to {result.out}")


def print_campbell(found: Campbell, count: int, directory: Path) -> None:
    """Frequencies over the rate, and whether a mode grows.

    Args:
        found: The modes.
        count: How many branches are shown.
        directory: Where everything about them is.
    """
    from rich.console import Console
    from rich.table import Table

    branches = min(count, found.branches.shape[1])
    table = Table(r"rate \[rad/s]", *(rf"{k} \[Hz]" for k in range(1, branches + 1)), box=None)
    for column in table.columns:
        column.justify = "right"
    for rate, row in zip(found.rates, found.frequencies[:, :branches], strict=True):
        table.add_row(f"{rate:g}", *("" if f != f else f"{f:.6g}" for f in row))
    Console(highlight=False).print(table)
    say(found.verdict)
    say(f"written to {directory}")


def print_state_modes(about: StateModes, directory: Path) -> None:
    """Modes about a state: frequencies, growth, damping, and whether one grows.

    Args:
        about: The modes.
        directory: Where everything about them is.
    """
    from rich.console import Console
    from rich.table import Table

    found = about.modes
    table = Table("mode", r"frequency \[Hz]", r"growth \[1/s]", "damping ratio", box=None)
    for k, value in enumerate(found.values):
        size = "rigid" if k < found.rigid else f"{found.frequencies[k]:.6g}"
        table.add_row(str(k + 1), size, f"{value.real:.4g}", f"{found.damping[k]:.4g}")
    Console(highlight=False).print(table)
    say(about.verdict)
    say(f"drift: {about.drift:.3g} of the scene's length")
    say(f"written to {directory}")


def print_modes(frequencies: Sequence[float], rigid: int, directory: Path) -> None:
    """Natural frequencies.

    Args:
        frequencies: Hz.
        rigid: How many of them, the first ones, are rigid-body motions.
        directory: Where everything about them is.
    """
    from rich.console import Console
    from rich.table import Table

    table = Table("mode", "frequency [Hz]", box=None)
    for column in table.columns:
        column.justify = "right"
    for k, frequency in enumerate(frequencies, start=1):
        table.add_row(str(k), "rigid" if k <= rigid else f"{frequency:.6g}")
    Console(highlight=False).print(table)
    say(f"written to {directory}")
