"""The state before the first step: positions that close all joints, velocities they allow."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from ufl import Form

from shellmb.errors import ConvergenceError, SceneError, warn
from shellmb.model.body import Body, kinetic_energy
from shellmb.preprocessing.bodyfields import NONE, dofs_of, kinematic_dofs
from shellmb.preprocessing.constraint_analysis.redundancy import RATE_STEP, largest_gap
from shellmb.scene import FromMode, Scene
from shellmb.schemes.base import Levels
from shellmb.schemes.linearised import strain_energy
from shellmb.simulate.problem import Problem
from shellmb.simulate.start.consistent import Relaxation
from shellmb.simulate.start.endforces import STRESSES, EndForces, begin_accelerations
from shellmb.simulate.start.initial_state import count, instant, largest_misfit, load_state
from shellmb.system.assembly.functionals import functionals

# a joint is open if its ends are apart by more than this part of the scene's length
OPEN = 1e-9
# a change of the kinetic energy of given velocities that the warning shows, in six digits
DRIFT = 1e-6


class Start:
    """Prepares the state at the time zero.

    Args:
        problem: The functions of all bodies, at rest in the reference configuration.
        dt: First step, s.
        scene: The scene, as the user describes it.
    """

    def __init__(self, problem: Problem, dt: float, scene: Scene) -> None:
        self.problem, self.model, self.scene = problem, problem.model, problem.model.scene
        self._described = scene
        self._dt = dt
        # whether a state was taken, and whether its resultants are to be found
        self._taken = self._anew = False
        self._tied = any(map(self.model.coupled, self.model.bodies))
        # velocities of floating frames follow from those of their bodies
        self._following = any("frame" in body.kinematic for body in self.model.bodies)

    def positions(self) -> None:
        """Close the joints, and find the equilibrium to start from, where the scene asks.

        Raises:
            SceneError: If a joint is open and the scene does not ask to close it.
            ConvergenceError: If the joints cannot be closed, or there is no equilibrium.
        """
        for start in self.scene.starts:
            if start != "equilibrium":
                self._anew = load_state(start, self.problem, self._described) or self._anew
                self._taken = True
            elif self.problem.scheme.dynamic:
                self._close()
                self._relaxation.equilibrium()
        self._close()

    @cached_property
    def _relaxation(self) -> Relaxation:
        return Relaxation(self.model, self.problem.levels, self._dt)

    @cached_property
    def _instant(self) -> Relaxation:
        """A relaxation for times so short that multipliers are round-off."""
        return Relaxation(self.model, self.problem.levels, self._dt, untested=("lam", "mu", "hold"))

    def _close(self) -> None:
        """Close the joints, and find resultants of a state that has none; refuse what does not fit.

        Statics finds an equilibrium in its first step, and small displacements add up.
        """
        if self._taken and not self.problem.scheme.dynamic:
            return
        gap, name, said = 0.0, "", ""
        if self._tied:
            q = {name: levels.q for name, levels in self.problem.levels.items()}
            gap, name, said = largest_gap(self.model, q)
        if not self._taken:
            if gap > OPEN and not self.scene.assemble:
                raise SceneError(
                    f"joint '{name}': it is open by {said} in the given "
                    "positions; move its bodies, or use assemble=True"
                )
            if gap > OPEN:
                self._relaxation.assemble()
            return
        misfit, body, words = largest_misfit(self.problem)
        if misfit > OPEN and not self.scene.assemble:
            raise SceneError(
                f"scene '{self.scene.name}': a support or a prescribed motion of '{body}' begins "
                f"{words} away from the state that the run starts from; prescribe what that state "
                "has there, or use assemble=True"
            )
        if (misfit > OPEN or gap > OPEN or self._anew) and not self.problem.scheme.linear:
            self._settle(name, said if gap > OPEN else "")
        self._anew = False

    def _settle(self, joint: str, gap: str) -> None:
        """Hold the bodies where they are but for constraints, and find what follows from that."""
        energy = self._energy(strain_energy) if self.scene.assemble else 0.0
        levels = [(body, self.problem.levels[body.name].q.x.array) for body in self.model.bodies]
        before = [q.copy() for _, q in levels]
        apart, name = self._instant.joined()
        if apart > OPEN and not self.scene.assemble:
            raise SceneError(
                f"scene '{self.scene.name}': in the state that the run starts from, '{name}' is "
                f"{apart:.3g} of its scale away from what it is joined to; give both bodies the "
                "same displacements and rotations there, or use assemble=True"
            )
        if self.model.mechanism.edges:
            for group in self.model.mechanism.edges:
                group.follow(self.problem.levels[group.name].q.x.array)
            self._instant.joined()
        count(self.problem)
        moved = self._instant.step(instant(self.model, self._dt), 0.0)
        for (body, q), given in zip(levels, before, strict=True):
            # multipliers there are those of the constraints' errors; joints and force elements
            # have the places and coordinates that they act on
            linked = np.concatenate([NONE, *(link.dofs for link in body.links)])
            linked = np.setdiff1d(linked, dofs_of(body, ("lam", "mu")))
            found = np.concatenate([kinematic_dofs(body), dofs_of(body, STRESSES), linked])
            given[found] = q[found]
            q[:] = given
        # a mode is off the constraints by its square
        of_mode = isinstance(self.scene.starts[-1], FromMode)
        if gap and moved > OPEN and not self.scene.assemble and not of_mode:
            raise SceneError(
                f"joint '{joint}': it is open by {gap} in the state that the run starts from; it "
                "must be closed there, or use assemble=True"
            )
        if self.scene.assemble and moved > OPEN:
            after = self._energy(strain_energy)
            warn(
                f"scene '{self.scene.name}': the state that the run starts from was moved by "
                f"{moved:.3g} of the bodies' scales to fit supports and joints; its strain energy "
                f"was {energy:.6g}, is {after:.6g}"
            )

    def _energy(self, of: Callable[[Body, Levels], Form | None]) -> float:
        """An energy of all bodies at the start, J; collective."""
        forms = [of(body, self.problem.levels[body.name]) for body in self.model.bodies]
        some = [form for form in forms if form is not None and not form.empty()]
        return float(functionals([some], self.model.comm)()[0]) if some else 0.0

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
                u = body.mixed.nodal("u")[nodes]
                w = body.mixed.nodal("w")[nodes]
                if self._taken and not self.problem.scheme.linear:
                    now = self.problem.levels[body.name].q.x.array
                    X, D = X + now[u], D + now[w].reshape(D.shape)
                v[u] += linear + np.cross(spin, X - np.asarray(initial.about))
                v[w] += np.cross(spin, D).reshape(w.shape)
        # what is free keeps its velocities, and needs no energy to be compared
        bound = self._tied or self._following or self.scene.supports
        given = self._taken or (self.scene.initial and bound)
        before = self._energy(_kinetic) if given else 0.0
        for body in self.model.bodies:
            # held dofs have none, or that of their prescribed motion
            v = self.problem.levels[body.name].rates["v"].x.array
            for fixed in body.fixed:
                v[fixed.dofs] = fixed.rate(RATE_STEP * self._dt)
        if self.scene.initial and not self.scene.assemble:
            contacts = self.model.mechanism.contacts
            rates = self.problem.projection.given() if contacts else {}
            for group in contacts:
                q = self.problem.levels[group.name].q
                group.refuse_slip(q.x.array, rates[group.name].x.array)
        velocities = [levels.rates["v"].x.array for levels in self.problem.levels.values()]
        # of what rests nothing is to be made consistent. Where something begins to act later the
        # projection is made here nevertheless, so that a resumed run has the same
        needed = self.model.comm.allreduce(any(map(np.any, velocities))) or self.problem.switches
        if (self._tied or self._following) and (needed or self._inertialess()):
            try:
                self.problem.projection.project()
            except ConvergenceError as error:
                raise error.reworded(
                    f"t = 0: no velocities agree with all joints: {error}{self._inertialess()}"
                ) from error
        if before > 0.0:
            self._warn_of_other_velocities(before)

    def _warn_of_other_velocities(self, before: float) -> None:
        """Warn of the energy of velocities that supports and joints do not allow."""
        after = self._energy(_kinetic)
        whose = "of the state that the run starts from" if self._taken else "that are given"
        if abs(after - before) > DRIFT * before:
            warn(
                f"scene '{self.scene.name}': supports and joints do not allow the velocities "
                f"{whose}; their kinetic energy was {before:.6g}, is {after:.6g}"
            )

    def accelerations(self, t: float = 0.0) -> None:
        """Find accelerations from the equations of motion, for schemes that keep them.

        Args:
            t: Time, s.
        """
        # motions are known from here on, and not before
        begin_accelerations(self.problem, lambda: self._forces, t, -self._dt)

    @cached_property
    def _forces(self) -> EndForces:
        return EndForces(self.problem)

    def _inertialess(self) -> str:
        """List the rigid bodies without inertia about an axis, for a message."""
        bodies = self.scene.rigid_bodies
        names = [b.name for b in bodies if not np.linalg.eigvalsh(b.inertia_tensor)[0] > 0]
        if not names:
            return ""
        said = ", ".join(f"'{name}'" for name in names)
        return f"; without inertia about an axis: {said}, give inertia, or a joint that holds it"


def _kinetic(body: Body, levels: Levels) -> Form | None:
    return kinetic_energy(body, levels.rates["v"])
