"""The cantilever plate of the demo `sudden_load` in shellmb, for comparisons with other codes."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from shellmb.bench.peers.history import TipHistory
from shellmb.demos import sudden_load
from shellmb.errors import ConvergenceError
from shellmb.model.places.nodes import local_nodes
from shellmb.scene import StepControl
from shellmb.simulate.simulation import Simulation


@dataclass(frozen=True)
class OurPlate:
    """How it is solved.

    Args:
        mesh: Elements along and across.
        dt: Time step, s.
        scheme: "ep" or "ed".
        alpha: Dissipation of "ed".
        force: Force on the free edge, N.
        t_end: End, s.
        tolerance: Relative tolerance of Newton's method.
    """

    mesh: tuple[int, int]
    dt: float
    scheme: str = "ep"
    alpha: float = 1.0
    force: float = 2.0
    t_end: float = 0.5
    tolerance: float = 1e-6


def run(plate: OurPlate) -> TipHistory:
    """Solve with fixed steps; set-up and compilation are not timed.

    Args:
        plate: How.
    """
    base = sudden_load.scene(force=plate.force, dt=plate.dt, t_end=plate.t_end)
    scene = replace(
        base,
        shells=(replace(base.shells[0], mesh=plate.mesh),),
        scheme=plate.scheme,
        alpha=plate.alpha,
        solver=replace(base.solver, tolerance=plate.tolerance),
        # a step that fails is not taken again with a smaller one
        control=StepControl(min_dt=plate.dt, max_dt=plate.dt),
    )
    simulation = Simulation(scene)
    body = simulation.model.meshed["plate"]
    point = (sudden_load.LENGTH, sudden_load.WIDTH / 2, 0.0)
    node = local_nodes(body, point, "the tip")[0]
    dof = int(body.mixed.dofs["u"].reshape(-1, 3)[node, 2])
    q = simulation.problem.levels["plate"].q.x.array
    iteration = simulation.problem.newton.iteration
    factored = iteration.factorisations
    t, u, failed = [0.0], [float(q[dof])], ""
    begin = time.process_time(), time.perf_counter()
    try:
        for _ in range(round(plate.t_end / plate.dt)):
            simulation.advance()
            t.append(simulation.t)
            u.append(float(q[dof]))
    except ConvergenceError as error:
        failed = str(error)
    cpu, wall = time.process_time() - begin[0], time.perf_counter() - begin[1]
    steps = max(len(t) - 1, 1)
    numbers = simulation.iterations / steps, (iteration.factorisations - factored) / steps
    return TipHistory(np.array(t), np.array(u), cpu, wall, *numbers, failed)
