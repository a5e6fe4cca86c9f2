"""Forces of a step on the slots of pairs of points and facets, and their derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.model.shell_contact.mean_distance_slopes import Families, Mixed, Places
from shellmb.simulate.couplings.stresses import PointForces


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
