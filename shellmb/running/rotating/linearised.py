"""Frames that turn, and equations of motion in them, linearised about a state: their matrices.

In a frame that turns with the angular velocity `omega` about an axis through `c` positions and
directors are vectors, and the velocity of a state at rest in the frame is `W y` with
`W = omega x` for `x - c` and for each director. Absolute velocities and accelerations are
`y' + W y` and `y'' + 2 W y' + W^2 y`. Mass matrices are constant and know no direction, so that
`M (y'' + 2 W y' + W^2 y)` are the inertia forces along the axes of the frame.
"""

import math
from collections.abc import Callable, Mapping

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.errors import ConvergenceError, SceneError
from shellmb.model.body import Body, Rates, added, rigid_rate
from shellmb.model.model import Model
from shellmb.model.sections.branches import branches_of
from shellmb.native.derivatives import derivative
from shellmb.preprocessing.checked_model import checked_model
from shellmb.preprocessing.constraint_analysis.redundancy import largest_gap
from shellmb.preprocessing.modal.tangent import Blocks
from shellmb.running.rotating.axis import Axis, held
from shellmb.scene import Scene
from shellmb.scene.schemes import SIMPLEST
from shellmb.schemes.base import Levels
from shellmb.simulate.eigenmodes import shift_below
from shellmb.simulate.start.consistent import Relaxation
from shellmb.simulate.start.start import OPEN


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


class Linearised:
    """Bodies in a frame that turns about an axis, and small motions about their state there.

    Args:
        model: The bodies.
        axis: The axis.
        frames: The frame as each body sees it, by name.
        levels: Functions of the bodies; `q` is the state.
        time: When loads and prescribed motions are taken, s.
        loaded: Whether loads act.

    Attributes:
        relaxation: Finds the state and its multipliers.
        system: Its block system.
        rate: Rate of the frame, rad/s.
        mass: Mass matrix.
        transport: The mass times `omega x`, for the rate one.
    """

    def __init__(
        self,
        model: Model,
        axis: Axis,
        frames: Mapping[str, RotatingFrame],
        levels: dict[str, Levels],
        time: float,
        loaded: bool,
    ) -> None:
        self.model, self.axis, self.frames, self.levels = model, axis, frames, levels
        self._shift = shift_below(model, loaded)
        self.relaxation = Relaxation(model, levels, 1 / math.sqrt(abs(self._shift)), frames, time)
        self.system = self.relaxation.system
        self.rate = math.nan
        self._mass, self._unit, self._damping = self._forms()
        self.mass, self.transport = self._inert(columns=False)

    def _forms(self) -> tuple[Blocks, Blocks, Blocks]:
        """Forms of the mass, of the mass times a rotation, and of the derivatives by rates."""
        mass: Blocks = {}
        unit: Blocks = {}
        damping: Blocks = {}
        for k, body in enumerate(self.model.bodies):
            space, frame = body.mixed.space, self.frames[body.name]
            q = self.relaxation.functions[body.name]
            test, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
            inertia, moved = body.inertia(trial, test), frame.gyroscopic(q, test)
            if inertia is not None and moved is not None:
                mass[k, k] = [inertia]
                # amplitudes of modes do not turn: they are refused where anything does
                if q in moved.coefficients():
                    unit[k, k] = [derivative(moved, q)]
            rates, time = frame.rates(q), fem.Constant(space.mesh, self.relaxation.time)
            forces = [body.applied(q, rates, test, time)]
            if body.damping is not None:
                # of strains, which a rotation does not change
                forces.append(-body.damping.at(q, frame.motion(q), test))
            work = added(forces)
            if work is not None and frame.still in work.coefficients():
                damping[k, k] = [derivative(-work, frame.still)]
            spun = frame.spun(q, test)
            if spun is not None and q in spun.coefficients():
                damping.setdefault((k, k), []).append(derivative(2 * spun, q))
        return mass, unit, damping

    def turn(self, rate: float) -> None:
        """Let the frames turn with another rate, rad/s."""
        for frame in self.frames.values():
            frame.turn(rate)

    def matrices(self, columns: bool = False) -> tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat]:
        """Stiffness, damping with Coriolis' forces, and mass at the state.

        Args:
            columns: Whether those of fixed dofs stay, by which prescribed motions act.
        """
        K = self.relaxation.tangent(columns)
        C = self.system.symmetric_matrix(self._damping, 0.0, columns)
        M, transport = self._inert(columns) if columns else (self.mass, self.transport)
        C.axpy(2 * self.rate, transport)
        self.turn(self.rate)
        return K, C, M

    def _inert(self, columns: bool) -> tuple[PETSc.Mat, PETSc.Mat]:
        """`M`, and `M W` for the rate one, at which frames are left: they depend on no state."""
        self.turn(1.0)
        matrix = self.system.symmetric_matrix
        return matrix(self._mass, 0.0, columns), matrix(self._unit, 0.0, columns)

    def branches(self, columns: bool = False) -> dict[float, PETSc.Mat]:
        """Stiffness of Maxwell branches that are relaxed at the state, by their times [s].

        Args:
            columns: Whether those of fixed dofs stay.
        """
        forms: dict[float, Blocks] = {}
        for k, body in enumerate(self.model.bodies):
            q = self.relaxation.functions[body.name]
            pairs = (pair for own in branches_of(body) or () for pair in own.stiffness(q))
            for time, form in pairs:
                forms.setdefault(time, {}).setdefault((k, k), []).append(form)
        matrix = self.system.symmetric_matrix
        return {time: matrix(of, 0.0, columns) for time, of in forms.items()}

    @property
    def shift(self) -> float:
        """A positive real number of the size of the lowest eigenvalues, rad/s."""
        return math.hypot(math.sqrt(abs(self._shift)), self.rate / 2)


