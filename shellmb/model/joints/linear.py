"""Linear constraints on coordinates of a mechanism: pitches of screws, couplings, and locks."""

from collections.abc import Sequence

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space, set_constants
from shellmb.model.joints.constraints import ConstraintGroup, GivenValues, Prescribed
from shellmb.model.joints.coordinates import (
    Coordinate,
    CoordinateGroup,
    as_row,
    gathered,
    scalar_links,
)


class TiedCoordinates(ConstraintGroup):
    """Sums of factors times coordinates that vanish, or have a given value: screws, couplings.

    Args:
        comm: Communicator.
        title: Name of the group.
        labels: A name for each.
        members: The coordinates of each, as many.
        factors: Their factors, and behind them those of the given values, shape (items, n).
        given: The given values of each: none, or one.
        force: Size of forces, N, or of couples, N m.
        size: What violations are relative to.
        switched: Whether some may be switched off.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        title: str,
        labels: Sequence[str],
        members: Sequence[Sequence[Coordinate]],
        factors: Floats,
        given: Sequence[Prescribed],
        force: float,
        size: float,
        switched: bool,
    ) -> None:
        self.members, self._factors = [list(each) for each in members], factors
        nodes, count = node_mesh(comm, len(members)), len(members[0])
        values, parts = GivenValues(nodes, given), [f"x{k + 1}" for k in range(count)]
        mixed = node_space(nodes, {**dict.fromkeys(parts, 1), **values.parts, "mu": 1})
        layout = Layout(mixed.parts)
        factor = constant_vector(nodes, factors, "factors")

        def violation(q: Expr) -> Expr:
            terms = [*(layout.part(q, part) for part in parts), *values.values(q, layout)]
            weighed = [factor[k] * term for k, term in enumerate(terms)]
            return as_row(sum(weighed[1:], weighed[0]))

        links = [
            link
            for k, part in enumerate(parts)
            for link in scalar_links(nodes, mixed, part, [each[k] for each in members])
        ]
        super().__init__(title, nodes, mixed, tuple(links), violation, force, size, switched)
        self.labels = list(labels)
        values.prescribe(self)

    def shares(self, held: fem.Function, group: CoordinateGroup) -> Floats:
        """Multipliers of coordinates on which nothing acts but what ties them; collective.

        Args:
            held: Function that holds the ties' own multipliers.
            group: The coordinates.

        Returns:
            One for each coordinate of the group, shape (items,).
        """
        found = np.zeros(group.items)
        for each, forces in zip(self.members, self.forces(held), strict=True):
            for coordinate, force in zip(each, forces, strict=True):
                if coordinate.group is group:
                    found[coordinate.item] = force / float(group.force.value)
        return found

    def forces(self, held: fem.Function) -> Floats:
        """Forces [N] or torques [N m] on the coordinates of each, shape (items, n); collective.

        Args:
            held: As of `shares`.
        """
        mu = gathered(self.nodes, held.x.array[self.mixed.dofs["mu"]]) * float(self.force.value)
        return -self._factors[:, : len(self.members[0])] * mu[:, None]


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
