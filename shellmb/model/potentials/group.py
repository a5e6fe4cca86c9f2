"""A potential of the place of a body at some of its points, as a body of the system."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.constraints.elements import Stretch
from shellmb.forms.constraints.joints import Place
from shellmb.forms.state import Layout
from shellmb.forms.steps import potentials as forms
from shellmb.forms.steps.discrete import gradient, variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Measure, Step, measure
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space
from shellmb.model.body import Massless, Rates, Term
from shellmb.model.places.ends import EndGroup
from shellmb.model.potentials.points import Points

Floats = npt.NDArray[np.float64]


class PotentialGroup(Massless):
    """What has an energy at points of a body; potentials and contacts derive from it.

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
    """

    def __init__(
        self, item: Any, comm: MPI.Comm, points: Points, turns: bool, length: float
    ) -> None:
        self.item, self.points, self.length = item, points, length
        ends = points.ends
        self.nodes = node_mesh(comm, len(ends))
        axes = np.array([end.directors if end.framed else np.eye(3) for end in ends])
        arms = any(np.any(end.offset != 0) for end in ends)
        self._end = EndGroup(self.nodes, ends, axes, "1", turns or arms)
        mixed = node_space(self.nodes, self._end.parts)
        super().__init__(f"{item.label} '{item.name}'", mixed, (), tuple(self._end.links(mixed)))
        self.layout = Layout(mixed.parts)
        self.weight = self.data(points.weights[:, None], "weight")
        self.dx = ufl.dx(self.nodes.mesh)
        # zero, and not zero where the pattern of matrices is looked for: there nothing that acts
        # at times only may be missing
        self.always = self.constant(0.0)

    @property
    def owner(self) -> str:
        """Name of the body that it acts on."""
        return self.points.ends[0].owner

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
        """How points and directors move with a rate or variation of the state."""
        count = len(self.place(at).e)
        return Place(
            variation(lambda q: self.place(q).x, at, v),
            tuple(variation(lambda q, k=k: self.place(q).e[k], at, v) for k in range(count)),  # type: ignore[misc]
        )

    def measure(self, q: Expr) -> Expr:
        """Measures of order one that the energy is a function of, shape (n,); quadratic at most."""
        raise NotImplementedError

    def potential(self, e: Expr) -> Expr:
        """Energy per area or length, or at a point."""
        raise NotImplementedError

    def internal(self, span: Interval, dq: Expr) -> Form:
        """Virtual work over a sub-interval."""
        a, b = self.measure(span.a), self.measure(span.b)
        if span.a is span.b:
            stress = gradient(self.potential, a)
        else:
            stress = forms.interval_stress(self.potential, a, b, span.beta)
        return self.weight * ufl.dot(stress, variation(self.measure, span.mid, dq)) * self.dx

    def _along(self, step: Step) -> tuple[Measure, Stretch]:
        """The measure, and what it is over a step."""
        path, measured = step.path, measure(self.measure)
        start = self.measure(path.start)
        return measured, Stretch(start, self.measure(path.end) - start, step.bow_of(measured))

    def along(self, step: Step, k: int, dq: Expr, trial: Expr) -> tuple[Form | None, list[Term]]:
        """Virtual work over a step, with stresses linear in time, eq. (Q2)."""
        (measured, e), p = self._along(step), step.path
        stresses = forms.path_stresses(self.potential, e, p.alpha)
        states = p.mean, p.chord, p.bow, p.swing
        work = sum(
            ufl.dot(stress, measured.at(pair.slope, states, dq))
            for stress, pair in zip(stresses, step.pairs[k], strict=True)
        )
        return self.weight * work * self.dx, []

    def lost(self, step: Step, bow: Expr) -> Form | None:
        """Energy of the bow of the measures, J."""
        _, e = self._along(step)
        return self.weight * forms.path_loss(self.potential, e) * self.dx

    def strain_energy(self, q: Expr) -> Form:
        """Its energy, J."""
        return self.weight * self.potential(self.measure(q)) * self.dx

    def jump(self, a: Expr, b: Expr) -> Form | None:
        """Elastic part of eq. (34), J."""
        found = forms.interval_jump(self.potential, self.measure(a), self.measure(b))
        return self.weight * found * self.dx

    def extra(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Nothing that dissipates."""
        return None

    def positions(self, q: Floats) -> Floats:
        """Positions of the local points (owned and ghost) at a state's array, shape (n, 3), m."""
        items = self.nodes.item
        ends = self.points.ends
        x = np.array([ends[k].point for k in items]).reshape(-1, 3)
        x += q[self.mixed.dofs["u1"]].reshape(-1, 3)
        if "w1" in self.mixed.dofs:
            w = q[self.mixed.dofs["w1"]].reshape(len(items), -1, 3)
            x += np.einsum("nk,nki->ni", np.array([ends[k].offset for k in items]), w)
        return x
