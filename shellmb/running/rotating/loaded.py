"""Modes about the static equilibrium under loads: with what resists velocities, complex ones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Bools, Complex, Floats
from shellmb.errors import ConvergenceError, SceneError, petsc_in_words
from shellmb.model.body import Body, Rates
from shellmb.native.assembler import assembled_as
from shellmb.running.natural_modes.equilibrium import Equilibrium, equilibrium
from shellmb.running.natural_modes.vibration import Modes, Shape, check_count, modes_about
from shellmb.running.rotating.modes import SPARE, modes_of
from shellmb.running.rotating.state import MovingState, check_state
from shellmb.scene import Scene


@dataclass(frozen=True, kw_only=True)
class DampedModes(Modes):
    """Modes `exp(s t)` of what resists velocities, those with the smallest `s` first.

    Args:
        values: Eigenvalues `s`, of a complex pair one, of real ones all, 1/s.
        grows: Numbers of the modes that grow, from 1.
        parts: Real and imaginary part of each mode, as `fields`.
    """

    values: Complex
    grows: Sequence[int]
    parts: list[dict[str, Shape]]

    @property
    def omega(self) -> Floats:
        """Damped angular frequencies, rad/s; 0 of what does not swing."""
        return np.asarray(self.values.imag)

    @property
    def growth(self) -> Floats:
        """Rates at which modes grow, or decay if negative, 1/s; zero of rigid ones."""
        return np.where(np.arange(len(self.values)) < self.rigid, 0.0, self.values.real)

    @property
    def growing(self) -> Bools:
        """Modes that grow."""
        return np.isin(np.arange(1, len(self.values) + 1), self.grows)

    @property
    def fields(self) -> list[dict[str, Shape]]:
        """Real and imaginary part of each mode."""
        return self.parts


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


def _damped(scene: Scene, state: Equilibrium, undamped: Modes, count: int) -> DampedModes:
    """Modes with damping about an equilibrium, of which those without are known; collective."""
    check_state(scene, "")
    moving = MovingState(scene, state.arrays, state.counters, undamped.model.comm, 0.0)
    # those of a diagram at the rate zero
    found = modes_of(moving, count, SPARE)
    values = found.values[:count]
    squares = -(values**2)
    return DampedModes(
        squares.real,
        [real for real, _ in found.shapes[:count]],
        found.model,
        found.unknowns,
        min(found.rigid, count),
        squares.imag,
        undamped.unstable,
        undamped.doubtful,
        values=values,
        grows=[k for k in found.unstable if k <= count],
        parts=found.fields[:count],
    )


def _resists(body: Body) -> bool:
    """Decide whether forces of a body depend on velocities."""
    space = body.mixed.space
    q, rate, now = fem.Function(space), fem.Function(space), fem.Constant(space.mesh, 0.0)
    work = body.applied(q, Rates(rate, rate), ufl.TestFunction(space), now)
    return body.damping is not None or (work is not None and rate in work.coefficients())
