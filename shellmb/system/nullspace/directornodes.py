"""The nodes of one field that carry directors: what is fixed, which bases, what holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.native import library as native
from shellmb.system.assembly.fields import DirectorPath, DirectorRates, Field
from shellmb.system.nullspace.directorpath import (
    Bases,
    MasslessPath,
    NodeBases,
    PathBases,
    PathDirectors,
    partial_bases,
)
from shellmb.system.nullspace.directors import (
    DEPENDENT,
    any_pseudo_inverse,
    constraint,
    null_space,
    orthonormal,
    pseudo_inverse,
    rotated,
    violation,
)

# rotation in one update beyond which it is taken as it is, rad
TURN = 0.1
# violation of a constraint of directors of unit length that is none
ROUND_OFF = 1e-13


class _Partial(NamedTuple):
    """A node of which some components are fixed.

    Args:
        node: Its number.
        free: The other components, shape (3 k,).
        size: Number of directions left.
    """

    node: int
    free: Bools
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
        made: Bases, once `bases` has made them.
        settled: Whether finite rotations have kept the constraints since they were last found to
            hold.
    """

    made: Bases

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
        self.values = field.function.x.array
        self.settled = False
        self.partial = self._partial()
        # none of velocities over a path: those of the state are theirs, too
        self._loop: NodeBases | None = None

    @property
    def rates(self) -> DirectorRates | None:
        """The declaration, of rates only."""
        return self.declared if isinstance(self.declared, DirectorRates) else None

    @property
    def path(self) -> DirectorPath | None:
        """The declaration, of a step that is quadratic in time only."""
        return self.declared if isinstance(self.declared, DirectorPath) else None

    @property
    def massless(self) -> bool:
        """Decide whether the directors have no inertia over a step that is quadratic in time."""
        return self.path is not None and self.path.massless

    @property
    def state(self) -> int | None:
        """Number of the field whose directors these are the rates of; None: they are no rates."""
        if self.path is not None:
            return self.path.state if self.path.state >= 0 else None
        return None if self.rates is None else self.rates.state

    @property
    def partner(self) -> int | None:
        """Number of the other field of a path; None otherwise."""
        return None if self.path is None else max(self.path.state, self.path.rate)

    def _partial(self) -> list[_Partial]:
        """Find how many directions are left where some components are fixed."""
        found = []
        # of rates: as of directors, whose values they do not have yet
        C = constraint(self.reference if self.state is not None else self.now())
        for n in np.flatnonzero(~self.held & ~self.regular):
            rows = np.concatenate([C[n], np.eye(C.shape[2])[self.fixed[n]]])
            self.free[n] = C.shape[2] - int(np.linalg.matrix_rank(rows, tol=DEPENDENT))
            found.append(_Partial(int(n), ~self.fixed[n], int(self.free[n])))
        return found

    def now(self) -> Floats:
        """Directors of the field's state, shape (n, 3 k)."""
        return np.asarray(self.reference + self.values[self.dofs])

    def along(self, fields: Sequence[Field]) -> PathDirectors:
        """Directors over a step that is quadratic in time."""
        path = self.path
        assert path is not None
        own, other = self.values, fields[max(path.state, path.rate)].function.x.array
        end, rate = (own, other) if path.state < 0 else (other, own)
        return self._path(end[self.dofs], rate[self.dofs])

    def _path(self, end: Floats, rate: Floats) -> PathDirectors:
        """Path of the directors from values at the nodes."""
        path = self.path
        assert path is not None and path.before is not None
        start, end = self.reference + path.before.x.array[self.dofs], self.reference + end
        make = MasslessPath if path.massless else PathDirectors
        return make(start, path.start_velocity.x.array[self.dofs], end, rate, path.alpha)

    def mean(self, fields: Sequence[Field]) -> Floats:
        """Directors at which forces act."""
        if self.path is not None:
            along = self.along(fields)
            return along.mean if self.path.state < 0 else along.second
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

    def bases(self, fields: Sequence[Field], others: Mapping[int, DirectorNodes]) -> Bases:
        """Make bases, whose numbers `renew` fills in.

        Args:
            fields: All fields.
            others: Nodes of the fields before this one, which have theirs.
        """
        if self.path is None:
            self._loop = made = self._new_bases(fields)
            left, right, forces = made.found
            self.made = Bases(right, left, forces)
            if self.rates is not None:
                self._of_state = others[self.rates.state].made
                self.made = self.made._replace(right_other=np.zeros_like(right))
        elif self.state is None:
            self._loop = path = self._path_loop(fields)
            self.made, self._of_rates = path.halves
        else:
            self.made = others[self.state]._of_rates
        return self.made

    def renew(self, fields: Sequence[Field]) -> None:
        """Find the bases at the current state of all fields, those of a state before its rates'."""
        if self._loop is not None:
            self._loop()
        if self.partial:
            (self._renew_partial if self.path is None else self._renew_partial_path)(fields)
        if self.made.right_other is not None and self.path is None:
            # C(d) b = C(b) d, and the mean directors move by half of the state's increments
            rate = constraint(self.field.function.x.array[self.dofs])
            self.made.right_other[:] = -0.5 * self.made.forces @ (rate @ self._of_state.right)

    def _renew_partial(self, fields: Sequence[Field]) -> None:
        """Bases of nodes of which some components are fixed."""
        mean, at, forces = self.mean(fields), self.at(fields), self.made.forces
        C_mean = constraint(mean)
        for node, free, size in self.partial:
            extra = np.eye(len(free))[~free]
            for d, basis in ((mean, self.made.left), (at, self.made.right)):
                rows = np.concatenate([constraint(d[node : node + 1])[0], extra])
                basis[node] = 0.0
                basis[node, :, :size] = null_space(rows, size)
            # forces at fixed components hold them
            forces[node] = 0.0
            forces[node, free] = any_pseudo_inverse(C_mean[node][:, free])

    def _renew_partial_path(self, fields: Sequence[Field]) -> None:
        """Bases of such nodes over a step that is quadratic in time."""
        along, which = self.along(fields), 0 if self.state is None else 1
        for node, free, size in self.partial:
            found = partial_bases(along.of(node), free, size)[which]
            for part, values in zip(self.made, found, strict=True):
                if part is not None:
                    part[node] = values

    def _new_bases(self, fields: Sequence[Field]) -> NodeBases:
        """Bases tangent where forces act and where increments are."""
        before, state = self.declared.before, None if self.rates is None else self.rates.state
        end = self.values if state is None else fields[state].function.x.array
        start = end if before is None else before.x.array
        mean = np.array([1.0, 0.0, 0.0, 0.0] if self.declared.linear else [0.5, 0.0, 0.5, 0.0])
        at = mean if self.declared.linear or state is not None else np.eye(4)[2]
        values = start, start, end, end
        return NodeBases("bases", (2, 1), self.held, self.dofs, self.reference, values, [mean, at])

    def _path_loop(self, fields: Sequence[Field]) -> PathBases:
        """Bases of a pair."""
        path = self.path
        assert path is not None and path.before is not None
        ends = self.field.function, fields[path.rate].function
        functions = path.before, path.start_velocity, *ends
        values = [function.x.array for function in functions]
        kind = MasslessPath if path.massless else PathDirectors
        return PathBases(self.held, self.dofs, self.reference, values, kind, path.alpha)

    def moved(self, number: int, change: Floats, others: dict[int, Floats]) -> None:
        """Values after a change, such that the constraints hold; none if they may change freely.

        Args:
            number: Number of the field.
            change: Of the values, shape (n, 3 k).
            others: New values of the fields before this one; gets those of this one.
        """
        values = self.values[self.dofs]
        if self.state is not None:
            others[number] = self._allowed(values + change, others)
        elif not self.declared.linear:
            # far from the solution a linear update of all unknowns alike leads further: a rotation
            # by that much would leave the displacements behind
            turned, far = rotated(self.reference + values, change, TURN)
            self.settled = self.settled and not far
            others[number] = turned - self.reference

    def nearest(self, number: int, values: Floats, others: dict[int, Floats]) -> None:
        """Values near given ones such that the constraints hold; arguments as of `moved`."""
        if self.state is not None:
            others[number] = self._allowed(values, others)
        elif not self.declared.linear:
            others[number] = orthonormal(self.reference + values) - self.reference

    def _allowed(self, rates: Floats, others: dict[int, Floats]) -> Floats:
        """Rates without what the constraints forbid, at the middle or at the end of a path."""
        before, state = self.declared.before, self.state
        assert before is not None and state is not None
        if self.path is not None:
            return self._path(others[state], rates).allowed()
        at = (self.reference + others[state] + self.reference + before.x.array[self.dofs]) / 2
        C = constraint(at)
        return np.asarray(rates - np.einsum("nic,ncj,nj->ni", pseudo_inverse(C), C, rates))

    def correction(self, fields: Sequence[Field]) -> Floats | None:
        """Change that brings nodes back to their constraints, to first order; None: none."""
        if self.declared.linear:
            return None
        if self.rates is not None:
            return self._jump_correction(fields) if self.partial else None
        if self.state is not None:
            return self._rate_correction(fields) if self.partial else None
        self.settled = native.cells().lib.violation(*self._now) <= ROUND_OFF
        if self.settled and not self.partial:
            return None
        for node, free, _ in self.partial:
            d = self.reference[node : node + 1] + self.values[self.dofs[node : node + 1]]
            inverse = any_pseudo_inverse(constraint(d)[0][:, free])
            self._back[node, free] = -inverse @ violation(d)[0]
        return self._back

    @cached_property
    def _now(self) -> tuple[Any, ...]:
        """For C, the directors of the field's state, which are free, and where changes go."""
        dofs, regular = self.dofs.astype(np.int64), self.regular.astype(np.uint8)
        reference, self._back = np.ascontiguousarray(self.reference, float), np.zeros(dofs.shape)
        self._kept = dofs, regular, reference
        places = len(dofs), dofs.shape[1] // 3, native.longs(dofs)
        values = map(native.doubles, (reference, self.values))
        return *places, *values, native.bytes_of(regular), ROUND_OFF, native.doubles(self._back)

    def _jump_correction(self, fields: Sequence[Field]) -> Floats:
        """Correction of jumps of rates; of nodes that are free, `moved` takes out what is not."""
        out, middle = np.zeros(self.dofs.shape), self.mean(fields)
        jumps = self.values[self.dofs]
        for node, free, _ in self.partial:
            C = constraint(middle[node : node + 1])[0]
            out[node, free] = -any_pseudo_inverse(C[:, free]) @ (C @ jumps[node])
        return out

    def _rate_correction(self, fields: Sequence[Field]) -> Floats:
        """Correction of rates at the end of a path; of nodes that are free, rotations keep it."""
        out, path = np.zeros(self.dofs.shape), self.along(fields)
        for node, free, _ in self.partial:
            one = path.of(node)
            C = constraint(one.rate_rows()[0])[0]
            out[node, free] = -any_pseudo_inverse(C[:, free]) @ one.excess()[0]
        return out
