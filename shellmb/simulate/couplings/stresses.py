"""Stresses of contacts with faces in a step: the forms of potentials, evaluated point by point."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from mpi4py import MPI

import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.meshes.nodes import node_mesh
from shellmb.model.elements.lawvalues import LawValues
from shellmb.model.touching.law import Penalty, energy
from shellmb.schemes.pieces import Pieces

# points that are evaluated together
TOGETHER = 32


class PointStresses(NamedTuple):
    """Stresses on the distances of points in a step.

    Args:
        values: Of each piece, shape (n, pieces), N.
        slopes: Their derivatives by the distances at the states, shape (n, pieces, states), N/m.
        loss: What the step dissipates, shape (n,), J.
        energy: At the first state, shape (n,), J.
    """

    values: Floats
    slopes: Floats
    loss: Floats
    energy: Floats


class StepStresses:
    """Evaluates the stresses of a step by distances.

    Args:
        comm: Communicator.
        pieces: The steps of the scheme.
        law: Law of the points.
    """

    def __init__(self, comm: MPI.Comm, pieces: Pieces, law: Penalty) -> None:
        self._pieces = pieces
        nodes = node_mesh(comm, TOGETHER)
        numbers = (law.reach, law.smoothing, pieces.alpha)
        reach, smoothing, alpha = (fem.Constant(nodes.mesh, float(v)) for v in numbers)
        self._shape = len(pieces.ends), len(pieces.states)

        def every(g: Expr, stiffness: Expr) -> Expr:
            g = ufl.variable(g)
            parts = [g] if g.ufl_shape == () else list(g)
            e = [ufl.as_vector([part / reach]) for part in parts]
            U = partial(energy, stiffness=stiffness, reach=reach, smoothing=smoothing)
            found = pieces.stresses(U, e, alpha)
            stresses = [stress[0] / reach for stress in found.values]
            by = [ufl.diff(stress, g) for stress in stresses]
            slopes = [d if d.ufl_shape == () else d[k] for d in by for k in range(len(parts))]
            return ufl.as_vector([*stresses, *slopes, found.loss, U(e[0])])

        self._values = LawValues(nodes, every, (len(pieces.states), 1))

    def at(self, law: Penalty, distances: Floats) -> PointStresses:
        """Stresses of points at distances, shape (n, states), m."""
        found, (pieces, states) = self._values(distances, law.stiffness), self._shape
        slopes = found[:, pieces:-2].reshape(-1, pieces, states)
        return PointStresses(found[:, :pieces], slopes, found[:, -2], found[:, -1])
