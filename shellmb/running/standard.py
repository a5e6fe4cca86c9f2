"""The observers that every run has, and the one that ends it when a signal asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

from shellmb.diagnostics.registry import WATCHES
from shellmb.errors import Stopped
from shellmb.observers.account.constraints import Constraints
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.momentum import Momentum
from shellmb.observers.account.rotations import BodyRotations
from shellmb.observers.fields.reserves import Reserves
from shellmb.observers.files.checkpoint import Checkpoint
from shellmb.observers.forces.endforces import BlowColumns, EndForceColumns
from shellmb.observers.forces.joints import JointForces
from shellmb.observers.forces.reactions import ContactForces
from shellmb.observers.history import (
    History,
    StateColumns,
    control_columns,
    error_columns,
    path_columns,
    volume_columns,
)
from shellmb.observers.probes import Probes
from shellmb.observers.summary import Sources
from shellmb.simulate.control.control import measuring
from shellmb.simulate.simulation import BaseObserver, Observer, Simulation
from shellmb.stopping import STOPPING

if TYPE_CHECKING:
    from shellmb.observers.files.frames import Frames


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


# what is measured where only probes, paths and controllers count
BARE = ("probes", "reserves", "path", "control")
# names in a run directory
SUMMARY, HISTORY, FIELDS, STATE = "summary.json", "history.csv", "fields", "state"


class StandardObservers:
    """The observers of a run.

    Args:
        directory: Directory to write; None: nothing is written.
        others: More observers; the numbers of those that measure enter the history.
        watched: Whether the run is watched for what makes it wrong.
        accounts: Whether energies, momenta and forces are measured.

    Attributes:
        named: All of them in their order, by the names under which their states are saved.
        sources: Those that the summary asks.
        watches: Those that say when the run is wrong.
        frames: The one that writes fields, if there is one.
    """

    def __init__(
        self,
        directory: Path | None,
        others: Sequence[Observer] = (),
        *,
        watched: bool = True,
        accounts: bool = True,
    ) -> None:
        energy, constraints = EnergyAccount(), Constraints()
        momentum, rotations, joints = Momentum(energy), BodyRotations(), JointForces()
        reserves = Reserves()
        self.named: dict[str, Observer] = {
            "energy": energy,
            "constraints": constraints,
            "momentum": momentum,
            "turning": rotations,
            "probes": Probes(),
            "joints": joints,
            "contacts": ContactForces(),
            "volumes": StateColumns(volume_columns),
            "end forces": EndForceColumns(),
            "impulses": BlowColumns(),
            "reserves": reserves,
            "path": StateColumns(path_columns),
            "step error": StateColumns(error_columns),
            "control": StateColumns(control_columns),
        }
        if not accounts:
            self.named = {name: self.named[name] for name in BARE}
        self.named |= {f"observer {k}": o for k, o in enumerate(others)}
        path = None if directory is None else directory / HISTORY
        history = self.named["history"] = History(measuring(self.named.values()), path)
        self.sources = Sources(energy, momentum, constraints, history, rotations, reserves)
        # behind the observers that they ask
        self.watches = [kind(self.sources) for kind in WATCHES] if watched else []
        self.named |= {f"watch of {watch.name}": watch for watch in self.watches}
        self.frames: Frames | None = None
        if directory is not None:
            # VTK and matplotlib are only loaded where something is written
            from shellmb.observers.files.frames import Frames

            self.frames = Frames(directory / FIELDS, joints)
            self.named["frames"] = self.frames
            self.named["checkpoint"] = Checkpoint(directory / STATE, dict(self.named))
        # behind all that write
        self.named["stop"] = Stop()
