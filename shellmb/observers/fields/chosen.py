"""Fields of shells and beams that a scene asks for beside its state, at the nodes."""

from collections.abc import Callable
from functools import partial
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.frames.beam import BeamModel
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields import by_section as section
from shellmb.observers.fields.modal import ModalStrained, modal_members, readable, resultants_of
from shellmb.observers.fields.reserves import judged
from shellmb.observers.fields.resultants import Strained
from shellmb.observers.fields.through import NodalResultants, interlaminar, ply_rows, ply_state
from shellmb.scene import Scene, Shell
from shellmb.scene.checks.names import wanted_fields
from shellmb.scene.fields import FIELDS, JUDGED, SPRINGS, STATE
from shellmb.scene.shells.lamination import Layup
from shellmb.simulate.simulation import Simulation

type Read = Callable[[Floats], Floats]

RESULTANTS, SLOPES, OWN = "resultants", "slopes", "own"

STRAINS = {
    "shell": (*SPRINGS, "gam 13", "gam 23"),
    "beam": ("stretch", "shear 2", "shear 3", "twist", "curvature 2", "curvature 3"),
}

# columns of resultants; those of a shell stand behind what stresses of its layers follow from
PARTS = {"N": np.s_[:, -8:-5], "M": np.s_[:, -5:-2], "Q": np.s_[:, -2:]}
PARTS |= {"force": np.s_[:, 0:3], "moment": np.s_[:, 3:6]}

# fields at both faces from the resultants of a linear section: what is there, and what of it
FACES: dict[str, tuple[Callable[[Shell, Layup], Read], Read]] = {
    "surface_stress": (section.surface_stress, np.asarray),
    "von_mises": (section.surface_stress, section.von_mises),
    "principal_stress": (section.surface_stress, section.principal_at_faces),
    "principal_strain": (section.face_strain, section.principal_at_faces),
}


class _Field(NamedTuple):
    """A field, by how it is read.

    Args:
        components: Names of its components; none of a scalar.
        read: Gives it from what it follows from, by rows of all nodes.
        source: What that is: the `RESULTANTS`, also with their `SLOPES`, or `OWN` strains.
    """

    components: tuple[str, ...]
    read: Read
    source: str = RESULTANTS


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
        self._dynamic, self._fields = simulation.scheme.dynamic, dict[str, _Field]()
        for name in names:
            if name not in JUDGED:
                self._fields |= _fields(body, name, self._dynamic)
        self.components = {name: field.components for name, field in self._fields.items()}
        judged_names = tuple(name for name in names if name in JUDGED)
        self._judging = self._judge(simulation.scene, body, judged_names)
        sources = {field.source for field in self._fields.values()}
        sources |= {SLOPES} if self._judging else set()
        self._resultants: NodalResultants | None = None
        if sources - {OWN}:
            found = resultants_of(simulation, body, layers=True)
            self._resultants = NodalResultants(body, found, SLOPES in sources)
        self._strained: NodalResultants | None = None
        if OWN in sources:
            modal = body.name in modal_members(simulation.model)
            strained = ModalStrained(simulation, body.name) if modal else Strained(simulation, body)
            self._strained = NodalResultants(body, strained)

    def _judge(
        self, scene: Scene, body: Any, names: tuple[str, ...]
    ) -> Callable[[Floats], dict[str, Floats]] | None:
        """Fields of each reserve factor of the body."""
        on = [r for r in scene.reserves if names and r.body in (None, body.name)]
        if not on:
            return None
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
            found |= self._read(RESULTANTS, both[:, : self._resultants.size])
            found |= self._read(SLOPES, both)
            found |= self._judging(both) if self._judging else {}
        if self._strained is not None:
            found |= self._read(OWN, self._strained.now())
        return found

    def _read(self, source: str, values: Floats) -> dict[str, Floats]:
        fields = self._fields.items()
        return {name: field.read(values) for name, field in fields if field.source == source}


def _fields(body: Any, name: str, dynamic: bool) -> dict[str, _Field]:
    """Fields by which one that is requested is in files, but for those of reserve factors."""
    known = FIELDS[name].components
    if name in PARTS:
        return {name: _Field(known, itemgetter(PARTS[name]))}
    if name == "principal_N":
        return {name: _Field(known, lambda R: section.principal(R[PARTS["N"]]))}
    if name in ("strains", "energy_density"):
        return {name: _strains(body, name, dynamic)}
    shell, at = body.shell, section.layup(body, dynamic)
    if name in FACES:
        make, of = FACES[name]
        plane = make(shell, at)
        return {name: _Field(known, lambda R: of(plane(R)))}
    if name == "ply_stress":
        each = [section.ply_stress(shell, at, k) for k in range(len(at.layers))]
        return {f"{name}_{k}": _Field(known, read) for k, read in enumerate(each, start=1)}
    factor = {"natural_factor": _Field((), itemgetter(np.s_[:, 6 * (1 + len(at.branches))]))}
    if name == "natural_factor":
        return factor
    compliance, springs = section.shell_compliance(shell, at)[..., :6, :6], dict[str, _Field]()
    for k in range(1, len(at.branches) + 1):
        others = np.zeros((*compliance.shape[:-1], 6 * k))
        rows = np.concatenate([others, compliance], axis=-1)
        springs[f"branch_strains_{k}"] = _Field(SPRINGS, section.strains_by(rows))
    if name == "branch_strains":
        return springs
    # `Run.plies` needs both beside resultants
    beside = springs | (factor if section.held_plies(shell) else {})
    return beside | {
        f"{name}_{k}": _Field(known, partial(interlaminar, rows), SLOPES)
        for k, rows in enumerate(ply_rows(shell, at), start=1)
    }


def _strains(body: Any, name: str, dynamic: bool) -> _Field:
    """Strains or their energy, which follow from resultants of linear sections only."""
    described, strains = body.described, name == "strains"
    every = STRAINS[described.label]
    size, components = len(every), every if strains else FIELDS[name].components
    if described.section.relaxes or not described.section.linear:
        return _Field(components, itemgetter(np.s_[:, :size] if strains else np.s_[:, size]), OWN)
    make = section.strains_by if strains else section.energy_by
    # of the resultants that are conjugate to strains, which stand last
    read = make(section.compliance(body, dynamic))
    return _Field(components, lambda R: read(R[:, -size:]))


def chosen_fields(simulation: Simulation) -> dict[str, ChosenFields]:
    """Fields beyond the state that the scene requests, by the names of the bodies.

    Args:
        simulation: The simulation.
    """
    scene, found = simulation.scene, {}
    for name, body in readable(simulation.model).items():
        described = scene.body(name)
        wanted = tuple(w for w in wanted_fields(scene, described.field_kinds) if w not in STATE)
        if wanted:
            found[name] = ChosenFields(simulation, body, wanted)
    return found


def wants(scene: Scene, field: str) -> bool:
    """Decide whether a field is requested."""
    return field in scene.output.fields or "all" in scene.output.fields
