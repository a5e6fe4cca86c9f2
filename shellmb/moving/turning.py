"""A scene that turns steadily: its relative equilibrium at a rate, and the matrices about it."""

from __future__ import annotations

import math

from mpi4py import MPI
from petsc4py import PETSc

import ufl
from dolfinx import fem

from shellmb.errors import ConvergenceError, SceneError
from shellmb.model.sections.damping import together
from shellmb.modes import shift_below
from shellmb.moving.axis import Axis, held
from shellmb.moving.frame import TurningFrame
from shellmb.scene import Scene
from shellmb.schemes.base import Levels
from shellmb.simulate.reduction.tangent import Blocks
from shellmb.simulate.soundness.redundancy import largest_gap
from shellmb.simulate.soundness.sound import sound_model
from shellmb.simulate.start.relaxation import Relaxation
from shellmb.simulate.start.start import OPEN

# a step to the next rate that fails is halved this many times
HALVINGS = 8

# Steps of the relaxation at one rate, and how far the last one moves, in scales of the bodies;
# where it moves no less than this before, round-off moves it. It has a longer `tau` where a step
# moves more than a tenth of what the one before did, and no other: forces hold no free motions, and
# their round-off moves bodies by its square.
STEPS, AT_REST, NEARLY = 60, 1e-10, 1e-7
SLOW, GROWTH = 0.1, 4.0


class Turning:
    """A scene in a frame that turns about an axis.

    Args:
        scene: The scene; its scheme and its initial velocities do not matter, and all of it turns
            along (`check_steady`).
        axis: The axis.
        comm: Communicator.
        loaded: Whether its loads act, those of the time `t_end`.

    Raises:
        SceneError: If it cannot be built, or a joint is open.

    Attributes:
        model: Bodies.
        system: Block system, whose functions hold the relative equilibrium.
        rate: Rate of that equilibrium, rad/s.
    """

    def __init__(self, scene: Scene, axis: Axis, comm: MPI.Comm, loaded: bool) -> None:
        t_end = float(scene.t_end or 1.0)
        still = held(scene).with_options(scheme="ep", dt=scene.dt or 1.0, t_end=t_end)
        self.axis, self.loaded, self.scene = axis, loaded, scene
        self.model, _ = sound_model(still, comm)
        self.frames = {body.name: TurningFrame(body, axis) for body in self.model.bodies}
        self.levels = {
            body.name: Levels(fem.Function(body.mixed.space), {}, {}, body.tangent)
            for body in self.model.bodies
        }
        self._check_closed()
        self._shift = shift_below(self.model, loaded)
        time = t_end if loaded else 0.0
        tau = 1 / math.sqrt(abs(self._shift))
        self._relaxation = Relaxation(self.model, self.levels, tau, self.frames, time)
        self.system = self._relaxation.system
        self.rate = math.nan
        self._mass, self._unit, self._damping = self._forms()
        self.mass = self.system.symmetric_matrix(self._mass, 0.0)
        self._turn(1.0)
        # M W for the rate one: it depends on no state
        self.transport = self.system.symmetric_matrix(self._unit, 0.0)

    def _check_closed(self) -> None:
        q = {name: levels.q for name, levels in self.levels.items()}
        name, gap = largest_gap(self.model, q) if self.model.mechanism.joints else ("", 0.0)
        if gap > OPEN:
            raise SceneError(
                f"joint '{name}': it is open by {gap * self.model.length:.3g} in the given "
                "positions; move its bodies"
            )

    def _forms(self) -> tuple[Blocks, Blocks, Blocks]:
        """Forms of the mass, of the mass times a rotation, and of the derivatives by rates."""
        mass: Blocks = {}
        unit: Blocks = {}
        damping: Blocks = {}
        for k, body in enumerate(self.model.bodies):
            space, frame = body.mixed.space, self.frames[body.name]
            q = self._relaxation.functions[body.name]
            test, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
            inertia, moved = body.inertia(trial, test), frame.gyroscopic(q, test)
            if inertia is not None and moved is not None:
                mass[k, k] = [inertia]
                unit[k, k] = [ufl.algorithms.expand_derivatives(ufl.derivative(moved, q, trial))]
            rates, time = frame.rates(q), fem.Constant(space.mesh, self._relaxation.time)
            forces = [body.extra(q, rates, test, time)]
            if body.damping is not None:
                # of strains, which a rotation does not change
                forces.append(-body.damping.at(q, frame.still, test))
            work = together(forces)
            if work is not None:
                by_rate = ufl.derivative(-work, frame.still, trial)
                by_rate = ufl.algorithms.expand_derivatives(by_rate)
                if not by_rate.empty():
                    damping[k, k] = [by_rate]
        return mass, unit, damping

    def _turn(self, rate: float) -> None:
        for frame in self.frames.values():
            frame.turn(rate)

    def go(self, rate: float) -> None:
        """Find the relative equilibrium at a rate, from that at the last one.

        Args:
            rate: Rate, rad/s.

        Raises:
            ConvergenceError: If there is none, or none is reached.
        """
        begin = 0.0 if math.isnan(self.rate) else self.rate
        done, part = 0.0, 1.0
        kept = {name: levels.q.x.array.copy() for name, levels in self.levels.items()}
        while done < 1.0:
            now = min(1.0, done + part)
            # forces grow with the square of the rate
            square = begin**2 + now * (rate**2 - begin**2)
            self._turn(math.copysign(math.sqrt(square), rate))
            try:
                self._settle()
            except ConvergenceError as error:
                part /= 2
                if part < 0.5**HALVINGS:
                    raise ConvergenceError(
                        f"modes: no relative equilibrium at {math.sqrt(square):.6g} rad/s: {error}",
                        error.field,
                        error.norms,
                    ) from error
                for name, levels in self.levels.items():
                    levels.q.x.array[:] = kept[name]
                continue
            done = now
            for name, levels in self.levels.items():
                kept[name][:] = levels.q.x.array
        self.rate = rate
        self._turn(rate)

    def _settle(self) -> None:
        """Relax at the rate of the frames."""
        tau, before = self._relaxation.tau, math.inf
        for _ in range(STEPS):
            moved = self._relaxation.step(tau, float(self.loaded))
            if moved < AT_REST or before <= moved < NEARLY:
                return
            tau *= GROWTH if moved > SLOW * before else 1.0
            before = moved
        raise ConvergenceError(f"nothing came to rest in {STEPS} steps", None, {})

    def matrices(self) -> tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat]:
        """Stiffness, damping with Coriolis' forces, and mass at the equilibrium."""
        K = self._relaxation.tangent()
        C = self.system.symmetric_matrix(self._damping, 0.0)
        C.axpy(2 * self.rate, self.transport)
        return K, C, self.mass

    @property
    def shift(self) -> float:
        """A positive real number of the size of the lowest eigenvalues, rad/s."""
        return math.hypot(math.sqrt(abs(self._shift)), self.rate / 2)
