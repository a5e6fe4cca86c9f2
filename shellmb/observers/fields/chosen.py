"""Fields of shells and beams that a scene asks for beside its state, at the nodes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from operator import itemgetter
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.frames.beam import BeamModel
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields import by_section as section
from shellmb.observers.fields.modal import ModalStrained, modal_members, readable, resultants_of
from shellmb.observers.fields.reserves import judged
from shellmb.observers.fields.resultants import Strained
from shellmb.observers.fields.through import NodalResultants, interlaminar, ply_rows, ply_state
from shellmb.scene import LinearSection, Scene, Shell
from shellmb.scene.checks.fields import kinds_of, wanted_fields
from shellmb.scene.fields import FIELDS, JUDGED, SPRINGS, STATE
from shellmb.scene.shells.lamination import Layup
from shellmb.simulate.simulation import Simulation

type Read = Callable[[Floats], Floats]

STRAINS = {
    "shell": (*SPRINGS, "gam 13", "gam 23"),
    "beam": ("stretch", "shear 2", "shear 3", "twist", "curvature 2", "curvature 3"),
}

# columns of resultants; those of a shell stand behind what stresses of its layers follow from
PARTS = {"N": np.s_[:, -8:-5], "M": np.s_[:, -5:-2], "Q": np.s_[:, -2:]}
PARTS |= {"force": np.s_[:, 0:3], "moment": np.s_[:, 3:6]}

# fields at both faces from the resultants of a linear section
FACES: dict[str, Callable[[Shell, Layup], Read]] = {
    "surface_stress": section.surface_stress,
    "von_mises": lambda shell, at: section.von_mises(section.surface_stress(shell, at)),
    "principal_stress": lambda shell, at: section.principal_at_faces(
        section.surface_stress(shell, at)
    ),
    "principal_strain": lambda shell, at: section.principal_at_faces(
        section.face_strain(shell, at)
    ),
}


class ChosenFields:
    """Fields of one body, from means of its resultants over the elements at each node.

    One expression is made for all that follows from resultants, none where nothing is asked
    for; nonlinear sections have another one for strains and energy.

    Args:
        simulation: The simulation.
        body: The shell or beam.
        names: What is requested.

    Attributes:
        components: Names of the components by the field's name; none of a scalar.
    """

    def __init__(
        self, simulation: Simulation, body: ShellModel | BeamModel, names: tuple[str, ...]
    ) -> None:
        self.components: dict[str, tuple[str, ...]] = {}
        self._derived: dict[str, Read] = {}
        self._own: dict[str, Read] = {}
        # from the resultants with their derivatives along the surface
        self._steep: dict[str, Read] = {}
        self._dynamic = simulation.scheme.dynamic
        for name in names:
            if name not in JUDGED:
                self._add(body, name)
        judged_names = tuple(name for name in names if name in JUDGED)
        self._judging = self._judge(simulation.scene, body, judged_names)
        slopes = bool(self._steep or self._judging)
        self._resultants: NodalResultants | None = None
        if self._derived or slopes:
            found = resultants_of(simulation, body, layers=isinstance(body, ShellModel))
            self._resultants = NodalResultants(body, found, slopes)
        self._strained: NodalResultants | None = None
        if self._own:
            modal = body.name in modal_members(simulation.model)
            strained = ModalStrained(simulation, body.name) if modal else Strained(simulation, body)
            self._strained = NodalResultants(body, strained)

    def _add(self, body: ShellModel | BeamModel, name: str) -> None:
        known = FIELDS[name].components
        if name in PARTS:
            self.components[name], self._derived[name] = known, itemgetter(PARTS[name])
        elif name == "principal_N":
            principal = section.principal
            self.components[name] = known
            self._derived[name] = lambda R: principal(R[PARTS["N"]])
        elif name in ("strains", "energy_density"):
            self._add_strains(body, name)
        else:
            assert isinstance(body, ShellModel)
            shell, at = body.shell, section.layup(body, self._dynamic)
            if name in FACES:
                self.components[name], self._derived[name] = known, FACES[name](shell, at)
                return
            if name == "natural_factor":
                self._add_factor(at)
                return
            if name == "branch_strains":
                self._add_springs(shell, at)
                return
            if name == "ply_stress":
                to = self._derived
                each = [section.ply_stress(shell, at, k) for k in range(len(at.layers))]
            else:
                to = self._steep
                each = [partial(interlaminar, rows) for rows in ply_rows(shell, at)]
                self._add_springs(shell, at)
                if section.held_plies(shell):
                    self._add_factor(at)
            for k, read in enumerate(each, start=1):
                self.components[f"{name}_{k}"], to[f"{name}_{k}"] = known, read

    def _add_factor(self, at: Layup) -> None:
        """Factor of natural strains of plies, which `Run.plies` needs, too."""
        self.components["natural_factor"] = ()
        self._derived["natural_factor"] = itemgetter(np.s_[:, 6 * (1 + len(at.branches))])

    def _add_springs(self, shell: Shell, at: Layup) -> None:
        """Strains of branches, which `Run.plies` needs beside resultants."""
        compliance = section.shell_compliance(shell, at)[..., :6, :6]
        for k in range(1, len(at.branches) + 1):
            name, others = f"branch_strains_{k}", np.zeros((*compliance.shape[:-1], 6 * k))
            rows = np.concatenate([others, compliance], axis=-1)
            self.components[name], self._derived[name] = SPRINGS, section.strains_by(rows)

    def _add_strains(self, body: Any, name: str) -> None:
        """Strains or their energy, which follow from resultants of linear sections only."""
        beam = isinstance(body, BeamModel)
        kind, described = ("beam", body.beam) if beam else ("shell", body.shell)
        size, strains = len(STRAINS[kind]), name == "strains"
        self.components[name] = STRAINS[kind] if strains else FIELDS[name].components
        if described.section.relaxes or not (beam or isinstance(described.section, LinearSection)):
            self._own[name] = itemgetter(np.s_[:, :size] if strains else np.s_[:, size])
            return
        make = section.strains_by if strains else section.energy_by
        # of the resultants that are conjugate to strains, which stand last
        if beam:
            compliance, count = section.beam_compliance(described), 6
        else:
            at = section.layup(body, self._dynamic)
            compliance, count = section.shell_compliance(described, at), 8
        read = make(compliance)
        self._derived[name] = lambda R: read(R[:, -count:])

    def _judge(
        self, scene: Scene, body: ShellModel | BeamModel, names: tuple[str, ...]
    ) -> Callable[[Floats], dict[str, Floats]] | None:
        """Fields of each reserve factor of the body."""
        on = [r for r in scene.reserves if names and r.body in (None, body.name)]
        if not on:
            return None
        assert isinstance(body, ShellModel)
        rows = ply_rows(body.shell, section.layup(body, self._dynamic))
        each = {reserve.name: judged(reserve, body.shell) for reserve in on}
        self.components |= {f"{name}_{reserve}": () for reserve in each for name in names}

        def read(both: Floats) -> dict[str, Floats]:
            state, found = ply_state(rows, both), dict[str, Floats]()
            for reserve, judge in each.items():
                fields = judge.fields(state)
                found |= {f"{name}_{reserve}": fields[name] for name in names}
            return found

        return read

    def solved(self) -> None:
        """Keep what means over the step need of its start."""
        if self._resultants is not None:
            self._resultants.solved()

    def values(self) -> dict[str, Floats]:
        """Values at the nodes of this rank, shape (n, k); collective."""
        found: dict[str, Floats] = {}
        if self._resultants is not None:
            both = self._resultants.now()
            R = both[:, : self._resultants.size]
            found |= {name: read(R) for name, read in self._derived.items()}
            found |= {name: read(both) for name, read in self._steep.items()}
            found |= self._judging(both) if self._judging else {}
        if self._strained is not None:
            E = self._strained.now()
            found |= {name: read(E) for name, read in self._own.items()}
        return found


def chosen_fields(simulation: Simulation) -> dict[str, ChosenFields]:
    """Fields beyond the state that the scene requests, by the names of the bodies.

    Args:
        simulation: The simulation.
    """
    scene, found = simulation.scene, {}
    for name, body in readable(simulation.model).items():
        described = scene.body(name)
        wanted = tuple(w for w in wanted_fields(scene, kinds_of(described)) if w not in STATE)
        if wanted:
            found[name] = ChosenFields(simulation, body, wanted)
    return found


def wants(scene: Scene, field: str) -> bool:
    """Decide whether a field is requested."""
    return field in scene.output.fields or "all" in scene.output.fields
