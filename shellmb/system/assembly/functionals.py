"""Integrals over meshes: energies, momenta, work; one loop in C over the cells of each mesh."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from ufl import Form

from shellmb.kernels import compile_all
from shellmb.system.assembly import native
from shellmb.system.assembly.loops import FormLoop, MeshGeometry

Floats = npt.NDArray[np.float64]


class Functionals:
    """Several sums of integrals, evaluated together as often as they are called.

    DOLFINx's own `assemble_scalar` packs coefficients and constants anew each time, which takes
    most of its time on small meshes.

    Args:
        sums: Forms without arguments that add up to each number.
        comm: Communicator of their meshes; calls are collective.
        given: For each sum what gives its constants their values, taken once and for all; none:
            constants have their values of the time of a call.
    """

    def __init__(
        self,
        sums: Sequence[Sequence[Form]],
        comm: MPI.Comm,
        given: Sequence[Callable[[], None]] = (),
    ) -> None:
        self._comm, self._lib = comm, native.cells().lib
        self._values, self._fixed = np.zeros(len(sums)), bool(given)
        values = native.doubles(self._values)
        different = {id(form): form for forms in sums for form in forms}
        made = compile_all(list(different.values()))
        kernels: dict[int, fem.Form] = dict(zip(different, made, strict=True))
        meshes = {id(k.mesh): k.mesh for k in kernels.values()}
        # each with the arguments of its call
        self._loops: list[tuple[FormLoop, tuple[Any, ...]]] = []
        for key, mesh in meshes.items():
            here = [
                (number, kernels[id(form)])
                for number, forms in enumerate(sums)
                for form in forms
                if id(kernels[id(form)].mesh) == key
            ]
            geometry = MeshGeometry(mesh)
            loop = FormLoop(geometry, [(form, (), -1) for _, form in here])
            for place, (number, _) in enumerate(here):
                if given:
                    given[number]()
                    loop.take_constants(place)
            to = loop.pointer(np.array([here[k][0] for k in loop.form_of], dtype=np.int32))
            arguments = geometry.struct(loop), loop.kernels, loop.count, to, values
            self._loops.append((loop, arguments))

    def __call__(self) -> Floats:
        """Their values, the same on all ranks, shape (n,); overwritten by the next call."""
        values = self._values
        values[:] = 0.0
        for loop, arguments in self._loops:
            if not self._fixed:
                loop.refresh()
            self._lib.functionals(*arguments)
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, values)
        return values
