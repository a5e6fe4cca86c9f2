"""Snapshots of everything that moves at equally spaced times, for ParaView and for pictures."""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError
from shellmb.files.writing import make_folder
from shellmb.observers.fields.chosen import chosen_fields, wants
from shellmb.observers.fields.nodal import nodal_values
from shellmb.observers.files.gridfiles import GridFiles, Lists
from shellmb.observers.files.output_parts import JOINTS, Drawn, drawn_parts
from shellmb.observers.forces.joints import JointForces
from shellmb.observers.history import Batches
from shellmb.simulate.simulation import BaseObserver, Simulation

_log = logging.getLogger(__name__)

# states of a run that asks for no number, and up to so many in place of one while something turns
# by more than an angle between two of them [rad]
USUAL, FINEST, ANGLE = 50, 8, np.radians(20.0)

# fields of states beside the displacement
DIRECTORS = ("director", "d1", "d2", "d3")
DIRECTOR_VELOCITIES = tuple(f"{name}_velocity" for name in DIRECTORS)
XYZ = ("x", "y", "z")
# a time this fraction of the interval before that of a frame is the frame's
EARLY = 1e-6


class RequestedFields:
    """Fields of all parts beside their displacement that the scene's output requests.

    Args:
        simulation: The simulation.
        forces: Forces of joints, if they are known.
    """

    def __init__(self, simulation: Simulation, forces: JointForces | None) -> None:
        scene = simulation.scene
        self._chosen = chosen_fields(simulation)
        # those of clamped edges of reduced bodies and of joins of rigid ones, too
        self._joints = list(simulation.model.mechanism.joints)
        self._forces = forces
        self._wanted = [name for name in ("force", "moment") if wants(scene, name)]
        self._left_out = set() if wants(scene, "director") else set(DIRECTORS)
        self._left_out |= set() if wants(scene, "velocity") else {"velocity"}
        self._left_out |= set() if wants(scene, "director_velocity") else set(DIRECTOR_VELOCITIES)

    def components(self, name: str) -> dict[str, tuple[str, ...]]:
        """Names of components of a part's fields."""
        vectors = ["displacement", "velocity", *DIRECTORS, *DIRECTOR_VELOCITIES]
        if name in self._chosen:
            return {**dict.fromkeys(vectors, XYZ), **self._chosen[name].components}
        return dict.fromkeys([*vectors, "force", "moment"], XYZ)

    def solved(self) -> None:
        """Keep what means over the step need of its start."""
        for chosen in self._chosen.values():
            chosen.solved()

    def of(self, name: str, part: Drawn, fields: dict[str, Floats]) -> dict[str, Floats]:
        """Fields of a body on rank 0, nothing elsewhere; collective.

        Args:
            name: Name of the part.
            part: The part.
            fields: Those of its state.
        """
        kept = {key: values for key, values in fields.items() if key not in self._left_out}
        if name in self._chosen:
            for key, values in self._chosen[name].values().items():
                gathered = part.gather(values)
                if gathered is not None:
                    kept[key] = gathered
        if name == JOINTS and self._forces is not None and kept:
            for row, key in enumerate(("force", "moment")):
                if key in self._wanted:
                    acting = np.array([self._forces.acting[j][row] for j in self._joints])
                    # what acts on the second body, and its opposite on the first one
                    kept[key] = np.stack([-acting, acting], axis=1).reshape(-1, 3)
        return kept


