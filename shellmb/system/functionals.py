"""Integrals over meshes: energies, momenta, work; one loop in C over the cells of each mesh."""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

from ufl import Form

from shellmb.kernels import compiled
from shellmb.system import native
from shellmb.system.loops import FormLoop, MeshGeometry


class Functional:
    """The sum of some integrals, evaluated as often as it is called.

    DOLFINx's own `assemble_scalar` packs coefficients and constants anew each time, which takes
    most of its time on small meshes.

    Args:
        forms: Forms without arguments.
        comm: Communicator of their meshes; calls are collective.
    """

    def __init__(self, forms: Sequence[Form], comm: MPI.Comm) -> None:
        self._comm, self._lib = comm, native.cells().lib
        kernels = [compiled(form) for form in forms]
        meshes = {id(form.mesh): form.mesh for form in kernels}
        self._loops = []
        for key in meshes:
            here = [form for form in kernels if id(form.mesh) == key]
            geometry = MeshGeometry(meshes[key])
            loop = FormLoop(geometry, [(form, -1, -1) for form in here])
            self._loops.append((loop, geometry.struct(loop)))

    def __call__(self) -> float:
        """Its value, the same on all ranks."""
        total = 0.0
        for loop, cells in self._loops:
            loop.refresh()
            total += self._lib.functional(cells, loop.kernels, loop.count)
        return float(self._comm.allreduce(total))
