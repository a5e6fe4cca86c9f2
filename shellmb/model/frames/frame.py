"""Frames at nodes of beams and rigid bodies: their inertia and constraints."""

from functools import cached_property
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Int32s
from shellmb.forms import frame
from shellmb.forms.constraints.held import Held
from shellmb.forms.frame import FrameMass, Vectors
from shellmb.forms.measure import Measure, measure
from shellmb.forms.state import Layout
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import Constraint, Damped, FixedDofs, Manifold, NodeLink, PartScale, largest
from shellmb.model.frames.floating import EVERYWHERE, FloatingFrame
from shellmb.model.frames.unit import DirectorConstraint, directors_held
from shellmb.model.joints.held import Constraints

IDENTITY = np.eye(3)


class FrameBody:
    """A body whose nodes are frames.

    Args:
        name: Its name in the system.
        mixed: Space with the parts "u", "w", "lam" and perhaps more.
        frames: Reference directors, shape (9,).
        order: Number in the space of `frames` of each node of the part "w".
        reference: Reference position as an expression, shape (3,), m.
        nodes: Measure whose points are the nodes.
        force: Size of the multipliers' forces: a Constant, N.
    """

    def __init__(
        self,
        name: str,
        mixed: MixedSpace,
        frames: fem.Function,
        order: Int32s,
        reference: Expr,
        nodes: ufl.Measure,
        force: Expr,
    ) -> None:
        self.name, self.mixed, self.frames, self._order = name, mixed, frames, order
        self.reference, self.nodes, self.force = reference, nodes, force
        self.layout = Layout(mixed.parts)
        self.parts: tuple[PartScale, ...] = ()
        self.fixed: list[FixedDofs] = []
        self.links: tuple[NodeLink, ...] = ()
        # set with the model: where there are frames, jumps of velocities are unknown
        self.inertialess = False
        self.slenderness = 1.0
        self.kinematic = frozenset({"u", "w"})
        self.damping: Damped | None = None
        # parts of the mass with the rule that integrates each; none in statics
        self.masses: tuple[tuple[FrameMass, ufl.Measure], ...] = ()
        # floating frames that its strains are small relative to
        self.ties: tuple[FloatingFrame, ...] = ()

    @property
    def jump_parts(self) -> frozenset[str]:
        """Parts that have equations for the jump of velocities."""
        turns = any(J is not None for mass, _ in self.masses for J in mass.J)
        own = {"u", "w", "lam"} if turns else {"u"}
        return frozenset(own | EVERYWHERE.keys() if self.ties else own)

    def directors(self, q: Expr) -> Vectors:
        """The three directors, shape (3,) each."""
        return frame.directors(self.layout.part(q, "w"), self.frames)

    def position(self, q: Expr) -> Expr:
        """Position of the nodes, shape (3,), m."""
        return self.reference + self.layout.part(q, "u")

    @cached_property
    def constraints(self) -> tuple[Constraint, ...]:
        """Frames are orthonormal, eq. (19), and tied to what floats with the body."""
        own = Constraints(
            Held(self.orthonormality.value),
            self.layout.multipliers,
            self.force,
            self.nodes,
            self._frame_errors,
            self.inertialess,
            "lam" in self.jump_parts,
        )
        return own, *(tie.held(self.inertialess) for tie in self.ties)

    @cached_property
    def orthonormality(self) -> Measure:
        """Constraints of the frames, shape (6,)."""
        layout, frames = self.layout, self.frames
        return measure(lambda q: frame.orthonormality(layout.part(q, "w"), frames))

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces for the acceleration `rate`."""
        return self._mass_form(rate, dq)

    def _mass_form(self, v: Expr, dv: Expr) -> Form | None:
        motions = (*self._motion(v), *self._motion(dv))
        forms = [_momentum_work(*motions, *mass) for mass in self.masses]
        return sum(forms[1:], forms[0]) if forms else None

    def _motion(self, v: Expr) -> tuple[Expr, Expr]:
        return self.layout.moved(v)

    def momentum(self, v: Expr, axis: Expr) -> Form | None:
        """Component of the linear momentum along `axis`, kg m/s."""
        motion = self._motion(v)
        forms = [_momentum(*motion, axis, *mass) for mass in self.masses]
        return sum(forms[1:], forms[0]) if forms else None

    def angular_momentum(self, q: Expr, v: Expr, axis: Expr) -> Form | None:
        """Component along `axis` of the angular momentum about the origin, kg m^2/s."""
        state = self.position(q), self.directors(q), *self._motion(v)
        forms = [_angular_momentum(state, axis, *mass) for mass in self.masses]
        return sum(forms[1:], forms[0]) if forms else None

    @property
    def manifold(self) -> Manifold:
        """Orthonormal triples; their jump is unknown and tangent already."""
        return Manifold(self._rest if self.held.unit else None, self.inertialess)

    @property
    def held(self) -> DirectorConstraint:
        """The constraints of the directors as numbers."""
        return directors_held(frame.orthonormality, 3)

    @cached_property
    def _rest(self) -> Floats:
        return np.asarray(self.frames.x.array.reshape(-1, 9)[self._order])

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


def _momentum_work(
    v: Expr, dd: Expr, dv: Expr, ddd: Expr, mass: FrameMass, measure: ufl.Measure
) -> Form:
    return frame.momentum_work(v, dd, mass, dv, ddd) * measure


def _momentum(v: Expr, dd: Expr, axis: Expr, mass: FrameMass, measure: ufl.Measure) -> Form:
    return ufl.dot(frame.momenta(v, dd, mass)[0], axis) * measure


def _angular_momentum(
    state: tuple[Any, ...], axis: Expr, mass: FrameMass, measure: ufl.Measure
) -> Form:
    x, d, v, dd = state
    return ufl.dot(frame.angular_momentum(x, d, v, dd, mass), axis) * measure
