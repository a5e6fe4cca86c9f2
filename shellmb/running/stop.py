"""The observer that ends a run between two steps when a signal asks for it."""

from __future__ import annotations

from mpi4py import MPI

from shellmb.errors import Stopped
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.stopping import STOPPING


class Stop(BaseObserver):
    """Raises `Stopped` on all ranks behind the step in which a signal came to one of them.

    It has to stand behind the observer that keeps the state.
    """

    def accepted(self, simulation: Simulation) -> None:
        """Look for signals, also for those that came while the run was built."""
        requested = STOPPING.requested or 0
        comm = simulation.model.comm
        if comm.size > 1:
            requested = comm.allreduce(requested, op=MPI.MAX)
        if requested:
            raise Stopped(requested)
