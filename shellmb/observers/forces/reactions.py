"""Forces of supports, drivers and joints to ground: at nodes, and their sums."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.model.model import Model
from shellmb.observers.deferred_observer import StepValues
from shellmb.observers.fields.nodal import NodalBody, Nodes, NodeSums, nodal_bodies
from shellmb.simulate.problem import Problem
from shellmb.simulate.start.endforces import EndForces, Impulses
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.meshgroups import residuals_of_fields

# a system of all bodies: that of a step, or that of the forces at its end
type Assembled = Problem | EndForces | Impulses


def resistance(problem: Assembled, rows: Iterable[tuple[str, str]]) -> Callable[[], Floats]:
    """Make what finds the virtual work of forces of some groups, one behind the other.

    Args:
        problem: The system.
        rows: Names of the groups with the rows that the forces are in.
    """
    numbers = [problem.number(*row) for row in rows]
    every = problem.system.residual_forms
    forms = {k: [form for form, of in every if of == (k,)] for k in numbers}
    return residuals_of_fields(problem.system, forms)


def gathered(system: BlockSystem, local: Floats, reactions: Floats | None = None) -> Floats:
    """Sums of nodal forces of all that share a node, as this rank sees them; collective.

    Args:
        system: The block system.
        local: Forces that this rank finds at each local dof in some steps, shape (k, local dofs).
        reactions: Forces on the fixed unknowns that come on top, shape (k, n).
    """
    fixed = system.fixed if reactions is not None else np.zeros(0, np.int64)
    more = np.zeros((len(local), 0)) if reactions is None else reactions
    found, exchange = np.empty(local.shape), system.exchange
    for row, values, given in zip(found, local, more, strict=True):
        sums = exchange.summed(values)
        sums[fixed] += given
        row[:] = exchange.seen(sums)
    return found


class HeldForces:
    """Forces of supports, drivers and joints to ground in a row.

    Args:
        problem: The system that was solved.
        model: The bodies.
        stage: The row.

    Attributes:
        carriers: Bodies that forces arrive at.
    """

    def __init__(self, problem: Assembled, model: Model, stage: str) -> None:
        self._system = problem.system

        def where(body: str) -> slice:
            return problem.system.numbering.slice(problem.number(body, stage))

        self.carriers = [Carrier(body, where(name)) for name, body in nodal_bodies(model).items()]
        on_arms = (body for body in model.bodies if body.arms is not None)
        self.carriers += [ArmCarrier(body, where(body.name)) for body in on_arms]
        self._planes = [
            (where(plane.name), StepValues(resistance(problem, [(plane.name, stage)])))
            for plane in model.planes
        ]
        self._supported = model.supported
        # what is left of the equations of fixed unknowns is what holds them
        system = problem.system
        self._reactions = StepValues(lambda: system.reactions)

    def take(self, step: int) -> None:
        """Take what a step leaves of them."""
        if not self._supported:
            return
        self._reactions.take(step)
        for _, works in self._planes:
            works.take(step)

    def nodal(self, steps: slice) -> Floats | None:
        """Nodal forces on this rank, shape (k, local dofs); None without any; collective.

        Args:
            steps: Which of those taken.
        """
        if not self._supported:
            return None
        reactions = self._reactions.of(steps)
        local = np.zeros((len(reactions), len(self._system.numbering.local_to_global)))
        for place, works in self._planes:
            # on the left-hand side they resist
            local[:, place] -= works.of(steps)
        return gathered(self._system, local, reactions)


class Carrier:
    """A body that forces arrive at.

    Args:
        body: The body.
        where: Its local dofs among those of the system.
    """

    def __init__(self, body: NodalBody, where: slice) -> None:
        self.name, self._nodes, self._where = body.name, Nodes(body), where
        self._sums = self._nodes.sums()
        # a node that two bodies share counts on the one that it belongs to
        index_map = body.mixed.space.dofmap.index_map
        self._counted = np.ones(index_map.size_local + index_map.num_ghosts)
        self._counted[index_map.size_local :] = 0.0
        for link in body.links:
            self._counted[link.dofs] = 0.0

    def resultants(
        self, q: Floats, whole: float, forces: Sequence[Floats], nodes: Bools | None = None
    ) -> tuple[Floats, Floats]:
        """Force and moment of several sets of forces in some steps, and their gross size.

        Args:
            q: Dofs of some states, or changes of them, shape (k, dofs): points at which they act.
            whole: One for states; zero for changes, which are arms by themselves.
            forces: Nodal forces of the whole system on this rank, of each set, shape (k, n).
            nodes: Markers of the nodes that count, shape (n,); None: all, and all that turns with
                the body and does not move with it.

        Returns:
            Resultants of shape (sets, k, 6), and the sum of the sizes of all forces on positions,
            shape (k,).
        """
        counted = self._counted
        if nodes is not None:
            marked = self._nodes.dofs_of(nodes)
            counted = np.zeros(len(counted))
            counted[marked] = self._counted[marked]
        found = np.zeros((len(forces), len(q), 7))
        for rows, values in zip(found, forces, strict=True):
            rows[:] = self._sums.resultants(q, whole, values[:, self._where], counted)
        return found[..., :6], found[..., 6].sum(axis=0)


class ArmCarrier(Carrier):
    """Arms of a body in modes that forces act on: they turn with it, and do not move with it.

    Args:
        body: What holds them.
        where: Its local dofs among those of the system.
    """

    def __init__(self, body: Any, where: slice) -> None:
        self.name, self._where = body.name, where
        dofs = np.reshape(body.mixed.dofs["u"], (-1, 3)).astype(np.int64)
        self._sums = NodeSums(dofs, body.arms[body.nodes.item], 0, len(dofs))
        self._counted = np.ones(where.stop - where.start)
