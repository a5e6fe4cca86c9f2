"""Fields of shells and beams that a scene asks for beside its state, at the nodes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
from dolfinx import la

from shellmb.arrays import Floats
from shellmb.model.frames.beam import BeamModel
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields import by_section as section
from shellmb.observers.fields.judging import judged
from shellmb.observers.fields.modal import modal_members, readable
from shellmb.observers.fields.modalresultants import ModalStrained, resultants_of
from shellmb.observers.fields.resultants import Resultants, Strained
from shellmb.observers.fields.through import Slopes, interlaminar, ply_rows, stresses
from shellmb.scene import Laminate, LinearSection, Scene, Shell
from shellmb.scene.checks.fields import kinds_of, wanted_fields
from shellmb.scene.fields import FIELDS, JUDGED, STATE
from shellmb.scene.shells.lamination import Layup
from shellmb.simulate.simulation import Simulation

type Read = Callable[[Floats], Floats]

STRAINS = {
    "shell": ("eps 11", "eps 22", "2 eps 12", "kap 11", "kap 22", "2 kap 12", "gam 13", "gam 23"),
    "beam": ("stretch", "shear 2", "shear 3", "twist", "curvature 2", "curvature 3"),
}

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
        self._judging: Callable[[Floats], dict[str, Floats]] | None = None
        for name in names:
            if name not in JUDGED:
                self._add(body, name)
        self._judge(simulation.scene, body, tuple(name for name in names if name in JUDGED))
        modal = body.name in modal_members(simulation.model)
        self._resultants: Resultants | None = None
        if self._derived or self._steep or self._judging:
            self._resultants = resultants_of(simulation, body)
        self._strained: Resultants | None = None
        if self._own and modal:
            self._strained = ModalStrained(simulation, body.name)
        elif self._own:
            self._strained = Strained(simulation, body)
        self._nodes = NodalMeans(body)
        self._slopes: Slopes | None = None
        if self._steep or self._judging:
            assert isinstance(body, ShellModel)
            self._slopes = Slopes(body)

    def _add(self, body: ShellModel | BeamModel, name: str) -> None:
        kind = "beam" if isinstance(body, BeamModel) else "shell"
        self.components[name] = STRAINS[kind] if name == "strains" else FIELDS[name].components
        parts = {"N": (0, 3), "M": (3, 6), "Q": (6, 8), "force": (0, 3), "moment": (3, 6)}
        if name in parts:
            first, last = parts[name]
            self._derived[name] = partial(_columns, first, last)
        elif name == "principal_N":
            self._derived[name] = section.principal
        elif name in FACES:
            assert isinstance(body, ShellModel)
            self._derived[name] = FACES[name](body.shell, section.layup(body))
        elif name == "ply_stress":
            assert isinstance(body, ShellModel) and isinstance(body.shell.section, Laminate)
            six = self.components.pop(name)
            for k in range(len(body.shell.section.plies)):
                self.components[f"{name}_{k + 1}"] = six
                self._derived[f"{name}_{k + 1}"] = section.ply_stress(
                    body.shell, section.layup(body), k
                )
        elif name == "interlaminar":
            assert isinstance(body, ShellModel)
            six = self.components.pop(name)
            for k, rows in enumerate(ply_rows(body.shell, section.layup(body)), start=1):
                self.components[f"{name}_{k}"] = six
                self._steep[f"{name}_{k}"] = partial(interlaminar, rows)
        elif isinstance(body, BeamModel) and body.beam.section.relaxes:
            self._own[name] = partial(_columns, *((0, 6) if name == "strains" else (6, 7)))
        elif isinstance(body, ShellModel) and (
            body.shell.section.relaxes or not isinstance(body.shell.section, LinearSection)
        ):
            self._own[name] = partial(_columns, *((0, 8) if name == "strains" else (8, 9)))
        else:
            make = section.strains_by if name == "strains" else section.energy_by
            if isinstance(body, BeamModel):
                # of the resultants that are conjugate to strains
                read = make(section.beam_compliance(body.beam))
                self._derived[name] = lambda R: read(R[:, 6:])
            else:
                self._derived[name] = make(
                    section.shell_compliance(body.shell, section.layup(body))
                )

    def _judge(self, scene: Scene, body: ShellModel | BeamModel, names: tuple[str, ...]) -> None:
        """Fields of each reserve factor of the body."""
        on = [r for r in scene.reserves if names and r.body in (None, body.name)]
        if not on:
            return
        assert isinstance(body, ShellModel)
        rows = ply_rows(body.shell, section.layup(body))
        each = {reserve.name: judged(reserve, body.shell) for reserve in on}
        self.components |= {f"{name}_{reserve}": () for reserve in each for name in names}

        def read(both: Floats) -> dict[str, Floats]:
            state, found = stresses(rows, both), dict[str, Floats]()
            for reserve, judge in each.items():
                fields = judge.fields(*state)
                found |= {f"{name}_{reserve}": fields[name] for name in names}
            return found

        self._judging = read

    def solved(self) -> None:
        """Keep what means over the step need of its start."""
        if self._resultants is not None:
            self._resultants.solved()

    def values(self) -> dict[str, Floats]:
        """Values at the nodes of this rank, shape (n, k); collective."""
        found: dict[str, Floats] = {}
        if self._resultants is not None:
            R = self._nodes.mean(self._resultants.elements())
            found |= {name: read(R) for name, read in self._derived.items()}
            if self._slopes is not None:
                both = self._nodes.with_slopes(R, self._slopes)
                found |= {name: read(both) for name, read in self._steep.items()}
                found |= self._judging(both) if self._judging else {}
        if self._strained is not None:
            E = self._nodes.mean(self._strained.elements())
            found |= {name: read(E) for name, read in self._own.items()}
        return found


def _columns(first: int, last: int, values: Floats) -> Floats:
    return values[:, first] if last == first + 1 else values[:, first:last]


class NodalMeans:
    """Means at each node of what the elements around it have there.

    Args:
        body: The body; all is collective.
    """

    def __init__(self, body: ShellModel | BeamModel) -> None:
        space = body.mixed.subspaces["u"]
        self._map = space.dofmap.index_map
        topology = space.mesh.topology
        local = topology.index_map(topology.dim).size_local
        self._nodes = np.asarray(space.dofmap.list[:local]).ravel()
        self._count = self._sum(np.ones((len(self._nodes), 1)))

    def mean(self, values: Floats) -> Floats:
        """Means at the nodes of this rank, shape (n, k).

        Args:
            values: Values of the cells of this rank at their nodes, shape (c, nodes, k).
        """
        flat = values.reshape(-1, values.shape[-1])
        return self._sum(flat) / np.maximum(self._count, 1.0)

    def with_slopes(self, R: Floats, slopes: Slopes) -> Floats:
        """Resultants of a shell with the derivatives of N and M along 1 and along 2, (n, 20).

        Args:
            R: N, M and Q at the nodes of this rank, shape (n, 8).
            slopes: What differentiates them.
        """
        return np.concatenate([R, self.mean(slopes.elements(R[:, :6]))], axis=1)

    def _sum(self, flat: Floats) -> Floats:
        vector = la.vector(self._map, flat.shape[1])
        table = vector.array.reshape(-1, flat.shape[1])
        np.add.at(table, self._nodes, flat)
        # cells of other ranks add to nodes of this one
        vector.scatter_reverse(la.InsertMode.add)
        vector.scatter_forward()
        return table


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
