"""Mass matrices: no motion has negative kinetic energy, whatever the offset of the section."""

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.kernels import compiled
from shellmb.meshes.mesh import build_surface
from shellmb.model.shells.shell import ShellModel
from shellmb.scene import Isotropic, Rectangle, Shell

THICKNESS = 0.1


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize("offset", [0.0, 0.2, 0.5])
def test_kinetic_energy_of_an_offset_shell_is_not_negative(cell, offset):
    section = Isotropic(1e9, 0.3, THICKNESS, density=1e3, offset=offset * THICKNESS)
    shell = Shell("s", Rectangle(1.0, 1.0), section, mesh=(2, 2), cell=cell)
    body = ShellModel(shell, build_surface(shell, MPI.COMM_SELF), [], True)
    space = body.mixed.space
    trial, test = ufl.TrialFunction(space), ufl.TestFunction(space)
    matrix = fem.assemble_matrix(compiled(body.inertia(trial, test))).to_dense()
    dofs = np.concatenate([body.mixed.dofs[p] for p in ("u", "w")])
    values = np.linalg.eigvalsh(matrix[np.ix_(dofs, dofs)])
    # round-off of a sum over nine elements' nodes; an indefinite one was -1e-2 of the largest
    assert values[0] > -1e-14 * values[-1]
    # bubbles of triangles may be massless with an offset, displacement and director are not
    assert np.count_nonzero(values > 1e-9 * values[-1]) == len(dofs)
