"""Values of laws that are written in UFL, at many given states."""

from collections.abc import Callable, Sequence

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.meshes.nodes import NodeMesh, constant_vector, set_constants
from shellmb.model.massless import gathered
from shellmb.native.expressions import values_at_states


class LawValues:
    """Evaluates a law at one state for each node of a mesh, and at more states in turns.

    Args:
        nodes: The nodes.
        law: Gives a scalar or vector in UFL, as a function of the states; parameters that differ
            from node to node are its own.
        sizes: Size of each of its arguments; those of force elements are coordinate, rate and time.
    """

    def __init__(
        self, nodes: NodeMesh, law: Callable[..., Expr], sizes: Sequence[int] = (1, 1, 1)
    ) -> None:
        self._nodes = nodes
        self._count = count = nodes.mesh.topology.index_map(1).size_global
        self._given = [
            constant_vector(nodes, np.zeros((count, n)), f"state {k}") for k, n in enumerate(sizes)
        ]
        # a derivative may be a plain number where what it is of is none
        value = expand_derivatives(ufl.as_ufl(law(*self._given)))
        if not ufl.domain.extract_domains(value):
            # a law may be a plain number, and an expression needs a mesh
            value = value + constant_vector(nodes, np.zeros((count, 1)), "nothing")
        value = value if value.ufl_shape else ufl.as_vector([value])
        self._size, self._find = len(value), values_at_states(value, self._given[0])

    def __call__(self, *states: Floats) -> Floats:
        """Values at states, shape (n,), of vectors (n, size); collective.

        Args:
            states: The arguments, each of shape (n,) or (n, size).
        """
        columns = [np.reshape(each, (len(each), -1)) for each in states]
        found = np.empty((len(columns[0]), self._size))
        for begin in range(0, len(found), self._count):
            # nodes that are left over repeat some states
            rows = np.resize(np.arange(begin, min(begin + self._count, len(found))), self._count)
            for function, values in zip(self._given, columns, strict=True):
                set_constants(function, self._nodes, values[rows])
            (local,) = self._find(self._given[0].x.array[None])
            found[begin : begin + self._count] = gathered(self._nodes, local)[: len(found) - begin]
        return found[:, 0] if self._size == 1 else found
