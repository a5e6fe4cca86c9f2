"""Scenes beside a run use its meshes and numberings, moved where their nodes are elsewhere."""

from typing import Literal

from mpi4py import MPI

import dolfinx
import numpy as np
import pytest
import ufl
from dolfinx import fem

import shellmb as sm
from shellmb.meshes.directors import reference_director
from shellmb.meshes.mesh import build_surface
from shellmb.meshes.shared import Meshes
from shellmb.meshes.spaces import MixedSpace, shell_space
from shellmb.model.shells.positions import field_of

STEEL = sm.Isotropic(210e9, 0.3, thickness=4e-3, density=7800.0)


def built(
    surface: sm.Surface, others: Meshes | None = None, mesh: tuple[int, int] = (3, 2)
) -> tuple[Meshes, dolfinx.mesh.Mesh, MixedSpace]:
    meshes = Meshes()
    with meshes.used(others):
        domain = build_surface(sm.Shell("s", surface, STEEL, mesh=mesh), MPI.COMM_WORLD).mesh
    return meshes, domain, shell_space(domain, 2, False)


def test_equal_meshes_are_one() -> None:
    meshes, mesh, space = built(sm.Rectangle(1.0, 0.5))
    _, same, again = built(sm.Rectangle(1.0, 0.5), meshes)
    assert same is mesh
    assert again.space.dofmap.index_map is space.space.dofmap.index_map
    for part, dofs in space.dofs.items():
        np.testing.assert_array_equal(again.dofs[part], dofs)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (sm.Rectangle(1.0, 0.5), sm.Rectangle(1.2, 0.5)),
        (sm.Cylinder(1.0, 0.5, angles=(0, 60)), sm.Cylinder(1.1, 0.5, angles=(0, 60))),
    ],
)
def test_moved_nodes(first: sm.Surface, second: sm.Surface) -> None:
    """Areas, places of unknowns and their numbers are those of the mesh made alone."""
    meshes, mesh, _ = built(first)
    _, moved, space = built(second, meshes)
    _, alone, expected = built(second)
    assert moved is not mesh
    assert moved.topology._cpp_object is mesh.topology._cpp_object
    np.testing.assert_array_equal(moved.geometry.x, alone.geometry.x)
    np.testing.assert_array_equal(space.nodes("u"), expected.nodes("u"))
    for part, dofs in expected.dofs.items():
        np.testing.assert_array_equal(space.dofs[part], dofs)
    areas = [
        MPI.COMM_WORLD.allreduce(
            fem.assemble_scalar(fem.form(fem.Constant(m, 1.0) * ufl.dx(metadata={"degree": 4})))
        )
        for m in (moved, alone)
    ]
    assert areas[0] == areas[1]


def test_other_cells_are_other_meshes() -> None:
    meshes, mesh, _ = built(sm.Rectangle(1.0, 0.5))
    _, other, _ = built(sm.Rectangle(1.0, 0.5), meshes, mesh=(2, 3))
    assert other.topology._cpp_object is not mesh.topology._cpp_object


def test_each_is_used_once() -> None:
    """Two bodies of one simulation never have the same mesh."""
    meshes, mesh, _ = built(sm.Rectangle(1.0, 0.5))
    twice = Meshes()
    with twice.used(meshes):
        shell = sm.Shell("s", sm.Rectangle(1.0, 0.5), STEEL, mesh=(3, 2))
        first, second = (build_surface(shell, MPI.COMM_WORLD).mesh for _ in range(2))
    assert first is mesh
    assert second is not mesh


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize(
    "surface", [sm.Sphere(1.0, polar=(0, 180)), sm.Rectangle(1.0, 0.5)], ids=["sphere", "plate"]
)
def test_parts_have_the_numbers_of_the_whole(surface: sm.Surface, degree: Literal[2, 3]) -> None:
    """The kind: where an edge runs the other way in a cell, DOLFINx forgets that in parts.

    Nodes of degree 3 along it, and directors there, were then those of one another in that cell.
    """
    shell = sm.Shell("s", surface, STEEL, mesh=(3, 3), degree=degree)  # type: ignore[arg-type]
    made = build_surface(shell, MPI.COMM_WORLD)
    space, x = shell_space(made.mesh, degree, False), ufl.SpatialCoordinate(made.mesh)
    weights = fem.Function(space.subspaces["u"]), field_of(lambda x: x[0], space, 1, "weight")
    weights[0].x.array[:] = space.nodes("u").ravel()
    for found, right in zip(weights, (x, x[0]), strict=True):
        away = fem.assemble_scalar(fem.form(ufl.inner(found - right, found - right) * ufl.dx))
        # elements have places of degree 2: squares of round-off
        assert abs(away) < 1e-28
    director = reference_director(made, space.subspaces["u"])
    if isinstance(surface, sm.Sphere):
        # of an interpolation with four elements on a quarter of a circle; nodes of the other one
        # are off by 2e-2
        away = fem.assemble_scalar(fem.form(ufl.inner(director - x, director - x) * ufl.dx))
        assert abs(away) < 1e-5
