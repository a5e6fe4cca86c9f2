"""The nodes of a system that carry directors: which unknowns, what is fixed, which bases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from mpi4py import MPI as _MPI  # noqa: F401  (before petsc4py)
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.system.assembly import BlockSystem
from shellmb.system.directors import (
    constraint,
    null_space,
    orthonormal,
    pseudo_inverse,
    rotated,
    tangent,
    violation,
)
from shellmb.system.fields import DirectorRates, Field
from shellmb.system.spread import Numbers

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

# singular values of constraints below this, of directors of unit length, are none
DEPENDENT = 1e-8
# rotation in one update beyond which it is taken as it is, rad
TURN = 0.1
# violation of a constraint of directors of unit length that is none
ROUND_OFF = 1e-13


class Bases(NamedTuple):
    """Tangent spaces of nodes; vectors of nodes that have fewer than others are zero.

    Args:
        right: Increments, shape (n, 3 k, m).
        left: Test vectors, shape (n, 3 k, m).
        forces: What makes multipliers of forces, `(C^T)^+`, shape (n, 3 k, c).
        state: Of rates, their change with the increments of the state, shape (n, 3 k, m).
    """

    right: Floats
    left: Floats
    forces: Floats
    state: Floats | None


@dataclass(frozen=True)
class _Partial:
    """Nodes of which the same components are fixed, and equally many directions are left.

    Args:
        nodes: Their numbers.
        fixed: Which components, shape (3 k,).
        size: Number of directions left.
    """

    nodes: Ints
    fixed: Bools
    size: int


class DirectorNodes:
    """The nodes of one field that this rank owns.

    Args:
        field: The field.
        keep: Which of its nodes; others belong to nodes of another field.
        held: Local dofs of the field whose values are given, as a mask.

    Attributes:
        dofs: Local dofs, shape (n, 3 k).
        multipliers: Local dofs of the multipliers, shape (n, c).
        free: Number of directions that are left, shape (n,).
    """

    def __init__(self, field: Field, keep: Bools, held: Bools) -> None:
        declared = field.directors
        assert declared is not None
        self.field, self.declared = field, declared
        self.dofs, self.multipliers = declared.dofs[keep], declared.multipliers[keep]
        self.reference = declared.reference[keep]
        self.fixed = held[self.dofs]
        self.size = 2 if self.dofs.shape[1] == 3 else 3
        self.held = self.fixed.all(axis=1)
        self.regular = ~self.fixed.any(axis=1)
        self.free = np.where(self.held, 0, self.size)
        self.partial = self._partial()

    @property
    def rates(self) -> DirectorRates | None:
        """The declaration, of rates only."""
        return self.declared if isinstance(self.declared, DirectorRates) else None

    def _partial(self) -> list[_Partial]:
        """Find how many directions are left where some components are fixed."""
        odd = np.flatnonzero(~self.held & ~self.regular)
        if not len(odd):
            return []
        C = constraint(self.now())
        sizes = np.zeros(len(self.dofs), dtype=np.int64)
        for n in odd:
            rows = np.concatenate([C[n], np.eye(C.shape[2])[self.fixed[n]]])
            sizes[n] = C.shape[2] - int(np.linalg.matrix_rank(rows, tol=DEPENDENT))
        self.free[odd] = sizes[odd]
        keys = {(self.fixed[n].tobytes(), int(sizes[n])) for n in odd}
        found = []
        for key, size in sorted(keys):
            fixed = np.frombuffer(key, dtype=bool)
            same = (self.fixed == fixed).all(axis=1) & (sizes == size)
            found.append(_Partial(np.flatnonzero(same), fixed, size))
        return found

    def now(self) -> Floats:
        """Directors of the field's state, shape (n, 3 k)."""
        return np.asarray(self.reference + self.field.function.x.array[self.dofs])

    def mean(self, fields: Sequence[Field]) -> Floats:
        """Directors at which forces act."""
        before = self.declared.before
        if before is None:
            return self.now()
        start = self.reference + before.x.array[self.dofs]
        if self.declared.linear:
            return np.asarray(start)
        end = self.field if self.rates is None else fields[self.rates.state]
        return np.asarray((start + self.reference + end.function.x.array[self.dofs]) / 2)

    def constraint_rows(self, fields: Sequence[Field]) -> Floats:
        """Derivatives of the constraints along which forces act, where free, (n, c, 3 k)."""
        return np.asarray(constraint(self.mean(fields)) * ~self.fixed[:, None, :])

    def at(self, fields: Sequence[Field]) -> Floats:
        """Directors that increments are tangent at."""
        if self.declared.linear or self.rates is not None:
            return self.mean(fields)
        return self.now()

    def bases(self, fields: Sequence[Field], found: dict[int, Bases]) -> Bases:
        """Bases at the current state of all fields.

        Args:
            fields: All fields.
            found: Bases of the fields before this one.
        """
        mean, at = self.mean(fields), self.at(fields)
        C_mean, C_at = constraint(mean), constraint(at)
        left = tangent(mean)
        right = left if at is mean else tangent(at)
        forces = pseudo_inverse(C_mean)
        state = None
        if self.rates is not None:
            # C(d) b = C(b) d, and the mean directors move by half of the state's increments
            rate = constraint(self.field.function.x.array[self.dofs])
            state = -0.5 * forces @ (rate @ found[self.rates.state].right)
        left[self.held], forces[self.held] = 0.0, 0.0
        if right is not left:
            right[self.held] = 0.0
        for group in self.partial:
            self._bases_of(group, C_mean, C_at, left, right, forces)
        return Bases(right, left, forces, state)

    def _bases_of(
        self,
        group: _Partial,
        C_mean: Floats,
        C_at: Floats,
        left: Floats,
        right: Floats,
        forces: Floats,
    ) -> None:
        extra = np.eye(len(group.fixed))[group.fixed]
        for n in group.nodes:
            for C, basis in ((C_mean, left), (C_at, right)):
                basis[n] = 0.0
                basis[n, :, : group.size] = null_space(np.concatenate([C[n], extra]), group.size)
            # forces at fixed components hold them
            forces[n] = 0.0
            free = ~group.fixed
            forces[n, free] = np.linalg.pinv(C_mean[n][:, free], rcond=DEPENDENT)

    def moved(self, number: int, change: Floats, others: dict[int, Floats]) -> None:
        """Values after a change, such that the constraints hold; none if they may change freely.

        Args:
            number: Number of the field.
            change: Of the values, shape (n, 3 k).
            others: New values of the fields before this one; gets those of this one.
        """
        values = self.field.function.x.array[self.dofs]
        if self.rates is not None:
            others[number] = self._allowed(values + change, others)
        elif not self.declared.linear:
            # far from the solution a linear update of all unknowns alike leads further: a rotation
            # by that much would leave the displacements behind
            far = np.einsum("ni,ni->n", change, change) > TURN**2
            turned = rotated(self.reference + values, change) - self.reference
            others[number] = np.where(far[:, None], values + change, turned)

    def nearest(self, number: int, values: Floats, others: dict[int, Floats]) -> None:
        """Values near given ones such that the constraints hold; arguments as of `moved`."""
        if self.rates is not None:
            others[number] = self._allowed(values, others)
        elif not self.declared.linear:
            others[number] = orthonormal(self.reference + values) - self.reference

    def _allowed(self, rates: Floats, others: dict[int, Floats]) -> Floats:
        """Rates without what the constraints at the middle forbid."""
        before = self.declared.before
        assert before is not None and self.rates is not None
        mean = self.reference + (before.x.array[self.dofs] + others[self.rates.state]) / 2
        C = constraint(mean)
        return np.asarray(rates - np.einsum("nic,ncj,nj->ni", pseudo_inverse(C), C, rates))

    def correction(self, fields: Sequence[Field]) -> Floats:
        """Change that brings nodes back to their constraints, to first order.

        Zero where only rotations have changed the directors: these keep the constraints.
        """
        out = np.zeros(self.dofs.shape)
        if self.rates is None and not self.declared.linear:
            d = self.now()
            C, g = constraint(d), violation(d)
            off = self.regular & (np.abs(g).max(axis=1, initial=0.0) > ROUND_OFF)
            if np.any(off):
                out[off] = -np.einsum("nic,nc->ni", pseudo_inverse(C[off]), g[off])
            for group in self.partial:
                for n in group.nodes:
                    free = ~group.fixed
                    out[n, free] = -np.linalg.pinv(C[n][:, free], rcond=DEPENDENT) @ g[n]
        return out


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
        self.full = Numbers(system.comm, n.owned, n.local_to_global)
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
        local = self.full.seen(dx.array_r)
        moved: dict[int, Floats] = {}
        for k, nodes in self.sets.items():
            offset = int(self.system.numbering.offsets[k])
            nodes.moved(k, -local[nodes.dofs + offset], moved)
        known, values = self._merged(moved)
        dx.array[known] = x.array_r[known] - values

    def normalise(self, x: PETSc.Vec) -> None:
        """Bring directors that are nearly so to unit length and right angles.

        Args:
            x: Unknowns; changed. Functions of the start of the step hold its values.
        """
        local = self.full.seen(x.array_r)
        near: dict[int, Floats] = {}
        for k, nodes in self.sets.items():
            offset = int(self.system.numbering.offsets[k])
            nodes.nearest(k, local[nodes.dofs + offset], near)
        known, values = self._merged(near)
        x.array[known] = values

    def _merged(self, values: dict[int, Floats]) -> tuple[Ints, Floats]:
        """Places of owned unknowns that nodes give values to, and these values."""
        pairs = [
            (self.rows[k][s.regular], values[k][s.regular])
            for k, s in self.sets.items()
            if k in values
        ]
        ids = np.concatenate([*(rows.ravel() for rows, _ in pairs), np.zeros(0, np.int64)])
        given = np.concatenate([*(v.ravel() for _, v in pairs), np.zeros(0)])
        if self.full.serial:
            return ids, given
        known = np.flatnonzero(self.full.set(ids, np.ones(len(ids))) > 0.0)
        return known, self.full.set(ids, given)[known]
