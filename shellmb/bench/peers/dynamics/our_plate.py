"""The cantilever plate of the demo `sudden_load` in shellmb, for comparisons with other codes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from shellmb.bench.peers.codes import OURS
from shellmb.bench.peers.dynamics.history import TipHistory
from shellmb.demos import sudden_load
from shellmb.errors import ConvergenceError
from shellmb.measuring.times import Stopwatch
from shellmb.model.places.nodes import local_nodes
from shellmb.scene import Scene, StepControl
from shellmb.simulate.simulation import Simulation


@dataclass(frozen=True)
class OurPlate:
    """How it is solved.

    Args:
        mesh: Elements along and across.
        dt: Time step, s.
        scheme: "ep", "ed", "ep4" or "ed3".
        alpha: Dissipation of "ed" and "ed3".
        force: Force on the free edge, N.
        t_end: End, s.
        tolerance: Relative tolerance of Newton's method.
    """

    code: ClassVar[str] = OURS
    mesh: tuple[int, int]
    dt: float
    scheme: str = "ep"
    alpha: float = 1.0
    force: float = 2.0
    t_end: float = 0.5
    tolerance: float = 1e-6

    @property
    def how(self) -> str:
        """Its time scheme in words."""
        return in_words(self.scheme, self.alpha)

    def run(self) -> TipHistory:
        """Solve with fixed steps; set-up and compilation are not timed."""
        base = sudden_load.scene(force=self.force, dt=self.dt, t_end=self.t_end)
        scene = replace(
            base,
            shells=(replace(base.shells[0], mesh=self.mesh),),
            scheme=self.scheme,
            alpha=self.alpha,
            solver=replace(base.solver, tolerance=self.tolerance),
            # a step that fails is not taken again with a smaller one
            control=StepControl(min_dt=self.dt, max_dt=self.dt),
        )
        return history_of(scene, (sudden_load.LENGTH, sudden_load.WIDTH / 2, 0.0), 2)


def in_words(scheme: str, alpha: float) -> str:
    """A time scheme as tables call it."""
    return f"{scheme.upper()} alpha={alpha:g}" if scheme in ("ed", "ed3") else scheme.upper()


def history_of(scene: Scene, point: tuple[float, float, float], component: int) -> TipHistory:
    """Step a scene through its time, and keep one displacement of its shell.

    Args:
        scene: The scene.
        point: A node of its only shell, m.
        component: Which one: 0, 1 or 2.
    """
    assert scene.dt is not None and scene.t_end is not None
    simulation = Simulation(scene)
    shell = scene.shells[0].name
    body = simulation.model.meshed[shell]
    node = local_nodes(body, point, "the point")[0]
    dof = int(body.mixed.dofs["u"].reshape(-1, 3)[node, component])
    q = simulation.problem.levels[shell].q.x.array
    iteration = simulation.problem.newton.iteration
    factored = iteration.factorisations
    t, u, failed = [0.0], [float(q[dof])], ""
    watch = Stopwatch()
    try:
        for _ in range(round(scene.t_end / scene.dt)):
            simulation.advance()
            t.append(simulation.t)
            u.append(float(q[dof]))
    except ConvergenceError as error:
        failed = str(error)
    cpu, wall = watch.cpu, watch.wall
    steps = max(len(t) - 1, 1)
    numbers = simulation.iterations / steps, (iteration.factorisations - factored) / steps
    return TipHistory(np.array(t), np.array(u), cpu, wall, *numbers, failed)
