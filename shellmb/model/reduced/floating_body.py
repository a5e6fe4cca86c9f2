"""Constraints that hold points and frames where the modes of a body place them (`data`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.floating import modal as forms
from shellmb.forms.frame import Vectors, vectors
from shellmb.meshes.nodes import NodeMesh, constant_vector, node_mesh, node_space
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import NodeLink, PartScale, Rates
from shellmb.model.identification import node_links
from shellmb.model.joints.constraints import ConstraintGroup, forces_and_sizes
from shellmb.model.locations.ends import End
from shellmb.model.reduced.data import ModalBody, amplitudes
from shellmb.model.reduced.modes import ADVICE, Modes
from shellmb.model.sections.damping import mass_damping


@dataclass(frozen=True)
class Reduced:
    """A reduced body in the system.

    Args:
        modes: Its amplitudes.
        frame: Its floating frame as a place.
    """

    modes: Modes
    frame: End

    @property
    def data(self) -> ModalBody:
        """Data of the body."""
        return self.modes.data

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        return self.modes.mixed.space.mesh.comm


def frame_links(
    nodes: NodeMesh, mixed: MixedSpace, body: Reduced, others: Sequence[End] = ()
) -> tuple[NodeLink, ...]:
    """Links of what acts on a reduced body, or is connected to it.

    Args:
        nodes: Node mesh with one cell for each item.
        mixed: Space with parts "eta", and perhaps "u1" and "w1" of the floating frame, and "u2" and
            "w2" of other places.
        body: The body.
        others: The other places, one for each item.
    """
    modes, count = body.modes, int(nodes.mesh.topology.index_map(1).size_global)
    wanted = {"eta": ([modes.name] * count, np.tile(modes.numbers(), (count, 1)))}
    for tag, ends in (("1", [body.frame] * count), ("2", others)):
        for source in ("u", "w"):
            if f"{source}{tag}" in mixed.parts:
                targets = np.array([end.dofs[source] for end in ends])
                wanted[f"{source}{tag}"] = ([end.body for end in ends], targets)
    links: list[NodeLink] = []
    for part, (bodies, targets) in wanted.items():
        rows = mixed.dofs[part].reshape(-1, mixed.parts[part][1])
        links += node_links(nodes, rows, bodies, targets)
    return tuple(links)


class OnFrame(ConstraintGroup):
    """Constraints with the floating frame and the amplitudes of one body.

    Args:
        title: What its name begins with.
        body: The body.
        parts: Sizes of the parts that are unknown besides these two, by name.
        table: Coefficients, one row for each item.
        force: Size of the multipliers' forces, N.
        length: Size of the scene, m.
        others: Places whose nodal unknowns are parts "u2" and "w2", one for each item.
    """

    def __init__(
        self,
        title: str,
        body: Reduced,
        parts: dict[str, int],
        table: Floats,
        force: float,
        length: float,
        others: Sequence[End] = (),
    ) -> None:
        self.data = data = body.data
        nodes = node_mesh(body.comm, len(table))
        mixed = node_space(nodes, {"eta": data.count, **parts})
        self.table = constant_vector(nodes, table, "coefficients")
        links = frame_links(nodes, mixed, body, others)
        name = f"{title} of {data.name}"
        scales = forces_and_sizes(force, length, parts["mu"], self.directions)
        super().__init__(name, nodes, mixed, links, self._violation, *scales)

    def _violation(self, q: Expr) -> Expr:
        raise NotImplementedError

    def _directors(self, q: Expr, tag: str = "1") -> Vectors:
        """Changes of the directors of a frame."""
        return vectors(self.layout.part(q, f"w{tag}"))


class OnArms(OnFrame):
    """Ends of arms from the frame, at places that modes and frame tell, that forces act on.

    Arguments as of `OnFrame`; of `parts` those of the frame.

    Attributes:
        arms: The arms at rest, shape (count, 3), m.
    """

    arms: Floats

    def __init__(
        self,
        title: str,
        body: Reduced,
        parts: dict[str, int],
        table: Floats,
        force: float,
        length: float,
    ) -> None:
        super().__init__(title, body, {**parts, "u": 3, "mu": 3}, table, force, length)
        self.mixed = replace(self.mixed, elementwise=frozenset({"u", "mu"}))
        self.jump_parts = frozenset({"u", "mu"})
        scale = PartScale("u", f"{title} of '{body.data.name}'", body.data.length, ADVICE)
        self.parts = (scale, *self.parts)


class InertiaPoints(OnArms):
    """Points with mass at places that modes and frame tell: the inertia of the modes."""

    def __init__(self, body: Reduced, force: float, length: float) -> None:
        data = body.data
        table = np.concatenate(
            [data.points.reshape(len(data.mass), -1), data.mass[:, None], data.coupling], axis=1
        )
        self.arms = np.zeros((len(table), 3))
        super().__init__("inertia", body, {"w1": 9}, table, force, length)
        # the directors are those of the frame, and their rates count here, too
        self.kinematic = frozenset({"u", "w1"})
        rate = data.slowing
        self._slowing = fem.Constant(self.nodes.mesh, rate) if rate else None

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
        return work * ufl.dx(self.nodes.mesh)

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Damping in proportion to the mass."""
        return mass_damping(self, self._slowing, rates, dq)

    def momentum(self, v: Expr, axis: Expr) -> Form | None:
        """None: the modes have none."""
        return None

    def angular_momentum(self, q: Expr, v: Expr, axis: Expr) -> Form:
        """Component along `axis` of the angular momentum about the origin, kg m^2/s."""
        h, g = self._momenta(v)
        d = forms.unit_vectors(self._directors(q))
        total = ufl.cross(self.layout.part(q, "u"), h)
        total += sum((ufl.cross(a, b) for a, b in zip(d, g, strict=True)), start=0 * total)
        return ufl.dot(total, axis) * ufl.dx(self.nodes.mesh)


class Interfaces(OnFrame):
    """Frames at which something is attached to a reduced body: where its modes have them."""

    directions = (3, 4, 5)

    def __init__(self, body: Reduced, others: Sequence[End], force: float, length: float) -> None:
        rows = []
        for end, item in zip(others, body.data.interfaces, strict=True):
            turned = [item.shift.ravel(), item.turn.ravel(), end.node - body.frame.node]
            rows.append(np.concatenate([*turned, end.directors.ravel()]))
        parts = {"u1": 3, "w1": 9, "u2": 3, "w2": 9, "mu": 6}
        super().__init__("interfaces", body, parts, np.array(rows), force, length, others)
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
