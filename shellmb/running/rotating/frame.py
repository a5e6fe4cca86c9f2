"""Velocities of a rigid rotation, written in the state: what a frame that turns adds to forces.

In a frame that turns with the angular velocity `omega` about an axis through `c` positions and
directors are vectors, and the velocity of a state at rest in the frame is `W y` with
`W = omega x` for `x - c` and for each director. Absolute velocities and accelerations are
`y' + W y` and `y'' + 2 W y' + W^2 y`. Mass matrices are constant and know no direction, so that
`M (y'' + 2 W y' + W^2 y)` are the inertia forces along the axes of the frame.
"""

from __future__ import annotations

from collections.abc import Callable

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.model.body import Body, Rates, rigid_rate
from shellmb.running.rotating.axis import Axis


class RotatingFrame:
    """The frame as one body sees it.

    Args:
        body: The body.
        axis: The axis about which the frame turns.
    """

    def __init__(self, body: Body, axis: Axis) -> None:
        domain = body.mixed.space.mesh
        self.body, self._axis = body, axis
        self._omega = fem.Constant(domain, np.zeros(3))
        self._about = fem.Constant(domain, np.array(axis.about))
        self.still = fem.Function(body.mixed.space, name=f"velocity_in_frame_{body.name}")

    def turn(self, rate: float) -> None:
        """Let it turn with another rate, rad/s."""
        self._omega.value[:] = rate * self._axis.unit

    def motion(self, q: Expr) -> Expr:
        """Velocities in the frame at a state, which contain `still`."""
        return self.still

    def turned(self, q: Expr, of: Callable[[Expr], Expr] | None = None) -> Expr:
        """Velocities of all that is at rest in the frame, as a rate of the state.

        Args:
            q: State.
            of: Linear map of the vectors; None: `omega x`.
        """
        mapped = of or (lambda vector: ufl.cross(self._omega, vector))
        return rigid_rate(self.body, q, mapped, about=self._about)

    def rates(self, q: Expr) -> Rates:
        """Absolute velocities along the axes of the frame, `still` being those in it."""
        velocity = self.motion(q) + self.turned(q)
        return Rates(velocity, velocity)

    def carried(self, q: Expr, dq: Expr) -> ufl.Form | None:
        """Virtual work `M W^2 y` of the inertia forces of what is at rest in the frame."""
        return self.body.inertia(self.centripetal(q), dq)

    def centripetal(self, q: Expr) -> Expr:
        """Accelerations `W^2 y` of what is at rest in the frame."""
        omega = self._omega
        return self.turned(q, lambda vector: ufl.cross(omega, ufl.cross(omega, vector)))

    def gyroscopic(self, q: Expr, dq: Expr) -> ufl.Form | None:
        """`M W y`, whose derivative by the state is half of the matrix of Coriolis' forces."""
        return self.body.inertia(self.turned(q), dq)

    def spun(self, q: Expr, dq: Expr) -> ufl.Form | None:
        """`M` times the velocities in the frame, whose derivative by the state acts as that."""
        return None