# a step to the next rate that fails is halved this many times
HALVINGS = 8

# Steps of the relaxation at one rate, and how far the last one moves, in scales of the bodies;
# where it moves no less than this before, round-off moves it. It has a longer `tau` where a step
# moves more than a tenth of what the one before did, and no other: forces hold no free motions, and
# their round-off moves bodies by its square.
STEPS, AT_REST, NEARLY = 60, 1e-10, 1e-7
SLOW, GROWTH = 0.1, 4.0


class SteadyRotation(Linearised):
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
        still = held(scene).with_options(scheme=SIMPLEST)
        self.loaded, self.scene = loaded, scene
        model, _ = checked_model(still, comm)
        frames = {body.name: RotatingFrame(body, axis) for body in model.bodies}
        levels = as_given(model)
        check_closed(model, levels)
        super().__init__(model, axis, frames, levels, still.t_end if loaded else 0.0, loaded)

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
            self.turn(math.copysign(math.sqrt(square), rate))
            try:
                self._settle()
            except ConvergenceError as error:
                part /= 2
                if part < 0.5**HALVINGS:
                    raise error.reworded(
                        f"modes: no relative equilibrium at {math.sqrt(square):.6g} rad/s: {error}"
                    ) from error
                for name, levels in self.levels.items():
                    levels.q.x.array[:] = kept[name]
                continue
            done = now
            for name, levels in self.levels.items():
                kept[name][:] = levels.q.x.array
        self.rate = rate
        self.turn(rate)

    def _settle(self) -> None:
        """Relax at the rate of the frames."""
        tau, before = self.relaxation.tau, math.inf
        for _ in range(STEPS):
            moved = self.relaxation.step(tau, float(self.loaded))
            if moved < AT_REST or before <= moved < NEARLY:
                return
            tau *= GROWTH if moved > SLOW * before else 1.0
            before = moved
        raise ConvergenceError(f"nothing came to rest in {STEPS} steps")


def as_given(model: Model) -> dict[str, Levels]:
    """Functions of bodies that are where the scene has them."""
    return {
        body.name: Levels(fem.Function(body.mixed.space), {}, {}, body.manifold.tangent)
        for body in model.bodies
    }


def check_closed(model: Model, levels: dict[str, Levels]) -> None:
    """Refuse joints that are open; collective."""
    q = {name: own.q for name, own in levels.items()}
    gap, name, said = largest_gap(model, q) if model.mechanism.joints else (0.0, "", "")
    if gap > OPEN:
        raise SceneError(
            f"joint '{name}': it is open by {said} in the given positions; move its bodies"
        )
