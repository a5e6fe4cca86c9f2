"""Equations of motion in a frame that turns, linearised about a state: their matrices."""

from __future__ import annotations

import math
from collections.abc import Mapping

from petsc4py import PETSc

import ufl
from dolfinx import fem

from shellmb.model.body import added
from shellmb.model.model import Model
from shellmb.model.sections.branches import branches_of
from shellmb.native.derivatives import derivative
from shellmb.preprocessing.modal.tangent import Blocks
from shellmb.running.rotating.axis import Axis
from shellmb.running.rotating.frame import RotatingFrame
from shellmb.schemes.base import Levels
from shellmb.simulate.eigenmodes import shift_below
from shellmb.simulate.start.relaxation import Relaxation


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
        self.mass = self.system.symmetric_matrix(self._mass, 0.0)
        self.turn(1.0)
        # M W for the rate one: it depends on no state
        self.transport = self.system.symmetric_matrix(self._unit, 0.0)

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

    def matrices(self) -> tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat]:
        """Stiffness, damping with Coriolis' forces, and mass at the state."""
        K = self.relaxation.tangent()
        C = self.system.symmetric_matrix(self._damping, 0.0)
        C.axpy(2 * self.rate, self.transport)
        return K, C, self.mass

    def branches(self, columns: bool = False) -> dict[float, PETSc.Mat]:
        """Stiffness of Maxwell branches that are relaxed at the state, by their times [s].

        Args:
            columns: Whether those of fixed dofs stay.
        """
        forms: dict[float, Blocks] = {}
        for k, body in enumerate(self.model.bodies):
            own = branches_of(body)
            q = self.relaxation.functions[body.name]
            for time, form in () if own is None else own.stiffness(q):
                forms.setdefault(time, {}).setdefault((k, k), []).append(form)
        matrix = self.system.symmetric_matrix
        return {time: matrix(of, 0.0, columns) for time, of in forms.items()}

    def columns(self) -> tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat]:
        """Matrices with the columns of fixed dofs, by which prescribed motions act."""
        K, matrix = self.relaxation.tangent(columns=True), self.system.symmetric_matrix
        C, M = (matrix(forms, 0.0, columns=True) for forms in (self._damping, self._mass))
        self.turn(1.0)
        C.axpy(2 * self.rate, matrix(self._unit, 0.0, columns=True))
        self.turn(self.rate)
        return K, C, M

    @property
    def shift(self) -> float:
        """A positive real number of the size of the lowest eigenvalues, rad/s."""
        return math.hypot(math.sqrt(abs(self._shift)), self.rate / 2)
