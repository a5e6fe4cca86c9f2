"""Constraints at nodes, a group per kind: what joints, kinks and planes have in common."""

from collections.abc import Callable, Collection
from functools import cached_property

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.build.nodes import NodeMesh, constant_vector, set_constants
from shellmb.build.spaces import MixedSpace
from shellmb.forms.discrete import variation
from shellmb.forms.mixed import Interval
from shellmb.forms.state import Layout
from shellmb.kernels import compiled_expression
from shellmb.model.body import Massless, NodeLink, PartScale

Floats = npt.NDArray[np.float64]

# a multiplier below this part of the group's force counts as zero
SMALL_FORCE = 1e-3


class ConstraintGroup(Massless):
    """Constraints of one kind at nodes or pairs of nodes, with a multiplier for each.

    Args:
        name: Name of the group.
        nodes: Its node mesh, one cell per item.
        mixed: Space with a part "mu" for the multipliers.
        links: Links of the nodal unknowns.
        violation: The constraints as a function of the state, all at most quadratic, shape (n,).
        force: Size of the multipliers' forces, N.
        length: Size of the scene, m, that makes violations of positions relative.
        switched: Whether single constraints may be switched off.

    Attributes:
        labels: Name of each item, for messages and results.
        allowed: Constraints that may act at all, shape (items, count): not the redundant ones.
    """

    def __init__(
        self,
        name: str,
        nodes: NodeMesh,
        mixed: MixedSpace,
        links: tuple[NodeLink, ...],
        violation: Callable[[Expr], Expr],
        force: float,
        length: float = 1.0,
        switched: bool = False,
    ) -> None:
        title = PartScale("mu", f"multiplier of {name}", SMALL_FORCE, "a smaller step")
        super().__init__(name, mixed, (title,), links)
        self.jump_parts = frozenset({"mu"})
        self.nodes, self.layout = nodes, Layout(mixed.parts)
        self.violation = violation
        self.count = mixed.parts["mu"][1]
        self.length = length
        self._force = fem.Constant(nodes.mesh, float(force))
        self.labels = [name] * self.items
        self.allowed = np.ones((self.items, self.count), dtype=bool)
        self.on: fem.Function | None = None
        if switched:
            self.on = constant_vector(nodes, np.ones((self.items, self.count)), "on")

    @property
    def items(self) -> int:
        """Number of joints in the group, over all ranks."""
        return int(self.nodes.mesh.topology.index_map(1).size_global)

    def switch(self, on: npt.NDArray[np.bool_]) -> None:
        """Switch single constraints on and off, shape (items, count)."""
        assert self.on is not None
        set_constants(self.on, self.nodes, (on & self.allowed).astype(float))

    def drop(self, dropped: Collection[tuple[str, int]]) -> None:
        """Leave redundant constraints out for good; a group that has some must be `switched`.

        Args:
            dropped: Labels, and which of the constraints of each; those of other groups, too.
        """
        for label, component in dropped:
            if label in self.labels:
                self.allowed[self.labels.index(label), component] = False
        if self.on is not None:
            self.switch(np.ones_like(self.allowed))

    def _part(self, q: Expr, name: str) -> list[Expr]:
        value = self.layout.part(q, name)
        return [value] if self.count == 1 else [value[k] for k in range(self.count)]

    def _sum(self, multiplier: Expr, rows: Expr, test: Expr, work: Expr) -> Form:
        """`mu . work + dmu . rows`, each with its switch."""
        mu, dmu = self._part(multiplier, "mu"), self._part(test, "mu")
        total = 0.0 * mu[0]
        for k in range(self.count):
            if self.on is None:
                total = total + mu[k] * work[k] + dmu[k] * rows[k]
            else:
                on = self.on if self.count == 1 else self.on[k]
                total = total + on * (mu[k] * work[k] + dmu[k] * rows[k])
                total = total + (1 - on) * dmu[k] * mu[k]
        return self._force * total * ufl.dx

    def internal(self, span: Interval, dq: Expr) -> Form:
        """Constraints at the end of the sub-interval, forces along the mid-point gradient."""
        work = variation(self.violation, span.mid, dq)
        return self._sum(span.unknown, self.violation(span.at), dq, work)

    def velocity_constraint(self, v: Expr, mid: Expr, dv: Expr) -> Form:
        """Velocities do not violate the constraints, with the impulses for that."""
        work = variation(self.violation, mid, dv)
        return self._sum(v, variation(self.violation, mid, v), dv, work)

    @cached_property
    def _evaluation(self) -> tuple[fem.Function, fem.Expression, fem.Function]:
        """A state, the violations there as an expression, and a function for their values."""
        state = fem.Function(self.mixed.space)
        shape = (self.count,)
        values = fem.Function(fem.functionspace(self.nodes.mesh, ("DG", 0, shape)))
        points = values.function_space.element.interpolation_points
        expression = compiled_expression(self.violation(state), points)
        return state, expression, values

    def all_violations(self, q: fem.Function) -> Floats:
        """Values of the constraints of the local items, also of those that are off.

        Args:
            q: The state.

        Returns:
            One row per local item, shape (local items, count).
        """
        state, expression, values = self._evaluation
        state.x.array[:] = q.x.array
        values.interpolate(expression)
        rows = values.function_space.dofmap.list[:, 0]
        return np.asarray(values.x.array.reshape(-1, self.count)[rows])

    def violations(self, q: fem.Function) -> Floats:
        """Those of the local items, zero where switched off, shape (local items, count)."""
        found = self.all_violations(q)
        if self.on is not None:
            rows = self.on.function_space.dofmap.list[:, 0]
            found = found * self.on.x.array.reshape(-1, self.count)[rows]
        return found

    def constraint_error(self, q: fem.Function) -> float:
        """Largest violation on this rank, relative to the scene's length."""
        return float(np.max(np.abs(self.violations(q)), initial=0.0)) / self.length
