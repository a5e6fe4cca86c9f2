"""The cantilever plate of the demo `sudden_load` in Exudyn: generalised-alpha, modified Newton."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from shellmb.bench.peers.codes import EXUDYN
from shellmb.bench.peers.dynamics.history import TipHistory
from shellmb.bench.peers.dynamics.strip import SECTION, place
from shellmb.bench.peers.exudyn import CLAMPED, Mesh, quiet, require, settings_of, timed
from shellmb.demos.sudden_load import WIDTH

DEFLECTION, TWIST = 2, 8


@dataclass(frozen=True)
class ExudynPlate:
    """How it is solved.

    Args:
        mesh: Elements along and across.
        dt: Time step, s.
        force: Force on the free edge, N.
        t_end: End, s.
        spectral_radius: Of generalised-alpha at infinity; 1: no numerical damping.
        tolerance: Relative tolerance of Newton's method. The default of Exudyn, 1e-8, is beyond
            round-off on several meshes.
        modified: Whether factorisations are kept while they contract.
    """

    code: ClassVar[str] = EXUDYN
    mesh: tuple[int, int]
    dt: float
    force: float = 2.0
    t_end: float = 0.5
    spectral_radius: float = 0.9
    tolerance: float = 1e-6
    modified: bool = True

    @property
    def how(self) -> str:
        """Its time scheme in words, and its element where there are several."""
        newton = "" if self.modified else ", full Newton"
        return f"rho={self.spectral_radius:g}{newton}"

    def run(self) -> TipHistory:
        """Solve; set-up is not timed.

        Raises:
            SceneError: If Exudyn is not installed.
        """
        exu = require()
        with quiet():
            mesh = _mesh(exu, self)
            system = mesh.system
            sensor = _sensor(exu, self, mesh)
            system.Assemble()
            settings = _settings(exu, self)
            cpu, wall, failed = timed(lambda: system.SolveDynamic(settings, showHints=False))
            rows = np.array(system.GetSensorStoredData(sensor))
            it = system.sys["dynamicSolver"].it
            steps = max(len(rows) - 1, 1)
        if not failed and rows[-1, 0] < self.t_end * (1 - 1e-6):
            failed = "ended early"
        numbers = it.newtonStepsCount / steps, it.newtonJacobiCount / steps
        return TipHistory(rows[:, 0], rows[:, 3], cpu, wall, *numbers, failed)


def _mesh(exu: Any, plate: ExudynPlate) -> Mesh:
    """The plate, clamped and loaded."""
    nx, ny = plate.mesh
    mesh = Mesh(exu, plate.mesh, SECTION, place)
    for j in range(ny + 1):
        mesh.hold(mesh.node(0, j), CLAMPED)
    # the line load as its cubic shape functions see it
    line, side = plate.force / WIDTH, WIDTH / ny
    for j in range(ny + 1):
        end = j in (0, ny)
        mesh.load(mesh.node(nx, j), DEFLECTION, line * side * (0.5 if end else 1.0))
        if end:
            mesh.load(mesh.node(nx, j), TWIST, line * side**2 / 12 * (1 if j == 0 else -1))
    return mesh


def _sensor(exu: Any, plate: ExudynPlate, mesh: Mesh) -> Any:
    """At the middle of the free edge, with an odd number of elements across within one."""
    import exudyn.itemInterface as items

    nx, ny = plate.mesh
    return mesh.system.AddSensor(
        items.SensorBody(
            bodyNumber=mesh.elements[nx - 1, ny // 2],
            localPosition=[1, 0, 0] if ny % 2 else [1, -1, 0],
            storeInternal=True,
            writeToFile=False,
            outputVariableType=exu.OutputVariableType.Displacement,
        )
    )


def _settings(exu: Any, plate: ExudynPlate) -> Any:
    """Fixed steps, nothing kept but the sensor's values at each."""
    settings = settings_of(exu)
    times = settings.timeIntegration
    times.numberOfSteps, times.endTime = round(plate.t_end / plate.dt), plate.t_end
    times.adaptiveStep, times.verboseMode = False, 0
    times.generalizedAlpha.spectralRadius = plate.spectral_radius
    times.newton.useModifiedNewton = plate.modified
    times.newton.relativeTolerance = plate.tolerance
    settings.solution.sensors.writePeriod = plate.dt
    return settings
