"""Mass matrices: no motion has negative kinetic energy, whatever the offset of the section."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

import shellmb as sm
from shellmb.meshes.mesh import build_surface
from shellmb.model.shells.shell import ShellModel
from shellmb.native.kernels import compiled
from shellmb.scene import Isotropic, Rectangle, Shell

THICKNESS = 0.1


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize("offset", [0.0, 0.2, 0.5])
def test_kinetic_energy_of_an_offset_shell_is_not_negative(cell, offset):
    section = Isotropic(1e9, 0.3, thickness=THICKNESS, density=1e3, offset=offset * THICKNESS)
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


def frequencies(offset: Any, cell: str = "quad", mesh: tuple[int, int] = (4, 2)) -> np.ndarray:
    section = sm.Isotropic(E=7e10, nu=0.3, thickness=THICKNESS, density=2700.0, offset=offset)
    shell = sm.Shell("strip", sm.Rectangle(1.0, 0.5), section, mesh=mesh, cell=cell)
    scene = sm.Scene("strip", shell, supports=sm.Clamped("left"))
    return np.array(sm.modes(scene, count=6).frequencies)


# numbers and functions of the position take other ways through the forms
@pytest.mark.parametrize("offset", [1e-15, -1e-9, lambda x: 1e-12 * (1 + x[0])])
def test_frequencies_are_continuous_in_the_offset_of_the_mass(offset) -> None:
    """Kind: a rule that changes where a number stops being zero. Of 1e-15 m nothing may change."""
    # of a thickness of 0.1 m; eigenvalues are found to 1e-10 of themselves or so
    np.testing.assert_allclose(frequencies(offset), frequencies(0.0), rtol=1e-6)


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_frequencies_know_nothing_of_the_offset_on_fine_meshes(cell) -> None:
    """Bending, torsion and motion in the plane of a plate, told about its lower face."""
    gaps = []
    for mesh in ((4, 2), (8, 4)):
        plain, moved = (frequencies(offset, cell, mesh) for offset in (0.0, THICKNESS / 2))
        gaps.append(float(np.max(np.abs(moved / plain - 1))))
    # found 0.29 and 0.12 % (quad), 30 and 2.4 % (tri)
    assert gaps[1] < gaps[0] / 2
    assert gaps[1] < {"quad": 3e-3, "tri": 0.04}[cell]  # not round-off


def test_frequencies_know_nothing_of_the_offset_of_a_roof() -> None:
    """Curved, where the two rules do not agree on the area either."""
    section = sm.Isotropic(E=7e10, nu=0.3, thickness=0.02, density=2700.0)
    found = []
    for offset in (0.0, 1e-14):
        made = replace(section, offset=offset)
        shell = sm.Shell("roof", sm.Cylinder(1.0, 1.0, (0.0, 60.0)), made, mesh=(2, 2))
        scene = sm.Scene("roof", shell, supports=sm.Clamped("left"))
        found.append(sm.modes(scene, count=4).frequencies)
    np.testing.assert_allclose(*found, rtol=1e-6)
