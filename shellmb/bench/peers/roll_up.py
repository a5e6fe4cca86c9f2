"""The strip of the demo `roll_up`, rolled into a circle by its end moment: error against time.

It is thinner than the demo's: ours leaves the circle of the inextensible strip by about
0.13 (thickness / radius)^2 of the length on any mesh (measured for 0.1, 0.05 and 0.02 m), which
would hide what meshes do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from shellmb.bench.peers.opensees import Mesh, require, solve_with
from shellmb.bench.peers.plates import OPENSEES, OURS
from shellmb.demos import roll_up
from shellmb.errors import ConvergenceError
from shellmb.measuring.tables import Column
from shellmb.measuring.times import Stopwatch, in_turn, spread
from shellmb.model.places.nodes import local_nodes
from shellmb.simulate.simulation import Simulation

THICKNESS, TOLERANCE = 0.02, 1e-6
QUARTERS = roll_up.LENGTH * np.arange(1, 5) / 4


@dataclass(frozen=True)
class Strip:
    """How it is solved.

    Args:
        code: "shellmb" or "OpenSees".
        mesh: Elements along; a multiple of four.
        element: Of OpenSees, a key of `ELEMENTS`; "" in shellmb.
        load_steps: Equal steps of the load.
    """

    code: str
    mesh: int
    element: str = ""
    load_steps: int = 1


@dataclass(frozen=True)
class Rolled:
    """What came out.

    Args:
        strip: How it was solved.
        error: Distance of the points at the quarters from the circle, root mean square, over the
            length; infinite if it failed.
        iterations: Newton iterations of all load steps.
        times: Processor times of all runs, s.
        failed: Why there is no circle; "" if there is.
    """

    strip: Strip
    error: float
    iterations: int
    times: tuple[float, ...]
    failed: str


STRIPS = (
    *(Strip(OURS, n) for n in (4, 8, 16, 32)),
    *(Strip(OPENSEES, n, "ASD") for n in (8, 16, 32, 64)),
    *(Strip(OPENSEES, 16, "NLDKGQ", steps) for steps in (20, 40, 100)),
)


def distance(places: npt.NDArray[np.float64]) -> float:
    """Distance from the exact circle, root mean square, over the length.

    Args:
        places: Positions x, |z| at `QUARTERS`, shape (4, 2).
    """
    radius = roll_up.LENGTH / (2 * math.pi)
    angle = QUARTERS / radius
    exact = radius * np.stack([np.sin(angle), 1 - np.cos(angle)], axis=-1)
    return float(np.sqrt(np.mean(np.sum((places - exact) ** 2, axis=1))) / roll_up.LENGTH)


def compared(rounds: int, strips: tuple[Strip, ...] = STRIPS) -> list[Rolled]:
    """All of them, the codes in turn.

    Args:
        rounds: How often each is run.
        strips: What is run.
    """

    def work(strip: Strip) -> Callable[[], Rolled]:
        return lambda: (_ours if strip.code == OURS else _opensees)(strip)

    found = in_turn(rounds, [work(strip) for strip in strips])
    return [
        replace(each[0], times=tuple(t for one in each for t in one.times))
        for each in zip(*found, strict=True)
    ]


def _ours(strip: Strip) -> Rolled:
    base = roll_up.scene(THICKNESS)
    scene = replace(
        base,
        shells=(replace(base.shells[0], mesh=(strip.mesh, 1)),),
        solver=replace(base.solver, tolerance=TOLERANCE),
        dt=1 / strip.load_steps,
    )
    simulation = Simulation(scene)
    body = simulation.model.meshed["strip"]
    q = simulation.problem.levels["strip"].q.x.array
    watch, failed = Stopwatch(), ""
    try:
        for _ in range(strip.load_steps):
            simulation.advance()
    except ConvergenceError as error:
        failed = str(error)
    cpu, dofs = watch.cpu, body.mixed.dofs["u"].reshape(-1, 3)
    nodes = [local_nodes(body, (float(x), 0.0, 0.0), "the strip")[0] for x in QUARTERS]
    return _rolled(strip, q[dofs[nodes]], simulation.iterations, cpu, failed)


def _opensees(strip: Strip) -> Rolled:
    ops = require()
    length, width = roll_up.LENGTH, roll_up.WIDTH
    section = (roll_up.E, 0.0, THICKNESS, 0.0)
    size = (strip.mesh, 1)
    mesh = Mesh(ops, size, strip.element, section, lambda r, s: (length * r, width * s, 0.0))
    moment = 2 * math.pi * roll_up.E * THICKNESS**3 / 12 * width / length
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node, _ in mesh.edge(0):
        ops.fix(node, *[1] * 6)
    for node, share in mesh.edge(strip.mesh):
        ops.load(node, 0.0, 0.0, 0.0, 0.0, -moment * share, 0.0)
    solve_with(ops, ("LoadControl", 1 / strip.load_steps), TOLERANCE, "Static")
    watch, failed, iterations = Stopwatch(), "", 0
    for step in range(strip.load_steps):
        if ops.analyze(1):
            failed = f"no convergence in load step {step + 1}"
            break
        iterations += ops.testIter()
    cpu = watch.cpu
    nodes = [mesh.node(strip.mesh * k // 4, 0) for k in range(1, 5)]
    moved = np.array([[ops.nodeDisp(node, k) for k in (1, 2, 3)] for node in nodes])
    return _rolled(strip, moved, iterations, cpu, failed)


def _rolled(
    strip: Strip, moved: npt.NDArray[np.float64], iterations: int, cpu: float, failed: str
) -> Rolled:
    places = np.stack([QUARTERS + moved[:, 0], np.abs(moved[:, 2])], axis=-1)
    return Rolled(strip, math.inf if failed else distance(places), iterations, (cpu,), failed)


COLUMNS: tuple[Column[Rolled], ...] = (
    Column("code", lambda r: r.strip.code, "words"),
    Column("element", lambda r: r.strip.element or "-", "words"),
    Column("mesh", lambda r: f"{r.strip.mesh}x1", "words"),
    Column("load steps", lambda r: str(r.strip.load_steps)),
    Column("error", lambda r: r.failed or f"{100 * r.error:.2g} %"),
    Column("iterations", lambda r: str(r.iterations)),
    Column("cpu [s]", lambda r: f"{min(r.times):.3g}"),
    Column("spread", lambda r: f"{100 * spread(r.times, min(r.times)):.0f} %"),
)
