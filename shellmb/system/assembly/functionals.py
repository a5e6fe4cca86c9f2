"""Integrals over meshes: energies, momenta, work, and residuals by DOLFINx."""

import itertools
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form

from shellmb.arrays import Floats, Ints
from shellmb.native import library as native
from shellmb.native.assembler import is_native
from shellmb.native.kernels import compile_all
from shellmb.native.library import cell_dofs
from shellmb.system.assembly.fields import Field
from shellmb.system.assembly.loops import FormLoop, LoopResiduals, MeshGeometry


def vector_of(mesh: Any, size: int) -> Any:
    """Test function for a vector of integrals: the integral of `dot(f, it)` is that of `f`.

    Args:
        mesh: A mesh of DOLFINx.
        size: Number of components.
    """
    return ufl.TestFunction(fem.functionspace(mesh, ("DG", 0, (size,))))


# values of several sums, the same on all ranks, shape (n,); overwritten by the next call
Functionals = Callable[[], Floats]


def functionals(sums: Sequence[Sequence[Form]], comm: MPI.Comm) -> Functionals:
    """Make what evaluates several sums of integrals.

    Args:
        sums: Forms that add up to each number, without arguments; or all of them linear forms in
            `vector_of` the same size, that add up to so many numbers.
        comm: Communicator of their meshes; calls are collective.
    """
    return (LoopFunctionals if is_native() else DolfinxFunctionals)(sums, comm)


class DolfinxFunctionals:
    """Sums of integrals, form by form, by DOLFINx.

    Args:
        sums: As of `functionals`.
        comm: As of `functionals`.
    """

    def __init__(self, sums: Sequence[Sequence[Form]], comm: MPI.Comm) -> None:
        self._comm, self._sums = comm, [(compile_all(forms), _size(forms)) for forms in sums]

    def __call__(self) -> Floats:
        """Their values."""
        values = [np.zeros(size) for _, size in self._sums]
        for total, (forms, size) in zip(values, self._sums, strict=True):
            for form in forms:
                if form.rank == 0:
                    total += float(np.real(fem.assemble_scalar(form)))
                else:
                    # one test function for each cell and component
                    here = form.function_spaces[0].dofmap.index_map.size_local
                    total += fem.assemble_vector(form).array[: size * here].reshape(-1, size).sum(0)
        found = np.concatenate([np.zeros(0), *values])
        self._comm.Allreduce(MPI.IN_PLACE, found)
        return found


class LoopFunctionals:
    """Sums of integrals by one loop in C over the cells of each mesh.

    DOLFINx's own `assemble_scalar` packs coefficients and constants anew each time, which takes
    most of its time on small meshes.

    Args:
        sums: As of `functionals`.
        comm: As of `functionals`.
    """

    def __init__(self, sums: Sequence[Sequence[Form]], comm: MPI.Comm) -> None:
        self._comm, self._lib = comm, native.cells().lib
        ends = np.cumsum([0, *map(_size, sums)], dtype=np.int32)
        self._values = np.zeros(ends[-1])
        places = [np.arange(*pair, dtype=np.int32) for pair in itertools.pairwise(ends)]
        different = {id(form): form for forms in sums for form in forms}
        made = compile_all(list(different.values()))
        kernels = dict(zip(different, made, strict=True))
        # each with the arguments of its call
        self._loops = []
        for key, mesh in {id(form.mesh): form.mesh for form in made}.items():
            here = [
                (kernels[id(form)], (number,), -1)
                for number, forms in enumerate(sums)
                for form in forms
                if id(kernels[id(form)].mesh) == key
            ]
            geometry = MeshGeometry(mesh)
            geometry.places = places
            loop = FormLoop(geometry, here)
            every = np.arange(len(self._values), dtype=np.int32)
            dofs = loop.pointer(np.tile(every, (geometry.count, 1)))
            loop.bind(geometry, size=len(every), dofs=dofs)
            self._loops.append((loop, (*loop.mesh, native.doubles(self._values))))

    def __call__(self) -> Floats:
        """Their values, the same on all ranks, shape (n,); overwritten by the next call."""
        values = self._values
        values[:] = 0.0
        for loop, arguments in self._loops:
            loop.refresh()
            self._lib.residual(*arguments)
        if self._comm.size > 1 and self._loops:
            self._comm.Allreduce(MPI.IN_PLACE, values)
        return values


def _size(forms: Sequence[Form]) -> int:
    """Number of values that some forms add up to."""
    spaces = [form.arguments()[0].ufl_function_space() for form in forms if form.arguments()]
    return int(spaces[0].value_size) if spaces else 1


# a compiled residual with the numbers of the fields whose rows it has
RowForm = tuple[fem.Form, tuple[int, ...]]


class DolfinxResiduals:
    """Residuals form by form, by DOLFINx.

    Args:
        forms: Compiled forms with the numbers of the fields whose rows they are.
        fields: The fields.
        offsets: First place of each in the local arrays.
    """

    def __init__(
        self, forms: Sequence[RowForm], fields: Sequence[Field], offsets: Sequence[int]
    ) -> None:
        self._forms, self._fields, self._offsets = forms, fields, offsets

    @cached_property
    def _placed(self) -> list[tuple[fem.Form, Ints]]:
        """Forms with the places of their rows; found when they are first assembled by these."""
        tables = [
            cell_dofs(field.function.function_space) + int(offset)
            for field, offset in zip(self._fields, self._offsets, strict=False)
        ]
        found = []
        for form, rows in self._forms:
            if form.rank == 0:
                # a term of nothing
                continue
            (space,) = form.function_spaces
            own = cell_dofs(space)
            places = np.zeros(own.max(initial=-1) + 1, dtype=np.int64)
            places[own] = np.hstack([tables[k] for k in rows])
            found.append((form, places))
        return found

    def add(self, local: Floats) -> None:
        """Add them to the concatenated local arrays."""
        for form, places in self._placed:
            local[places] += fem.assemble_vector(form).array

    def refresh(self) -> None:
        """Take nothing: DOLFINx does at each assembly."""


# what assembles the residuals of all fields
Residuals = DolfinxResiduals | LoopResiduals
