"""The cantilever plate of the demo `sudden_load` in OpenSees.

Its own initial accelerations are zero under a load that is there at once, so that its answers are
half a step late; here they are solved for, with the masses that the elements have (`ASD` lumped,
`NLDKGQ` consistent and bilinear).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.sudden_load import LENGTH, WIDTH
from shellmb.demos.verification.measuring import Stopwatch
from tests.bench.peers.codes import OPENSEES
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.dynamics.our_plate import DENSITY, SECTION, THICKNESS, place
from tests.bench.peers.opensees import Mesh, require, solve_with

RADIUS = 0.9
# names of integrators in tables, and OpenSees' own words and parameters
INTEGRATORS: dict[str, tuple[str | float, ...]] = {
    "Newmark": ("Newmark", 0.5, 0.25),
    "TRBDF2": ("TRBDF2",),
    "HHT 0.9": ("HHT", 0.9),
    "generalised alpha": ("GeneralizedAlpha", (2 - RADIUS) / (1 + RADIUS), 1 / (1 + RADIUS)),
}


@dataclass(frozen=True)
class OpenSeesPlate:
    """Settings of the solution.

    Args:
        mesh: Elements along and across; for the middle of the edge to be a node, one or an even
            number across (with one both corners are the same by symmetry).
        dt: Time step, s.
        element: "ASD" or "NLDKGQ".
        integrator: A key of `INTEGRATORS`.
        force: Force on the free edge, N.
        t_end: End, s.
        tolerance: Relative tolerance of Newton's method.
    """

    code: ClassVar[str] = OPENSEES
    mesh: tuple[int, int]
    dt: float
    element: str = "NLDKGQ"
    integrator: str = "Newmark"
    force: float = 2.0
    t_end: float = 0.5
    tolerance: float = 1e-3

    @property
    def how(self) -> str:
        """Time scheme in words, and its element where there are several."""
        return f"{self.element}, {self.integrator}"

    def run(self) -> TipHistory:
        """Solve; set-up is not timed.

        Raises:
            SceneError: If OpenSees is not installed.
        """
        ops, (nx, ny) = require(), self.mesh
        mesh = Mesh(ops, self.mesh, self.element, SECTION, place)
        ops.timeSeries("Constant", 1)
        ops.pattern("Plain", 1, 1)
        for node, _ in mesh.edge(0):
            ops.fix(node, *[1] * 6)
        for node, share in mesh.edge(nx):
            ops.load(node, 0.0, 0.0, self.force * share, 0.0, 0.0, 0.0)
        for i, acceleration in enumerate(_initial(self)):
            for node, _ in mesh.edge(i):
                ops.setNodeAccel(node, 3, float(acceleration), "-commit")
        solve_with(ops, INTEGRATORS[self.integrator], self.tolerance, "Transient")
        tip = mesh.node(nx, ny // 2)
        t, u, iterations, failed = [0.0], [0.0], 0, ""
        watch = Stopwatch()
        for _ in range(round(self.t_end / self.dt)):
            if ops.analyze(1, self.dt):
                failed = "Newton's method did not converge in 50 iterations"
                break
            iterations += ops.testIter()
            t.append(ops.getTime())
            u.append(ops.nodeDisp(tip, 3))
        cpu, wall = watch.cpu, watch.wall
        per_step = iterations / max(len(t) - 1, 1)
        return TipHistory(np.array(t), np.array(u), cpu, wall, per_step, per_step, failed)


def _initial(plate: OpenSeesPlate) -> Floats:
    """Accelerations across the plate at first, the same on each line of nodes, m/s^2."""
    nx = plate.mesh[0]
    element = DENSITY * THICKNESS * WIDTH * LENGTH / nx
    one = np.eye(2) / 2 if plate.element == "ASD" else np.array([[2.0, 1.0], [1.0, 2.0]]) / 6
    mass = np.zeros((nx + 1, nx + 1))
    for i in range(nx):
        mass[i : i + 2, i : i + 2] += element * one
    force = np.zeros(nx)
    force[-1] = plate.force
    return np.concatenate([[0.0], np.linalg.solve(mass[1:, 1:], force)])
