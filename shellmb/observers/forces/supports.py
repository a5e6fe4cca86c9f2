"""Forces and moments that supports exert, summed up over their nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Bools
from shellmb.model.locations.nodes import local_nodes
from shellmb.model.model import Model
from shellmb.observers.forces.joints import Span
from shellmb.observers.forces.reactions import Arms, Assembled, HeldForces
from shellmb.scene.lookup import said
from shellmb.schemes.base import END

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


class SupportForces:
    """Forces [N] and moments about the origin [N m] of all supports, in the scene's axes.

    A node that several places have in common counts at the first of them.

    Args:
        problem: The system that was solved.
        model: The bodies.
        balance: Stages of the rows that balance momenta, as of a scheme.

    Attributes:
        names: Columns of the history, `BODY.EDGE.Fx` to `BODY.EDGE.Mz`.
    """

    def __init__(self, problem: Assembled, model: Model, balance: Sequence[str] = (END,)) -> None:
        self._rows = [HeldForces(problem, model, stage) for stage in balance]
        self._comm = model.comm
        self._places: list[tuple[int, Bools]] = []
        places: dict[str, int] = {}
        numbers = {carrier.name: k for k, carrier in enumerate(self._rows[0].carriers)}
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

    def __call__(self, span: Callable[[str], Span]) -> dict[str, float]:
        """Columns of the history; collective.

        Args:
            span: States of a body over which they act, by its name.
        """
        sums = np.zeros((len(self._places), 6))
        for number, held in enumerate(self._rows):
            held.take(0)
            forces = held.nodal(slice(1))
            if forces is None:
                continue
            for row, (k, marks) in enumerate(self._places):
                carrier = held.carriers[k]
                start, end, middle = span(carrier.name)
                # the first moment of a force in time is no force, and acts on the way
                arms = Arms((end - start)[None] / 2, 0.0) if number else Arms(middle[None], 1.0)
                ((found,),), _ = carrier.resultants(arms, [forces], marks)
                first = 3 * number
                sums[row, first:] += found[first:]
        self._comm.Allreduce(MPI.IN_PLACE, sums)
        return dict(zip(self.names, sums.ravel().tolist(), strict=True))


def _place(where: object) -> str:
    """An edge, several, a point or coordinates in a name of a column."""
    if isinstance(where, tuple):
        return "+".join(w if isinstance(w, str) else f"{w:g}" for w in where)
    return str(where)
