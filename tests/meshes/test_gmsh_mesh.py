"""Meshes of gmsh's: files and models, groups, kinks, sides."""

import re
from pathlib import Path

from mpi4py import MPI

import dolfinx.mesh
import gmsh
import numpy as np
import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.meshes.files.joined import oriented
from shellmb.meshes.mesh import build_surface
from shellmb.scene import GmshFile, GmshModel, Isotropic, Shell

SECTION = Isotropic(E=1.0, nu=0.3, thickness=0.1)


def fold(gmsh, mesh):
    """A floor and a wall that meet in the line x = 1, z = 0."""
    geo = gmsh.model.geo
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 1), (1, 1, 1))
    p = [geo.addPoint(*c, 1 / mesh[0]) for c in corners]
    ends = ((0, 1), (1, 2), (2, 3), (3, 0), (1, 4), (4, 5), (5, 2))
    c = [geo.addLine(p[a], p[b]) for a, b in ends]
    floor = geo.addPlaneSurface([geo.addCurveLoop(c[:4])])
    wall = geo.addPlaneSurface([geo.addCurveLoop([c[4], c[5], c[6], -c[1]])])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(2, [floor], name="floor")
    gmsh.model.addPhysicalGroup(2, [wall], name="wall")
    gmsh.model.addPhysicalGroup(1, [c[1]], name="fold")
    gmsh.model.addPhysicalGroup(1, [c[3], c[0]], name="base")
    gmsh.model.addPhysicalGroup(0, [p[4]], name="tip")


def disc(gmsh, mesh):
    gmsh.model.occ.addDisk(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(1, [1], name="rim")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 1 / mesh[0])


@pytest.fixture
def fold_file(tmp_path):
    gmsh.initialize(["test"], False, False, False)
    gmsh.option.setNumber("General.Terminal", 0)
    fold(gmsh, (3, 3))
    gmsh.write(str(tmp_path / "fold.geo_unrolled"))
    (tmp_path / "fold.geo_unrolled").rename(tmp_path / "fold.geo")
    gmsh.model.mesh.generate(2)
    gmsh.write(str(tmp_path / "fold.msh"))
    gmsh.finalize()
    return tmp_path / "fold.msh"


def made(surface, **kwargs):
    return build_surface(Shell("s", surface, SECTION, **kwargs), MPI.COMM_SELF)


def edge_nodes(surface, edge):
    nodes = dolfinx.mesh.entities_to_geometry(surface.mesh, 1, surface.edges[edge])
    return np.unique(surface.mesh.geometry.x[np.unique(nodes)], axis=0)


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_groups_that_meet_keep_coinciding_nodes(cell):
    floor, wall = (made(GmshModel(fold, g), mesh=(4, 4), cell=cell) for g in ("floor", "wall"))
    np.testing.assert_array_equal(edge_nodes(floor, "fold"), edge_nodes(wall, "fold"))
    assert set(floor.edges) == {"fold", "base"}
    assert set(wall.edges) == {"fold"}
    assert set(wall.points) == {"tip"}
    assert not floor.points
    np.testing.assert_array_equal(wall.points["tip"], (1, 0, 1))
    assert np.ptp(floor.mesh.geometry.x[:, 2]) == 0
    assert floor.normal is None


@pytest.mark.parametrize("order", [1, 2, None])
@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_order_of_the_geometry(cell, order):
    meshed = made(GmshModel(disc), mesh=(4, 4), cell=cell, geometry_order=order)
    assert meshed.mesh.geometry.cmaps[0].degree == (order or 2)
    rim = edge_nodes(meshed, "rim")
    assert len(rim) == (order or 2) * len(meshed.edges["rim"])
    np.testing.assert_allclose(np.linalg.norm(rim, axis=1), 1, atol=1e-12)


def test_files_keep_their_cells_and_order(fold_file):
    meshed = made(GmshFile(fold_file, "floor"), cell="tri")
    assert meshed.mesh.geometry.cmaps[0].degree == 1
    assert (
        made(GmshFile(fold_file, "floor"), cell="tri", geometry_order=2)
        .mesh.geometry.cmaps[0]
        .degree
        == 2
    )
    geometry = GmshFile(fold_file.with_suffix(".geo"), "wall")
    assert made(geometry).mesh.topology.cell_type == dolfinx.mesh.CellType.quadrilateral


