"""Distributed loads on a body in modes.

Forces that keep their directions do their work on a mean of the body's points,

    sum_I f_I . x_I = f . (W x0 + z),       z = d_a (A_a + Q_ka eta_k),

with their sum `f W` and first moments `f A`. So they are a force on the frame and one at `z`, which
holds as constraints `d_a . z = A_a + Q_ka eta_k` like the points of `modal`: linear in unknowns,
and so their work is exact in every scheme. Where a load has several directions there are several
such points, one for each.

Forces that turn with the body, and moments, are a force `P_a` and a moment `T_a` along the frame's
axes and forces `F_k` on the amplitudes, linear in these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.floating import modal as forms
from shellmb.forms.frame import vectors
from shellmb.forms.loads import dead_force
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import NodeMesh, constant_vector, node_mesh, node_space, set_constants
from shellmb.model.body import LoadFactors, TimeFunction
from shellmb.model.massless import Massless
from shellmb.model.reduced.data import amplitudes
from shellmb.model.reduced.floating_body import OnArms, Reduced, frame_links


class Factors:
    """Loads at a node each with the time factors of one stage.

    Args:
        nodes: Their node mesh.
        values: The loads, shape (n, size).
        times: Their functions of time.
        work: Virtual work of loads at a configuration in a direction.
    """

    def __init__(
        self,
        nodes: NodeMesh,
        values: Floats,
        times: Sequence[TimeFunction | None],
        work: Callable[[Expr, Expr, Expr], Expr],
    ) -> None:
        self._nodes, self._values, self._times, self._work = nodes, values, times, work
        self._loads = constant_vector(nodes, 0 * values, "loads")

    def update(self, average: Callable[[TimeFunction | None], float]) -> None:
        """Set the loads from their time functions."""
        factors = np.array([average(time) for time in self._times])
        set_constants(self._loads, self._nodes, factors[:, None] * self._values)

    def virtual_work(self, mid: Expr, dq: Expr) -> Form | None:
        """Virtual work of the loads at the configuration `mid`."""
        return self._work(self._loads, mid, dq) * ufl.dx(self._nodes.mesh)


class LoadPoints(OnArms):
    """Points that loads which keep their directions act on."""

    def __init__(self, body: Reduced, force: float, length: float) -> None:
        self._data = body.data.points_loaded
        self.arms = np.array([item.arm for item in self._data])
        rows = np.array([[*p.shape.ravel(), *p.arm, p.share] for p in self._data])
        super().__init__("loads", body, {"u1": 3, "w1": 9}, rows, force, length)
        self.kinematic = frozenset({"u"})

    def _violation(self, q: Expr) -> Expr:
        shape = forms.components(self.table, 0, amplitudes(self.layout, q))
        first = 3 * self.data.count
        arm = self.table[first], self.table[first + 1], self.table[first + 2]
        return forms.held_apart(self.layout.part(q, "u"), arm, shape, self._directors(q))

    def _work(self, force: Expr, mid: Expr, dq: Expr) -> Expr:
        share = self.table[3 * self.data.count + 3]
        return dead_force(force, share * self.layout.part(dq, "u1") + self.layout.part(dq, "u"))

    def loads(self) -> LoadFactors:
        """The loads with factors of their own."""
        values = np.array([item.force for item in self._data])
        return Factors(self.nodes, values, [item.time for item in self._data], self._work)


class FrameLoads(Massless):
    """Loads that turn with a body in modes, and moments.

    Args:
        body: The body.
    """

    def __init__(self, body: Reduced) -> None:
        data = body.data
        self._data = data.follower_loads
        self._nodes = node_mesh(body.comm, len(self._data))
        mixed = node_space(self._nodes, {"eta": data.count, "u1": 3, "w1": 9})
        links = frame_links(self._nodes, mixed, body)
        super().__init__(f"turning loads of {data.name}", mixed, (), links)
        self.layout = Layout(mixed.parts)
        tables = np.array([item.table.ravel() for item in self._data])
        self._table, self._columns = constant_vector(self._nodes, tables, "forces"), 1 + data.count

    def _work(self, factor: Expr, mid: Expr, dq: Expr) -> Expr:
        layout, test = self.layout, amplitudes(self.layout, dq)
        du, dw = layout.part(dq, "u1"), layout.part(dq, "w1")
        d = forms.unit_vectors(vectors(layout.part(mid, "w1")))
        # of a moment the component along one axis
        products = [factor[1 + 3 * a + i] * d[a][i] for a in range(3) for i in range(3)]
        one_and_eta = [1, *amplitudes(layout, mid)]
        rows = [
            sum(self._table[self._columns * row + k] * eta for k, eta in enumerate(one_and_eta))
            for row in range(6 + len(test))
        ]
        work = forms.frame_work(rows[:3], rows[3:6], d, du, dw)
        work += sum(f * t for f, t in zip(rows[6:], test, strict=True))
        return sum(products, factor[0]) * work

    def loads(self) -> LoadFactors:
        """The loads with factors of their own."""
        values = [np.append(1.0 if p.along is None else 0.0, _or_zero(p.along)) for p in self._data]
        times = [item.time for item in self._data]
        return Factors(self._nodes, np.array(values), times, self._work)


def _or_zero(along: Floats | None) -> Floats:
    return np.zeros(9) if along is None else along
