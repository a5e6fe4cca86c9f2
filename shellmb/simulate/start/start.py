"""The state before the first step: positions that close all joints, velocities they allow."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from shellmb.bodyfields import kinematic_dofs
from shellmb.constraint_analysis.redundancy import RATE_STEP, largest_gap
from shellmb.errors import ConvergenceError, SceneError
from shellmb.model.joints.rolling import ContactGroup
from shellmb.model.joints.slipping import refuse_slip
from shellmb.simulate.problem import Problem
from shellmb.simulate.start.endforces import EndForces
from shellmb.simulate.start.relaxation import Relaxation

# a joint is open if its ends are apart by more than this part of the scene's length
OPEN = 1e-9


class Start:
    """Prepares the state at the time zero.

    Args:
        problem: The functions of all bodies, at rest in the reference configuration.
        dt: First step, s.
    """

    def __init__(self, problem: Problem, dt: float) -> None:
        self.problem, self.model, self.scene = problem, problem.model, problem.model.scene
        self._dt = dt
        self._tied = any(body.coupled for body in self.model.bodies)
        # velocities of floating frames follow from those of their bodies
        self._following = any("frame" in body.kinematic for body in self.model.bodies)

    def positions(self) -> None:
        """Close the joints, and find the equilibrium to start from, where the scene asks.

        Raises:
            SceneError: If a joint is open and the scene does not ask to close it.
            ConvergenceError: If the joints cannot be closed, or there is no equilibrium.
        """
        gap, name, said = 0.0, "", ""
        if self._tied:
            q = {name: levels.q for name, levels in self.problem.levels.items()}
            gap, name, said = largest_gap(self.model, q)
        wanted = self.scene.start == "equilibrium" and self.problem.scheme.dynamic
        if gap > OPEN and not self.scene.assemble:
            raise SceneError(
                f"joint '{name}': it is open by {said} in the given "
                "positions; move its bodies, or use assemble=True"
            )
        if gap > OPEN or wanted:
            relaxation = Relaxation(self.model, self.problem.levels, self._dt)
            if gap > OPEN:
                relaxation.assemble()
            if wanted:
                relaxation.equilibrium()

    def velocities(self) -> None:
        """Initial velocities, made consistent with supports, drivers and joints.

        Raises:
            SceneError: If something slips that is to roll, and the scene does not ask to mend it.
            ConvergenceError: If they cannot be, as without inertia.
        """
        if "v" not in self.problem.scheme.rates:
            return
        for initial in self.scene.initial:
            linear, spin = np.asarray(initial.linear), np.asarray(initial.spin)
            for target in self.scene.bodies_of(initial):
                body, nodes, X, D = self.model.nodes_of(target.name)
                v = self.problem.levels[body.name].rates["v"].x.array
                u = body.mixed.dofs["u"].reshape(-1, 3)[nodes]
                w = body.mixed.dofs["w"].reshape(-1, body.mixed.parts["w"][1])[nodes]
                v[u] += linear + np.cross(spin, X - np.asarray(initial.about))
                v[w] += np.cross(spin, D).reshape(w.shape)
        self._given_velocities()
        if self.scene.initial and not self.scene.assemble:
            q = {name: levels.q for name, levels in self.problem.levels.items()}
            groups = [g for g in self.model.mechanism.groups if isinstance(g, ContactGroup)]
            if groups:
                refuse_slip(groups, q, self.problem.projection.given())
        if self._tied or self._following:
            try:
                self.problem.projection.project()
            except ConvergenceError as error:
                raise ConvergenceError(
                    f"t = 0: no velocities agree with all joints: {error}{self._inertialess()}",
                    error.field,
                    error.norms,
                ) from error

    def accelerations(self, t: float = 0.0) -> None:
        """Those of the equations of motion, for schemes that keep accelerations.

        Args:
            t: Time, s.
        """
        if "acceleration" not in self.problem.scheme.rates:
            return
        # motions are known from here on, and not before
        self._forces.solve(t, -self._dt)
        for body in self.model.bodies:
            dofs, rates = kinematic_dofs(body), self.problem.levels[body.name].rates
            for rate in ("a", "acceleration"):
                rates[rate].x.array[dofs] = self._forces.state(body.name).x.array[dofs]

    @cached_property
    def _forces(self) -> EndForces:
        return EndForces(self.problem)

    def _inertialess(self) -> str:
        """Which rigid bodies have no inertia about an axis, for a message."""
        bodies = self.scene.rigid_bodies
        names = [b.name for b in bodies if not np.linalg.eigvalsh(b.inertia_tensor)[0] > 0]
        if not names:
            return ""
        said = ", ".join(f"'{name}'" for name in names)
        return f"; without inertia about an axis: {said}, give inertia, or a joint that holds it"

    def _given_velocities(self) -> None:
        """Velocities of held dofs: zero, or that of their prescribed motion."""
        if "v" not in self.problem.scheme.rates:
            return
        for body in self.model.bodies:
            v = self.problem.levels[body.name].rates["v"].x.array
            for fixed in body.fixed:
                v[fixed.dofs] = fixed.rate(RATE_STEP * self._dt)
