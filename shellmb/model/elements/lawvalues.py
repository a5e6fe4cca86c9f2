"""Values of the laws of force elements at given coordinates, rates and times."""

from collections.abc import Callable

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.meshes.nodes import NodeMesh, constant_vector, set_constants
from shellmb.model.joints.coordinates import gathered
from shellmb.native.expressions import compiled_expression, evaluate


class LawValues:
    """Evaluates a law at one state for each node of a mesh.

    Args:
        nodes: The nodes.
        law: Gives the force in UFL, as a function of coordinate, rate and time; parameters that
            differ from node to node are its own.
    """

    def __init__(self, nodes: NodeMesh, law: Callable[[Expr, Expr, Expr], Expr]) -> None:
        self._nodes = nodes
        count = nodes.mesh.topology.index_map(1).size_global
        zeros = np.zeros((count, 1))
        names = "x", "rate", "time"
        self._given = [constant_vector(nodes, zeros, name) for name in names]
        self._found = constant_vector(nodes, zeros, "force")
        points = self._found.function_space.element.interpolation_points
        # a derivative may be a plain number where what it is of is none
        force = expand_derivatives(ufl.as_ufl(law(*self._given)))
        if not ufl.domain.extract_domains(force):
            # a law may be a plain number, and an expression needs a mesh
            force = force + constant_vector(nodes, zeros, "nothing")
        self._expression = compiled_expression(force, points)

    def __call__(self, *states: Floats) -> Floats:
        """Forces [N] or moments [N m], shape (nodes,); collective.

        Args:
            states: Coordinates, rates and times, each of shape (nodes,).
        """
        for function, values in zip(self._given, states, strict=True):
            set_constants(function, self._nodes, values[:, None])
        evaluate(self._expression, self._found)
        rows = self._found.function_space.dofmap.list[:, 0]
        return gathered(self._nodes, self._found.x.array[rows])
