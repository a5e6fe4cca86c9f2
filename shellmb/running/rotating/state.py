"""A state of a run in a frame that turns, with accelerations and multipliers of that instant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError, SceneError
from shellmb.model.body import Body, added
from shellmb.model.model import Model
from shellmb.native.assembler import assembled_as
from shellmb.preprocessing.bodyfields import kinematic_dofs
from shellmb.preprocessing.checked_model import checked_model
from shellmb.running.rotating.axis import Axis, bearing, check_steady
from shellmb.running.rotating.linearised import Linearised, RotatingFrame
from shellmb.running.rotating.modes import RotatingModes
from shellmb.running.rotating.rigid import (
    NOTHING,
    Functions,
    Products,
    Unsteady,
    WholeMotion,
    spinning,
)
from shellmb.scene import JointDamper, Motor, Scene
from shellmb.scene.schemes import SIMPLEST
from shellmb.scene.values.validate import listed, said, show
from shellmb.schemes.base import Levels
from shellmb.schemes.registry import make_scheme
from shellmb.simulate.problem import Problem
from shellmb.simulate.start.endforces import EndForces

Arrays = Mapping[str, Floats]

# an axis that follows from a state is known to the errors of its run, in time and of constraints
KNOWN = 1e-6

# of the energy of motion, below which nothing turns
STANDS = 1e-12

# what balances the forces of a state moves its bodies by no more than this, in their scales: by
# the errors of constraints in the run, times the square of a time of the lowest modes
BALANCED = 1e-5

# of the length of the scene: a plate as thin as that bends by its thickness, which changes modes
STEADY = 1e-2


class StateFrame(RotatingFrame):
    """A frame that turns, in which a body moves at a state and is accelerated.

    Neighbouring states have the same velocities and accelerations relative to the frame, and
    triples of directors the same components of these along themselves: they spin about their own
    axes. So small motions of what spins are those of its axes, not of its material, and have
    gyroscopic forces. For `d_k(t)` spinning, `d_k + sum_j (d_j(0) . d_k(t)) e_j` are neighbours
    with small `e_j`, and of `e_j` with constant coefficients if inertia is the same all around.

    Args:
        body: The body.
        axis: The axis.
        state: The state.
        velocity: Absolute velocities there.
        acceleration: Absolute accelerations.
    """

    def __init__(
        self,
        body: Body,
        axis: Axis,
        state: fem.Function,
        velocity: fem.Function,
        acceleration: fem.Function,
    ) -> None:
        super().__init__(body, axis)
        self._state = state
        # relative to the frame
        self._velocity = velocity - self.turned(state)
        self._acceleration = (
            acceleration - self.centripetal(state) - 2 * self._across(self._velocity)
        )

    def motion(self, q: Expr) -> Expr:
        """Velocities in the frame, those of neighbouring states."""
        return self.still + self._along(q, self._velocity)

    def carried(self, q: Expr, dq: Expr) -> Form | None:
        """Inertia forces of a state with these accelerations, and the forces of damped strains."""
        relative = self._along(q, self._acceleration)
        coriolis = 2 * self._across(self._along(q, self._velocity))
        forms = [self.body.inertia(relative + coriolis + self.centripetal(q), dq)]
        if self.body.damping is not None:
            forms.append(self.body.damping.at(q, self.motion(q), dq))
        return added(forms)

    def spun(self, q: Expr, dq: Expr) -> Form | None:
        """`M` times the velocities in the frame of neighbouring states."""
        return self.body.inertia(self._along(q, self._velocity), dq)

    def _across(self, rate: Expr) -> Expr:
        """`omega x` of vectors that a rate has."""
        return self.turned(self._state + rate) - self.turned(self._state)

    def _along(self, q: Expr, rate: Expr) -> Expr:
        """The rate that a neighbouring state has: along its own directors that of the state."""
        body = self.body
        if body.vectors_at is None:
            return rate
        here, there = (body.vectors_at(at).get("w", ()) for at in (self._state, q))
        if len(here) != 3:
            return rate
        components = [rate[i] for i in range(rate.ufl_shape[0])]
        first, size = body.mixed.parts["w"]
        for k in range(first, first + size, 3):
            own = ufl.as_vector(components[k : k + 3])
            turned = sum(ufl.dot(d, own) * e for d, e in zip(here, there, strict=True))
            components[k : k + 3] = [turned[i] for i in range(3)]
        return ufl.as_vector(components)


@dataclass(frozen=True)
class StateModes:
    """Modes about a state.

    Args:
        modes: The modes, as seen from the frame.
        state: The state.
    """

    modes: RotatingModes
    state: MovingState

    @property
    def drift(self) -> float:
        """Distance that the state moves during one radian of its slowest mode.

        In lengths of the scene, root mean square over the mass; and the part by which inertia
        changes that spins and is not the same all around.
        """
        sizes = np.abs(self.modes.values[self.modes.rigid :])
        return self.state.unsteady.drift(float(min(sizes, default=self.state.shift)))

    @property
    def warnings(self) -> list[str]:
        """Warnings that the eigenvalues mean little, or that bodies are too stiff or too soft."""
        if self.drift <= STEADY:
            return [*self.modes.doubtful]
        return [
            f"the state is no steady motion: it moves by {self.drift:.2g} of the scene's length, "
            "or its inertia changes by that part, in the time in which its slowest mode turns by "
            "one radian; eigenvalues frozen in time say little about what follows",
            *self.modes.doubtful,
        ]

    @property
    def verdict(self) -> str:
        """Say whether a mode grows, in one sentence."""
        found = self.modes
        if not found.unstable:
            said = "no mode grows"
        else:
            value = complex(found.values[found.unstable[0] - 1])
            kind = "divergence" if value.imag == 0 else "flutter"
            said = f"mode {found.unstable[0]} grows by {value.real:.4g}/s ({kind})"
        at = "at rest" if found.rate == 0 else f"that turns by {found.rate:.6g} rad/s"
        return "; ".join([f"at t = {self.state.time:g}, in a frame {at}: {said}", *self.warnings])


class MovingState(Linearised):
    """A scene at a state of a run, in a frame that turns.

    Args:
        scene: The scene.
        arrays: The state, as `Simulation.arrays` gives it on this rank.
        counters: As of `Simulation.state`.
        comm: Communicator.
        rate: Rate of the frame, rad/s; None: that of the rigid rotation nearest to the state.
        axis: Its axis; None: that of this rotation.
        about: A point of it; None: where accelerations say it is.

    Raises:
        SceneError: If what is given does not fit the scene, or the scene has no such modes.
        ConvergenceError: If the state's accelerations do not follow from it.

    Attributes:
        time: Time of the state, s.
        unsteady: How far it is from a steady rotation.
        standing: Why the frame does not turn; "" where it does.
    """

    @assembled_as(lambda self, scene, *_, **__: scene.solver)
    def __init__(
        self,
        scene: Scene,
        arrays: Arrays,
        counters: Mapping[str, Any],
        comm: MPI.Comm,
        rate: float | None = None,
        axis: Sequence[float] | None = None,
        about: Sequence[float] | None = None,
    ) -> None:
        self.time = t = float(counters["t"])
        _refuse_strained(scene, any(key.endswith("/v") for key in arrays))
        moving = scene.with_options(scheme=SIMPLEST)
        model, _ = checked_model(moving, comm)
        model.mechanism.switches.restore(counters["switches"])
        found = _motion(model, arrays, t, moving.dt)
        q, velocity, acceleration = found
        products = Products(model, q)
        whole = WholeMotion(products, model.length)
        line, omega, self.standing = _frame(
            scene, products, whole, velocity, acceleration, (rate, axis, about)
        )
        frames = {
            b.name: StateFrame(b, line, q[b.name], velocity[b.name], acceleration[b.name])
            for b in model.bodies
        }
        levels = {b.name: Levels(q[b.name], {}, {}, b.manifold.tangent) for b in model.bodies}
        self.unsteady = Unsteady(scene, products, whole, (velocity, acceleration), line, omega)
        super().__init__(model, line, frames, levels, t, True)
        self.rate = omega
        self.turn(omega)
        points = {b.name: b.follow for b in model.bodies if b.follow is not None}
        if any(f"{name}/q" not in arrays for name in points):
            self.relaxation.joined()
            for name, follow in points.items():
                follow(q[name].x.array)
        moved = self.relaxation.step(self.relaxation.tau, 1.0)
        if not moved < BALANCED:
            raise ConvergenceError(
                f"modes: the state at t = {t:g} is not in balance with its accelerations (by "
                f"{moved:.1e} of the bodies' scales); run it with a smaller tolerance or step"
            )


def check_state(scene: Scene, scheme: str) -> None:
    """Check that there are modes about a state of a run.

    Args:
        scene: The scene.
        scheme: Scheme of the run.

    Raises:
        SceneError: Names what has none.
    """
    if scheme in ("linear-statics", "linear-dynamics"):
        raise SceneError(
            f"modes: the state is of the scheme '{scheme}', whose equations are those about the "
            "reference; compute the modes without a state"
        )
    if scene.path is not None:
        raise SceneError(
            "modes: the state is of a static path, where the factor of the loads is unknown; "
            "multiply the loads by it and compute the modes of the loaded scene, without a state"
        )
    for contact in scene.contacts:
        if contact.obstacle.deforms:
            raise SceneError(
                f"modes: contact '{contact.name}' is with the faces of a shell, which is no part "
                "of the linearised equations; compute the modes without a state, or remove it"
            )
    if scene.controllers:
        names = listed(c.name for c in scene.controllers)
        raise SceneError(
            f"modes: the scene has controllers ({names}), which act by samples in time and are no "
            "part of the linearised equations; its states have modes without them only"
        )
    for joint in scene.joints:
        if joint.rolls:
            raise SceneError(
                f"modes: {joint.said} rolls on ground or slips; states with such contacts have no "
                "modes here"
            )


def _refuse_strained(scene: Scene, moved: bool) -> None:
    """Check that all branches are relaxed at a state: of a motion or of statics.

    Raises:
        SceneError: Names what relaxes.
    """
    sections = {said(b): b.section for b in scene.meshed if b.section.relaxes}
    series = {said(e): e.relaxation for e in scene.force_elements if e.relaxation is not None}
    for who, item in (sections | series).items():
        if moved or not item.relaxed:
            raise SceneError(
                f"modes: {who} relaxes, and there are equations about states where its branches "
                "are relaxed only: rest, a steady rotation, and with relaxed=True an equilibrium"
            )


def _motion(
    model: Model, arrays: Arrays, t: float, dt: float
) -> tuple[dict[str, fem.Function], dict[str, fem.Function], dict[str, fem.Function]]:
    """State, velocities that the constraints allow, and accelerations, by body."""
    found = tuple({b.name: fem.Function(b.mixed.space) for b in model.bodies} for _ in range(3))
    q, velocity, acceleration = found
    dynamic = any(key.endswith("/v") for key in arrays)
    problem = Problem(model, make_scheme(SIMPLEST, 0.0)) if dynamic else None
    for body in model.bodies:
        given = arrays.get(f"{body.name}/q")
        if given is None and not dynamic and body.follow is not None:
            # it follows from modes and frames
            continue
        if given is None or given.shape != q[body.name].x.array.shape:
            raise SceneError(f"modes: the state has no part '{body.name}' of this scene's size")
        q[body.name].x.array[:] = given
        if problem is not None:
            levels = problem.levels[body.name]
            levels.q.x.array[:] = given
            levels.rates["v"].x.array[:] = arrays[f"{body.name}/v"]
    if problem is not None:
        forces = EndForces(problem)
        # a motion need not be defined before its start
        forces.solve(t, dt if t >= dt else -dt)
        for body in model.bodies:
            dofs = kinematic_dofs(body)
            # of places of joints, too, which dampers know
            velocity[body.name].x.array[:] = forces.velocity[body.name].x.array
            acceleration[body.name].x.array[dofs] = forces.state(body.name).x.array[dofs]
    return q, velocity, acceleration


def _frame(
    scene: Scene,
    products: Products,
    whole: WholeMotion,
    velocity: Functions,
    acceleration: Functions,
    given: tuple[float | None, Sequence[float] | None, Sequence[float] | None],
) -> tuple[Axis, float, str]:
    """Axis and rate of the frame, and why it stands."""
    rate, axis, about = given
    held = bearing(scene) if axis is None else None
    chosen = Axis(axis) if axis is not None else held
    omega = whole.rotation(velocity, None if chosen is None else chosen.unit)
    if held is not None:
        # the rotation about that very line
        turn = spinning(held.unit, np.asarray(held.about))
        inertia = products.square(None, turn)
        along = products((velocity, NOTHING), (None, turn)) / inertia if inertia > 0 else 0.0
        omega = along * held.unit
    middle = whole.centre if held is None else np.asarray(held.about)
    rotating = products.square(None, spinning(omega, middle))
    still = rotating <= STANDS * products.square(velocity)
    if rate and chosen is None and still:
        raise SceneError(
            f"modes: rate is {rate:g}, and nothing turns in the state, so the axis of rotation "
            "is unknown; give axis, and about"
        )
    size = float(np.linalg.norm(omega))
    unit = chosen.unit if chosen is not None else omega / size if size > 0 else np.eye(3)[2]
    own = float(rate) if rate is not None else 0.0 if still else float(unit @ omega)
    if about is not None:
        point = about
    elif held is not None:
        point = held.about
    else:
        # of what turns about an axis the centre is accelerated towards it
        pull = whole.translation(acceleration)
        away = (pull - (pull @ unit) * unit) / own**2 if own else np.zeros(3)
        point = (whole.centre + away).tolist()
    line = Axis(unit.tolist(), point, KNOWN)
    if own == 0:
        return line, 0.0, "nothing turns" if rate is None else "its rate is given as 0"
    try:
        _check_turns(scene, line)
    except SceneError as error:
        if rate is not None or axis is not None:
            raise
        return line, 0.0, str(error).removeprefix("modes: ")
    return line, own, ""


def _check_turns(scene: Scene, line: Axis) -> None:
    """Check that all of a scene turns along, as it is held in space."""
    for support in scene.supports:
        if support.rotation is None and support.translation is None:
            place = getattr(support, "at", "")
            raise SceneError(
                f"modes: {said(support)} {show(place)} is fixed in space and does not rotate "
                "with the system"
            )
    # these know only rates, which are those in space whatever the frame
    kept = tuple(e for e in scene.force_elements if not isinstance(e, JointDamper | Motor))
    check_steady(replace(scene, force_elements=kept), line, True)
