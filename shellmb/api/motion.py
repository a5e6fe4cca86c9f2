"""Motions of bodies of the user's own: the schemes as a library."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

from mpi4py import MPI

from dolfinx import fem

from shellmb.errors import SceneError
from shellmb.exchange.motion import SceneMotion
from shellmb.model.body import constraint_error
from shellmb.model.user_bodies.body import OwnBody
from shellmb.observers.account.energy import EnergyAccount, scalar
from shellmb.options.described import takes
from shellmb.scene import Scene, Solver
from shellmb.scene.schemes import SIMPLEST
from shellmb.scene.values.validate import show
from shellmb.simulate.start.endforces import EndForces, begin_accelerations


class Motion(SceneMotion):
    """Motion of bodies of the user's own, by any dynamic scheme.

    Example::

        motion = sm.Motion(body, scheme="ep4", dt=0.01)
        motion.take("plate", v=lambda x: ...)
        motion.step(100)
        motion.u("plate"), motion.energies

    A step can be tried first: `motion.trial(dt)`, then `motion.accept()` or `motion.reject()`; one
    that is longer than `dt` is tried in several.

    Args:
        bodies: The bodies.
        scheme: Name of a scheme, or a scheme.
        dt: Length of a step, s.
        alpha: Numerical dissipation, 0 to 1; None: the default of scenes, 0.5 for `ed` and `ed3`.
        tolerance: Tolerance of Newton's method, relative to the sizes of the bodies.
        newton: When to factorise: in each iteration (`full`), once in each step (`modified`), or as
            rarely as pays (`auto`).

    Attributes:
        time: The time, s.
        problem: Functions and block system (`simulate.problem.Problem`).
        account: Energy balance (`observers.account.energy.EnergyAccount`).

    Raises:
        SceneError: If two bodies have one name, or there is no such scheme.
    """

    @takes()
    def __init__(
        self,
        *bodies: OwnBody,
        scheme: Any = SIMPLEST,
        dt: float,
        alpha: float | None = None,
        tolerance: float = 1e-10,
        newton: Literal["full", "auto", "modified"] = "full",
    ) -> None:
        for body in bodies:
            if not isinstance(body, OwnBody):
                raise SceneError(f"Motion: a body is {show(body)}; it must be an OwnBody")
        scene = Scene(
            "motion",
            own_bodies=bodies,
            scheme=scheme,
            alpha=alpha,
            dt=dt,
            t_end=dt,
            solver=Solver(tolerance=tolerance, newton=newton),
        )
        super().__init__(scene, comm=bodies[0].space.mesh.comm)
        self.dt, self.t_end = dt, math.inf
        self.problem, self.account = self.simulation.problem, EnergyAccount()
        # those of the scene's model
        self._bodies: dict[str, Any] = {body.name: body for body in self.simulation.model.bodies}
        self._momenta: dict[str, dict[Any, Any]] = {}
        self._started = False

    def u(self, name: str) -> fem.Function:
        """Field of a body now, as a new function of its space."""
        return self._read(name, self.problem.levels[name].q)

    def v(self, name: str) -> fem.Function:
        """Velocity of a body now, as a new function of its space."""
        return self._read(name, self.problem.levels[name].rates["v"])

    def _read(self, name: str, state: fem.Function) -> fem.Function:
        found = fem.Function(self._bodies[name].space)
        found.x.array[:] = state.x.array[self._bodies[name].mixed.dofs["u"]]
        return found

    def take(self, name: str, u: Any = None, v: Any = None) -> None:
        """Set the initial field and velocity; the velocity is projected onto the constraints.

        Args:
            name: The body.
            u: Its field: anything that `fem.Function.interpolate` accepts; None: zero.
            v: Its velocity, likewise.
        """
        levels = self.problem.levels[name]
        for state, given in ((levels.q, u), (levels.rates["v"], v)):
            if given is not None:
                start = fem.Function(self._bodies[name].space)
                start.interpolate(given)
                state.x.array[self._bodies[name].mixed.dofs["u"]] = start.x.array
        self._saved, self._tried = None, False

    def start(self) -> None:
        """Make velocities and accelerations consistent; the first `step` does it otherwise."""
        if any(body.constraints for body in self._bodies.values()):
            self.problem.projection.project()
        begin_accelerations(self.problem, lambda: EndForces(self.problem), self.time, -self.dt)
        self._begin([self.account])
        self._started = True

    def step(self, count: int = 1) -> None:
        """Solve some steps.

        Args:
            count: Their number.

        Raises:
            ConvergenceError: If Newton's method does not converge.
            SceneError: If there is a trial that is neither accepted nor rejected.
        """
        if self._tried:
            raise SceneError("step: there is a trial; call accept() or reject() first")
        if not self._started:
            self.start()
        self._saved = None
        for _ in range(count):
            self._advance(self.dt)

    def state(self) -> Any:
        """Copy of all that steps change now, for `take_up`."""
        if not self._started:
            self.start()
        return super().state()

    @property
    def energies(self) -> dict[str, float]:
        """Energies now; work and dissipation since the start; violation of the balance, J."""
        return dict(self.account.values)

    def momentum(self, name: str, motion: Callable[[Any], Any]) -> float:
        """Momentum of a body in the direction of a field; collective.

        Args:
            name: The body.
            motion: The direction in UFL, as a function of the body's field `u`: a unit vector for
                the linear momentum, `ufl.cross(axis, x + u)` for the angular one, kg m/s and
                kg m^2/s.
        """
        body, levels = self._bodies[name], self.problem.levels[name]
        known = self._momenta.setdefault(name, {})
        if motion not in known:
            form = body.momentum_along(levels.rates["v"], motion(body.field(levels.q)))
            known[motion] = scalar([form], self.simulation.model.comm)
        total = known[motion]
        return 0.0 if total is None else total()

    @property
    def violation(self) -> float:
        """Largest violation of the constraints, relative; collective."""
        levels, bodies = self.problem.levels, self._bodies.items()
        found = [constraint_error(body, levels[name].q) for name, body in bodies]
        return float(self.simulation.model.comm.allreduce(max(found), op=MPI.MAX))
