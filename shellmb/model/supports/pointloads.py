"""Forces and moments at points of bodies."""

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from ufl.core.expr import Expr

from shellmb.errors import SceneError
from shellmb.forms import loads as forms
from shellmb.forms.constraints.joints import Place
from shellmb.model.body import LoadFactors
from shellmb.model.locations.ends import End, EndGroup, change_of
from shellmb.model.locations.nodes import FindEnd
from shellmb.model.massless import NodeGroup, node_loads
from shellmb.scene import FollowerForce, FollowerMoment, PointForce, PointMoment, Scene
from shellmb.scene.lookup import of_kind

# part of a moment about the director of a shell that counts as none
DRILLING = 1e-6

PointLoad = PointForce | PointMoment | FollowerForce | FollowerMoment


def _moment(moment: Expr, place: Place, change: Place) -> Expr:
    if len(place.e) == 1:
        return forms.director_moment(moment, place.e[0], change.e[0])
    return forms.frame_moment(moment, place.e, change.e)


# kind of load to its virtual work, the number of vectors it needs at its place, and where it says
# its components
_WORK: dict[type, tuple[Callable[[Expr, Place, Place], Expr], int, str]] = {
    PointForce: (lambda f, at, d: forms.dead_force(f, d.x), 0, "force"),
    FollowerForce: (lambda f, at, d: forms.follower_frame_force(f, at.e, d.x), 3, "components"),
    PointMoment: (_moment, 3, "moment"),
    FollowerMoment: (lambda m, at, d: forms.follower_frame_moment(m, at.e, d.e), 3, "components"),
}


class PointLoads(NodeGroup):
    """Loads of one kind at points of bodies.

    Args:
        comm: Communicator.
        items: The loads, all of one kind, with their places on bodies with so many directors.
        vectors: Number of directors that matter.
    """

    def __init__(
        self, comm: MPI.Comm, items: Sequence[tuple[PointLoad, End]], vectors: int
    ) -> None:
        loads, ends = zip(*items, strict=True)
        # the vectors of a place are the body's directors
        axes = np.array([e.directors if e.framed else np.eye(3) for e in ends])
        end, name = EndGroup(ends, axes, "1", vectors > 0), f"{loads[0].label}s ({vectors})"
        super().__init__(name, comm, len(loads), places=[end])
        self.times = [load.time for load in loads]
        self._kind, _, given = of_kind(_WORK, loads[0])
        self.values = np.array([getattr(load, given) for load in loads], dtype=float)

    def loads(self) -> LoadFactors | None:
        """The loads with factors of their own."""
        return node_loads(self.nodes, self.values, self.times, self._work)

    def _work(self, value: Expr, mid: Expr, dq: Expr) -> Expr:
        return self._kind(value, self.place(mid), change_of(self.place, mid, dq))


def _refuse_drilling(load: PointMoment, end: End) -> None:
    """A shell has no moment about its director, and would take no part of the load there."""
    moment, director = np.array(load.moment), end.directors[0]
    about = float(moment @ director)
    least, across = DRILLING * np.linalg.norm(moment), moment - about * director
    if abs(about) <= least:
        return
    normal, rest = (", ".join(f"{c:.9g}" for c in v + 0.0) for v in (director, across))
    would_do = f"be across it, ({rest}), or " if np.linalg.norm(across) > least else ""
    raise SceneError(
        f"{load.label} on '{end.owner}': moment is {load.moment}, {about:.4g} of it about the "
        f"director ({normal}), about which a shell carries none; it must {would_do}act on a rigid "
        "body or a beam that is fixed to the shell"
    )


def point_loads(scene: Scene, comm: MPI.Comm, find: FindEnd) -> list[PointLoads]:
    """Loads at points as bodies of the system, one for all that share their kernels.

    Args:
        scene: The scene.
        comm: Communicator.
        find: Places on bodies by name.

    Raises:
        SceneError: If there is no such place, or a shell cannot carry the moment.
    """
    groups: dict[tuple[type, int], list[tuple[PointLoad, End]]] = {}
    loads: tuple[Any, ...] = scene.loads
    for load in loads:
        if not load.at_point:
            continue
        _, needed, given = of_kind(_WORK, load)
        (body,) = scene.bodies_of(load)
        end = find(body.name, load.at, load.label)
        if given == "moment" and not end.framed:
            _refuse_drilling(load, end)
        vectors = end.needed(needed)
        groups.setdefault((type(load), vectors), []).append((load, end))
    return [PointLoads(comm, items, vectors) for (_, vectors), items in groups.items()]
