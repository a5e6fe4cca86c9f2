"""Contact with the faces of a shell in the steps of a scheme, as a coupling of the system."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import ConvergenceError
from shellmb.model.touching.blend import Mixed, mixed
from shellmb.model.touching.faces import FacesContact, Touching
from shellmb.model.touching.pulls import mean_slope
from shellmb.scene.lookup import said
from shellmb.schemes.base import END, Levels
from shellmb.schemes.pieces import START, START_RATE, Pieces
from shellmb.simulate.couplings.stresses import PointStresses, StepStresses
from shellmb.system.couplings import Entries

# times a motion that was larger than expected for which pairs are found anew
AHEAD = 1.2


class Acting(NamedTuple):
    """Forces of a step on the slots of pairs of points and facets.

    Args:
        touching: The pairs.
        stresses: Stresses of the pieces, of each point.
        slopes: Mean slopes of the distances in each piece with their derivatives by both ends.
        mixed: Mean weights of the pairs in each piece.
        nodes: Numbers of the nodes in the slots, points first, shape (p, k).
    """

    touching: Touching
    stresses: PointStresses
    slopes: list[tuple[Floats, ...]]
    mixed: list[Mixed]
    nodes: Ints


class FacesCoupling:
    """Forces of one contact with the faces of a shell.

    Args:
        comm: Communicator.
        contact: The contact.
        levels: Functions of both bodies by their names.
        pieces: The steps of the scheme.
        offsets: First local dof of each field by body and stage.

    Attributes:
        dofs: Local dofs that it may ever act on.
        changed: Whether its entries are others than those that the matrix was made for.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        contact: FacesContact,
        levels: Mapping[str, Levels],
        pieces: Pieces,
        offsets: Mapping[tuple[str, str], int],
    ) -> None:
        self.contact, self._pieces, self._offsets = contact, pieces, offsets
        self._stages = tuple(pieces.rows)
        self._stresses = StepStresses(comm, pieces, contact.law)
        self._arrays = {name: _arrays(levels[name]) for name in (contact.body, contact.shell)}
        self._sides = (
            (contact.body, contact.y, contact.y_dofs),
            (contact.shell, contact.x, contact.x_dofs),
        )
        self.candidates = contact.candidates(contact.y, contact.x)
        self._pattern = contact.coupled(self.candidates)
        self.changed = False

    @cached_property
    def dofs(self) -> Ints:
        """Local dofs that it may ever act on."""
        found = [self._places(stage, np.arange(self._count)).ravel() for stage in self._stages]
        return np.unique(np.concatenate(found))

    @property
    def _count(self) -> int:
        return len(self.contact.y) + len(self.contact.x)

    def _places(self, stage: str, nodes: Ints) -> Ints:
        """Local dofs of a stage at nodes, those of points first, shape (n, 3)."""
        both = [dofs + self._offsets[body, stage] for body, _, dofs in self._sides]
        return np.concatenate(both)[nodes]

    @property
    def name(self) -> str:
        """Name of the contact."""
        return self.contact.item.name

    def _at(self, state: Mapping[str, float]) -> tuple[Floats, Floats]:
        """Positions of points and nodes at a state of the step."""
        found = []
        for body, X, dofs in self._sides:
            arrays = self._arrays[body]
            found.append(X + sum(share * arrays[name][dofs] for name, share in state.items()))
        return found[0], found[1]

    def start(self) -> tuple[Floats, Floats]:
        """Positions of points and nodes at the start of the step."""
        return self._at({START: 1.0})

    def end(self) -> tuple[Floats, Floats]:
        """Positions of points and nodes at its end."""
        return self._at({END: 1.0})

    def _touching(self) -> Touching | None:
        states = [self._at(state) for state in self._pieces.states]
        return self.contact.touching(self.candidates, states)

    def _acting(self, derivatives: bool) -> Acting | None:
        touching = self._touching()
        if touching is None:
            return None
        places = touching.places
        stresses = self._stresses.at(touching.law, touching.distances)
        ends, of = self._pieces.ends, touching.families
        slopes = [mean_slope(places[i], places[j], derivatives) for i, j in ends]
        mix = [mixed(of, places[i].distance, places[j].distance) for i, j in ends]
        points = touching.point[of.owner]
        nodes = np.column_stack([points, len(self.contact.y) + touching.nodes])
        return Acting(touching, stresses, slopes, mix, nodes)

    def residual(self) -> tuple[Ints, Floats]:
        """Local dofs and forces on them."""
        acting = self._acting(False)
        if acting is None:
            return np.zeros(0, dtype=np.int64), np.zeros(0)
        places, values = [], []
        for stage, shares in self._pieces.rows.items():
            places.append(self._places(stage, acting.nodes).ravel())
            values.append(_row(acting, shares).ravel())
        return np.concatenate(places), np.concatenate(values)

    def jacobian(self) -> Entries:
        """Derivatives of the forces."""
        acting = self._acting(True)
        none = np.zeros(0, dtype=np.int64)
        if acting is None:
            return Entries(none, none, np.zeros(0))
        states, found = self._pieces.states, []
        for row, shares in self._pieces.rows.items():
            blocks = _derivatives(acting, shares, self._pieces.ends, len(states))
            for column in self._stages:
                weights = [state.get(column, 0.0) for state in states]
                for rows, columns, by_states in blocks:
                    parts = [w * d for w, d in zip(weights, by_states, strict=True) if w]
                    if not parts:
                        continue
                    values = sum(parts[1:], parts[0])
                    i = self._places(row, rows)[:, :, :, None, None]
                    j = self._places(column, columns)[:, None, None]
                    here = np.flatnonzero(values)
                    one, two = (np.broadcast_to(k, values.shape).ravel()[here] for k in (i, j))
                    found.append(Entries(one, two, values.ravel()[here]))
        return Entries(*(np.concatenate(some) for some in zip(*found, strict=True)))

    def pattern(self) -> tuple[Ints, Ints]:
        """All entries that candidates may have."""
        one, other = self._pattern.nonzero()
        rows, columns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for row in self._stages:
            for column in self._stages:
                i, j = self._places(row, one)[:, :, None], self._places(column, other)[:, None]
                rows.append(np.broadcast_to(i, (len(one), 3, 3)).ravel())
                columns.append(np.broadcast_to(j, (len(one), 3, 3)).ravel())
        self.changed = False
        return np.concatenate(rows), np.concatenate(columns)

    def look(self) -> None:
        """Before a step: find pairs again where something may have come near."""
        y, x = self.start()
        if self.candidates.moved(y, x) > 0.5:
            self._find(y, x, 0.0)

    def covered(self) -> bool:
        """Decide whether the pairs are all that could touch in the step; if not, find more."""
        states = [self._at(state) for state in self._pieces.states]
        if max(self.candidates.moved(y, x) for y, x in states) <= 1:
            return True
        y, x = self.end()
        most = max(
            float(np.max(np.linalg.norm(a - b, axis=1), initial=0.0))
            for state in states
            for a, b in zip(state, (y, x), strict=True)
        )
        self._find(y, x, 2 * AHEAD * most)
        return False

    def _find(self, y: Floats, x: Floats, slack: float) -> None:
        self.candidates = self.contact.candidates(y, x, slack)
        pattern = self.contact.coupled(self.candidates)
        if pattern.multiply(self._pattern).nnz < pattern.nnz:
            self._pattern, self.changed = pattern, True

    def check(self) -> None:
        """See that nothing has passed through the shell.

        Raises:
            ConvergenceError: If a point has.
        """
        contact = self.contact
        point = contact.through(self.candidates, self.start(), self.end())
        if point is None:
            return
        place = ", ".join(f"{c:.4g}" for c in contact.y[point])
        raise ConvergenceError(
            f"{said(contact.item)}: the point of '{contact.body}' that was at ({place}) passes "
            f"through '{contact.shell}' within a step; use a smaller step or a larger stiffness",
            contact.item.name,
        )

    def energy(self) -> float:
        """Energy of the contact at the start of the step, J."""
        touching = self.contact.touching(self.candidates, [self.start()])
        if touching is None:
            return 0.0
        distances = np.repeat(touching.distances, len(self._pieces.states), axis=1)
        return float(self._stresses.at(touching.law, distances).energy.sum())

    def depth(self) -> float:
        """Penetration of the deepest point at the start of the step, m."""
        touching = self.contact.touching(self.candidates, [self.start()])
        reach = self.contact.law.reach
        return 0.0 if touching is None else float(np.max(reach - touching.distances, initial=0.0))

    def crosses(self) -> bool:
        """Decide whether the bodies intersect between the points, at the start of the step."""
        return self.contact.pierced(self.candidates, *self.start())

    def loss(self) -> float:
        """Energy that the step just solved has dissipated, J."""
        touching = self._touching()
        if touching is None:
            return 0.0
        return float(self._stresses.at(touching.law, touching.distances).loss.sum())

    def forces(self) -> Floats:
        """Mean forces on the points over the step just solved, shape (n, 3), N."""
        acting = self._acting(False)
        if acting is None:
            return np.zeros((0, 3))
        of = acting.touching.families
        return -np.add.reduceat(_row(acting, self._pieces.rows[END])[:, 0], of.first)


