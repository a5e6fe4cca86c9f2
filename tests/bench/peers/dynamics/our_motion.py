"""Motions in shellmb, for comparisons with other codes: fixed steps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from shellmb.demos.verification.measuring import Stopwatch
from shellmb.errors import ConvergenceError
from shellmb.model.locations.nodes import local_nodes
from shellmb.scene import Scene, StepControl
from shellmb.scene.schemes import DISSIPATIVE
from shellmb.simulate.simulation import Simulation
from tests.bench.peers.codes import OURS
from tests.bench.peers.dynamics.history import TipHistory


@dataclass(frozen=True)
class OurMotion:
    """Settings of the solution.

    Args:
        mesh: Elements along and across.
        dt: Time step, s.
        scheme: "ep", "ed", "ep4" or "ed3".
        alpha: Dissipation of "ed" and "ed3".
        tolerance: Relative tolerance of Newton's method.
    """

    code: ClassVar[str] = OURS
    mesh: tuple[int, int]
    dt: float
    scheme: str = "ep"
    alpha: float = 1.0
    tolerance: float = 1e-6

    @property
    def how(self) -> str:
        """Time scheme in words."""
        name = self.scheme.upper()
        return f"{name} alpha={self.alpha:g}" if self.scheme in ("ed", "ed3") else name

    def solve(self, base: Scene, point: tuple[float, float, float], component: int) -> TipHistory:
        """Solve; set-up and compilation are not timed.

        Args:
            base: A scene of one shell, for its mesh, scheme, step and tolerance to be replaced.
            point: A node of the shell, m.
            component: Which displacement: 0, 1 or 2.
        """
        assert base.t_end is not None
        scene = replace(
            base,
            shells=(replace(base.shells[0], mesh=self.mesh),),
            scheme=self.scheme,
            alpha=self.alpha if self.scheme in DISSIPATIVE else None,
            dt=self.dt,
            solver=replace(base.solver, tolerance=self.tolerance),
            # a step that fails is not taken again with a smaller one
            step_control=StepControl(min_dt=self.dt, max_dt=self.dt),
        )
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
            for _ in range(round(base.t_end / self.dt)):
                simulation.advance()
                t.append(simulation.t)
                u.append(float(q[dof]))
        except ConvergenceError as error:
            failed = str(error)
        cpu, wall = watch.cpu, watch.wall
        steps = max(len(t) - 1, 1)
        numbers = simulation.iterations / steps, (iteration.factorisations - factored) / steps
        return TipHistory(np.array(t), np.array(u), cpu, wall, *numbers, failed)
