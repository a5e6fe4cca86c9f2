"""Shells in Exudyn (PyPI `exudyn`, the extra `peers`): elements, meshes, what is solved with.

Elements `ANCFThinPlate` (Kirchhoff, nodes with two slopes: 9 coordinates; curved as their slopes
are) with the reduced rule (3x3 Lobatto points for the membrane, 2x2 Gauss points for bending),
which is both faster and more accurate here than 5x5 points; the sparse solver of Eigen; the module
without range checks; one thread. These are the fastest settings found.
"""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats
from shellmb.demos.verification.measuring import Stopwatch
from tests.bench.peers.codes import require_package

# coordinates of a node that a clamp at an x holds: the position, the slope along the edge, and
# the other slope across the plate; in its plane that is the strain, which the clamp leaves free
CLAMPED = (0, 1, 2, 5, 6, 7, 8)
# imaginary step of derivatives, which are exact with any that is small
STEP = 1e-30


def require() -> Any:
    """The module.

    Raises:
        SceneError: If it is not installed.
    """
    require_package("exudyn")
    with quiet():
        # the compiled module without range checks, about 30 % faster
        sys.exudynFast = True  # type: ignore[attr-defined]
        import exudyn

        exudyn.config.printToConsole = False
    return exudyn


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Send to stderr what Exudyn says on stdout; that names change is not our concern here."""
    with contextlib.redirect_stdout(sys.stderr), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


class Mesh:
    """A structured mesh of one shell in a new system.

    Args:
        exu: The module.
        mesh: Elements along two directions.
        section: E, Poisson's ratio, thickness, density.
        place: Position of a node, both arguments from 0 to 1, shape (3,); analytic, since it is
            given complex arguments for its derivatives.

    Attributes:
        system: Exudyn's system.
        elements: Elements by their indices along the directions.
    """

    def __init__(
        self,
        exu: Any,
        mesh: tuple[int, int],
        section: tuple[float, float, float, float],
        place: Callable[[complex, complex], npt.ArrayLike],
    ) -> None:
        import exudyn.itemInterface as items

        self._exu, self._items, (nx, ny) = exu, items, mesh
        # a system lives as long as its container
        self._container = exu.SystemContainer()
        self.system = self._container.AddSystem()
        E, nu, thickness, density = section
        plane = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]]) * E / (1 - nu**2)
        strain, curvature = exu.Matrix3DList(), exu.Matrix3DList()
        strain.Append(plane * thickness)
        curvature.Append(plane * thickness**3 / 12)
        self._nodes = {}
        for j in range(ny + 1):
            for i in range(nx + 1):
                r, s = i / nx, j / ny
                along = np.imag(place(r + STEP * 1j, s)) / STEP
                across = np.imag(place(r, s + STEP * 1j)) / STEP
                slopes = (slope / np.linalg.norm(slope) for slope in (along, across))
                coordinates = np.concatenate([np.real(place(r, s)), *slopes])
                node = items.NodePointSlope12(referenceCoordinates=coordinates.tolist())
                self._nodes[i, j] = self.system.AddNode(node)
        self.elements = {}
        for j in range(ny):
            for i in range(nx):
                corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
                plate = items.ObjectANCFThinPlate(
                    nodeNumbers=[self._nodes[c] for c in corners],
                    thickness=thickness,
                    density=density,
                    strainCoefficients=strain,
                    curvatureCoefficients=curvature,
                    useReducedOrderIntegration=1,
                )
                self.elements[i, j] = self.system.AddObject(plate)
        nothing = self.system.AddNode(items.NodePointGround())
        self._ground = self._coordinate(nothing, 0)

    def node(self, i: int, j: int) -> Any:
        """Index of a node."""
        return self._nodes[i, j]

    def _coordinate(self, node: Any, which: int) -> Any:
        marker = self._items.MarkerNodeCoordinate(nodeNumber=node, coordinate=which)
        return self.system.AddMarker(marker)

    def hold(self, node: Any, coordinates: Iterable[int]) -> None:
        """Hold coordinates of a node: 0 to 2 its position, 3 to 5 and 6 to 8 its slopes."""
        for which in coordinates:
            markers = [self._ground, self._coordinate(node, which)]
            self.system.AddObject(self._items.CoordinateConstraint(markerNumbers=markers))

    def drive(self, node: Any, which: int, rate: float) -> None:
        """Prescribe the velocity of a coordinate of a node."""
        markers = [self._ground, self._coordinate(node, which)]
        driven = self._items.CoordinateConstraint(
            markerNumbers=markers, velocityLevel=True, offset=rate
        )
        self.system.AddObject(driven)

    def load(self, node: Any, which: int, load: float) -> None:
        """Load a coordinate of a node."""
        marker = self._coordinate(node, which)
        self.system.AddLoad(self._items.LoadCoordinate(markerNumber=marker, load=load))

    def turn(self, node: Any, torque: tuple[float, float, float]) -> None:
        """Load a node with a torque that keeps its direction, N m."""
        marker = self.system.AddMarker(self._items.MarkerNodeRigid(nodeNumber=node))
        self.system.AddLoad(self._items.LoadTorqueVector(markerNumber=marker, loadVector=torque))

    def moved(self, node: Any) -> Floats:
        """Displacement of a node once solved, shape (3,) [m]."""
        return np.array(self.system.GetNodeOutput(node, self._exu.OutputVariableType.Displacement))


def settings_of(exu: Any) -> Any:
    """Settings that dynamics and statics have in common: nothing is written, one thread."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True
    settings.parallel.numberOfThreads = 1
    return settings


def timed(solve: Callable[[], object]) -> tuple[float, float, str]:
    """Processor and wall time of a solution [s], and why it failed; "" if it did not."""
    watch, failed = Stopwatch(), ""
    try:
        solve()
    except Exception as error:
        failed = str(error).strip().splitlines()[0][:200] or type(error).__name__
    return watch.cpu, watch.wall, failed


def solve_static(exu: Any, mesh: Mesh, load_steps: int) -> tuple[int, float, str]:
    """Newton's method, a tangent in each iteration, in equal steps of the load.

    The tolerance is Exudyn's own, 1e-8: it is one of residuals, which are large where a step
    begins, and errors with 1e-6 show that of the strip.

    Returns:
        Iterations, processor time [s], and why it failed.
    """
    mesh.system.Assemble()
    settings = settings_of(exu)
    static = settings.staticSolver
    static.numberOfLoadSteps, static.adaptiveStep, static.verboseMode = load_steps, False, 0
    static.newton.maxIterations = 50
    cpu, _, failed = timed(lambda: mesh.system.SolveStatic(settings, showHints=False))
    return mesh.system.sys["staticSolver"].it.newtonStepsCount, cpu, failed
