"""Frames at nodes of beams and rigid bodies: their inertia and constraints, and floating frames.

Directors are eliminated, put on their constraints and reported by numbers at nodes, which know unit
vectors and orthonormal triples (`system.nullspace`). The constraints themselves are written in
`forms`: here they are asked what they are, so that whoever changes them there changes all of it.

A body whose strains are small relative to a floating frame has that frame as its own: its directors
are unknowns that are the same all over the body: a part "frame" of the body's own space that is
constant on each cell, all cells identified, and so are the multipliers, "hold", of what ties it to
the body (`forms.floating.frame`). It has no mass: its velocity follows from the body's, and its
forces do no work.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats, Int32s
from shellmb.forms import frame
from shellmb.forms.constraints.held import Held
from shellmb.forms.frame import FrameMass, Vectors
from shellmb.forms.measure import Measure, measure
from shellmb.forms.state import Layout
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import Manifold, MassiveBody, NodeLink, added, largest, same_everywhere
from shellmb.model.multipliers import Constraints

# round-off of the values of constraints of random directors, whose squares are up to a hundred
ROUND_OFF = 1e-11


class DirectorConstraint:
    """Constraints of the directors of a node, quadratic in their changes.

    Args:
        written: Constraints `g(w, D)` of the changes and the reference, a number or shape (c,).
        count: Number of directors.
    """

    def __init__(self, written: Callable[[Expr, Expr], Expr], count: int) -> None:
        self._written, self._count = written, count

    @cached_property
    def unit(self) -> bool:
        """Decide whether all directors have length one and, of a triple, are at right angles."""
        k, rng = self._count, np.random.default_rng(1)
        for w, D in rng.normal(size=(2, 2, k, 3)):
            products = (D + w) @ (D + w).T - D @ D.T
            known = [*products.diagonal() / 2, *products[np.triu_indices(k, 1)]]
            found = self._at(w.ravel(), D.ravel())
            if len(found) != len(known) or np.abs(found - known).max() > ROUND_OFF:
                return False
        return True

    def values(self, w: Floats, D: Floats) -> Floats:
        """Values at nodes, shape (n, c), from shapes (n, 3 k)."""
        by_rest, square = self._numbers
        found = np.einsum("cij,ni,nj->nc", by_rest, D, w)
        return np.asarray(found + np.einsum("cij,ni,nj->nc", square, w, w) / 2)

    def normals(self, w: Floats, D: Floats) -> Floats:
        """Derivatives of the first one by the changes, at nodes, shape (n, 3 k)."""
        by_rest, square = (matrix[0] for matrix in self._numbers)
        return np.asarray(D @ by_rest + w @ square)

    def normal(self, w: Expr, D: Expr) -> Expr:
        """Derivative of the first one by the changes, shape (3 k,)."""
        if self.unit:
            return D + w
        by_rest, square = (ufl.as_matrix(matrix[0].tolist()) for matrix in self._numbers)
        return ufl.dot(D, by_rest) + ufl.dot(w, square)

    def _at(self, w: Floats, D: Floats) -> Floats:
        """Values for numbers, shape (c,)."""
        first, second = (ufl.as_vector([ufl.as_ufl(float(x)) for x in v]) for v in (w, D))
        found = self._written(first, second)
        parts = [found] if not found.ufl_shape else [found[i] for i in range(len(found))]
        return np.array([float(part(())) for part in parts])

    @cached_property
    def _numbers(self) -> tuple[Floats, Floats]:
        """Second derivatives by reference and change, and by changes, shape (c, 3 k, 3 k) each."""
        n = 3 * self._count
        axes, none = np.eye(n), np.zeros(n)
        own = np.array([self._at(a, none) for a in axes])
        pairs = np.array([[self._at(a + b, none) for b in axes] for a in axes])
        square = pairs - own[:, None] - own[None]
        by_rest = np.array([[self._at(a, D) for a in axes] for D in axes]) - own[None]
        return by_rest.transpose(2, 0, 1), square.transpose(2, 0, 1)


# they are found once for all bodies that have them
directors_held = cache(DirectorConstraint)


# parts of a state that are the same all over a body, with their sizes; and that which moves
EVERYWHERE = {"frame": 9, "hold": 9}
FRAME = "frame"


@dataclass(frozen=True)
class FloatingFrame:
    """A frame and what ties it to its body.

    Args:
        mixed: Space of the body.
        constraints: Densities whose integrals vanish as a function of the state, shape (9,).
        measure: Rule of the integrals.
        force: Size of the body's resultants: a Constant.
    """

    mixed: MixedSpace
    constraints: Callable[[Expr], Expr]
    measure: ufl.Measure
    force: Expr

    @cached_property
    def _dofs(self) -> Int32s:
        """Dofs of some cell: they are the same on all."""
        return self.mixed.dofs[FRAME][: EVERYWHERE[FRAME]].reshape(-1, 3, 3)

    def changes(self, values: Floats) -> Floats:
        """Changes of the directors as rows, or their rates, of a local array, shape (3, 3).

        Zero on ranks that have nothing of the body.
        """
        return np.asarray(values[self._dofs].sum(axis=0))

    def errors(self, states: Floats) -> Floats:
        """Largest deviations from an orthonormal frame in local arrays of states, shape (k,)."""
        d = np.eye(3) + states[:, self._dofs].sum(axis=1)
        return largest(d @ d.swapaxes(1, 2) - np.eye(3))

    def held(self, inertialess: bool) -> Constraints:
        """The frame tied to its body, as what the body holds.

        Args:
            inertialess: Whether the body has no inertia.
        """
        held, layout = Held(self.constraints), Layout(self.mixed.parts)
        of = held, lambda q: layout.part(q, "hold"), self.force, self.measure, self.errors
        return Constraints(*of, inertialess)


def identified(mixed: MixedSpace, name: str) -> list[NodeLink]:
    """Links that make the parts which are the same everywhere one unknown each; collective.

    Args:
        mixed: Space of the body.
        name: Its name.
    """
    links = []
    for part, size in EVERYWHERE.items():
        # those of the first cell of the first rank that has one
        first = mixed.dofs[part].reshape(-1, size)[mixed.subspaces[part].dofmap.list[:1, 0]]
        mine = mixed.numbers(first.ravel()).tolist()
        targets = next(found for found in mixed.space.mesh.comm.allgather(mine) if found)
        links.append(same_everywhere(mixed, part, name, targets))
    return links


class Floating(MassiveBody):
    """A shell or beam with a floating frame that its strains are small relative to.

    Arguments as of the body.
    """

    everywhere: Mapping[str, int] = EVERYWHERE
    ties: tuple[FloatingFrame, ...]
    layout: Layout
    rules: Any
    section: Any
    # constraints that tie the frame, shape (9,)
    _apart: Callable[[Expr], Expr]

    def __init__(self, *of: Any) -> None:
        super().__init__(*of)
        force = self.section.force
        self.ties = (FloatingFrame(self.mixed, self._apart, self.rules.full, force),)
        self.links = tuple(identified(self.mixed, self.name))
        self.kinematic |= {FRAME}

    def _moved(self, q: Expr) -> tuple[Expr, Expr, Expr]:
        return (*self.layout.moved(q), self.layout.part(q, FRAME))


IDENTITY = np.eye(3)


class FrameBody(MassiveBody):
    """A body whose nodes are frames.

    Args:
        name: Its name in the system.
        mixed: Space with the parts "u", "w", "lam" and perhaps more.

    Attributes:
        frames: Reference directors, shape (9,).
        order: Number in the space of `frames` of each node of the part "w".
        reference: Reference position as an expression, shape (3,), m.
        nodes: Measure whose points are the nodes.
        force: Size of the multipliers' forces: a Constant, N.
    """

    frames: fem.Function
    order: Int32s
    reference: Expr
    nodes: ufl.Measure
    force: Expr

    def __init__(self, name: str, mixed: MixedSpace) -> None:
        super().__init__(name, mixed)
        self.layout = Layout(mixed.parts)
        # the constraints of the directors as numbers
        self.held = directors_held(frame.orthonormality, 3)
        # set with the model: where there are frames, jumps of velocities are unknown
        self.inertialess = False
        self.kinematic = frozenset({"u", "w"})
        # parts of the mass with the rule that integrates each; none in statics
        self.masses: tuple[tuple[FrameMass, ufl.Measure], ...] = ()
        # floating frames that its strains are small relative to
        self.ties: tuple[FloatingFrame, ...] = ()

    @property
    def jump_parts(self) -> frozenset[str]:  # type: ignore[override]
        """Parts that have equations for the jump of velocities."""
        turns = any(J is not None for mass, _ in self.masses for J in mass.J)
        own = {"u", "w", "lam"} if turns else {"u"}
        return frozenset(own | EVERYWHERE.keys() if self.ties else own)

    def pieces(self) -> Iterator[Bools]:
        """Nodes of each part that is a body of its own, to be multiplied with vectors."""
        yield np.array([[[True]]])

    def directors(self, q: Expr) -> Vectors:
        """The three directors, shape (3,) each."""
        return frame.vectors(self.frames + self.layout.part(q, "w"))

    def position(self, q: Expr) -> Expr:
        """Position of the nodes, shape (3,), m."""
        return self.reference + self.layout.part(q, "u")

    @cached_property
    def constraints(self) -> tuple[Constraints, ...]:
        """Frames are orthonormal, eq. (19), and tied to what floats with the body."""
        held = Held(self.orthonormality.value), self.layout.multipliers, self.force, self.nodes
        own = Constraints(*held, self._frame_errors, self.inertialess, "lam" in self.jump_parts)
        return own, *(tie.held(self.inertialess) for tie in self.ties)

    @cached_property
    def orthonormality(self) -> Measure:
        """Constraints of the frames, shape (6,)."""
        layout, frames = self.layout, self.frames
        return measure(lambda q: frame.orthonormality(layout.part(q, "w"), frames))

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces for the acceleration `rate`."""
        (v, dd), virtual = self.layout.moved(rate), self.layout.moved(dq)
        works = (frame.momentum_work(v, dd, m, *virtual) * rule for m, rule in self.masses)
        return added(works)

    def vectors_at(self, q: Expr) -> Mapping[str, Sequence[Expr]]:
        """Positions and directors at a state."""
        return {"u": [self.position(q)], "w": self.directors(q)}

    @property
    def manifold(self) -> Manifold:  # type: ignore[override]
        """Orthonormal triples; their jump is unknown and tangent already."""
        return Manifold(self._rest if self.held.unit else None, self.inertialess)

    @cached_property
    def _rest(self) -> Floats:
        return np.asarray(self.frames.x.array.reshape(-1, 9)[self.order])

    def frames_at(self, q: Floats) -> Floats:
        """Directors of a state's local array as rows, node after node of "w", shape (n, 3, 3)."""
        return np.asarray((self._rest + q[self.mixed.dofs["w"]].reshape(-1, 9)).reshape(-1, 3, 3))

    def _frame_errors(self, states: Floats) -> Floats:
        """Largest deviations of a frame from orthonormality on this rank, of some states."""
        w = states[:, self.mixed.dofs["w"].reshape(-1, 9)]
        if self.held.unit:
            d = (self._rest + w).reshape(len(states), -1, 3, 3)
            found = d @ d.swapaxes(2, 3)
            found -= IDENTITY
        else:
            found = np.array([self.held.values(one, self._rest) for one in w])
        return largest(found)
