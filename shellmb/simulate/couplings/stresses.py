"""Stresses of contacts with faces in a step: the forms of potentials, evaluated point by point."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from mpi4py import MPI

import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms import contact
from shellmb.meshes.nodes import node_mesh
from shellmb.model.massless import LawValues
from shellmb.model.shell_contact.faces import Law, energy
from shellmb.schemes.pieces import Pieces

# points that are evaluated together
TOGETHER = 32


class PointForces(NamedTuple):
    """Forces along the distances of points.

    Args:
        values: The forces, shape (n,), N.
        slopes: Their derivatives by the distances at the states, shape (n, states), N/m.
    """

    values: Floats
    slopes: Floats


def opposite(of: PointForces) -> PointForces:
    """Forces that are opposite."""
    return PointForces(-of.values, -of.slopes)


class PointStresses(NamedTuple):
    """Stresses on the distances of points in a step.

    Args:
        pieces: Of each piece: the slope of the energy.
        damped: Force of the damping over the whole step; None: there is none.
        normal: Normal force over the whole step that friction goes by; None: there is none.
        loss: What the scheme dissipates, shape (n,), J.
        energy: At the first state, shape (n,), J.
    """

    pieces: list[PointForces]
    damped: PointForces | None
    normal: PointForces | None
    loss: Floats
    energy: Floats


class StepStresses:
    """Evaluates the stresses of a step by distances.

    Damping and friction act over the whole step: forces that are constant in it, by the mean of the
    elastic force and the mean rate, so that they take energy in any step.

    Args:
        comm: Communicator.
        pieces: The steps of the scheme.
        law: Law of the points.

    Attributes:
        dt: Length of the step, s.
    """

    def __init__(self, comm: MPI.Comm, pieces: Pieces, law: Law) -> None:
        self._pieces, item = pieces, law.item
        nodes = node_mesh(comm, TOGETHER)
        self.dt = 1.0

        def constant(value: float) -> fem.Constant:
            return fem.Constant(nodes.mesh, float(value))

        numbers = law.reach, item.smoothing, pieces.alpha
        reach, smoothing, alpha = map(constant, numbers)
        self._damps, self._rubs = item.relative_damping > 0, item.friction > 0
        chi = constant(item.relative_damping) if self._damps else None
        self._rate = constant(1.0)
        states = len(pieces.states)

        def every(g: Expr, stiffness: Expr) -> Expr:
            g = ufl.variable(g)
            parts = [g] if g.ufl_shape == () else list(g)
            e = [ufl.as_vector([part / reach]) for part in parts]
            U = partial(energy, stiffness=stiffness, reach=reach, smoothing=smoothing)
            found = pieces.stresses(U, e, alpha)
            forces = [stress[0] / reach for stress in found.values]
            if self._damps or self._rubs:
                shares = zip(pieces.mean, forces, strict=True)
                mean = -sum((share * force for share, force in shares), 0 * parts[0])
                # a stress that dissipates may attract
                normal = contact.greatest(mean, 0 * mean)
                if chi is not None:
                    approach = (parts[0] - parts[-1]) * self._rate
                    damped = contact.resisted(normal, approach, chi)
                    forces, normal = [*forces, damped], normal + damped
                forces = [*forces, normal] if self._rubs else forces
            by = [ufl.diff(force, g) for force in forces]
            slopes = [d if d.ufl_shape == () else d[k] for d in by for k in range(len(parts))]
            return ufl.as_vector([*forces, *slopes, found.loss, U(e[0])])

        self._values = LawValues(nodes, every, (states, 1))

    def at(self, law: Law, distances: Floats) -> PointStresses:
        """Stresses of points at distances, shape (n, states), m."""
        self._rate.value = 1 / self.dt  # type: ignore[assignment]
        found = self._values(distances, law.stiffness)
        states = len(self._pieces.states)
        count = (found.shape[1] - 2) // (1 + states)
        slopes = found[:, count:-2].reshape(-1, count, states)
        every = [PointForces(found[:, k], slopes[:, k]) for k in range(count)]
        normal = every.pop() if self._rubs else None
        damped = every.pop() if self._damps else None
        return PointStresses(every, damped, normal, found[:, -2], found[:, -1])
