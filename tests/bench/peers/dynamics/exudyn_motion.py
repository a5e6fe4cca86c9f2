"""Motions in Exudyn: generalised-alpha, modified Newton, fixed steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from tests.bench.peers.codes import EXUDYN
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.exudyn import Mesh, settings_of, timed


@dataclass(frozen=True)
class ExudynMotion:
    """Settings of the solution.

    Args:
        mesh: Elements along and across.
        dt: Time step, s.
        spectral_radius: Of generalised-alpha at infinity; 1: no numerical damping.
        tolerance: Relative tolerance of Newton's method. The default of Exudyn, 1e-8, is beyond
            round-off on several meshes.
        modified: Whether factorisations are kept while they contract.
    """

    code: ClassVar[str] = EXUDYN
    mesh: tuple[int, int]
    dt: float
    spectral_radius: float = 0.9
    tolerance: float = 1e-6
    modified: bool = True

    @property
    def how(self) -> str:
        """Time scheme in words."""
        newton = "" if self.modified else ", full Newton"
        return f"rho={self.spectral_radius:g}{newton}"

    def solve(self, exu: Any, mesh: Mesh, sensor: Any, component: int, t_end: float) -> TipHistory:
        """Solve; nothing is kept but what a sensor of displacements says at each step.

        Args:
            exu: The module.
            mesh: The shell, in its system, which is complete.
            sensor: The sensor.
            component: Which displacement: 0, 1 or 2.
            t_end: End, s.
        """
        system = mesh.system
        system.Assemble()
        settings = settings_of(exu)
        times = settings.timeIntegration
        times.numberOfSteps, times.endTime = round(t_end / self.dt), t_end
        times.adaptiveStep, times.verboseMode = False, 0
        times.generalizedAlpha.spectralRadius = self.spectral_radius
        times.newton.useModifiedNewton = self.modified
        times.newton.relativeTolerance = self.tolerance
        settings.solution.sensors.writePeriod = self.dt
        cpu, wall, failed = timed(lambda: system.SolveDynamic(settings, showHints=False))
        rows = np.array(system.GetSensorStoredData(sensor))
        it = system.sys["dynamicSolver"].it
        steps = max(len(rows) - 1, 1)
        if not failed and rows[-1, 0] < t_end * (1 - 1e-6):
            failed = "ended early"
        numbers = it.newtonStepsCount / steps, it.newtonJacobiCount / steps
        return TipHistory(rows[:, 0], rows[:, 1 + component], cpu, wall, *numbers, failed)
