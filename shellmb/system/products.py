"""Products of the Jacobian of a system with vectors, cell by cell, without a matrix."""

from petsc4py import PETSc

import numpy as np

from shellmb.native.assembler import is_native
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.loops import FormLoop, MeshCells
from shellmb.system.assembly.meshgroups import mesh_groups


class Products:
    """Multiplies the Jacobian of a system with vectors.

    To enter the matrices of cells in a large one takes ten times as long as to evaluate them.

    Args:
        system: The system.
    """

    def __init__(self, system: BlockSystem) -> None:
        self._system = system
        self._loops = _loops(system) if is_native() else None

    def __call__(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Multiply with the Jacobian at the state that the functions hold; collective.

        Args:
            x: The vector.
            y: Gets the product; where values are given, these entries of `x`.
        """
        system = self._system
        if self._loops is None:
            system.jacobian(system.x, system.A)
            system.A.mult(x, y)
            return
        exchange = system.exchange
        seen = exchange.seen(x.array_r)
        local = np.zeros_like(seen)
        for cells, loop in self._loops:
            loop.refresh()
            for some, matrices in loop.matrices(cells):
                at = cells.dofs[some]
                np.add.at(local, at, (matrices @ seen[at][..., None])[..., 0])
        if system.couplings:
            local += system.coupled.times(system.coupled.derivatives(), seen)
        y.array[:] = exchange.summed(local)
        y.array[system.fixed] = x.array_r[system.fixed]


def _loops(system: BlockSystem) -> list[tuple[MeshCells, FormLoop]]:
    """Loops over the cells of each mesh with all derivatives of the residuals on it."""
    found = []
    for group in mesh_groups(system):
        loop = FormLoop(group.cells, group.jacobians())
        loop.bind(group.cells)
        found.append((group.cells, loop))
    return found
