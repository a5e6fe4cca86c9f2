"""A configuration at work: its steps, counted and timed."""

from __future__ import annotations

import time
from pathlib import Path

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.bench.bare import BareWork, direct_solver
from shellmb.bench.record import PARTS, Round
from shellmb.bench.restart import Restart
from shellmb.bench.watchers import Timed, default_observers
from shellmb.run.directory import make_directory
from shellmb.scene import Scene
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.blocks import Residuals

Floats = npt.NDArray[np.float64]

# steps before those that are measured, in small systems, whose data caches can hold
AGAIN, SMALL = 2, 5000


class Counted:
    """Residuals that are counted.

    Args:
        residuals: What assembles them.

    Attributes:
        count: Their number so far.
    """

    def __init__(self, residuals: Residuals) -> None:
        self._residuals, self.count = residuals, 0

    def add(self, local: Floats) -> None:
        """Add them to the concatenated local arrays."""
        self.count += 1
        self._residuals.add(local)

    def refresh(self) -> None:
        """Take the values of constants."""
        self._residuals.refresh()


class Runner:
    """A simulation that is run round by round.

    A dynamic one goes on where it was; a static one starts anew for each load step.

    Args:
        scene: The scene.
        folder: Where its observers write.
    """

    def __init__(self, scene: Scene, folder: Path) -> None:
        self.simulation = Simulation(scene, MPI.COMM_WORLD)
        make_directory(folder, self.comm)
        self._observers = Timed(default_observers(folder))
        self._observers.start(self.simulation)
        problem = self.simulation.problem
        self._iteration = problem.newton.iteration
        problem.system.residuals = self._counted = Counted(problem.system.residuals)
        self._restart = Restart(self.simulation)
        self._anew = scene.scheme == "static"
        self._bare: BareWork | None = None
        # the simulation's own number goes back to zero where a static one starts anew
        self._iterations = 0

    @property
    def comm(self) -> MPI.Comm:
        """Communicator."""
        return self.simulation.model.comm

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the linear systems."""
        return self._iteration.linear.size

    def advance(self, steps: int) -> float:
        """Run steps as users do; returns the time they took, s."""
        total = 0.0
        for _ in range(steps):
            if self._anew:
                self._restart()
            begin = time.perf_counter()
            self.simulation.advance([self._observers])
            total += time.perf_counter() - begin
            assert self.simulation.last is not None
            self._iterations += self.simulation.last.iterations
        return total

    def round(self, steps: int) -> Round:
        """Run steps, then time their bare work; of several ranks the slowest counts.

        Args:
            steps: Number of steps.
        """
        # others ran in between: without these steps the caches are theirs
        self.advance(AGAIN if self.unknowns < SMALL else 0)
        before = self._read()
        self.comm.Barrier()
        took = self.advance(steps)
        done = self._read() - before
        counts, seconds = done[:5] / steps, done[5:]
        self._bare = self._bare or BareWork(self.simulation.problem)
        bare = self._bare.measure()
        iterations, factorisations, residuals, jacobians, solutions = counts
        own = np.array([took, *seconds]) / steps
        own = np.append(own, bare.total(residuals, jacobians, factorisations, solutions))
        self.comm.Allreduce(MPI.IN_PLACE, own, op=MPI.MAX)
        parts = dict(zip(PARTS, map(float, own[1:-1]), strict=True))
        numbers = float(iterations), float(factorisations), float(own[0]), float(own[-1])
        return Round(steps, *numbers, parts)

    def _read(self) -> Floats:
        """Counters and clocks so far: five numbers, then the seconds of `PARTS`."""
        iteration = self._iteration
        inside = iteration.linear.seconds
        return np.array(
            [
                self._iterations,
                iteration.factorisations,
                self._counted.count,
                iteration.linear.jacobians,
                direct_solver(iteration.linear).solutions,
                iteration.residual_seconds,
                *(inside[name] for name in ("jacobian", "reduction", "factor", "solve")),
                self._observers.seconds,
            ]
        )

    def finish(self) -> None:
        """Close the files."""
        self._observers.finish(self.simulation, None)
