"""The nodes of a whole system that carry directors, and updates that turn them."""

from collections.abc import Callable
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.native import library as native
from shellmb.native.assembler import is_native
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.nullspace.directornodes import TURN, DirectorNodes

# a method of `DirectorNodes`: number of the field, values of its nodes, values found so far
Take = Callable[[DirectorNodes, int, Floats, dict[int, Floats]], None]


class SystemNodes:
    """The nodes of a whole system that carry directors, each on the rank that owns it.

    Args:
        system: The block system.

    Attributes:
        sets: Nodes by number of their field.
        rows: Their unknowns, shape (n, 3 k) each.
        full: All unknowns, as this rank sees them.
    """

    def __init__(self, system: BlockSystem) -> None:
        self.system, self.fields, n = system, system.fields, system.numbering
        self.full = system.exchange
        declared = [(k, f.directors) for k, f in enumerate(self.fields) if f.directors is not None]
        self.sets: dict[int, DirectorNodes] = {}
        # triples first: a director that is one of a triple's, or of a node that several fields
        # share, is not a node of its own
        claimed = np.zeros(0, np.int64)
        for k, directors in sorted(declared, key=lambda item: -item[1].dofs.shape[1]):
            # linked or not, the dofs of a node have one owner in the field's own index map
            keep = (directors.multipliers < self.fields[k].size_local).all(axis=1)
            numbers = n.by_field[k][directors.dofs]
            keep &= ~np.isin(numbers, claimed).any(axis=1)
            mine = system.comm.allgather(numbers[keep].ravel())
            claimed = np.unique(np.concatenate([claimed, *mine]))
            self.sets[k] = DirectorNodes(self.fields[k], keep, system.held[k].astype(bool))
        # rates come behind the states that they belong to
        self.sets = dict(sorted(self.sets.items()))
        self.rows = {k: n.by_field[k][s.dofs] for k, s in self.sets.items()}
        self._places = {k: s.dofs + int(n.offsets[k]) for k, s in self.sets.items()}
        self._given = {k: self.rows[k][s.regular] for k, s in self.sets.items()}
        here = {k: rows - self.full.start for k, rows in self._given.items()}
        # the loops turn nodes in place; no rank has nodes whose unknowns others own, as nodes may
        # that bodies share
        alone = is_native() and all(
            not (s.rates or s.massless) and np.all((rows >= 0) & (rows < n.owned))
            for s, rows in zip(self.sets.values(), here.values(), strict=True)
        )
        alone = bool(system.comm.allreduce(alone, op=MPI.MIN))
        self._loops: list[tuple[DirectorNodes, Any]] | None = None
        if alone:
            self._lib, self._pointer = native.cells().lib, native.CArrays()
            self._loops = [
                turning(s, here[k], None if s.partner is None else here[s.partner], self._pointer)
                for k, s in self.sets.items()
                # rates are turned with their directors
                if not s.declared.linear and s.state is None
            ]

    def begin(self) -> None:
        """The fields hold another state."""
        for nodes in self.sets.values():
            nodes.settled = False

    def multipliers(self, k: int) -> Ints:
        """Unknowns of the multipliers of a field's nodes, shape (n, c)."""
        return np.asarray(self.system.numbering.by_field[k][self.sets[k].multipliers])

    def turn(self, x: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Make an update one by finite rotations, so that `x - dx` keeps lengths and angles.

        Args:
            x: Unknowns; the fields' functions hold their values, too.
            dx: Solution of the linear system; changed.
        """
        if not self.sets:
            return
        if self._loops is not None:
            now, change = native.entries(x), native.entries(dx, True)
            for nodes, struct in self._loops:
                if self._lib.turn_nodes(struct, now, change, TURN):
                    nodes.settled = False
            return
        changes, state = dx.array, x.array_r
        for known, values in self._found(DirectorNodes.moved, -changes):
            changes[known] = state[known] - values

    def normalise(self, x: PETSc.Vec) -> None:
        """Bring directors that are nearly so to unit length and right angles.

        Args:
            x: Unknowns; changed. Functions of the start of the step hold its values.
        """
        if self._loops is not None:
            now = native.entries(x, True)
            for _, struct in self._loops:
                self._lib.normalise_nodes(struct, now)
            return
        state = x.array
        for known, values in self._found(DirectorNodes.nearest, state):
            state[known] = values

    def _found(self, take: Take, unknowns: Floats) -> list[tuple[Ints, Floats]]:
        """Places of owned unknowns that nodes give values to, and these values.

        Args:
            take: Gives the values of the nodes of a field from some of all `unknowns`.
            unknowns: One number for each unknown that this rank owns.
        """
        local = self.full.seen(unknowns)
        values: dict[int, Floats] = {}
        # an update far from the solution may have no square: convergence tests see that on every
        # rank, and C says nothing of it
        with np.errstate(all="ignore"):
            for k, nodes in self.sets.items():
                take(nodes, k, local[self._places[k]], values)
        pairs = [(self._given[k], v[self.sets[k].regular]) for k, v in values.items()]
        if self.full.serial:
            return pairs
        ids = np.concatenate([*(rows.ravel() for rows, _ in pairs), np.zeros(0, np.int64)])
        given = np.concatenate([*(v.ravel() for _, v in pairs), np.zeros(0)])
        known = np.flatnonzero(self.full.set(ids, np.ones(len(ids))) > 0.0)
        return [(known, self.full.set(ids, given)[known])]


def turning(
    nodes: DirectorNodes, rows: Ints, rates: Ints | None, pointer: native.CArrays
) -> tuple[DirectorNodes, Any]:
    """The nodes of one field where their unknowns are this rank's own, and for C, where they are.

    Args:
        nodes: The nodes.
        rows: Owned unknowns of those without fixed components, shape (n, 3 k).
        rates: Those of their velocities over a path, of the same shape; None: there are none.
        pointer: Makes pointers.
    """
    members = {
        "nodes": len(rows),
        "directors": rows.shape[1] // 3,
        "rows": pointer(np.ascontiguousarray(rows)),
        "rates": pointer(None if rates is None else np.ascontiguousarray(rates)),
        "reference": pointer(np.ascontiguousarray(nodes.reference[nodes.regular])),
    }
    return nodes, pointer.many("Turning", [members])