class Frames(BaseObserver):
    """Takes snapshots, the first and the last state included.

    Each shell and each beam gets files `NAME_0000.vtu` with the fields that the scene asks for, and
    thickness or size of the section, on Lagrange cells of its own degree, and `NAME.vtu.series`,
    which ParaView opens as one thing in time. All rigid bodies are in `rigid_bodies_0000.vtu`,
    lines from their centres to their points, their shapes in `solids_0000.vtu`, all joints in
    `joints_0000.vtu`, and all obstacles in `obstacles_0000.vtu`. `all.pvd` opens all of it. Where
    the scene asks for no number of states, there are more of what turns fast. Files of short steps
    are written several at a time (`Batches`).

    Args:
        folder: Where the files go.
        forces: Forces of joints, if they are known.

    Attributes:
        clock: Simulation whose frames these correspond to, one by one, at its times; None: the one
            that is observed.
    """

    def __init__(self, folder: Path, forces: JointForces | None = None) -> None:
        self._folder, self._forces = folder, forces
        self.clock: Simulation | None = None
        self._kept: list[float] = []
        self._finer = 1
        self._sums: dict[str, str] = {}
        # numbers of frames that are not written yet, and their fields by the name of the grid
        self._pending: list[tuple[int, dict[str, dict[str, Floats]]]] = []
        self._batches = Batches()

    def start(self, simulation: Simulation) -> None:
        """Gather the grids and take the first frame, or list those of the earlier run."""
        self._parts = drawn_parts(simulation.model)
        self._requested = RequestedFields(simulation, self._forces)
        # on rank 0
        self._files = {
            name: GridFiles(self._folder, part.grid, part.cells, self._requested.components(name))
            for name, part in self._parts.items()
            if part.grid is not None
        }
        self._lists = Lists(self._folder, self._files)
        if self._files:
            make_folder(self._folder)
        requested = simulation.scene.output.frames
        self._interval = simulation.t_end / max((requested or USUAL) - 1, 1)
        self._follows = requested is None and simulation.scheme.dynamic
        self._times = list(self._kept)
        if self._kept:
            self._go_on()
        else:
            self._take(simulation)
            self.write()

    def solved(self, simulation: Simulation) -> None:
        """Keep what means over the step need of its start."""
        self._requested.solved()

    def accepted(self, simulation: Simulation) -> None:
        """Take a frame if it is time, and at the end."""
        # by the number of the interval, not by adding intervals up: no drift
        interval, clock = self._interval / self._finer, self.clock or simulation
        due = self._times[-1] // interval + 1
        if (due - EARLY) * interval <= self._times[-1]:
            due += 1
        if clock.t >= (due - EARLY) * interval or clock.t >= clock.t_end:
            self._take(simulation)
        if self._pending and self._batches.due():
            self.write()

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """After a step that did not converge add the last good state."""
        try:
            if isinstance(error, ConvergenceError) and not simulation.scheme.linear:
                if (self.clock or simulation).t > self._times[-1]:
                    self._take(simulation)
            self.write()
        finally:
            # what cannot be written is lost
            self._pending.clear()

    def _take(self, simulation: Simulation) -> None:
        clock = self.clock or simulation
        self._times.append(clock.t)
        if self._follows:
            turned = self._interval * rotation_rate(clock)
            self._finer = int(min(max(np.ceil(turned / ANGLE), 1), FINEST))
        taken = {
            name: self._requested.of(name, part, part.fields(simulation))
            for name, part in self._parts.items()
        }
        if self._files:
            self._pending.append((len(self._times) - 1, taken))

    def write(self) -> None:
        """Write the frames that are not in files yet."""
        if self._pending:
            for name, files in self._files.items():
                for number, fields in self._pending:
                    files.write(number, fields[name])
            self._lists.write(self._times)
        self._pending.clear()
        self._batches.written()

    def _go_on(self) -> None:
        """List the frames of the earlier run; a run does without those that are lost."""
        missing = [
            files.file(number).name
            for number in range(len(self._times))
            for files in self._files.values()
            if not files.find(number, self._sums)
        ]
        self._lists.write(self._times)
        if missing:
            _log.warning(
                "resume: lost or damaged in %s, and left out of the pictures: %s",
                self._folder,
                ", ".join(missing),
            )

    def state(self) -> dict[str, Any]:
        """Times of the frames, and how many there are now for one of the usual ones."""
        return {"times": list(self._times), "finer": self._finer}

    def sealed(self, state: Mapping[str, Any]) -> dict[str, Any]:
        """A saved state with the checksums of the files of its frames, on rank 0."""
        sums: dict[str, str] = {}
        for files in self._files.values():
            sums |= files.checksums(len(state["times"]))
        return {**state, "sha256": sums}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on behind so many frames."""
        self._kept = [float(t) for t in state["times"]]
        self._sums = dict(state["sha256"])
        self._finer = int(state["finer"])


def rotation_rate(simulation: Simulation) -> float:
    """The largest speed of a director, rad/s; collective."""
    model, found = simulation.model, 0.0
    for name in (*model.meshed, *([model.rigid.name] if model.rigid is not None else [])):
        speeds = np.linalg.norm(nodal_values(simulation, name).director_velocity, axis=-1)
        found = max(found, float(speeds.max(initial=0.0)))
    return float(model.comm.allreduce(found, op=MPI.MAX))
