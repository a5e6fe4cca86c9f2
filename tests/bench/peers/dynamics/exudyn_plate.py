"""The cantilever plate of the demo `sudden_load` in Exudyn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from shellmb.demos.sudden_load import WIDTH
from tests.bench.peers.dynamics.exudyn_motion import ExudynMotion
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.dynamics.our_plate import SECTION, Pushed, place
from tests.bench.peers.exudyn import CLAMPED, Mesh, quiet, require

DEFLECTION, TWIST = 2, 8


@dataclass(frozen=True)
class ExudynPlate(Pushed, ExudynMotion):
    """Settings of the solution; `tolerance` as of the plate in other codes (`plates.py`)."""

    tolerance: float = 1e-3

    def run(self) -> TipHistory:
        """Solve; set-up is not timed.

        Raises:
            SceneError: If Exudyn is not installed.
        """
        exu = require()
        with quiet():
            mesh = self._mesh(exu)
            return self.solve(exu, mesh, self._sensor(exu, mesh), DEFLECTION, self.t_end)

    def _mesh(self, exu: Any) -> Mesh:
        """The plate, clamped and loaded."""
        nx, ny = self.mesh
        mesh = Mesh(exu, self.mesh, SECTION, place)
        for j in range(ny + 1):
            mesh.hold(mesh.node(0, j), CLAMPED)
        # the line load as its cubic shape functions see it
        line, side = self.force / WIDTH, WIDTH / ny
        for j in range(ny + 1):
            end = j in (0, ny)
            mesh.load(mesh.node(nx, j), DEFLECTION, line * side * (0.5 if end else 1.0))
            if end:
                mesh.load(mesh.node(nx, j), TWIST, line * side**2 / 12 * (1 if j == 0 else -1))
        return mesh

    def _sensor(self, exu: Any, mesh: Mesh) -> Any:
        """At the middle of the free edge, with an odd number of elements across within one."""
        import exudyn.itemInterface as items

        nx, ny = self.mesh
        return mesh.system.AddSensor(
            items.SensorBody(
                bodyNumber=mesh.elements[nx - 1, ny // 2],
                localPosition=[1, 0, 0] if ny % 2 else [1, -1, 0],
                storeInternal=True,
                writeToFile=False,
                outputVariableType=exu.OutputVariableType.Displacement,
            )
        )
