"""Block system: residual and Jacobian of all fields in one PETSc vector and one AIJ matrix.

Each form is assembled on its own mesh and added through the local-to-global map of `Numbering`.
Rows of fixed dofs are
left out of the assembly and replaced by `x - value`; their columns stay, so that a prescribed
motion reaches its neighbours within the same Newton step.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
from dolfinx import cpp, fem  # type: ignore[attr-defined]
from ufl import Form

from shellmb.arrays import Floats, Ints
from shellmb.clock import now
from shellmb.native import library as native
from shellmb.native.derivatives import derivative
from shellmb.native.kernels import together
from shellmb.system.assembly.fields import (
    DependentFunctions,
    Field,
    Following,
    following,
    general_position,
)
from shellmb.system.assembly.functionals import DolfinxResiduals, Residuals, RowForm
from shellmb.system.assembly.loops import LoopResiduals
from shellmb.system.assembly.numbering import Numbering, Numbers, most_entries
from shellmb.system.couplings import Coupled, Coupling

BlockForms = dict[tuple[int, int], list[fem.Form]]


class BlockSystem:
    """Residual and Jacobian of coupled fields.

    Args:
        comm: Communicator of all meshes.
        fields: Fields with their residual forms.
        followers: Functions that follow the fields' ones.

    Attributes:
        couplings: Forces between unknowns that share no cell; to be given before a matrix is made.
        x: Unknowns of all fields, PETSc vector.
        b: Residual.
        A: Jacobian, made when it is first requested.
        held: Which local dofs of each field have given values, as markers.
        residual_forms: Residuals made ready, with the numbers of the fields whose rows they have.
        jacobians: Their derivatives by row and column field.
        residuals: What assembles the residuals.
        evaluation: For C, what does so and gives the functions their values in one; None: nothing.
        exchange: Between unknowns and what this rank sees of them.
        jit_seconds: Time spent on making the forms ready, s.
        values: Given values of the fixed unknowns, among those of all owned ones.
        reactions: Residual at the fixed unknowns before they were replaced, aligned with `fixed`.
        follow: Gives functions that follow the fields' ones their values.
        arrays: Numbers of the fields' functions.
    """

    def __init__(
        self, comm: MPI.Comm, fields: list[Field], followers: Sequence[DependentFunctions] = ()
    ) -> None:
        self.comm, self.fields = comm, fields
        self.couplings: list[Coupling] = []
        self._followers = followers
        self.numbering = Numbering(comm, fields)
        n = self.numbering
        sizes = (n.owned, PETSc.DETERMINE)
        self.x = PETSc.Vec().createMPI(sizes, comm=comm)
        self.b = self.x.duplicate()
        start = now()
        self._compile()
        self.follow = following(followers)
        self.jit_seconds = now() - start
        self.residuals: Residuals = DolfinxResiduals(
            self.residual_forms, fields, n.offsets.tolist()
        )
        self._rows = [
            PETSc.IS().createStride(f.size_all, int(n.offsets[k]), 1, comm=PETSc.COMM_SELF)
            for k, f in enumerate(fields)
        ]
        # views: those that DOLFINx's functions give are made anew at each call
        self.arrays = [f.function.x.array for f in fields]
        self.exchange = Numbers(comm, n.owned, n.local_to_global)
        self.evaluation: Any = None
        self._owned = [self.owned(k) for k in range(len(fields))]
        self._set_fixed()

    def owned(self, k: int) -> tuple[Ints, Ints]:
        """Dofs of a field that are unknowns of this rank, and which of them; links included."""
        n = self.numbering
        numbers = n.by_field[k][: self.fields[k].size_local] - n.start
        dofs = np.flatnonzero((numbers >= 0) & (numbers < n.owned))
        return dofs, numbers[dofs]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.x.getSize())

    def _compile(self) -> None:
        self.residual_forms: list[RowForm]
        fields = self.fields
        terms = [term for f in fields for term in f.terms]
        alone = [pair for term in terms for pair in zip(term.rows, term.alone, strict=True)]
        alone += [(i, form) for i, field in enumerate(fields) for form in field.residual]
        numbers = {f.function: j for j, f in enumerate(fields)}
        behind = {
            f: {numbers[q] for q, w in zip(some.sources, row, strict=True) if w and q in numbers}
            for some in self._followers
            for f, row in zip(some.functions, some.weights, strict=True)
        }
        # of a row's forms that follow the same unknown functions the derivatives by all of these
        # are one program, with other shares, of which those that have these themselves are part;
        # others would be derived by what they do not follow
        own: dict[Any, tuple[int, Form]] = {}
        every = [set().union(*(behind.get(f, ()) for f in q.coefficients())) for _, q in alone]
        of_row = {i: followed for (i, _), followed in zip(alone, every, strict=True) if followed}
        for k, ((i, form), followed) in enumerate(zip(alone, every, strict=True)):
            there = {numbers[f] for f in form.coefficients() if f in numbers}
            if there and not followed and there <= of_row.get(i, set()):
                followed = of_row[i]
            key = (i, *sorted(followed)) if followed else k
            own[key] = (i, own[key][1] + form) if key in own else (i, form)
        derivatives = [((i, j), by) for i, form in own.values() for j, by in self.derivatives(form)]
        rows = [
            some
            for k, f in enumerate(fields)
            for some in (*((k,) for _ in f.residual), *(term.rows for term in f.terms))
        ]
        # what has the same rows and columns is one program
        moving = [f.function for f in fields]
        moving += [f for some in self._followers for f in some.functions]
        residuals = together(zip(rows, self.forms, strict=True), moving)
        self.residual_forms = [(f, some) for some, own in residuals.items() for f in own]
        self.jacobians = together(derivatives, moving)

    def derivatives(self, form: Form) -> Iterator[tuple[int, Form]]:
        """Derivatives of a residual by the unknown functions, also by what follows them."""
        coefficients, found = form.coefficients(), set[int]()
        numbers = {f.function: j for j, f in enumerate(self.fields)}
        for some in self._followers:
            there = [k for k, f in enumerate(some.functions) if f in coefficients]
            if not there:
                continue
            own = [f for f in some.sources if f in numbers]
            direct = [f for f in own if f in coefficients and numbers[f] not in found]
            first, *others = [*(some.functions[k] for k in there), *direct]
            for function in own:
                shares = some.weights[there, some.sources.index(function)]
                shares = np.append(shares, [float(f is function) for f in direct])
                found.add(numbers[function])
                if shares.any():
                    constant = fem.Constant(function.function_space.mesh, shares)
                    yield numbers[function], derivative(form, first, others, constant)
        for function, j in numbers.items():
            if function in coefficients and j not in found:
                yield j, derivative(form, function)

    def _set_fixed(self) -> None:
        """Find the fixed unknowns, on whatever field and rank they were named."""
        n = self.numbering
        numbers = [n.by_field[k][f.fixed] for k, f in enumerate(self.fields)]
        local = [v - n.start for v in numbers]
        mine_of = [np.flatnonzero((v >= 0) & (v < n.owned)) for v in local]
        each = zip(self.fields, mine_of, local, strict=True)
        self._fixed = [(f, m, v[m]) for f, m, v in each if len(m)]
        mine = np.concatenate([*numbers, np.zeros(0, dtype=np.int64)])
        everywhere = np.unique(np.concatenate(self.comm.allgather(mine)))
        held = np.isin(n.local_to_global, everywhere)
        self.held = [held[n.slice(k)].astype(np.int8).copy() for k in range(len(self.fields))]
        self._no_columns = [np.zeros(0, dtype=np.int8) for _ in self.fields]
        owned = everywhere[(everywhere >= n.start) & (everywhere < n.start + n.owned)]
        self.fixed = owned - n.start
        self._diagonal = self.x.duplicate()
        self._diagonal.array[:] = 0.0
        self._diagonal.array[self.fixed] = 1.0
        self.values = np.zeros(n.owned)
        self.reactions = np.zeros(len(self.fixed))

    @property
    def forms(self) -> list[Form]:
        """Residuals of all fields, as they are written."""
        return [form for f in self.fields for form in f.forms]

    @cached_property
    def tangents(self) -> float:
        """Forms of the Jacobian for each of the residual."""
        return sum(map(len, self.jacobians.values())) / max(len(self.residual_forms), 1)

    def update_fixed_values(self) -> None:
        """Take the values of the fixed dofs from the fields (after they changed)."""
        for f, dofs, numbers in self._fixed:
            self.values[numbers] = f.values[dofs]

    def gather(self) -> None:
        """Copy the fields' functions into the vector of unknowns."""
        unknowns = self.x.array
        for array, (dofs, numbers) in zip(self.arrays, self._owned, strict=True):
            unknowns[numbers] = array[dofs]

    def scatter(self, x: PETSc.Vec) -> None:
        """Copy a vector of unknowns into the fields' functions, ghosts and linked dofs included."""
        local = self.exchange.seen(x.array_r)
        for k, array in enumerate(self.arrays):
            array[:] = local[self.numbering.slice(k)]
        self.follow()

    def local_values(self, x: PETSc.Vec) -> Floats:
        """Entries of a vector of unknowns at all local dofs of all fields, concatenated."""
        return self.exchange.seen(x.array_r)

    def global_values(self, local: list[Floats], known: bool = False) -> Floats:
        """Entries of owned unknowns from one local array per field (owned entries).

        Args:
            local: The arrays.
            known: Whether entries that are not a number are to be taken from another field.
        """
        out = np.zeros(self.numbering.owned)
        for values, (dofs, numbers) in zip(local, self._owned, strict=True):
            if known:
                some = ~np.isnan(values[dofs])
                dofs, numbers = dofs[some], numbers[some]
            out[numbers] = values[dofs]
        return out

    def join(self, local: list[Floats]) -> None:
        """Give functions the values of their fields, linked ones those of the nodes they are at.

        Args:
            local: One local array per field, which is changed.
        """
        for field, values in zip(self.fields, local, strict=True):
            for link in field.links:
                values[link.dofs] = np.nan
        self.x.array[:] = self.global_values(local, known=True)
        self.scatter(self.x)

    def evaluate(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Assemble the residual at `x`, which the functions take, into `b`."""
        if self.evaluation is None:
            self.scatter(x)
            self.residual(x, b)
            return
        self._lib.evaluate(self.evaluation, x.handle, b.handle)
        self._couple(b)

    def take_loops(self, residuals: LoopResiduals) -> None:
        """Assemble residuals by loops in C from now on; in one process one call evaluates all.

        Args:
            residuals: The loops.
        """
        self.residuals = residuals
        if not self.exchange.serial:
            return
        assert isinstance(self.follow, Following)
        self._lib, n = native.cells().lib, self.numbering
        # what C points to
        self._pointer = pointer = native.CArrays()
        members = {
            "fields": len(self.arrays),
            "ends": pointer(n.offsets[1:].astype(np.int64)),
            "arrays": pointer.many("double *", list(map(pointer, self.arrays))),
            "local": len(n.local_to_global),
            "wanted": pointer(self.exchange.wanted),
            **self.follow.members,
            "sums": pointer(np.zeros(len(n.local_to_global))),
            "owned": n.owned,
            "meshes": residuals.struct,
            "held": len(self.fixed),
            "fixed": pointer(self.fixed),
            "values": pointer(self.values),
            "reactions": pointer(self.reactions),
        }
        self.evaluation = pointer.many("Evaluation", [members])

    def residual(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Assemble the residual at `x` into `b`. The functions must hold `x` already."""
        local = np.zeros(len(self.exchange.wanted))
        self.residuals.add(local)
        entries = b.array
        entries[:] = self.exchange.summed(local)
        self.reactions[:] = entries[self.fixed]
        entries[self.fixed] = x.array_r[self.fixed] - self.values[self.fixed]
        self._couple(b)

    @cached_property
    def coupled(self) -> Coupled:
        """All couplings as one."""
        return Coupled(self.comm, self.couplings)

    @cached_property
    def _coupled_unknowns(self) -> Ints:
        """Numbers of the unknowns of the couplings' dofs."""
        return np.asarray(self.coupled.dofs.seen(self.numbering.local_to_global))

    def _couple(self, b: PETSc.Vec) -> None:
        """Add the forces of couplings, to the reactions where values are given."""
        if not self.couplings:
            return
        n = self.numbering
        unknown, found = self._coupled_unknowns - n.start, self.coupled.forces()
        mine = (unknown >= 0) & (unknown < n.owned)
        total = np.bincount(unknown[mine], found[mine], n.owned)
        self.reactions += total[self.fixed]
        total[self.fixed] = 0.0
        b.array[:] += total

    def jacobian(self, x: PETSc.Vec, A: PETSc.Mat) -> None:
        """Assemble the Jacobian into `A`. The functions must hold `x` already."""
        self._assemble(A, self.jacobians, self._no_columns)
        A.setDiagonal(self._diagonal, PETSc.InsertMode.ADD)

    def fixed_values(self) -> Floats:
        """Given values of the fixed unknowns, aligned with `fixed`."""
        return np.asarray(self.values[self.fixed])

    @cached_property
    def A(self) -> PETSc.Mat:
        """Jacobian."""
        return self._new_matrix()

    def _new_matrix(self) -> PETSc.Mat:
        """An empty matrix whose local-to-global map holds the links."""
        n = self.numbering
        sizes = (n.owned, PETSc.DETERMINE)
        l2g = PETSc.LGMap().create(n.local_to_global.astype(PETSc.IntType), comm=self.comm)
        A = PETSc.Mat().createAIJ((sizes, sizes), comm=self.comm)
        A.setLGMap(l2g, l2g)
        A.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
        # kernels fill blocks that are zero whatever the state: without them the matrix has a
        # fraction of the entries, and its factors, too
        A.setOption(PETSc.Mat.Option.IGNORE_ZERO_ENTRIES, True)
        A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        return A

    @cached_property
    def _without_fixed(self) -> PETSc.Mat:
        """Place for `symmetric_jacobian`."""
        return self._new_matrix()

    def symmetric_jacobian(self) -> PETSc.Mat:
        """Jacobian without rows and columns of fixed dofs, whose diagonals are one.

        It is that of the state that the functions hold, and the same matrix at each call.
        """
        A = self._without_fixed
        self._assemble(A, self.jacobians, self.held)
        A.setDiagonal(self._diagonal, PETSc.InsertMode.ADD)
        return A

    def symmetric_matrix(
        self,
        forms: Mapping[tuple[int, int], Sequence[Form]] | None,
        diagonal: float,
        columns: bool = False,
    ) -> PETSc.Mat:
        """A matrix of its own without the rows and columns of fixed dofs, as eigenproblems need.

        Args:
            forms: Bilinear forms by row and column field; None: the Jacobian's.
            diagonal: Value on the diagonal of fixed dofs.
            columns: Whether their columns stay, as prescribed motions act by them.
        """
        A = self._new_matrix()
        kernels = self.jacobians
        if forms is not None:
            every = ((place, form) for place, parts in forms.items() for form in parts)
            kernels = together(every)
        self._assemble(A, kernels, self._no_columns if columns else self.held)
        held = self._diagonal.copy()
        held.scale(diagonal)
        A.setDiagonal(held, PETSc.InsertMode.ADD)
        return A

    def _assemble(
        self, A: PETSc.Mat, forms: BlockForms, dropped_columns: list[npt.NDArray[np.int8]]
    ) -> None:
        """Assemble forms block by block, leaving out the rows of fixed dofs."""
        if not A.isAssembled():
            self._find_pattern(A, forms, dropped_columns)
        A.zeroEntries()
        self._add(A, forms, dropped_columns)
        if forms is self.jacobians and self.couplings:
            self._add_couplings(A, dropped_columns is self.held)
        A.assemble()

    def _add_couplings(self, A: PETSc.Mat, symmetric: bool) -> None:
        """Add the derivatives of couplings, without rows of fixed dofs, or without columns, too."""
        rows, columns, values = self.coupled.derivatives()
        held = self.coupled.dofs.seen(np.concatenate(self.held)).astype(bool)
        free = ~held[rows] & ~(symmetric & held[columns])
        unknown = self._coupled_unknowns.astype(PETSc.IntType)
        places = (unknown[which[free]][:, None] for which in (rows, columns))
        A.setValuesRCV(*places, values[free][:, None], addv=PETSc.InsertMode.ADD)

    def _find_pattern(
        self, A: PETSc.Mat, forms: BlockForms, dropped_columns: list[npt.NDArray[np.int8]]
    ) -> None:
        """Assemble with states and parameters in general position: nothing is zero by chance.

        So the pattern is the same at all times, of a load that begins at zero, too.
        """
        most = most_entries(self.comm, self.numbering, self.fields, forms)
        if most is not None:
            # without it PETSc collects entries in a hash table, which takes three times as long
            A.setPreallocationNNZ(most)
            A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        # and once as they are: what is zero up to round-off may be zero exactly in another state
        self._add(A, forms, dropped_columns)
        with general_position(self.forms):
            self._add(A, forms, dropped_columns)
        # keep a full structural diagonal: fixed rows and zero blocks of multipliers need one
        n = self.numbering
        rows = np.arange(n.start, n.start + n.owned, dtype=PETSc.IntType)[:, None]
        A.setValuesRCV(rows, rows, np.zeros(rows.shape), addv=PETSc.InsertMode.ADD)
        A.assemble()

    def _add(
        self, A: PETSc.Mat, forms: BlockForms, dropped_columns: list[npt.NDArray[np.int8]]
    ) -> None:
        """Add the element matrices of all blocks."""
        for (i, j), form in ((key, form) for key, parts in forms.items() for form in parts):
            block = A.getLocalSubMatrix(self._rows[i], self._rows[j])
            cpp.fem.petsc.assemble_matrix(
                block,
                form._cpp_object,
                cpp.fem.pack_constants(form._cpp_object),
                cpp.fem.pack_coefficients(form._cpp_object),
                self.held[i],
                dropped_columns[j],
                True,
            )
            A.restoreLocalSubMatrix(self._rows[i], self._rows[j], block)
