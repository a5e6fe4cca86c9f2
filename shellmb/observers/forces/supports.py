"""Forces and moments that supports exert, summed up over their nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.model.locations.nodes import local_nodes
from shellmb.model.model import Model
from shellmb.observers.forces.reactions import Arms, Assembled, HeldForces
from shellmb.scene.lookup import said

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


class SupportForces:
    """Forces [N] and moments about the origin [N m] of all supports, in the scene's axes.

    A node that several places have in common counts at the first of them.

    Args:
        problem: The system that was solved.
        model: The bodies.

    Attributes:
        names: Columns of the history, `BODY.EDGE.Fx` to `BODY.EDGE.Mz`.
    """

    def __init__(self, problem: Assembled, model: Model) -> None:
        self._held, self._comm = HeldForces(problem, model, problem.last), model.comm
        self._places: list[tuple[int, Bools]] = []
        places: dict[str, int] = {}
        numbers = {carrier.name: k for k, carrier in enumerate(self._held.carriers)}
        taken: dict[str, Bools] = {}
        for support in model.scene.supports:
            where: Any = getattr(support, "at", None)
            for described in model.scene.bodies_of(support):
                body = model.meshed[described.name]
                count = len(body.mixed.nodes("u"))
                name = f"{body.name}.{_place(where)}"
                if name not in places:
                    places[name] = len(self._places)
                    self._places.append((numbers[body.name], np.zeros(count, dtype=bool)))
                mine = self._places[places[name]][1]
                found = np.zeros(count, dtype=bool)
                found[local_nodes(body, where, said(support))] = True
                here = taken.setdefault(body.name, np.zeros(count, dtype=bool))
                mine |= found & ~here
                here |= found
        self.names = [f"{place}.{component}" for place in places for component in COMPONENTS]

    def __call__(self, state: Callable[[str], Floats], ending: str = "") -> dict[str, float]:
        """Columns of the history; collective.

        Args:
            state: State of a body at which they act, by its name.
            ending: What the names of the columns end with.
        """
        taken, sums = self._held.room(1), np.zeros((len(self._places), 6))
        self._held.take(taken, 0)
        forces = self._held.nodal(taken, slice(1))
        if forces is not None:
            for row, (k, marks) in enumerate(self._places):
                carrier = self._held.carriers[k]
                arms = Arms(state(carrier.name)[None], 1.0)
                ((sums[row],),), _ = carrier.resultants(arms, [forces], marks)
        self._comm.Allreduce(MPI.IN_PLACE, sums)
        values = sums.ravel().tolist()
        return {f"{name}{ending}": v for name, v in zip(self.names, values, strict=True)}


def _place(where: object) -> str:
    """An edge, several, a point or coordinates in a name of a column."""
    if isinstance(where, tuple):
        return "+".join(w if isinstance(w, str) else f"{w:g}" for w in where)
    return str(where)
