"""What is printed at the end of a command."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from shellmb.cli.failures import tell

if TYPE_CHECKING:
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


def print_list(scenes: Mapping[str, str]) -> None:
    """The bundled scenes.

    Args:
        scenes: Description by name.
    """
    width = max(map(len, scenes), default=0)
    for name, description in scenes.items():
        say(f"{name:{width}}  {description}")


def print_run(result: RunResult) -> None:
    """The numbers of a run that say whether to trust it, and its results."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    summary = result.summary
    table = Table.grid(padding=(0, 2))
    table.add_column()
    table.add_column(justify="right")

    def add(name: str, value: float | str | None) -> None:
        if value is not None:
            table.add_row(name, value if isinstance(value, str) else f"{value:.6g}")

    steps = summary["steps"]
    rejected = summary["rejected_steps"]
    add("steps", f"{steps} ({rejected} rejected)" if rejected else str(steps))
    add("iterations per step", f"{summary['newton_iterations'] / max(steps, 1):.2f}")
    add("energy balance error", _power(summary["energy_balance_error"]))
    add("director length error", _power(summary["director_max"]))
    add("constraint error", _power(summary["constraint_max"]))
    add("dissipated by the scheme", _share(summary["dissipated_share"]))
    add("linear momentum drift", _power(summary["linear_momentum_drift"]))
    add("angular momentum drift", _power(summary["angular_momentum_drift"]))
    if summary["wall_per_step_s"] is not None:
        add("wall time per step", f"{1000 * summary['wall_per_step_s']:.1f} ms")
    add("wall time", f"{summary['wall_s']:.1f} s")
    for name, value in summary["results"].items():
        add(name, value)
    console = Console(highlight=False)
    console.print(table)
    for caution in result.warnings:
        console.print(f"[bold yellow]warning:[/] {escape(caution.says)}", soft_wrap=True)
    say(f"written to {result.out}")


def _power(value: float | None) -> str | None:
    return None if value is None else f"{value:.1e}"


def _share(value: float | None) -> str | None:
    return f"{100 * value:.2g} %" if value else None


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