def _arrays(levels: Levels) -> dict[str, Floats]:
    found = {stage: function.x.array for stage, function in levels.unknown.items()}
    found[START] = levels.q.x.array
    if levels.scaled:
        (rate,) = levels.scaled.values()
        found[START_RATE] = rate.x.array
    return found


def _row(acting: Acting, shares: tuple[float, ...]) -> Floats:
    """Forces of a row on the slots of all pairs, shape (p, k, 3)."""
    owner, found = acting.touching.families.owner, []
    for p, (share, mix, (f, *_)) in enumerate(
        zip(shares, acting.mixed, acting.slopes, strict=True)
    ):
        if share:
            stress = share * acting.stresses.values[owner, p] * mix.weights
            found.append(stress[:, None, None] * f)
    return sum(found[1:], found[0])


def _derivatives(
    acting: Acting, shares: tuple[float, ...], ends: tuple[tuple[int, int], ...], count: int
) -> list[tuple[Ints, Ints, list[Floats]]]:
    """Derivatives of a row's forces by the positions at each state.

    Returns:
        Blocks: nodes of the rows and of the columns, shape (n, k) each, and of each state the
        derivatives, shape (n, k, 3, k, 3). First of the pairs by themselves, then through the
        stresses and weights of their points, which all pairs of these have in common.
    """
    touching, stresses, slopes, mixes, nodes = acting
    of = touching.families
    p, k = nodes.shape
    one, other = of.relatives()
    own = [np.zeros((p, k, 3, k, 3)) for _ in range(count)]
    common = [np.zeros((len(one), k, 3, k, 3)) for _ in range(count)]
    turns = [place.slope for place in touching.places]
    weights = [of.least(place.distance)[1] for place in touching.places]
    for n, (share, (f, by_a, by_b), mix, (i, j)) in enumerate(
        zip(shares, slopes, mixes, ends, strict=True)
    ):
        if not share:
            continue
        stress = share * stresses.values[of.owner, n]
        whole = (stress * mix.weights)[:, None, None, None, None]
        own[i] += whole * by_a
        own[j] += whole * by_b
        changes = [
            share * (mix.weights * stresses.slopes[of.owner, n, m])[one] * weights[m][other]
            for m in range(count)
        ]
        for m, change in zip((i, j), mix.derivatives(one, other), strict=True):
            changes[m] = changes[m] + stress[one] * change
        for m, change in enumerate(changes):
            common[m] += np.einsum("n,nki,nlj->nkilj", change, f[one], turns[m][other])
    return [(nodes, nodes, own), (nodes[one], nodes[other], common)]
