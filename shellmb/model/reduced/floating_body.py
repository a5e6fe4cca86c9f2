"""A body in modes: its amplitudes, what holds points and frames where these are, and its loads.

Distributed loads on a body in modes.

Forces that keep their directions do their work on a mean of the body's points,

    sum_I f_I . x_I = f . (W x0 + z),       z = d_a (A_a + Q_ka eta_k),

with their sum `f W` and first moments `f A`. So they are a force on the frame and one at `z`, which
holds as constraints `d_a . z = A_a + Q_ka eta_k` like the points of `modal`: linear in unknowns,
and so their work is exact in every scheme. Where a load has several directions there are several
such points, one for each.

Forces that turn with the body, and moments, are a force `P_a` and a moment `T_a` along the frame's
axes and forces `F_k` on the amplitudes, linear in these.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.floating import modal as forms
from shellmb.forms.frame import Vectors, vectors
from shellmb.forms.loads import dead_force
from shellmb.forms.measure import linear
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import Stiffness
from shellmb.meshes.nodes import NodeMesh, constant_vector
from shellmb.model.body import Elastic, LoadFactors, PartScale
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.locations.ends import End
from shellmb.model.massless import NONE, NodeGroup, Scale, Targets, node_loads
from shellmb.model.reduced.data import ModalBody, amplitudes
from shellmb.model.sections.branches import StrainDamping
from shellmb.model.sections.strains import SeparateRows, Strains

# couplings of modes below this share of what they have by themselves are round-off: with one time
# for all strains there are none
NOTHING = 1e-9


def modal_damping(layout: Layout, nodes: NodeMesh, matrix: Floats | None) -> StrainDamping | None:
    """Damping of the strains of a body in modes; None without any.

    Args:
        layout: Parts of the state, with the amplitudes.
        nodes: Node mesh of the amplitudes.
        matrix: Damping of the modes, shape (K, K), N s/m; None without any.
    """
    if matrix is None:
        return None
    own = np.sqrt(np.outer(matrix.diagonal(), matrix.diagonal()))
    pairs = [tuple(pair) for pair in np.argwhere(np.abs(matrix) > NOTHING * own)]
    values = constant_vector(nodes, np.array([[matrix[pair] for pair in pairs]]), "damping")
    numbers = [values] if len(pairs) == 1 else [values[k] for k in range(len(pairs))]
    D: list[list[Any]] = [[0] * len(matrix) for _ in matrix]
    for (i, k), number in zip(pairs, numbers, strict=True):
        D[i][k] = number
    strain = linear(lambda q: ufl.as_vector(amplitudes(layout, q)))
    dx = ufl.dx(nodes.mesh)
    section = Stiffness(ufl.as_matrix(D))
    return StrainDamping([Strains(section, layout, strain, lambda d: d[0] * dx)])


ADVICE = "a smaller step, or fewer modes"


class Modes(NodeGroup):
    """Amplitudes of a body's modes, with their stiffness; their inertia is in `InertiaPoints`.

    Args:
        comm: Communicator.
        data: The body.
        frame: Its floating frame as a place.
    """

    def __init__(self, comm: MPI.Comm, data: ModalBody, frame: End) -> None:
        self.comm, self.data, self.frame, name = comm, data, frame, f"modes of {data.name}"
        title = PartScale("eta", f"modes of '{data.name}'", data.length, ADVICE)
        super().__init__(name, comm, 1, own={"eta": data.count}, parts=(title,))
        self.kinematic = self.jump_parts = frozenset({"eta"})
        self._k = self.per_item(data.stiffness[None], "stiffness")
        self.damping = modal_damping(self.layout, self.nodes, data.damping)

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """Their stiffness."""
        n, k = self.data.count, self._k
        numbers = [k] if n == 1 else [k[i] for i in range(n)]
        C = ufl.as_matrix([[k if i == j else 0 for j in range(n)] for i, k in enumerate(numbers)])
        strain = linear(lambda q: ufl.as_vector(amplitudes(self.layout, q)))
        return (SeparateRows(Stiffness(C), self.layout, strain, lambda d: d[0] * self.dx),)

    def shared(
        self, count: int, parts: Sequence[str], others: Sequence[End] = ()
    ) -> Mapping[str, Targets]:
        """Unknowns of the body, and of places connected to it, that a group has.

        Args:
            count: Number of items of the group.
            parts: What it has besides the amplitudes "eta": perhaps "u1" and "w1" of the floating
                frame, and "u2" and "w2" of other places.
            others: The other places, one for each item.
        """
        found = {"eta": ([self.name] * count, np.tile(self.numbers("eta"), (count, 1)))}
        for part in parts:
            ends = others if part[1] == "2" else [self.frame] * count
            found[part] = [end.body for end in ends], np.array([end.dofs[part[0]] for end in ends])
        return found


class OnFrame(ConstraintGroup):
    """Constraints with the floating frame and the amplitudes of one body.

    Args:
        title: What its name begins with.
        body: The body.
        shared: What it has of frame and other places, as of `Modes.shared`.
        count: Number of constraints of each item.
        table: Coefficients, one row for each item.
        scale: Communicator and sizes.
        own: Sizes of the parts that are its own, by name.
        others: Places whose nodal unknowns are parts "u2" and "w2", one for each item.
    """

    _violation: Callable[[Expr], Expr]

    def __init__(
        self,
        title: str,
        body: Modes,
        shared: Sequence[str],
        count: int,
        table: Floats,
        scale: Scale,
        own: Mapping[str, int] = NONE,
        others: Sequence[End] = (),
    ) -> None:
        self.data, items = body.data, len(table)
        super().__init__(
            f"{title} of {body.data.name}",
            body.comm,
            items,
            count,
            self._violation,
            *scale.of(count, self.directions),
            targets=body.shared(items, shared, others),
            own=own,
        )
        self.table = self.per_item(table, "coefficients")

    def _directors(self, q: Expr, tag: str = "1") -> Vectors:
        """Changes of the directors of a frame."""
        return vectors(self.layout.part(q, f"w{tag}"))


class OnArms(OnFrame):
    """Ends of arms from the frame, at places that modes and frame tell, that forces act on.

    Arguments as of `OnFrame`.

    Attributes:
        arms: The arms at rest, shape (count, 3), m.
    """

    arms: Floats

    def __init__(
        self, title: str, body: Modes, shared: Sequence[str], table: Floats, scale: Scale
    ) -> None:
        super().__init__(title, body, shared, 3, table, scale, own={"u": 3})
        self.mixed = replace(self.mixed, elementwise=frozenset({"u", "mu"}))
        self.jump_parts = frozenset({"u", "mu"})
        size = PartScale("u", f"{title} of '{body.data.name}'", body.data.length, ADVICE)
        self.parts = (size, *self.parts)


class InertiaPoints(OnArms):
    """Points with mass at places that modes and frame tell: the inertia of the modes."""

    def __init__(self, body: Modes, scale: Scale) -> None:
        data = body.data
        table = np.concatenate(
            [data.points.reshape(len(data.mass), -1), data.mass[:, None], data.coupling], axis=1
        )
        self.arms = np.zeros((len(table), 3))
        super().__init__("inertia", body, ["w1"], table, scale)
        # the directors are those of the frame, and their rates count here, too
        self.kinematic = frozenset({"u", "w1"})
        self.slowing = self.constant(data.slowing) if data.slowing else None

    def _violation(self, q: Expr) -> Expr:
        parts = forms.components(self.table, 0, amplitudes(self.layout, q))
        return forms.seen_apart(self.layout.part(q, "u"), parts, self._directors(q))

    def _momenta(self, v: Expr) -> tuple[Expr, Vectors]:
        first = 3 * self.data.count
        m, *c = (self.table[first + k] for k in range(4))
        z, w = self.layout.part(v, "u"), self._directors(v)
        return forms.coupled_momentum(m, (c[0], c[1], c[2]), z, w)

    def follow(self, q: Floats) -> None:
        """Find the places of the points from modes and frame, whose values a local state has.

        Args:
            q: The state, which is changed.
        """
        dofs = self.mixed.dofs
        d = np.eye(3) + q[dofs["w1"]].reshape(-1, 3, 3)
        points = self.data.points[self.nodes.item].reshape(len(d), 3, -1)
        along = np.einsum("rak,rk->ra", points, q[dofs["eta"]].reshape(len(d), -1))
        q[dofs["u"]] = np.einsum("ra,raj->rj", along, d).reshape(dofs["u"].shape)

    def inertia(self, rate: Expr, dq: Expr) -> Form:
        """Virtual work of the inertia forces."""
        h, g = self._momenta(rate)
        work = ufl.dot(h, self.layout.part(dq, "u"))
        work += sum(ufl.dot(a, b) for a, b in zip(g, self._directors(dq), strict=True))
        return work * self.dx

    def momentum(self, v: Expr, axis: Expr) -> Form | None:
        """None: the modes have none."""
        return None

    def angular_momentum(self, q: Expr, v: Expr, axis: Expr) -> Form:
        """Component along `axis` of the angular momentum about the origin, kg m^2/s."""
        h, g = self._momenta(v)
        d = forms.unit_vectors(self._directors(q))
        total = ufl.cross(self.layout.part(q, "u"), h)
        total += sum((ufl.cross(a, b) for a, b in zip(d, g, strict=True)), start=0 * total)
        return ufl.dot(total, axis) * self.dx


class Interfaces(OnFrame):
    """Frames at which something is attached to a reduced body: where its modes have them."""

    directions = (3, 4, 5)

    def __init__(self, body: Modes, others: Sequence[End], scale: Scale) -> None:
        rows = []
        for end, item in zip(others, body.data.interfaces, strict=True):
            turned = [item.shift.ravel(), item.turn.ravel(), end.node - body.frame.node]
            rows.append(np.concatenate([*turned, end.directors.ravel()]))
        shared = "u1", "w1", "u2", "w2"
        super().__init__("interfaces", body, shared, 6, np.array(rows), scale, others=others)
        self.labels = [item.name for item in body.data.interfaces]

    def _violation(self, q: Expr) -> Expr:
        table, K = self.table, self.data.count
        first = 6 * K
        eta, w, own = amplitudes(self.layout, q), self._directors(q), self._directors(q, "2")
        shift, turn = (forms.components(table, k, eta) for k in (0, 3 * K))
        arm = (table[first], table[first + 1], table[first + 2])
        # the interface's directors may be others than the scene's axes, of which these are changes
        D = [[table[first + 3 + 3 * k + i] for i in range(3)] for k in range(3)]
        v = [sum((D[k][i] * own[k] for k in (1, 2)), D[0][i] * own[0]) for i in range(3)]
        gap = self.layout.part(q, "u2") - self.layout.part(q, "u1")
        apart = forms.held_apart(gap, arm, shift, w)
        turned = forms.turned_apart(turn, w, (v[0], v[1], v[2]))
        return ufl.as_vector([*(apart[i] for i in range(3)), *(turned[i] for i in range(3))])


class LoadPoints(OnArms):
    """Points that loads which keep their directions act on."""

    def __init__(self, body: Modes, scale: Scale) -> None:
        self._data = body.data.points_loaded
        self.arms = np.array([item.arm for item in self._data])
        rows = np.array([[*p.shape.ravel(), *p.arm, p.share] for p in self._data])
        super().__init__("loads", body, ["u1", "w1"], rows, scale)
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
        return node_loads(self.nodes, values, [item.time for item in self._data], self._work)


class FrameLoads(NodeGroup):
    """Loads that turn with a body in modes, and moments.

    Args:
        body: The body.
    """

    def __init__(self, body: Modes) -> None:
        data = body.data
        self._data = data.follower_loads
        count = len(self._data)
        targets = body.shared(count, ("u1", "w1"))
        super().__init__(f"turning loads of {data.name}", body.comm, count, targets)
        tables = np.array([item.table.ravel() for item in self._data])
        self._table, self._columns = self.per_item(tables, "forces"), 1 + data.count

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
        # of what turns with the body the force itself, of moments their products
        one = np.eye(10)[0]
        values = [one if p.along is None else np.append(0.0, p.along) for p in self._data]
        times = [item.time for item in self._data]
        return node_loads(self.nodes, np.array(values), times, self._work)
