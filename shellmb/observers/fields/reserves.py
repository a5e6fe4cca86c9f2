"""Reserve factors against failure: of plies, the least in each step, and of all steps."""

from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.raw import true_at
from shellmb.model.locations.nodes import local_point
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.by_section import layup
from shellmb.observers.fields.modal import readable, resultants_of
from shellmb.observers.fields.through import SIDES, NodalResultants, PlyState, ply_rows, ply_state
from shellmb.scene import Reserve, Shell
from shellmb.scene.lookup import said
from shellmb.scene.shells.strength import CRITERIA, MOST
from shellmb.simulate.simulation import BaseObserver, Simulation


class Judged(NamedTuple):
    """Utilisations of plies by one criterion.

    Args:
        reserve: The description.
        shell: Its shell.
        strengths: Strengths by the index of the ply.
    """

    reserve: Reserve
    shell: Shell
    strengths: dict[int, Any]

    @property
    def across(self) -> bool:
        """Decide whether stresses 13 and 23 are needed."""
        return CRITERIA[self.reserve.criterion].across

    def utilisations(self, state: PlyState, nodes: Any = np.s_[:]) -> Floats:
        """Utilisations by ply, side and mode, shape (n, plies, 3, modes).

        Args:
            state: Stresses and strains.
            nodes: Which nodes.
        """
        criterion, total = CRITERIA[self.reserve.criterion], state.total[:, nodes]
        found = np.zeros((*total.shape[1:4], len(criterion.modes)))
        for k, strength in self.strengths.items():
            if state.held is None:
                found[:, k] = criterion.utilisations(total[0, :, k], total[1, :, k], strength)
            else:
                held = state.held[:, nodes, k]
                found[:, k] = criterion.beside(total[:, :, k] - held, held, strength)
        return found

    def fields(self, state: PlyState) -> dict[str, Floats]:
        """Utilisation, reserve factor (at most `MOST`) and critical ply, each of shape (n,).

        Args:
            state: Stresses and strains.
        """
        by_ply = self.utilisations(state).max(axis=(2, 3))
        largest = by_ply.max(axis=1)
        return {
            "utilisation": largest,
            "reserve": 1 / np.maximum(largest, 1 / MOST),
            "critical_ply": np.asarray(1.0 + by_ply.argmax(axis=1), dtype=float),
        }


def judged(reserve: Reserve, shell: Shell) -> Judged:
    """Utilisations of a shell by a reserve factor."""
    layers = shell.section.generic.layers
    chosen = reserve.plies or range(1, len(layers) + 1)
    return Judged(reserve, shell, {k - 1: layers[k - 1].strength for k in chosen})


class Critical(NamedTuple):
    """Largest utilisation, and its place.

    Args:
        utilisation: It.
        step: Number of the step.
        t: Time at its end.
        criterion: The criterion.
        body: Name of the shell.
        x: Reference place, m.
        y: The same along y.
        z: The same along z.
        ply: Number of the ply, 1 is the lowest.
        side: One of `SIDES`.
        mode: Mode of failure.
    """

    utilisation: float
    step: int
    t: float
    criterion: str
    body: str
    x: float
    y: float
    z: float
    ply: int
    side: str
    mode: str


class Place(NamedTuple):
    """Place of a utilisation among those that were found.

    Args:
        rank: Rank that owns the node.
        node: Number of the node there.
        ply: Number of the ply from 0.
        side: Number of its side.
        mode: Number of the mode of failure.
    """

    rank: int
    node: int
    ply: int
    side: int
    mode: int


