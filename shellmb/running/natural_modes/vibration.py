"""Natural frequencies and modes about the reference or a loaded state (SLEPc, shift and invert)."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Complex, Floats
from shellmb.diagnostics.base import Motion
from shellmb.diagnostics.modes import SECTIONS, beside_better
from shellmb.errors import ConvergenceError, SceneError, UnheldError, petsc_in_words
from shellmb.model.body import Body, Rates, TimeFunction
from shellmb.model.model import Model
from shellmb.native.assembler import assembled_as
from shellmb.preprocessing.checked_model import checked_model
from shellmb.preprocessing.modal.tangent import tangent
from shellmb.running.natural_modes.shapes import Shape, mode_shape, parts_of
from shellmb.running.rotating.linearised import as_given, check_closed
from shellmb.running.rotating.modes import SPARE, modes_of
from shellmb.running.rotating.state import MovingState, check_state
from shellmb.scene import Scene
from shellmb.scene.schemes import SIMPLEST
from shellmb.simulate.eigenmodes import Lowest, lowest, shift_below
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.start.consistent import Relaxation
from shellmb.system.assembly.blocks import BlockSystem


@dataclass(frozen=True)
class Equilibrium:
    """State of bodies that loads do not move.

    Args:
        model: The bodies with their masses; multipliers have the unit that they have in the state.
        arrays: Local arrays, by `NAME/q`.
        counters: Its time and what else a restart needs, as of `Simulation.saved`.
        factor: Factor of each load by its function of time.
    """

    model: Model
    arrays: Mapping[str, Floats]
    counters: Mapping[str, Any]
    factor: Callable[[TimeFunction | None], float]


def equilibrium(scene: Scene, comm: MPI.Comm) -> Equilibrium:
    """Equilibrium that a scene's loads lead to in statics, or its bodies by coming to rest.

    Args:
        scene: The scene; its scheme does not matter.
        comm: Communicator.

    Raises:
        SceneError: If nothing holds a motion, not even the loads.
        ConvergenceError: If no equilibrium is found.
    """
    try:
        static = Simulation(scene.with_options(scheme="static"), comm)
    except UnheldError as unheld:
        try:
            return _at_rest(scene, comm)
        except ConvergenceError:
            raise unheld from None
    model, _ = checked_model(scene.with_options(scheme=SIMPLEST), comm, static.model.force)
    static.run()
    return Equilibrium(model, *static.saved(), partial(static.problem.start_factor, static.t))


def _at_rest(scene: Scene, comm: MPI.Comm) -> Equilibrium:
    """Equilibrium in which bodies come to rest that only their loads hold, as pendulums do."""
    model, _ = checked_model(scene.with_options(scheme=SIMPLEST), comm)
    levels = as_given(model)
    if not scene.assemble:
        check_closed(model, levels)
    t = scene.t_end
    Relaxation(model, levels, 1 / math.sqrt(-shift_below(model, True)), time=t).equilibrium()
    arrays = {f"{name}/q": own.q.x.array for name, own in levels.items()}
    counters = {"t": t, "switches": model.mechanism.switches.state()}
    return Equilibrium(model, arrays, counters, lambda of: 1.0 if of is None else float(of(t)))


@dataclass(frozen=True)
class Modes:
    """Natural modes, lowest first; with damping those with the smallest eigenvalues first.

    Args:
        squares: Squares of the angular frequencies, rad^2/s^2; negative ones are unstable. Complex
            ones come in pairs where loads follow the bodies.
        omega: Angular frequencies, rad/s; a mode that grows without swinging has a negative one.
        growth: Rates at which modes grow, `exp(growth t)`, 1/s; negative where dampers resist them.
        fields: Fields of each mode by name, as files have them: by the body's name in the system,
            the displacement of a shell or a beam at this rank's nodes, shape (n, 3), and of the
            rigid bodies of this rank the displacement of the centre and the changes of the three
            directors, shape (n, 12).
        model: The model, with the nodes' positions.
        unknowns: Number of unknowns of the eigenproblem.
        rigid: Number of rigid-body modes, which are the first ones.
        unstable: Number of directions in which the state is unstable; None where it is not known.
        doubtful: Warnings about bodies that are too stiff, as their elements lock, on modes that
            these hardly resist, and on bodies that forces do not stiffen, as their strains are
            small.
    """

    squares: Complex
    omega: Floats
    growth: Floats
    fields: list[dict[str, Shape]]
    model: Model
    unknowns: int
    rigid: int
    unstable: int | None
    doubtful: Sequence[str] = ()

    @property
    def omega2(self) -> Floats:
        """Real parts of the squares."""
        return self.squares.real

    @property
    def imaginary(self) -> Floats:
        """Imaginary parts of the squares, zero where these are real."""
        return self.squares.imag

    @property
    def shapes(self) -> list[Shape]:
        """Displacements of each mode, with damping their real parts."""
        return [fields["displacement"] for fields in self.fields]

    @property
    def warnings(self) -> list[str]:
        """Warnings that the state is unstable, or that bodies are too stiff or too soft."""
        said, growth = [], self.growth
        places = np.flatnonzero(growth > 0)
        if len(places):
            k = int(places[np.argmax(growth[places])])
            numbers = ", ".join(str(n + 1) for n in places)
            which = f"mode {numbers} grows" if len(places) == 1 else f"modes {numbers} grow"
            kind = "flutter" if self.imaginary[k] or self.omega[k] > 0 else "divergence"
            said.append(
                f"the state is unstable: {which}, the fastest by {growth[k]:.4g}/s (mode {k + 1}, "
                f"{kind})"
            )
        if self.unstable is not None and self.unstable > len(places):
            said.append(
                f"the state is unstable in {self.unstable} directions, {len(places)} of which are "
                "among the modes; ask for more modes"
            )
        return [*said, *self.doubtful]

    @property
    def frequencies(self) -> Floats:
        """Frequencies, Hz; a mode that grows without swinging has a negative one."""
        return self.omega / (2 * np.pi)


@petsc_in_words()
@assembled_as(lambda scene, *_, **__: scene.solver)
def natural_modes(
    scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD, count: int = 6, loaded: bool = False
) -> Modes:
    """Natural modes of a scene, and of a loaded one that resists velocities damped ones.

    Those are the modes about a steady rotation with the rate zero.

    Args:
        scene: The scene; its scheme does not matter.
        comm: Communicator.
        count: Number of modes wanted, rigid-body modes included.
        loaded: Whether about the static equilibrium under the scene's loads, with its damping.

    Raises:
        SceneError: If a body has no mass, `count` is not positive, or constraints contradict one
            another.
        ConvergenceError: If the static state or the eigenproblem does not converge, or there are
            fewer modes than wanted.
    """
    check_count(count)
    state = equilibrium(scene, comm) if loaded else None
    found = _undamped(scene, comm, count, state)
    resisting = [body.name for body in found.model.bodies if _resists(body)]
    if state is None or not resisting:
        return found
    try:
        return _damped(scene, state, found, count)
    except (SceneError, ConvergenceError) as error:
        why = str(error).removeprefix("modes: ")
        return replace(
            found,
            doubtful=[
                f"damping ({', '.join(resisting)}) is left out: growth and frequencies are those "
                f"of the same scene without it, and it may be unstable where these are not. {why}",
                *found.doubtful,
            ],
        )


def _undamped(scene: Scene, comm: MPI.Comm, count: int, state: Equilibrium | None) -> Modes:
    """Modes about an equilibrium, or the reference, without what resists velocities."""
    if state is None:
        model, _ = checked_model(scene.with_options(scheme=SIMPLEST), comm)
        system, stiffness, mass = tangent(model)
    else:
        model = state.model
        system, stiffness, mass = tangent(model, state.arrays, state.factor)
    found = lowest(model, system, stiffness, mass, count, state is not None)
    squares, root = found.values, np.sqrt(found.values)
    swung = np.where(squares.imag == 0.0, np.sign(squares.real) * np.abs(root), root.real)
    growth = np.where(np.arange(len(root)) >= found.rigid, np.abs(root.imag), 0.0)
    fields = [{"displacement": mode_shape(system, model, v)} for v in found.vectors]
    doubtful = _doubtful(model, system, found, state)
    return Modes(
        squares, swung, growth, fields, model, system.size, found.rigid, found.unstable, doubtful
    )


def _damped(scene: Scene, state: Equilibrium, undamped: Modes, count: int) -> Modes:
    """Modes with damping about an equilibrium, of which those without are known; collective."""
    check_state(scene, "")
    moving = MovingState(scene, state.arrays, state.counters, undamped.model.comm, 0.0)
    # those of a diagram at the rate zero
    found = modes_of(moving, count, SPARE)
    values, number, rigid = found.values[:count], np.arange(1, count + 1), min(found.rigid, count)
    # of what swings without end round-off may grow
    grows = (values.real <= 0) | np.isin(number, found.unstable)
    return replace(
        undamped,
        squares=-(values**2),
        omega=values.imag,
        growth=np.where((number > rigid) & grows, values.real, 0.0),
        fields=found.fields[:count],
        model=found.model,
        unknowns=found.unknowns,
        rigid=rigid,
    )


def _resists(body: Body) -> bool:
    """Decide whether forces of a body depend on velocities."""
    space = body.mixed.space
    q, rate, now = fem.Function(space), fem.Function(space), fem.Constant(space.mesh, 0.0)
    work = body.applied(q, Rates(rate, rate), ufl.TestFunction(space), now)
    return body.damping is not None or (work is not None and rate in work.coefficients())


def check_count(count: int) -> None:
    """A number of modes.

    Raises:
        SceneError: If it is not positive.
    """
    if count < 1:
        raise SceneError(f"modes: count is {count}; it must be at least 1")


def _doubtful(
    model: Model, system: BlockSystem, found: Lowest, about: Equilibrium | None
) -> list[str]:
    """Sentences on bodies that are too stiff or too soft in modes; collective."""
    state = None if about is None else lambda name: about.arrays[f"{name}/q"]
    modes = [
        Motion(k + 1, found.energies[k], (parts_of(system, vector),))
        for k, vector in enumerate(found.vectors)
        if k >= found.rigid and found.energies[k] > 0
    ]
    if not modes:
        return []
    count = len(found.values)

    def better(scene: Scene) -> Floats:
        finer, _ = checked_model(scene, model.comm)
        lower = lowest(finer, *tangent(finer), count, loaded=False)
        return np.asarray(np.sqrt(np.abs(lower.values.real)))

    # equilibria of better elements cost more than what they tell
    values, loaded = np.sqrt(np.abs(found.values.real)), state is not None
    what = "frequency without loads" if loaded else "frequency"
    said = beside_better(model, modes, system.size, values, better, what, loaded)
    return said + [text for look in SECTIONS for text in look(model, state, modes)]
