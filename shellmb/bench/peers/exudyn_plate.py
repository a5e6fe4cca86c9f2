"""The cantilever plate of the demo `sudden_load` in Exudyn (PyPI `exudyn`, the extra `peers`).

Elements `ANCFThinPlate` (Kirchhoff, nodes with two slopes: 9 coordinates) with the reduced rule
(3x3 Lobatto points for the membrane, 2x2 Gauss points for bending), which is both faster and more
accurate here than 5x5 points; generalised-alpha; modified Newton; the sparse solver of Eigen; the
module without range checks; one thread. These are the fastest settings found on this problem.
"""

from __future__ import annotations

import contextlib
import itertools
import sys
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from shellmb.bench.peers.history import TipHistory
from shellmb.bench.peers.installed import require_package
from shellmb.demos.sudden_load import LENGTH, WIDTH
from shellmb.measuring.times import Stopwatch

E, NU, DENSITY, THICKNESS = 210e9, 0.25, 7870.0, 2e-3
# coordinates of a node that a clamp holds: the position, the slope along the edge, and the other
# slope across the plate; in its plane that slope is the strain, which the clamp leaves free
CLAMPED = (0, 1, 2, 5, 6, 7, 8)
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

    mesh: tuple[int, int]
    dt: float
    force: float = 2.0
    t_end: float = 0.5
    spectral_radius: float = 0.9
    tolerance: float = 1e-6
    modified: bool = True


def require() -> Any:
    """The module.

    Raises:
        SceneError: If it is not installed.
    """
    require_package("exudyn")
    with _quiet():
        # the compiled module without range checks, about 30 % faster
        sys.exudynFast = True  # type: ignore[attr-defined]
        import exudyn

        exudyn.config.printToConsole = False
    return exudyn


@contextlib.contextmanager
def _quiet() -> Any:
    """What Exudyn says on stdout goes to stderr; that names change is not our concern here."""
    with contextlib.redirect_stdout(sys.stderr), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def run(plate: ExudynPlate) -> TipHistory:
    """Solve; set-up is not timed.

    Raises:
        SceneError: If Exudyn is not installed.
    """
    exu = require()
    with _quiet():
        system, sensor, keep = _build(exu, plate)
        settings = _settings(exu, plate)
        watch, failed = Stopwatch(), ""
        try:
            system.SolveDynamic(settings, showHints=False)
        except Exception as error:
            failed = str(error).strip().splitlines()[0][:200] or type(error).__name__
        cpu, wall = watch.cpu, watch.wall
        rows = np.array(system.GetSensorStoredData(sensor))
        it = system.sys["dynamicSolver"].it
        steps = max(len(rows) - 1, 1)
        del keep
    if not failed and rows[-1, 0] < plate.t_end * (1 - 1e-6):
        failed = "ended early"
    numbers = it.newtonStepsCount / steps, it.newtonJacobiCount / steps
    return TipHistory(rows[:, 0], rows[:, 3], cpu, wall, *numbers, failed)


def _build(exu: Any, plate: ExudynPlate) -> tuple[Any, Any, Any]:
    """The system, its sensor at the middle of the free edge, and what must live as long."""
    import exudyn.itemInterface as items

    container = exu.SystemContainer()
    system = container.AddSystem()
    nx, ny = plate.mesh
    plane = np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]]) * E / (1 - NU**2)
    strain, curvature = exu.Matrix3DList(), exu.Matrix3DList()
    strain.Append(plane * THICKNESS)
    curvature.Append(plane * THICKNESS**3 / 12)
    slopes = [1, 0, 0, 0, 1, 0]
    nodes = [
        [
            system.AddNode(
                items.NodePointSlope12(
                    referenceCoordinates=[LENGTH * i / nx, WIDTH * j / ny, 0, *slopes]
                )
            )
            for i in range(nx + 1)
        ]
        for j in range(ny + 1)
    ]
    elements = [
        [
            system.AddObject(
                items.ObjectANCFThinPlate(
                    nodeNumbers=[a[i], a[i + 1], b[i + 1], b[i]],
                    thickness=THICKNESS,
                    density=DENSITY,
                    strainCoefficients=strain,
                    curvatureCoefficients=curvature,
                    useReducedOrderIntegration=1,
                )
            )
            for i in range(nx)
        ]
        for a, b in itertools.pairwise(nodes)
    ]

    def coordinate(node: Any, which: int) -> Any:
        marker = items.MarkerNodeCoordinate(nodeNumber=node, coordinate=which)
        return system.AddMarker(marker)

    ground = coordinate(system.AddNode(items.NodePointGround()), 0)
    for row in nodes:
        for which in CLAMPED:
            held = items.CoordinateConstraint(markerNumbers=[ground, coordinate(row[0], which)])
            system.AddObject(held)
    # the line load as its cubic shape functions see it
    line, side = plate.force / WIDTH, WIDTH / ny
    for j, row in enumerate(nodes):
        end = j in (0, ny)
        half = line * side * (0.5 if end else 1.0)
        system.AddLoad(
            items.LoadCoordinate(markerNumber=coordinate(row[-1], DEFLECTION), load=half)
        )
        if end:
            moment = line * side**2 / 12 * (1 if j == 0 else -1)
            system.AddLoad(
                items.LoadCoordinate(markerNumber=coordinate(row[-1], TWIST), load=moment)
            )
    where = [1, 0, 0] if ny % 2 else [1, -1, 0]
    sensor = system.AddSensor(
        items.SensorBody(
            bodyNumber=elements[ny // 2][-1],
            localPosition=where,
            storeInternal=True,
            writeToFile=False,
            outputVariableType=exu.OutputVariableType.Displacement,
        )
    )
    system.Assemble()
    return system, sensor, container


def _settings(exu: Any, plate: ExudynPlate) -> Any:
    """Fixed steps, nothing written but the sensor's values at each."""
    settings = exu.SimulationSettings()
    times = settings.timeIntegration
    times.numberOfSteps, times.endTime = round(plate.t_end / plate.dt), plate.t_end
    times.adaptiveStep, times.verboseMode = False, 0
    times.generalizedAlpha.spectralRadius = plate.spectral_radius
    times.newton.useModifiedNewton = plate.modified
    times.newton.relativeTolerance = plate.tolerance
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = plate.dt
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True
    settings.parallel.numberOfThreads = 1
    return settings
