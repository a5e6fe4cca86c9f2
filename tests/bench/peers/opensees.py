"""Shells in OpenSees (PyPI `openseespy`, the extra `peers`): elements, meshes, what is solved with.

Both elements for large displacements are used: `ASDShellQ4` with `-corotational` (four nodes,
enhanced membrane, mixed shear) and `ShellNLDKGQ` (Kirchhoff, updated Lagrangian). Newton's method
with a tangent in each iteration, since modified Newton, BFGS and the solvers of symmetric matrices
fail on the plate of `opensees_plate`, and Krylov's acceleration is no faster there; the banded
solver, which is the fastest on strips.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.bench.peers.codes import require_package

# names of elements in tables, and what OpenSees calls them
ELEMENTS = {"ASD": ("ASDShellQ4", "-corotational"), "NLDKGQ": ("ShellNLDKGQ",)}


def require() -> Any:
    """The module; it keeps one model for the whole process.

    Raises:
        SceneError: If it is not installed.
    """
    require_package("openseespy")
    import openseespy.opensees

    # what it says of steps that fail is told by us
    openseespy.opensees.logFile(os.devnull, "-noEcho")
    return openseespy.opensees


class Mesh:
    """A structured mesh of one shell in a new model.

    Args:
        ops: The module.
        mesh: Elements along two directions.
        element: A key of `ELEMENTS`.
        section: E, Poisson's ratio, thickness, density.
        place: Position of a node, both arguments from 0 to 1, shape (3,).
    """

    def __init__(
        self,
        ops: Any,
        mesh: tuple[int, int],
        element: str,
        section: tuple[float, float, float, float],
        place: Callable[[complex, complex], npt.ArrayLike],
    ) -> None:
        self._ops = ops
        self.mesh = nx, ny = mesh
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", 6)
        ops.section("ElasticMembranePlateSection", 1, *section)
        for j in range(ny + 1):
            for i in range(nx + 1):
                ops.node(self.node(i, j), *np.real(place(i / nx, j / ny)).tolist())
        name, *options = ELEMENTS[element]
        for j in range(ny):
            for i in range(nx):
                corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
                nodes = [self.node(*corner) for corner in corners]
                ops.element(name, 1 + j * nx + i, *nodes, 1, *options)

    def node(self, i: int, j: int) -> int:
        """Tag of a node."""
        return 1 + j * (self.mesh[0] + 1) + i

    def edge(self, i: int) -> list[tuple[int, float]]:
        """Nodes of a line across, and their shares of what acts on it evenly."""
        ny = self.mesh[1]
        return [(self.node(i, j), (0.5 if j in (0, ny) else 1.0) / ny) for j in range(ny + 1)]

    def moved(self, node: int) -> list[float]:
        """Displacement of a node, m."""
        return [self._ops.nodeDisp(node, k) for k in (1, 2, 3)]


def solve_with(
    ops: Any,
    integrator: tuple[Any, ...],
    tolerance: float,
    analysis: str,
    algorithm: str = "Newton",
    system: str = "BandGeneral",
) -> None:
    """Newton's method and linear solver.

    Args:
        ops: The module.
        integrator: Its name and parameters.
        tolerance: Of the last increment, relative to the first one of the step.
        analysis: "Static" or "Transient".
        algorithm: Of nonlinear equations.
        system: Of linear ones.
    """
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system(system)
    ops.test("RelativeNormDispIncr", tolerance, 50, 0)
    ops.algorithm(algorithm)
    ops.integrator(*integrator)
    ops.analysis(analysis, "-noWarnings")
