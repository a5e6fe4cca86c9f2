"""Links between dofs of bodies, each to one that is not linked itself."""

import itertools

from mpi4py import MPI

import numpy as np

from shellmb.model.body import Body, NodeLink


def aliases(bodies: list[Body], comm: MPI.Comm) -> dict[tuple[str, int], tuple[str, int]]:
    """Body and global dof of all linked dofs, with those that they are linked to; collective.

    Links may say the same twice, as where each of three shells is joined to both others.

    Args:
        bodies: All bodies.
        comm: Communicator.
    """
    alias: dict[tuple[str, int], tuple[str, int]] = {}
    for body in bodies:
        index_map = body.mixed.space.dofmap.index_map
        local = [
            ((body.name, int(g)), (link.body, int(target)))
            for link in body.links
            for g, target in zip(index_map.local_to_global(link.dofs), link.targets, strict=True)
        ]
        for pair in itertools.chain(*comm.allgather(local)):
            here, there = (_end(alias, dof) for dof in pair)
            if here != there:
                alias[here] = there
    return alias


def _end(alias: dict[tuple[str, int], tuple[str, int]], dof: tuple[str, int]) -> tuple[str, int]:
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
        resolved: dict[str, tuple[list[int], list[int]]] = {}
        index_map = body.mixed.space.dofmap.index_map
        count = index_map.size_local + index_map.num_ghosts
        numbers = index_map.local_to_global(np.arange(count, dtype=np.int32))
        for dof in np.flatnonzero(np.isin(numbers, linked.get(body.name, []))):
            name, target = _end(alias, (body.name, int(numbers[dof])))
            dofs, targets = resolved.setdefault(name, ([], []))
            dofs.append(int(dof))
            targets.append(target)
        # numbering links is collective: every rank has a link to the same bodies, if an empty one
        names = sorted(set().union(*comm.allgather(set(resolved))))
        body.links = tuple(_as_link(name, *resolved.get(name, ([], []))) for name in names)


def _as_link(name: str, dofs: list[int], targets: list[int]) -> NodeLink:
    return NodeLink(np.array(dofs, dtype=np.int32), name, np.array(targets, dtype=np.int64))