def test_errors(fold_file):
    cases = {
        "has several physical surfaces; group must be one of 'floor', 'wall'": (None, "tri"),
        "has no set of cells 'roof'; it has 'floor', 'wall'": ("roof", "tri"),
        "has triangles; cell must be 'tri', not 'quad'": ("floor", "quad"),
    }
    for message, (group, cell) in cases.items():
        with pytest.raises(SceneError, match=message):
            made(GmshFile(fold_file, group), cell=cell)
    with pytest.raises(SceneError, match="no edge 'rim'; its edges are"):
        made(GmshModel(fold, "floor")).facets("rim", "clamped edge")
    with pytest.raises(SceneError, match="gmsh fails: division by zero"):
        made(GmshModel(lambda gmsh, mesh: 1 / 0))
    with pytest.raises(SceneError, match="has no cells; mesh its surfaces"):
        made(GmshModel(lambda gmsh, mesh: None))
    assert not gmsh.isInitialized()


def test_a_session_that_is_open_is_left_as_it_was():
    gmsh.initialize(["test"], False, False, False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 2)
        gmsh.model.add("mine")
        gmsh.model.occ.addSphere(0, 0, 0, 1)
        made(GmshModel(disc), mesh=(3, 3))
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.option.getNumber("Mesh.RecombinationAlgorithm") == 2
        gmsh.model.occ.synchronize()
        assert gmsh.model.getEntities(3)
    finally:
        gmsh.finalize()


def strip(turned):
    """Six quadrilaterals in a ring; every other one numbered the other way round."""
    angle = np.arange(6) * np.pi / 3
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    x = np.concatenate([ring, ring + np.array([0, 0, 1])])
    cells = []
    for i in range(6):
        a, b = i, (i + 1) % 6
        lower, upper = (a, b), (a + 6, b + 6)
        if turned and i == 5:
            lower, upper = (a, b + 6), (a + 6, b)
        cells.append([*lower, *upper] if i % 2 else [*upper, *lower])
    return x, np.array(cells)


def test_sides_are_made_consistent():
    x, cells = strip(turned=False)
    normals = oriented(x, cells, "quad", "s")
    middle = x[cells].mean(axis=1) * (1, 1, 0)
    side = np.sign((normals * middle).sum(axis=1))
    assert abs(side.sum()) == 6


def test_one_sided_and_branching_meshes_are_refused():
    with pytest.raises(SceneError, match="shell 's': its mesh has one side only"):
        oriented(*strip(turned=True), "quad", "s")
    x = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)], dtype=float)
    with pytest.raises(SceneError, match="shell 's': 3 cells of its mesh share one facet"):
        oriented(x, np.array([(0, 1, 2), (0, 1, 3), (0, 1, 4)]), "tri", "s")


def torus(file: Path) -> Path:
    """A face that closes on itself in both directions."""
    gmsh.initialize(["test"], False, False, False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addTorus(0, 0, 0, 1.0, 0.2)
        gmsh.model.occ.synchronize()
        gmsh.model.occ.remove([(3, 1)])
        gmsh.write(str(file))
    finally:
        gmsh.finalize()
    return file


def test_faces_that_take_no_quadrilaterals_get_triangles(tmp_path):
    """Kind: faces of CAD on which gmsh does not recombine triangles."""
    file = GmshFile(torus(tmp_path / "torus.step"))
    with pytest.warns(ShellmbWarning, match="it has triangles, as with cell='tri'"):
        meshed = made(file, mesh=(4, 4))
    assert meshed.mesh.topology.cell_type == dolfinx.mesh.CellType.triangle
    with pytest.raises(SceneError, match=r"no quadrilaterals on these .*; cell must be 'tri'"):
        made(file, mesh=(4, 4), cell="quad")
    assert not gmsh.isInitialized()


def test_messages_of_gmsh_have_the_name_of_the_file(tmp_path):
    file = tmp_path / "part.step"
    file.write_text("ISO-10303-21;\nnonsense")
    with pytest.raises(SceneError, match=re.escape(f"gmsh fails: Could not read file '{file}'")):
        made(GmshFile(file))
