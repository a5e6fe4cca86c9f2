"""Reduced bodies as the schemes see them: modes, points with mass, and interfaces (`data`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms import modal as forms
from shellmb.forms.constraints.elements import (
    Stretch,
    linear_force,
    linear_forces,
    linear_jump,
    linear_potential,
)
from shellmb.forms.frame import Vectors, vectors
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Step
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space
from shellmb.model.body import Body, PartScale, Term
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.identification import node_links
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.massless import Massless
from shellmb.model.places.ends import End
from shellmb.model.reduced.data import Floats, ModalBody

Ints = npt.NDArray[np.int64]

_ADVICE = "a smaller step, or fewer modes"


class Modes(Massless):
    """Amplitudes of a body's modes, with their stiffness; their inertia is in `InertiaPoints`.

    Args:
        comm: Communicator.
        data: The body.
    """

    def __init__(self, comm: MPI.Comm, data: ModalBody) -> None:
        self.data, name = data, f"modes of {data.name}"
        nodes = node_mesh(comm, 1)
        mixed = node_space(nodes, {"eta": data.count})
        title = PartScale("eta", f"modes of '{data.name}'", data.length, _ADVICE)
        super().__init__(name, mixed, (title,), ())
        self.kinematic = self.jump_parts = frozenset({"eta"})
        self.layout, self._dx = Layout(mixed.parts), ufl.dx(nodes.mesh)
        self._k = constant_vector(nodes, data.stiffness[None], "stiffness")

    def numbers(self) -> Ints:
        """Global dofs of the amplitudes, the same on all ranks; collective."""
        local = self.mixed.dofs["eta"]
        index_map = self.mixed.space.dofmap.index_map
        found = index_map.local_to_global(local[local < index_map.size_local])
        return np.concatenate(self.mixed.space.mesh.comm.allgather(found))

    def amplitudes(self, q: Expr) -> list[Expr]:
        """The amplitudes of a state, m."""
        return amplitudes(self.layout, q)

    def _sum(self, terms: Sequence[Expr]) -> Form:
        return sum(terms[1:], terms[0]) * self._dx

    def _stiffness(self) -> list[Expr]:
        return [self._k] if self.data.count == 1 else [self._k[k] for k in range(self.data.count)]

    def internal(self, span: Interval, dq: Expr) -> Form:
        """Average elastic force over the sub-interval."""
        a, b, test = (self.amplitudes(q) for q in (span.a, span.b, dq))
        k = self._stiffness()
        if span.a is span.b:
            return self._sum([k[i] * a[i] * test[i] for i in range(len(k))])
        forces = [linear_force(k[i], a[i], b[i], span.beta) for i in range(len(k))]
        return self._sum([f * t for f, t in zip(forces, test, strict=True)])

    def _stretches(self, step: Step) -> list[Stretch]:
        path = step.path
        parts = (self.amplitudes(q) for q in (path.start, path.chord, path.bow))
        return [Stretch(a, d, 2 * z) for a, d, z in zip(*parts, strict=True)]

    def along(self, step: Step, k: int, dq: Expr, trial: Expr) -> tuple[Form | None, list[Term]]:
        """Elastic force over a step, linear in time."""
        alpha, weight = step.path.alpha, (1, 1 / 3)[k]
        pairs = zip(self._stiffness(), self._stretches(step), strict=True)
        forces = [weight * linear_forces(c, e, alpha)[k] for c, e in pairs]
        test = self.amplitudes(dq)
        return self._sum([f * t for f, t in zip(forces, test, strict=True)]), []

    def lost(self, step: Step, bow: Expr) -> Form | None:
        """Energy of the bow of the amplitudes, J."""
        pairs = zip(self._stiffness(), self._stretches(step), strict=True)
        return self._sum([c * e.bow**2 / 2 for c, e in pairs])

    def strain_energy(self, q: Expr) -> Form:
        """Strain energy, J."""
        pairs = zip(self._stiffness(), self.amplitudes(q), strict=True)
        return self._sum([linear_potential(c)(e) for c, e in pairs])

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of eq. (34)."""
        ends = zip(self._stiffness(), self.amplitudes(a), self.amplitudes(b), strict=True)
        return self._sum([linear_jump(c, first, second) for c, first, second in ends])


def amplitudes(layout: Layout, q: Expr) -> list[Expr]:
    """The amplitudes in a state, m."""
    first, size = layout.parts["eta"]
    return [q[first + k] for k in range(size)]