class Reserves(BaseObserver):
    """Records the largest utilisation of each reserve factor of the scene; the same on all ranks.

    Stresses are means over the step, in statics values, as probes of resultants have them.

    Attributes:
        judged: Utilisations, the nodes of this rank that are looked at, and their places.
        resultants: Resultants of each shell by its name.
        places: Places of the largest ones of the present step, by name.
    """

    remembered = ("_least", "_now")

    def __init__(self) -> None:
        self._least: dict[str, Any] = {}
        self._now: dict[str, float] = {}
        self.resultants: dict[str, NodalResultants] = {}
        self.places: dict[str, Place] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the nodes and take the values at the start.

        Raises:
            SceneError: If there is no node where a reserve factor looks.
        """
        scene, model = simulation.scene, simulation.model
        self.idle = not scene.reserves
        self._comm = model.comm
        self.judged: list[tuple[Judged, Ints, Floats]] = []
        bodies: dict[str, tuple[ShellModel, bool]] = {}
        # labels of point loads on a shell, and the nodes of elements that they act on
        self._loads: dict[str, list[tuple[str, Floats]]] = defaultdict(list)
        for reserve in scene.reserves:
            shell = scene.shell(reserve.body, said(reserve))
            body = readable(model)[shell.name]
            each = judged(reserve, shell)
            bodies[shell.name] = body, each.across or bodies.get(shell.name, (body, False))[1]
            nodes = body.mixed.nodes("u")[: body.mixed.subspaces["u"].dofmap.index_map.size_local]
            chosen = np.arange(len(nodes))
            if reserve.where is not None:
                there = true_at(reserve.where, nodes[None], f"{said(reserve)}: where")
                chosen = np.flatnonzero(there[0])
            if not self._comm.allreduce(len(chosen)):
                raise SceneError(
                    f"{said(reserve)}: where is true at no node of {said(shell)}; it must be true "
                    "at some"
                )
            self.judged.append((each, chosen, nodes[chosen] + 0.0))
            for load in scene.loads:
                if load.at_point and shell in scene.bodies_of(load):
                    self._loads[shell.name].append((load.label, _places(body, load)))
        dynamic = simulation.scheme.dynamic
        self._rows = {n: ply_rows(b.shell, layup(b, dynamic)) for n, (b, _) in bodies.items()}
        self.resultants = {
            name: NodalResultants(body, resultants_of(simulation, body, layers=True), across)
            for name, (body, across) in bodies.items()
        }
        # a run that goes on has those of its last step, which are means over it
        if not self._now:
            self.accepted(simulation)

    def solved(self, simulation: Simulation) -> None:
        """Keep what means over the step need of its start."""
        for each in self.resultants.values():
            each.solved()

    def accepted(self, simulation: Simulation) -> None:
        """Take the largest utilisations of the step."""
        self._judge(simulation, {name: each.now() for name, each in self.resultants.items()})

    def _judge(self, simulation: Simulation, both: dict[str, Floats]) -> None:
        """Take the largest utilisations from resultants at the nodes."""
        now = {name: ply_state(self._rows[name], values) for name, values in both.items()}
        for each, nodes, places in self.judged:
            found = each.utilisations(now[each.shell.name], nodes)
            mine: tuple[Critical, Place] | None = None
            if found.size:
                node, ply, side, mode = map(int, np.unravel_index(found.argmax(), found.shape))
                who = each.reserve.criterion, each.shell.name
                names = SIDES[side], CRITERIA[who[0]].modes[mode]
                x, y, z = places[node].tolist()
                when = simulation.step, float(simulation.t)
                at = Critical(float(found.max()), *when, *who, x, y, z, ply + 1, *names)
                mine = at, Place(self._comm.rank, int(nodes[node]), ply, side, mode)
            every = [one for one in self._comm.allgather(mine) if one is not None]
            name = each.reserve.name
            largest, self.places[name] = max(every)
            self._now[name] = largest.utilisation
            if name not in self._least or largest.utilisation > self._least[name][0]:
                self._least[name] = tuple(largest)

    def measure(self) -> dict[str, float]:
        """Columns of the history: utilisations by name."""
        return dict(self._now)

    def critical(self, name: str) -> Critical:
        """Largest utilisation so far of a reserve factor, and its place."""
        return Critical(*self._least[name])

    def at_loads(self) -> dict[str, str]:
        """Point loads on elements where a reserve factor is least, by its name."""
        found = {}
        for name in self._least:
            at = self.critical(name)
            for label, places in self._loads[at.body]:
                if at.utilisation and (places == (at.x, at.y, at.z)).all(axis=1).any():
                    found[name] = label
        return found

    def summary(self) -> dict[str, Any]:
        """Least reserve factors over the run by name, as `reserves` of the summary."""
        found = {name: self.critical(name)._asdict() for name in self._least}
        return {"reserves": found} if found else {}


def _places(body: ShellModel, load: Any) -> Floats:
    """Nodes of the elements that a point load acts on, shape (n, 3); collective."""
    space = body.mixed.subspaces["u"]
    cells = np.asarray(space.dofmap.list)
    touched = np.isin(cells, local_point(body, load.at, load.label)[0]).any(axis=1)
    mine = body.mixed.nodes("u")[np.unique(cells[touched])]
    return np.concatenate(space.mesh.comm.allgather(mine))
