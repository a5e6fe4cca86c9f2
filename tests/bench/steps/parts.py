"""Parts of the steps of chains, each timed by itself: `python -m tests.bench parts`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from shellmb.accuracy.measuring import Column, console, print_table
from shellmb.arrays import Floats
from shellmb.demos.verification.measuring import markdown, replaced
from shellmb.simulate.simulation import Simulation
from tests.bench.bare import direct_solver
from tests.bench.peers.mechanisms.scenes import MECHANISMS
from tests.bench.steps.process import ROOT

PAGE = ROOT / "docs" / "theory" / "linear_systems.md"
BEGIN, END = "<!-- parts: begin -->", "<!-- parts: end -->"
# mechanism, scheme and step, s
CASES = (
    ("chain3", "ep", 2e-3),
    ("chain3", "ep4", 15.6e-3),
    ("chain10", "ep4", 12.5e-3),
    ("chain100", "ep4", 12.5e-3),
)
# of these steps the first ones of a run are not measured, and of some runs the least times count
STEPS, ROUNDS = 50, 6


@dataclass(frozen=True)
class Parts:
    """Times of what a step is made of, each of one call.

    Args:
        title: Mechanism and scheme.
        unknowns: Number of unknowns of the linear systems.
        seconds: Of a residual, a Jacobian, its factors, and a solution with both of its passes, s.
        cost: What a Jacobian with its factors is taken to cost, in iterations with old ones.
    """

    title: str
    unknowns: int
    seconds: Floats
    cost: float


def _us(k: int) -> Column[Parts]:
    name = ("residual", "Jacobian", "factors", "solution")[k]
    return Column(f"{name} [us]", lambda p: f"{1e6 * p.seconds[k]:.3g}")


COLUMNS = (
    Column[Parts]("mechanism, scheme", lambda p: p.title, "words"),
    Column[Parts]("unknowns", lambda p: str(p.unknowns)),
    *map(_us, range(4)),
    Column[Parts]("new factors [iterations]", lambda p: f"{p.cost:.2g}"),
)


def parts_of(name: str, scheme: str, dt: float, rounds: int = ROUNDS) -> Parts:
    """Time the parts of steps in a run without observers.

    Args:
        name: Name of the mechanism.
        scheme: Time scheme.
        dt: Time step, s.
        rounds: How many runs of steps are measured.
    """
    mechanism = MECHANISMS[name]
    end = (1 + rounds) * STEPS * dt
    simulation = Simulation(replace(mechanism.scene(), scheme=scheme, dt=dt, t_end=end))
    iteration = simulation.problem.iteration
    linear = iteration.linear

    def read() -> tuple[Floats, Floats]:
        seconds, solver = linear.seconds, direct_solver(linear)
        solutions = seconds["solve"] + seconds["reduction"]
        clocks = iteration.residual_seconds, seconds["jacobian"], seconds["factor"], solutions
        counts = iteration.residuals, linear.jacobians, linear.factorisations, solver.solutions
        return np.array(clocks), np.array(counts, dtype=float)

    found = []
    for _ in range(1 + rounds):
        before = read()
        for _ in range(STEPS):
            simulation.advance()
        clocks, counts = (b - a for a, b in zip(before, read(), strict=True))
        found.append(clocks / np.maximum(counts, 1))
    title = f"{mechanism.title}, {scheme.upper()}"
    return Parts(title, linear.size, np.min(found[1:], axis=0), linear.cost)


def _rows() -> Iterator[Parts]:
    for case in CASES:
        yield parts_of(*case)


def run_parts(docs: bool) -> None:
    """Print the table.

    Args:
        docs: Whether that in the documentation is written anew.
    """
    rows = list(_rows())
    print_table(console(), COLUMNS, rows)
    if docs:
        table = "\n".join(markdown(COLUMNS, rows))
        PAGE.write_text(replaced(PAGE.read_text(), BEGIN, END, table))
