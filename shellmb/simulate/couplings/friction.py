"""Friction of points along the facets of shells, from its form, pair by pair."""

from __future__ import annotations

from typing import NamedTuple

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms import contact
from shellmb.meshes.nodes import node_mesh
from shellmb.model.massless import LawValues
from shellmb.model.shell_contact.faces import Law, Touching
from shellmb.model.shell_contact.facets import nearest
from shellmb.simulate.couplings.stresses import TOGETHER


class Ends(NamedTuple):
    """Positions at both ends of a step, in the slots of pairs, shape (p, k, 3) each, m.

    Args:
        first: At its start: the point, the nodes of the facet, and directors at the point.
        last: At its end.
    """

    first: Floats
    last: Floats


class FacetFriction:
    """Evaluates friction for a normal force of one.

    Args:
        comm: Communicator.
        law: Coefficient, slip speed and distance of the surface from the points.
        directors: Number of directors at the points that matter.

    Attributes:
        dt: Length of the step, s.
    """

    def __init__(self, comm: MPI.Comm, law: Law, directors: int) -> None:
        nodes = node_mesh(comm, TOGETHER)
        self.dt = 1.0
        self._count = count = contact.CORNERS + directors
        item = law.item
        numbers = item.friction, item.slip_speed or 0.0, item.radius
        friction, slow, arm = (fem.Constant(nodes.mesh, float(v)) for v in numbers)
        parameters = contact.Law(arm, arm, friction=friction, slip_speed=slow)

        def every(state: Expr, speed: Expr, given: Expr) -> Expr:
            state, speed = ufl.variable(state), ufl.variable(speed)
            rows = [[given[3 * k + i] for i in range(3)] for k in range(3)]
            near = contact.Nearest(rows[0], rows[1:], [given[9], given[10]])
            forces = []
            for unit in np.eye(3 * count).tolist():
                moved = _vectors(ufl.as_vector(unit))
                now, rates = _vectors(state), _vectors(speed)
                forces.append(contact.facet_friction(now, rates, moved, near, arm, parameters))
            force = ufl.as_vector(forces)
            n = range(3 * count)
            by = [ufl.diff(force, of) for of in (state, speed)]
            return ufl.as_vector([*forces, *(d[i, j] for d in by for i in n for j in n)])

        self._values = LawValues(nodes, every, (3 * count, 3 * count, 11))

    def at(self, touching: Touching, ends: Ends) -> tuple[Floats, ...]:
        """Friction on the slots of pairs, and its derivatives by positions at both ends of a step.

        Args:
            touching: The pairs.
            ends: Positions.

        Returns:
            Shape (p, k, 3), and twice (p, k, 3, k, 3).
        """
        vertices, n = touching.vertices, self._count
        p, k = ends.first.shape[:2]
        # corners relative to the point, and directors
        taken = np.zeros((p, n, k))
        taken[:, :3, 0] = -1.0
        taken[:, :3, 1 : 1 + vertices.shape[2]] = vertices
        taken[:, range(3, n), range(1 + vertices.shape[2], k)] = 1.0
        middle, speed = taken @ ((ends.first + ends.last) / 2), taken @ (ends.last - ends.first)
        near = nearest(np.zeros((p, 3)), middle[:, :3])
        still = ~near.turns.any(axis=2)
        given = np.column_stack([near.weights, near.turns.reshape(p, 6), still])
        found = self._values(
            middle.reshape(p, -1), speed.reshape(p, -1) / self.dt, given.astype(float)
        )
        size = 3 * n
        force = found[:, :size].reshape(p, n, 3)
        by = found[:, size:].reshape(p, 2, n, 3, n, 3)
        by_middle, by_speed = by[:, 0] / 2, by[:, 1] / self.dt
        turned = [
            np.einsum("pak,paibj,pbl->pkilj", taken, d, taken, optimize=True)
            for d in (by_middle - by_speed, by_middle + by_speed)
        ]
        return np.einsum("pak,pai->pki", taken, force), *turned


def _vectors(q: Expr) -> list[Expr]:
    return [ufl.as_vector([q[k + i] for i in range(3)]) for k in range(0, q.ufl_shape[0], 3)]
