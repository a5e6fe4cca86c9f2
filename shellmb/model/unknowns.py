"""Links between dofs of bodies, numbers of the nodal unknowns, and which of them are given.

The look-throughs before a run ask for the numbers, of linked ones once, and need no block system,
and so no residual.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Bools, Floats, Ints
from shellmb.model.body import Body, NodeLink

# name of a body, and a global dof of it
Dof = tuple[str, int]


def aliases(bodies: list[Body], comm: MPI.Comm) -> dict[Dof, Dof]:
    """Body and global dof of all linked dofs, with those that they are linked to; collective.

    Links may say the same twice, as where each of three shells is joined to both others.

    Args:
        bodies: All bodies.
        comm: Communicator.
    """
    alias: dict[Dof, Dof] = {}
    for body in bodies:
        local = [
            ((body.name, int(g)), (link.body, int(target)))
            for link in body.links
            for g, target in zip(body.mixed.numbers(link.dofs), link.targets, strict=True)
        ]
        for pair in itertools.chain(*comm.allgather(local)):
            here, there = (linked_to(alias, dof) for dof in pair)
            if here != there:
                alias[here] = there
    return alias


def linked_to(alias: Mapping[Dof, Dof], dof: Dof) -> Dof:
    """The dof that a dof is linked to in the end."""
    while dof in alias:
        dof = alias[dof]
    return dof


def resolve_links(bodies: list[Body], comm: MPI.Comm) -> None:
    """Let every link point to a dof that is not linked itself (three shells at one edge, say).

    Args:
        bodies: All bodies, which get their links.
        comm: Communicator; the call is collective.
    """
    alias = aliases(bodies, comm)
    linked: dict[str, list[int]] = {}
    for name, number in alias:
        linked.setdefault(name, []).append(number)
    for body in bodies:
        index_map = body.mixed.space.dofmap.index_map
        count = index_map.size_local + index_map.num_ghosts
        numbers = index_map.local_to_global(np.arange(count, dtype=np.int32))
        dofs = np.flatnonzero(np.isin(numbers, linked.get(body.name, []))).astype(np.int32)
        ends = [linked_to(alias, (body.name, int(number))) for number in numbers[dofs]]
        owners = np.array([name for name, _ in ends], dtype=str)
        targets = np.array([target for _, target in ends], dtype=np.int64)
        # numbering links is collective: every rank has a link to the same bodies, if an empty one
        names = sorted(set().union(*comm.allgather({name for name, _ in ends})))
        body.links = tuple(
            NodeLink(dofs[owners == name], name, targets[owners == name]) for name in names
        )


@dataclass(frozen=True)
class Given:
    """Unknowns with given values, the same on all ranks.

    Args:
        numbers: Their numbers, ascending and perhaps repeated, shape (n,).
        rates: Their rates at the start, shape (n,).
        values: Their values at the times requested, shape (n, times).
    """

    numbers: Ints
    rates: Floats
    values: Floats

    def has(self, numbers: Ints) -> Bools:
        """Find which of some unknowns are given."""
        # they are in order, and asked for once by each constraint
        behind = np.searchsorted(self.numbers, numbers, side="right")
        return np.asarray(behind > self.place(numbers))

    def place(self, numbers: Ints) -> Ints:
        """Find where unknowns are in the list; all of them must be given."""
        return np.searchsorted(self.numbers, numbers)


NOT_GIVEN = Given(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 1)))


class Unknowns:
    """Numbers of all unknowns of a model; those that are linked have the number of their target.

    Args:
        bodies: The bodies, their links resolved.
        comm: Communicator.

    Attributes:
        numbers: By the body's name the number of every local dof (owned and ghost).
        linked: By the body's name which of them are another body's.
    """

    def __init__(self, bodies: Sequence[Body], comm: MPI.Comm) -> None:
        self._bodies, self._comm = bodies, comm
        self.numbers: dict[str, Ints] = {}
        self.linked: dict[str, Bools] = {}
        maps = {body.name: body.mixed.space.dofmap.index_map for body in bodies}
        ends = np.cumsum([0, *(m.size_global for m in maps.values())])
        first = {name: int(end) for name, end in zip(maps, ends, strict=False)}
        for body in bodies:
            index_map = maps[body.name]
            count = index_map.size_local + index_map.num_ghosts
            numbers = index_map.local_to_global(np.arange(count, dtype=np.int32)) + first[body.name]
            linked = np.zeros(count, dtype=bool)
            for link in body.links:
                numbers[link.dofs] = first[link.body] + link.targets
                linked[link.dofs] = True
            self.numbers[body.name], self.linked[body.name] = numbers, linked

    def sizes(self, wanted: Ints) -> Floats:
        """Typical size of some unknowns: the length of a body, or 1 for a director; collective.

        Args:
            wanted: Their numbers, ascending, the same on all ranks.

        Returns:
            One number for each, the same for an unknown of several bodies.
        """
        found = np.zeros(len(wanted))
        for body in self._bodies:
            for part in body.parts:
                numbers = self.numbers[body.name][body.mixed.dofs[part.name]]
                numbers = numbers[np.isin(numbers, wanted)]
                np.maximum.at(found, np.searchsorted(wanted, numbers), part.scale)
        self._comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
        return np.where(found > 0, found, 1.0)

    def given(self, times: Sequence[float], h: float) -> Given:
        """Values that supports and drivers prescribe, and fixed ones; collective.

        Args:
            times: Times at which values are wanted, s.
            h: Step of the difference that gives the rates at the time 0, s.
        """
        numbers, rates, values = [np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros((0, len(times)))]
        for body in self._bodies:
            for fixed in body.fixed:
                numbers.append(self.numbers[body.name][fixed.dofs])
                rates.append(fixed.rate(h))
                values.append(np.array([fixed.value(t) for t in times]).T)
        mine = (np.concatenate(numbers), np.concatenate(rates), np.concatenate(values))
        every = self._comm.allgather(mine)
        found, speeds, histories = (np.concatenate([part[k] for part in every]) for k in range(3))
        # ghosts are named by several ranks, always alike
        rows = np.column_stack([found, speeds, histories])
        _, first = np.unique(rows, axis=0, return_index=True)
        order = first[np.argsort(found[first], kind="stable")]
        return Given(found[order], speeds[order], histories[order])