class _OnFrame(ConstraintGroup):
    """Constraints with the floating frame and the amplitudes of one body.

    Args:
        title: What its name begins with.
        data: The body.
        modes: Its modes.
        frame: Its floating frame as a place.
        parts: Sizes of the parts that are unknown besides these two, by name.
        others: Places whose nodal unknowns are parts "u2" and "w2", one for each item.
        count: Number of items.
        table: Coefficients, shape (count, n).
        force: Size of the multipliers' forces, N.
        length: Size of the scene, m.
    """

    def __init__(
        self,
        title: str,
        comm: MPI.Comm,
        data: ModalBody,
        modes: Modes,
        frame: End,
        parts: dict[str, int],
        others: Sequence[End],
        table: Floats,
        force: float,
        length: float,
    ) -> None:
        count = len(table)
        nodes = node_mesh(comm, count)
        mixed = node_space(nodes, {"eta": data.count, **parts})
        self.table = constant_vector(nodes, table, "coefficients")
        links = []
        wanted = {"eta": ([modes.name] * count, np.tile(modes.numbers(), (count, 1)))}
        for tag, ends in (("1", [frame] * count), ("2", others)):
            for source in ("u", "w"):
                if f"{source}{tag}" in parts:
                    targets = np.array([end.dofs[source] for end in ends])
                    wanted[f"{source}{tag}"] = ([end.body for end in ends], targets)
        for part, (bodies, targets) in wanted.items():
            rows = mixed.dofs[part].reshape(-1, mixed.parts[part][1])
            links += node_links(nodes, rows, bodies, targets)
        name = f"{title} of {data.name}"
        super().__init__(name, nodes, mixed, tuple(links), self._violation, force, length)
        self.data = data

    def _violation(self, q: Expr) -> Expr:
        raise NotImplementedError

    def _directors(self, q: Expr, tag: str = "1") -> Vectors:
        """Changes of the directors of a frame."""
        return vectors(self.layout.part(q, f"w{tag}"))


class InertiaPoints(_OnFrame):
    """Points with mass at places that modes and frame tell: the inertia of the modes."""

    def __init__(
        self,
        comm: MPI.Comm,
        data: ModalBody,
        modes: Modes,
        frame: End,
        force: float,
        length: float,
    ) -> None:
        table = np.concatenate(
            [data.points.reshape(len(data.mass), -1), data.mass[:, None], data.coupling], axis=1
        )
        parts = {"w1": 9, "u": 3, "mu": 3}
        args = ("inertia", comm, data, modes, frame, parts, (), table, force, length)
        super().__init__(*args)
        self.mixed = replace(self.mixed, elementwise=frozenset({"u", "mu"}))
        # the directors are those of the frame, and their rates count here, too
        self.kinematic, self.jump_parts = frozenset({"u", "w1"}), frozenset({"u", "mu"})
        title = PartScale("u", f"inertia points of '{data.name}'", data.length, _ADVICE)
        self.parts = (title, *self.parts)

    def _violation(self, q: Expr) -> Expr:
        parts = forms.components(self.table, 0, amplitudes(self.layout, q))
        return forms.seen_apart(self.layout.part(q, "u"), parts, self._directors(q))

    def _momenta(self, v: Expr) -> tuple[Expr, Vectors]:
        first = 3 * self.data.count
        m, *c = (self.table[first + k] for k in range(4))
        z, w = self.layout.part(v, "u"), self._directors(v)
        return forms.coupled_momentum(m, (c[0], c[1], c[2]), z, w)

    def inertia(self, rate: Expr, dq: Expr) -> Form:
        """Virtual work of the inertia forces."""
        h, g = self._momenta(rate)
        work = ufl.dot(h, self.layout.part(dq, "u"))
        work += sum(ufl.dot(a, b) for a, b in zip(g, self._directors(dq), strict=True))
        return work * ufl.dx(self.nodes.mesh)

    def kinetic_energy(self, v: Expr) -> Form:
        """Kinetic energy, J."""
        return 0.5 * self.inertia(v, v)

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


class Interfaces(_OnFrame):
    """Frames at which something is attached to a reduced body: where its modes have them."""

    def __init__(
        self,
        comm: MPI.Comm,
        data: ModalBody,
        modes: Modes,
        frame: End,
        others: Sequence[End],
        force: float,
        length: float,
    ) -> None:
        rows = []
        for end, item in zip(others, data.interfaces, strict=True):
            turned = [item.shift.ravel(), item.turn.ravel(), end.node - frame.node]
            rows.append(np.concatenate([*turned, end.directors.ravel()]))
        parts = {"u1": 3, "w1": 9, "u2": 3, "w2": 9, "mu": 6}
        args = ("interfaces", comm, data, modes, frame, parts, others, np.array(rows))
        super().__init__(*args, force, length)
        self.labels = [item.name for item in data.interfaces]

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


def modal_bodies(
    comm: MPI.Comm,
    data: Sequence[ModalBody],
    rigid: RigidBodies,
    dynamic: bool,
    force: float,
    length: float,
) -> list[Body]:
    """The bodies of the system that reduced bodies consist of, besides their frames.

    Args:
        comm: Communicator.
        data: The reduced bodies.
        rigid: All frames, theirs included.
        dynamic: Whether they have inertia.
        force: Size of the multipliers' forces, N.
        length: Size of the scene, m.
    """
    ends = rigid.ends()
    found: list[Body] = []
    for body in data:
        modes, frame = Modes(comm, body), ends[body.name]
        found.append(modes)
        if dynamic:
            found.append(InertiaPoints(comm, body, modes, frame, force, length))
        if body.interfaces:
            others = [ends[item.name] for item in body.interfaces]
            found.append(Interfaces(comm, body, modes, frame, others, force, length))
    return found
