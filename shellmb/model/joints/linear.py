"""Linear constraints on coordinates of a mechanism: the pitch of a screw, and locks."""

from collections.abc import Sequence

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space, set_constants
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.joints.coordinates import (
    Coordinate,
    CoordinateGroup,
    as_row,
    gathered,
    scalar_links,
)


class TiedCoordinates(ConstraintGroup):
    """Pairs of coordinates in proportion, `x2 = ratio x1`: the pitch of a screw.

    Args:
        comm: Communicator.
        labels: A name for each.
        pairs: The coordinates `x1, x2`.
        ratios: Their ratios.
        force: Size of forces, N.
        length: Size of the scene, m.
        switched: Whether some may be switched off.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        labels: Sequence[str],
        pairs: Sequence[tuple[Coordinate, Coordinate]],
        ratios: Sequence[float],
        force: float,
        length: float,
        switched: bool,
    ) -> None:
        self.pairs, self._ratios = list(pairs), np.array(ratios, dtype=float)
        nodes = node_mesh(comm, len(pairs))
        mixed = node_space(nodes, {"x1": 1, "x2": 1, "mu": 1})
        layout = Layout(mixed.parts)
        ratio = constant_vector(nodes, np.array(ratios, dtype=float)[:, None], "ratio")

        def violation(q: Expr) -> Expr:
            return as_row(layout.part(q, "x2") - ratio * layout.part(q, "x1"))

        links = [
            *scalar_links(nodes, mixed, "x1", [a for a, _ in pairs]),
            *scalar_links(nodes, mixed, "x2", [b for _, b in pairs]),
        ]
        super().__init__(
            "screw pitches", nodes, mixed, tuple(links), violation, force, length, switched
        )
        self.labels = list(labels)

    def shares(self, held: fem.Function, group: CoordinateGroup) -> Floats:
        """Multipliers of coordinates on which nothing acts but what ties them; collective.

        Args:
            held: Function that holds the ties' own multipliers.
            group: The coordinates.

        Returns:
            One for each coordinate of the group, shape (items,).
        """
        mu = gathered(self.nodes, held.x.array[self.mixed.dofs["mu"]]) * float(self.force.value)
        found = np.zeros(group.items)
        for pair, ratio, force in zip(self.pairs, self._ratios, mu, strict=True):
            for coordinate, weight in zip(pair, (ratio, -1.0), strict=True):
                if coordinate.group is group:
                    found[coordinate.item] = weight * force / float(group.force.value)
        return found


class HeldCoordinates(ConstraintGroup):
    """Coordinates fixed at a value, `x = x_held`, switched on at times: locks.

    Args:
        comm: Communicator.
        kind: Kind of the coordinates.
        labels: A name for each.
        coordinates: The coordinates.
        force: Size of forces, N, or moments, N m.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        kind: str,
        labels: Sequence[str],
        coordinates: Sequence[Coordinate],
        force: float,
    ) -> None:
        nodes = node_mesh(comm, len(coordinates))
        mixed = node_space(nodes, {"x": 1, "mu": 1})
        layout = Layout(mixed.parts)
        self._held = constant_vector(nodes, np.zeros((len(coordinates), 1)), "held")

        def violation(q: Expr) -> Expr:
            return as_row(layout.part(q, "x") - self._held)

        links = tuple(scalar_links(nodes, mixed, "x", coordinates))
        size = coordinates[0].size
        super().__init__(f"{kind} locks", nodes, mixed, links, violation, force, size, True)
        self.labels = list(labels)
        self.coordinates = list(coordinates)

    def values(self, q: fem.Function) -> Floats:
        """Coordinates at a state, shape (items,), the same on all ranks; collective."""
        return gathered(self.nodes, q.x.array[self.mixed.dofs["x"]])

    def hold(self, values: Floats) -> None:
        """Set the values at which the coordinates are fixed, shape (items,)."""
        set_constants(self._held, self.nodes, values[:, None])

    def forces(self, q: fem.Function) -> Floats:
        """Forces [N] or moments [N m] that hold the coordinates, shape (items,); collective."""
        mu = gathered(self.nodes, q.x.array[self.mixed.dofs["mu"]])
        return -float(self.force.value) * mu
