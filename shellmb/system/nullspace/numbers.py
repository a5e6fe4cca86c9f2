"""Numbers of the reduced unknowns, and which combinations of them every unknown is."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Bools, Floats, Ints
from shellmb.native import library as native
from shellmb.native.library import CArrays
from shellmb.system.assembly.loops import MeshCells
from shellmb.system.couplings import MatrixPlaces
from shellmb.system.nullspace.nodes import SystemNodes
from shellmb.system.nullspace.prolongation import RowMap

NONE = -1
# largest number of unknowns of a cell that some of them are eliminated of (stacks in cells.c)
MOST = 256


class NodeRows(NamedTuple):
    """Rows of a table that the unknowns of a field's nodes have.

    Args:
        table: Rows of all local dofs.
        field: Number of the field.
        values: Of the nodes, shape (n, 3 k, m).
        first: Column of the first of the m.
        multipliers: Field whose multipliers these are the forces of; None: of none.
    """

    table: Floats
    field: int
    values: Floats
    first: int = 0
    multipliers: int | None = None


class ReducedNumbers:
    """The reduced unknowns: what cells share, without fixed values, lengths and angles.

    Args:
        nodes: Nodes of the unreduced system.
        cells: The cells of all meshes.
        kept: Local dofs that are not eliminated, beside those of fields: more than cells may act on
                them.

    Attributes:
        right: Unknowns by reduced unknowns.
        left: Equations by reduced ones.
        forces: Equations by the multipliers that nodes carry.
        count: Number of reduced unknowns that this rank owns.
        outer: Which of them are in the matrix.
        first_outer: Number in the matrix of the first of them.
        own: Local dof of each unknown that this rank owns.
        kept: Local dofs that are not eliminated.
    """

    def __init__(
        self, nodes: SystemNodes, cells: list[MeshCells], kept: Sequence[Ints] = ()
    ) -> None:
        self.system, n = nodes.system, nodes.system.numbering
        self.fields, self.full = self.system.fields, nodes.full
        of_fields = (k + field.kept for k, field in zip(n.offsets, self.fields, strict=False))
        self.kept = np.concatenate([*kept, *of_fields])
        self.nodes, self._rows = nodes.sets, nodes.rows
        self.multipliers_of = nodes.multipliers
        local = n.local_to_global - n.start
        mine = np.flatnonzero((local >= 0) & (local < n.owned))
        self.own = np.zeros(n.owned, dtype=np.int64)
        # the first of several linked ones
        self.own[local[mine][::-1]] = mine[::-1]
        self._lib = native.cells().lib
        self._given = np.zeros(len(local))
        # nodes that may have to be brought back to their constraints
        self._loose = [
            (k, s)
            for k, s in self.nodes.items()
            if not s.declared.linear and (s.partial or s.state is None)
        ]
        self._number(cells)

    def _number(self, cells: list[MeshCells]) -> None:
        n, full = self.system.numbering, self.full
        own = [a.ravel() for a in self._rows.values()]
        own += [self.multipliers_of(k).ravel() for k in self.nodes]
        taken = np.concatenate([*own, np.zeros(0, np.int64)])
        plain = full.set(taken, np.ones(len(taken))) == 0.0
        plain[self.system.fixed] = False
        for group in cells:
            inner = n.local_to_global[np.unique(group.dofs[:, group.shared :])]
            plain[inner - n.start] = False
        order, counts = self._order(cells, np.flatnonzero(plain))
        start = int(self.system.comm.exscan(len(order)) or 0)  # type: ignore[attr-defined]
        numbers = np.empty(len(order), dtype=np.int64)
        numbers[order] = start + np.arange(len(order))
        self.count = len(order)
        columns = np.full((n.owned, 1), NONE)
        columns[plain, 0] = numbers[: counts[0]]
        # of nodes: their own directions, and of rates those of the state, too
        directions, first = {}, counts[0]
        for (k, nodes), count in zip(self.nodes.items(), counts[1:], strict=True):
            ids = np.full((len(nodes.dofs), nodes.size), NONE)
            ids[np.arange(nodes.size) < nodes.free[:, None]] = numbers[first : first + count]
            directions[k], first = ids, first + count
        width = max([1, *(s.size for s in self.nodes.values())])
        columns = np.pad(columns, ((0, 0), (0, width - 1)), constant_values=NONE)
        states = {k: directions[s.state] for k, s in self.nodes.items() if s.state is not None}
        pairs = {k: s.partner for k, s in self.nodes.items() if s.partner is not None}
        tests = directions | {k: directions[p] for k, p in pairs.items()}
        others = {k: directions[k] for k in pairs}
        nothing = np.full_like(columns, NONE)
        rows, more = (
            np.concatenate([own, self._columns(nothing, numbers)], axis=1) if numbers else own
            for own, numbers in (
                (self._columns(self._exchanged(columns, plain, pairs), tests), others),
                (self._columns(columns, directions), states),
            )
        )
        self._split = width
        comm = self.system.comm
        self.left = RowMap(comm, rows, self.count, self.own)
        self.right = RowMap(comm, more, self.count, self.own)
        ones = np.where(columns >= 0, 1.0, 0.0)
        ones[:, 1:] = 0.0
        ones = self._seen(ones)
        self.left.values[:, :width] = ones
        self.right.values[:, :width] = ones
        self._number_multipliers()
        self._number_outer(cells)

    def _exchanged(self, columns: Ints, plain: Bools, pairs: dict[int, int]) -> Ints:
        """Numbers of the equations of unknowns that have one of their own.

        Over a step that is quadratic in time the balance of momentum, tested with the end, tells
        the velocities above all, and its first moment, tested with these, where the end is.
        Equations take each other's numbers there, so that what is large is on the diagonal: else
        factors without pivots lose six more digits with long steps of thin plates.

        Args:
            columns: Numbers of the unknowns that this rank owns, shape (owned, width).
            plain: Which of these have one.
            pairs: Numbers of fields of ends and velocities, each with that of its other one.
        """
        n, found = self.system.numbering, columns.copy()
        for k, partner in pairs.items():
            size = self.fields[k].size_local
            own, other = (n.by_field[f][:size] - n.start for f in (k, partner))
            mine = (own >= 0) & (own < n.owned) & (other >= 0) & (other < n.owned)
            own, other = own[mine], other[mine]
            both = plain[own] & plain[other]
            found[own[both]] = columns[other[both]]
        return found

    def _number_outer(self, cells: list[MeshCells]) -> None:
        """Numbers in the matrix of what cells share; what only one cell has is eliminated there.

        Not of meshes without element-wise unknowns: multipliers of joints have no block to
        eliminate them with.
        """
        inner = np.ones(self.count, dtype=bool)
        for rows in (self.left, self.right):
            counts = np.zeros(len(rows.numbers.wanted) + 1)
            for group in cells:
                places = np.sort(
                    rows.places[group.dofs[:, : group.shared]].reshape(
                        group.count, group.shared * rows.places.shape[1]
                    )
                )
                new = np.ones(places.shape, dtype=bool)
                new[:, 1:] = places[:, 1:] != places[:, :-1]
                alone = np.bincount(places[new], minlength=len(counts))
                many = group.size == group.shared or group.shared > MOST
                counts += alone * (2 if many else 1)
            # what others act on, too, counts as shared
            kept = np.bincount(rows.places[self.kept].ravel(), minlength=len(counts))
            counts += 2 * kept
            inner &= rows.numbers.summed(counts[:-1]) == 1
        comm = self.system.comm
        if not comm.allreduce(int(np.sum(~inner))):
            inner[:] = False
        self.outer = np.flatnonzero(~inner)
        self.first_outer = int(comm.exscan(len(self.outer)) or 0)  # type: ignore[attr-defined]
        numbers = np.full(self.count, float(NONE))
        numbers[self.outer] = self.first_outer + np.arange(len(self.outer))
        self.matrix_rows, self.matrix_columns = (
            np.rint(rows.numbers.seen(numbers)).astype(np.int64) for rows in (self.left, self.right)
        )
        self.inner_rows, self.inner_columns = self.matrix_rows < 0, self.matrix_columns < 0

    def matrix_places(self, dofs: Ints) -> tuple[MatrixPlaces, MatrixPlaces]:
        """Rows and columns in the matrix of equations and unknowns of local dofs; collective.

        Args:
            dofs: Local dofs that matter.
        """
        found = []
        for bases, numbers in ((self.left, self.matrix_rows), (self.right, self.matrix_columns)):
            places = np.append(numbers, NONE)[bases.places]
            most = int((places[dofs] >= 0).any(axis=0).nonzero()[0].max(initial=0)) + 1
            # as many as some of them have on any rank
            most = self.system.comm.allreduce(most, op=MPI.MAX)
            found.append(MatrixPlaces(places[:, :most], bases.values))
        rows, columns = found
        return rows, columns

    def _number_multipliers(self) -> None:
        n, comm = self.system.numbering, self.system.comm
        ends = np.cumsum([0, *(s.multipliers.size for s in self.nodes.values())])
        self._first = dict(zip(self.nodes, map(int, ends), strict=False))
        self.multipliers = int(ends[-1])
        start = int(comm.exscan(self.multipliers) or 0)  # type: ignore[attr-defined]
        every = start + np.arange(self.multipliers)
        numbers = {k: self.of_node(every, k).copy() for k in self.nodes}
        for k, nodes in self.nodes.items():
            # of nodes that are held, forces are reactions and not multipliers
            numbers[k][nodes.held] = NONE
        width = max([1, *(s.multipliers.shape[1] for s in self.nodes.values())])
        nothing = np.full((n.owned, width), NONE)
        columns = self._columns(nothing, numbers)
        partners = {k: numbers[s.partner] for k, s in self.nodes.items() if s.partner is not None}
        if partners:
            columns = np.concatenate([columns, self._columns(nothing, partners)], axis=1)
        self._split_forces = width
        self.forces = RowMap(comm, columns, self.multipliers, self.own)
        rows = self._columns(
            nothing[:, :1],
            {k: ids.reshape(-1, 1) for k, ids in numbers.items()},
            {k: self.multipliers_of(k).reshape(-1, 1) for k in self.nodes},
        )
        self.multiplier_values = RowMap(comm, rows, self.multipliers, self.own)
        self.multiplier_values.values[:] = np.where(rows >= 0, 1.0, 0.0)
        self.weights = np.ones(self.multipliers)

    def _order(self, cells: list[MeshCells], plain: Ints) -> tuple[Ints, list[int]]:
        """Order of all reduced unknowns that keeps those of a node together; and their counts."""
        local = len(self.full.wanted)
        first, last = np.full(local, 1 << 40), np.full(local, -1)
        offset = 0
        for group in cells:
            numbers = offset + np.repeat(np.arange(group.count), group.size)
            np.minimum.at(first, group.dofs.ravel(), numbers)
            np.maximum.at(last, group.dofs.ravel(), numbers)
            offset += group.count
        places, counts = [self.own[plain]], [len(plain)]
        for k, nodes in self.nodes.items():
            offset = int(self.system.numbering.offsets[k])
            where = np.repeat(nodes.dofs[:, 0].astype(np.int64) + offset, nodes.free)
            places.append(where)
            counts.append(len(where))
        where = np.concatenate(places).astype(np.int64)
        return np.lexsort((last[where], first[where])), counts

    def _columns(
        self, base: Ints, numbers: dict[int, Ints], rows: dict[int, Ints] | None = None
    ) -> Ints:
        """Columns of all local dofs from those of owned unknowns and of nodes."""
        values = (base + 1).astype(float)
        rows = self._rows if rows is None else rows
        ids = [np.empty(0, np.int64)]
        found = [np.empty((0, base.shape[1]))]
        for k, columns in numbers.items():
            repeated = np.repeat(columns, rows[k].size // len(columns) if len(columns) else 1, 0)
            pad = base.shape[1] - repeated.shape[1]
            found.append(np.pad(repeated + 1.0, ((0, 0), (0, pad))))
            ids.append(rows[k].ravel())
        out = self._spread(values, np.concatenate(ids), np.concatenate(found))
        return np.rint(out).astype(np.int64) - 1

    def _spread(self, base: Floats, ids: Ints, values: Floats) -> Floats:
        """Rows of owned unknowns, replaced where nodes know better, at all local dofs."""
        known = self.full.set(ids, np.ones(len(ids))) > 0.0
        merged = base.copy()
        for q in range(base.shape[1]):
            merged[known, q] = self.full.set(ids, values[:, q])[known]
        return self._seen(merged)

    def _seen(self, values: Floats) -> Floats:
        return np.stack([self.full.seen(values[:, q]) for q in range(values.shape[1])], axis=1)

    def update(self) -> None:
        """Bases of the tangent spaces at the current state of all fields."""
        rows = self._node_rows
        for nodes in self.nodes.values():
            nodes.renew(self.fields)
        if self.full.serial:
            self._lib.put_rows(*self._put)
            return
        for row in rows:
            by = None if row.multipliers is None else self._divisors(row.multipliers)[:, None, :]
            self._put_shared(row if by is None else row._replace(values=row.values / by))

    @cached_property
    def _node_rows(self) -> list[NodeRows]:
        """The rows that bases have for the tables."""
        left, right, forces = self.left.values, self.right.values, self.forces.values
        rows = []
        for k, nodes in self.nodes.items():
            b = nodes.bases(self.fields, self.nodes)
            rows += [NodeRows(left, k, b.left), NodeRows(right, k, b.right)]
            rows.append(NodeRows(forces, k, b.forces, multipliers=k))
            if b.right_other is not None:
                rows.append(NodeRows(right, k, b.right_other, self._split))
            if b.left_other is not None:
                rows.append(NodeRows(left, k, b.left_other, self._split))
            if b.forces_other is not None:
                first, partner = self._split_forces, nodes.partner
                rows.append(NodeRows(forces, k, b.forces_other, first, partner))
        return rows

    def _divisors(self, partner: int) -> Floats:
        """Forces of multipliers of size one, of a field's nodes, shape (n, c)."""
        return np.asarray(self.of_node(self.weights, partner))

    def scales(self, unknowns: Floats) -> Floats:
        """Means of those of the unknowns that each reduced one in the matrix is part of.

        Args:
            unknowns: Scales of the unknowns that this rank owns.
        """
        places, seen = self.right.places[self.own, : self._split], self.right.numbers
        each = np.broadcast_to(unknowns[:, None], places.shape)
        found = [
            seen.summed(np.bincount(places.ravel(), values.ravel(), len(seen.wanted) + 1)[:-1])
            for values in (each, np.ones(places.shape))
        ]
        return np.asarray((found[0] / found[1])[self.outer])

    def of_node(self, values: npt.NDArray[Any], k: int) -> npt.NDArray[Any]:
        """The part of an array of this rank's multipliers that a field's nodes have, (n, c)."""
        first, shape = self._first[k], self.nodes[k].multipliers.shape
        return values[first : first + shape[0] * shape[1]].reshape(shape)

    @cached_property
    def _put(self) -> tuple[int, Any]:
        """For C, the rows, which one process puts at once."""
        self._pointers = pointer = native.CArrays()
        rows = [self._to_put(pointer, row) for row in self._node_rows]
        return len(rows), pointer.many("RowsToPut", rows)

    def _to_put(self, pointer: CArrays, row: NodeRows) -> dict[str, Any]:
        """Rows of a table for C."""
        (count, to, from_), of = self._local[row.field], row.multipliers
        return {
            "count": count,
            "width": row.values.shape[2],
            "table_width": row.table.shape[1],
            "components": row.values.shape[1],
            "to": to,
            "from": from_,
            "values": pointer(row.values),
            "divisors": pointer(None if of is None else self._divisors(of)),
            "table": pointer(row.table) + row.first,
        }

    def _put_shared(self, row: NodeRows) -> None:
        """Give the rows of a field's nodes new values on all ranks that see them."""
        values = np.ascontiguousarray(row.values.reshape(-1, row.values.shape[2]))
        ids = self._rows[row.field].ravel()
        known = self.full.seen(self.full.set(ids, np.ones(len(ids)))) > 0.0
        for q in range(values.shape[1]):
            found = self.full.seen(self.full.set(ids, values[:, q]))
            row.table[known, row.first + q] = found[known]

    @cached_property
    def _local(self) -> dict[int, tuple[Any, ...]]:
        """For C, local dofs of each field's nodes, and which of the nodes' unknowns each one is."""
        found, self._places = {}, list[Ints]()
        for k, rows in self._rows.items():
            number = np.full(self.full.total, NONE)
            number[rows.ravel()] = np.arange(rows.size)
            row = number[self.full.wanted]
            places = np.flatnonzero(row >= 0), row[row >= 0]
            self._places += places
            found[k] = (len(places[0]), *map(native.longs, places))
        return found

    def correction(self) -> Floats:
        """Given changes of the local unknowns: of fixed ones, and back to constraints.

        Returns:
            One for each local dof; overwritten by the next call.
        """
        system, full, given = self.system, self.full, self._given
        # where only rotations have changed directors there is none: these keep the constraints
        loose = [(k, nodes) for k, nodes in self._loose if nodes.partial or not nodes.settled]
        found = [(k, nodes.correction(self.fields)) for k, nodes in loose]
        values = {k: v.ravel() for k, v in found if v is not None}
        if full.serial:
            self._lib.to_values(*self._fixed)
        else:
            change = np.zeros(system.numbering.owned)
            change[system.fixed] = system.fixed_values() - system.x.array_r[system.fixed]
            given[:] = full.seen(change)
        if values if full.serial else full.comm.allreduce(bool(values), op=MPI.MAX):
            ids = [self._rows[k].ravel() for k in values]
            all_ids = np.concatenate([*ids, np.zeros(0, np.int64)])
            all_values = np.concatenate([*values.values(), np.zeros(0)])
            given += full.seen(full.set(all_ids, all_values)) * (given == 0.0)
        return given

    @cached_property
    def _fixed(self) -> tuple[Any, ...]:
        """Local dofs of one process that have given values, for C."""
        wanted = self.full.wanted
        dofs = np.flatnonzero(np.isin(wanted, self.system.fixed))
        unknowns = wanted[dofs]
        self._kept = dofs, unknowns
        places = native.longs(dofs), native.longs(unknowns)
        where = native.doubles(self.system.values), native.entries(self.system.x)
        return len(wanted), len(dofs), *places, *where, native.doubles(self._given)
