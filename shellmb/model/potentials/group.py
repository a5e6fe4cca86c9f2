"""A potential of the place of a body at some of its points, as a body of the system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.constraints.joints import Place
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import variation
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space
from shellmb.model.body import Elastic
from shellmb.model.locations.ends import End, EndGroup
from shellmb.model.massless import Massless
from shellmb.model.potentials.exact import ExactEnergy
from shellmb.model.potentials.points import Points


class PotentialGroup(Massless):
    """Base of potentials and contacts: an energy at points of a body.

    Points are nodes: their places are unknowns of the body itself, so that one form at single
    nodes serves shells, beams and rigid bodies alike, and what is seen of a contact, the places of
    nodes, is what is acted on. Energies are of measures that are at most quadratic in the state,
    so that forces over a step are exact (`forms.steps.potentials`).

    Args:
        item: What the scene has, with a name.
        comm: Communicator.
        points: The points.
        turns: Whether the directors matter.
        length: Size of the scene, m.
        carrier: A rigid body that the energy is fixed to: the body's place, a point (3,) and axes
            as rows (3, 3) that move with it; None: it is fixed in space.

    Attributes:
        seen: That point with the axes at each node; None: there is none.
        resists: Whether it has friction or damping, which the account books as its loss.
    """

    resists = False

    def __init__(
        self,
        item: Any,
        comm: MPI.Comm,
        points: Points,
        turns: bool,
        length: float,
        carrier: tuple[End, Floats, Floats] | None = None,
    ) -> None:
        self.item, self.points, self.length = item, points, length
        count = len(points.ends)
        self.nodes = node_mesh(comm, count)
        self._end = points.bound(self.nodes, turns)
        parts, self.seen = dict(self._end.parts), None
        if carrier is not None:
            body, point, axes = carrier
            places = [replace(body, point=point)] * count
            self.seen = EndGroup(self.nodes, places, np.tile(axes, (count, 1, 1)), "2", True)
            parts |= self.seen.parts
        mixed = node_space(self.nodes, parts)
        links = self._end.links(mixed) + ([] if self.seen is None else self.seen.links(mixed))
        super().__init__(f"{item.label} '{item.name}'", mixed, (), tuple(links))
        self.layout = Layout(mixed.parts)
        self.weight: Expr = self.data(points.weights[:, None], "weight")
        # of what is a load, the factor that the energy has now
        self.factor: fem.Constant | None = None
        self.dx = ufl.dx(self.nodes.mesh)
        # not zero where the pattern of matrices is looked for: what acts at times only must not be
        # missing there
        self.always = self.constant(0.0)

    @property
    def holds(self) -> bool:
        """Decide whether a potential may hold a body alone: contacts open, and so do not."""
        return not hasattr(self.item, "preloaded") or bool(self.item.preloaded)

    @property
    def owner(self) -> str:
        """Name of the body that it acts on."""
        return self.points.ends[0].owner

    @property
    def owners(self) -> set[str]:
        """Names of all bodies that it acts on."""
        return {self.owner} | (set() if self.seen is None else {self.seen.ends[0].owner})

    def data(self, rows: Floats, name: str) -> fem.Function:
        """A function with values of its own at each point, shape (n, size)."""
        return constant_vector(self.nodes, rows, name)

    def constant(self, value: float | Floats) -> fem.Constant:
        """A Constant on its mesh."""
        return fem.Constant(self.nodes.mesh, np.asarray(value, dtype=float))

    def place(self, q: Expr) -> Place:
        """The points and their directors at a state."""
        return self._end.place(q, self.layout)

    def moved(self, at: Expr, v: Expr) -> Place:
        """Motion of points and directors by a rate or variation of the state."""
        return self.changed(self.place, at, v)

    @staticmethod
    def changed(place: Callable[[Expr], Place], at: Expr, v: Expr) -> Place:
        """Motion of a place by a rate or variation of the state."""
        count = len(place(at).e)
        return Place(
            variation(lambda q: place(q).x, at, v),
            tuple(variation(lambda q, k=k: place(q).e[k], at, v) for k in range(count)),  # type: ignore[misc]
        )

    def measure(self, q: Expr) -> Expr:
        """Measures of order one that the energy is a function of, shape (n,); quadratic at most."""
        raise NotImplementedError

    def potential(self, e: Expr) -> Expr:
        """Energy for a weight of one."""
        raise NotImplementedError

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """The energy."""
        return (ExactEnergy(self.measure, self.potential, self.weight, self.dx),)

    def positions(self, q: Floats) -> Floats:
        """Positions of the local points (owned and ghost) at a state's array, shape (n, 3), m."""
        return self._end.positions(q, self.mixed)

    def everywhere(self, rows: Floats) -> Floats:
        """Values of all points from those of the local ones, on every rank; collective."""
        comm = self.nodes.mesh.comm
        if comm.size == 1:
            return rows[np.argsort(self.nodes.item)]
        found = np.zeros((len(self.points.ends), rows.shape[1]))
        for items, values in comm.allgather((self.nodes.item, rows)):
            found[items] = values
        return found

    def seen_positions(self, q: Floats) -> Floats:
        """Positions of the local points as the carrier sees them, in the reference, (n, 3), m."""
        x = self.positions(q)
        if self.seen is None:
            return x
        r = x - self.seen.positions(q, self.mixed)
        back = np.einsum("nji,nj->ni", self.seen.rotations(q, self.mixed), r)
        return np.asarray(self.seen.ends[0].point + back)
