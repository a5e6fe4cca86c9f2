"""Modes about the static equilibrium under loads: with what resists velocities, complex ones."""

from dataclasses import replace

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

from shellmb.errors import ConvergenceError, SceneError, petsc_in_words
from shellmb.model.body import Body, Rates
from shellmb.native.assembler import assembled_as
from shellmb.running.natural_modes.equilibrium import Equilibrium, equilibrium
from shellmb.running.natural_modes.vibration import Modes, check_count, modes_about
from shellmb.running.rotating.modes import SPARE, modes_of
from shellmb.running.rotating.state import MovingState, check_state
from shellmb.scene import Scene


@petsc_in_words()
@assembled_as(lambda scene, *_, **__: scene.solver)
def modes_at_rest(
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
        SceneError: As `natural_modes`.
        ConvergenceError: As `natural_modes`.
    """
    check_count(count)
    state = equilibrium(scene, comm) if loaded else None
    found = modes_about(scene, comm, count, state)
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
