"""Forces of a step on the slots of pairs of points and facets, and their derivatives.

Stresses of contacts with faces follow from the forms of potentials, point by point; friction along
the facets follows from its form, pair by pair.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.forms import contact
from shellmb.meshes.nodes import node_mesh
from shellmb.model.massless import LawValues
from shellmb.model.shell_contact.faces import Law, Touching, energy
from shellmb.model.shell_contact.facets import nearest
from shellmb.model.shell_contact.mean_distance_slopes import Families, Mixed, Places
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


class PointStresses(NamedTuple):
    """Stresses on the distances of points in a step.

    Args:
        pieces: Of each piece: the slope of the energy.
        damped: Force of the damping over the whole step; None: there is none.
        normal: What presses over the whole step, by which friction goes, as it acts along the
            distances: not positive; None: there is no friction.
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
                    forces, normal = [*forces, -damped], normal + damped
                forces = [*forces, -normal] if self._rubs else forces
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


# positions at the start and at the end of a step, in the slots of pairs, shape (p, k, 3) each, m:
# of the point, the nodes of the facet, and directors at the point
type Ends = tuple[Floats, Floats]


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
        (first, last), vertices, n = ends, touching.vertices, self._count
        p, k = first.shape[:2]
        # corners relative to the point, and directors
        taken = np.zeros((p, n, k))
        taken[:, :3, 0] = -1.0
        taken[:, :3, 1 : 1 + vertices.shape[2]] = vertices
        taken[:, range(3, n), range(1 + vertices.shape[2], k)] = 1.0
        middle, speed = taken @ ((first + last) / 2), taken @ (last - first)
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


class Force(NamedTuple):
    """A force of each point in a part of a step, in given directions on the slots of its pairs.

    Args:
        shares: Its share in each row, by the name of the row's unknown state.
        size: Along the distances.
        along: Directions of all pairs, shape (p, k, 3), and, where derivatives are requested, those
            by the positions at both ends of the part, shape (p, k, 3, k, 3) each.
        mixed: Mean weights of the pairs in this part.
        ends: Numbers of the states at both ends.
        nodes: Numbers of the nodes in the slots, points first, shape (p, k).
    """

    shares: Mapping[str, float]
    size: PointForces
    along: tuple[Floats, ...]
    mixed: Mixed
    ends: tuple[int, int]
    nodes: Ints

    def on_slots(self, of: Families) -> Floats:
        """Forces on all slots, shape (p, k, 3), N."""
        pulls = self.size.values[of.owner] * self.mixed.weights
        return np.asarray(pulls[:, None, None] * self.along[0])


class Block(NamedTuple):
    """Derivatives of forces on slots.

    Args:
        rows: Nodes of the forces, shape (n, k).
        columns: Nodes of the positions, shape (n, m).
        by: Derivatives by the positions at each state, shape (n, k, 3, m, 3); None: there is none.
    """

    rows: Ints
    columns: Ints
    by: list[Floats | None]


def blocks(force: Force, of: Families, places: Sequence[Places], nodes: Ints) -> list[Block]:
    """Derivatives of a force: of pairs by themselves, then by what pairs of a point have in common.

    Args:
        force: The force, with derivatives of its directions.
        of: Points of the pairs.
        places: Nearest places of all pairs at each state.
        nodes: Nodes of these.
    """
    f, *by_ends = force.along
    mix, size = force.mixed, force.size
    one, other = of.relatives()
    own: list[Floats | None] = [None] * len(places)
    stress = size.values[of.owner]
    whole = (stress * mix.weights)[:, None, None, None, None]
    for i, d in zip(force.ends, by_ends, strict=True):
        before = own[i]
        own[i] = whole * d if before is None else before + whole * d
    changes = [
        (mix.weights * size.slopes[of.owner, m])[one] * of.least(place.distance)[1][other]
        for m, place in enumerate(places)
    ]
    for m, change in zip(force.ends, mix.derivatives(one, other), strict=True):
        changes[m] = changes[m] + stress[one] * change
    common: list[Floats | None] = [
        np.einsum("n,nki,nlj->nkilj", change, f[one], place.slope[other])
        for change, place in zip(changes, places, strict=True)
    ]
    return [Block(force.nodes, force.nodes, own), Block(force.nodes[one], nodes[other], common)]
