"""Shells in Kratos (PyPI `KratosMultiphysics` and its structural application, the extra `peers`).

The corotational thin quadrilateral is used, `ShellThinElementCorotational3D4N` (discrete
Kirchhoff); the thick one, `ShellThickElementCorotational3D4N`, ends in a segmentation fault in the
wheel of 10.4.4. Newton's method with a tangent in each iteration.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from shellmb.demos.verification.measuring import Stopwatch
from tests.bench.peers.codes import require_package

ELEMENT = "ShellThinElementCorotational3D4N"
AXES = "XYZ"


def require() -> Any:
    """The module, silent.

    Raises:
        SceneError: If it is not installed.
    """
    require_package("KratosMultiphysics")
    import KratosMultiphysics

    KratosMultiphysics.Logger.GetDefaultOutput().SetSeverity(
        KratosMultiphysics.Logger.Severity.WARNING
    )
    return KratosMultiphysics


class Mesh:
    """A structured mesh of one shell in a new model.

    Args:
        kratos: The module.
        mesh: Elements along two directions.
        section: E, Poisson's ratio, thickness, density.
        place: Position of a node, both arguments from 0 to 1, shape (3,).
    """

    def __init__(
        self,
        kratos: Any,
        mesh: tuple[int, int],
        section: tuple[float, float, float, float],
        place: Callable[[complex, complex], npt.ArrayLike],
    ) -> None:
        import KratosMultiphysics.StructuralMechanicsApplication as structural

        self._kratos, self._structural, self.mesh = kratos, structural, mesh
        nx, ny = mesh
        self._model = kratos.Model()
        self.part = part = self._model.CreateModelPart("shell", 2)
        for name in (
            *("DISPLACEMENT", "REACTION", "ROTATION", "REACTION_MOMENT"),
            "VOLUME_ACCELERATION",
        ):
            part.AddNodalSolutionStepVariable(getattr(kratos, name))
        for name in ("POINT_LOAD", "POINT_MOMENT"):
            part.AddNodalSolutionStepVariable(getattr(structural, name))
        part.ProcessInfo[kratos.DOMAIN_SIZE] = 3
        properties = part.CreateNewProperties(1)
        for name, value in zip(
            ("YOUNG_MODULUS", "POISSON_RATIO", "THICKNESS", "DENSITY"), section, strict=True
        ):
            properties.SetValue(getattr(kratos, name), value)
        law = structural.LinearElasticPlaneStress2DLaw()
        properties.SetValue(kratos.CONSTITUTIVE_LAW, law)
        for j in range(ny + 1):
            for i in range(nx + 1):
                part.CreateNewNode(self.node(i, j), *np.real(place(i / nx, j / ny)).tolist())
        for j in range(ny):
            for i in range(nx):
                corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
                nodes = [self.node(*corner) for corner in corners]
                part.CreateNewElement(ELEMENT, 1 + j * nx + i, nodes, properties)
        for kind, reaction in (("DISPLACEMENT", "REACTION"), ("ROTATION", "REACTION_MOMENT")):
            for axis in AXES:
                pair = getattr(kratos, f"{kind}_{axis}"), getattr(kratos, f"{reaction}_{axis}")
                kratos.VariableUtils().AddDof(*pair, part)
        self._loads: list[tuple[Any, Any, float]] = []

    def node(self, i: int, j: int) -> int:
        """Number of a node."""
        return 1 + j * (self.mesh[0] + 1) + i

    def edge(self, i: int) -> list[tuple[int, float]]:
        """Nodes of a line across, and their shares of what acts on it evenly."""
        ny = self.mesh[1]
        return [(self.node(i, j), (0.5 if j in (0, ny) else 1.0) / ny) for j in range(ny + 1)]

    def fix(self, node: int, *held: int) -> None:
        """Hold displacements and rotations about x, y, z, one flag each."""
        for k, flag in enumerate(held):
            if flag:
                kind = "DISPLACEMENT" if k < 3 else "ROTATION"
                self.part.GetNode(node).Fix(getattr(self._kratos, f"{kind}_{AXES[k % 3]}"))

    def load(self, node: int, component: int, size: float) -> None:
        """A force (component 0 to 2) or moment (3 to 5) in proportion to the load's factor."""
        moment = component >= 3
        kind = "POINT_MOMENT" if moment else "POINT_LOAD"
        variable = getattr(self._structural, f"{kind}_{AXES[component % 3]}")
        condition = "PointMomentCondition3D1N" if moment else "PointLoadCondition3D1N"
        number = self.part.NumberOfConditions() + 1
        self.part.CreateNewCondition(condition, number, [node], self.part.GetProperties(1))
        self._loads.append((self.part.GetNode(node), variable, size))

    def solve(self, steps: int, tolerance: float) -> tuple[int, float, str]:
        """Solve in equal load steps; set-up is not timed.

        Args:
            steps: Their number.
            tolerance: Of the last increment of Newton's method, relative to the solution.

        Returns:
            Newton iterations, processor time [s], and why it ended early, "" if it did not.
        """
        strategy, watch, iterations = self._strategy(tolerance), Stopwatch(), 0
        for number in range(1, steps + 1):
            self.part.CloneTimeStep(float(number))
            for node, variable, size in self._loads:
                node.SetSolutionStepValue(variable, 0, number / steps * size)
            strategy.InitializeSolutionStep()
            strategy.Predict()
            converged = strategy.SolveSolutionStep()
            strategy.FinalizeSolutionStep()
            iterations += int(self.part.ProcessInfo[self._kratos.NL_ITERATION_NUMBER])
            if not converged:
                return iterations, watch.cpu, f"no convergence in load step {number}"
        return iterations, watch.cpu, ""

    def _strategy(self, tolerance: float) -> Any:
        from KratosMultiphysics.LinearSolversApplication import SparseLUSolver

        kratos = self._kratos
        strategy = kratos.ResidualBasedNewtonRaphsonStrategy(
            self.part,
            kratos.ResidualBasedIncrementalUpdateStaticScheme(),
            kratos.DisplacementCriteria(tolerance, 1e-30),
            kratos.ResidualBasedBlockBuilderAndSolver(SparseLUSolver()),
            50,
            False,
            False,
            True,
        )
        strategy.SetEchoLevel(0)
        strategy.Check()
        strategy.Initialize()
        return strategy

    def moved(self, node: int) -> list[float]:
        """Displacement of a node, m."""
        value = self.part.GetNode(node).GetSolutionStepValue(self._kratos.DISPLACEMENT)
        return [float(value[k]) for k in range(3)]
