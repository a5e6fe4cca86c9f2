"""Meshes of structured surfaces: area, edges, points, sides, on one and on two ranks."""

from mpi4py import MPI

import basix
import dolfinx.mesh
import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.meshes.mesh import build_surface
from shellmb.model.model import Model
from shellmb.scene import (
    Clamped,
    Cylinder,
    Disc,
    Isotropic,
    Parametric,
    Rectangle,
    Scene,
    Shell,
    Sphere,
    Surface,
)

SECTION = Isotropic(E=1.0, nu=0.3, thickness=0.1)


def saddle(xi, eta):
    return np.stack([xi, 2 * eta, 0.3 * np.sin(2 * xi) * eta])


def made(surface, **kwargs):
    return build_surface(Shell("s", surface, SECTION, **kwargs), MPI.COMM_SELF)


def jacobians(surface):
    """Positions, cross products of the Jacobian's columns (c, q, 3), and weights (q,)."""
    mesh = surface.mesh
    points, weights = basix.make_quadrature(mesh.basix_cell(), 6)
    element = basix.create_element(
        basix.ElementFamily.P,
        mesh.basix_cell(),
        mesh.geometry.cmaps[0].degree,
        basix.LagrangeVariant.equispaced,
    )
    table = element.tabulate(1, points)[..., 0]
    x = mesh.geometry.x[mesh.geometry.dofmaps[0]]
    position, j0, j1 = (np.einsum("qk,ckd->cqd", t, x) for t in table)
    return position, np.cross(j0, j1), weights


def area(surface):
    _, cross, weights = jacobians(surface)
    return float((np.linalg.norm(cross, axis=2) * weights).sum())


def nodes_of(surface, edge):
    facets = surface.edges[edge]
    nodes = dolfinx.mesh.entities_to_geometry(surface.mesh, 1, facets)
    return surface.mesh.geometry.x[np.unique(nodes)].T


ROUND = [
    (Cylinder(2, 3, (20, 110)), 3 * np.pi),
    (Cylinder(2, 3), 12 * np.pi),
    (Sphere(1, (18, 90), (0, 90)), np.pi / 2 * np.cos(np.radians(18))),
    (Sphere(1, (0, 60), (10, 100)), np.pi / 4),
    (Sphere(1), 2 * np.pi),
    (Disc(1, (30, 90)), np.pi / 6),
    (Disc(1, (0, 180)), np.pi / 2),
    (Disc(1), np.pi),
]


@pytest.mark.parametrize("distortion", [0.0, 0.25])
@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize(("surface", "exact"), ROUND)
def test_area_and_side_of_round_surfaces(surface, exact, cell, distortion):
    meshed = made(surface, mesh=(8, 8), cell=cell, distortion=distortion)
    assert area(meshed) == pytest.approx(exact, rel=1e-3)
    position, cross, _ = jacobians(meshed)
    exact_normals = meshed.normal(position.reshape(-1, 3).T).T.reshape(cross.shape)
    cosine = (exact_normals * cross).sum(axis=2) / np.linalg.norm(cross, axis=2)
    assert (cosine * meshed.cell_normal_sign[:, None]).min() > 0.98


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize("order", [1, 2])
def test_area_converges_with_the_order_of_the_geometry(cell, order):
    errors = [
        1
        - area(made(Cylinder(1, 1, (0, 90)), mesh=(n, 2), cell=cell, geometry_order=order))
        * 2
        / np.pi
        for n in (4, 8)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * order, abs=0.1)


@pytest.mark.parametrize("distortion", [0.0, 0.3])
@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_flat_meshes_stay_exact_and_untangled(cell, distortion):
    meshed = made(Rectangle(2, 3, (1, 1, 1)), mesh=(6, 5), cell=cell, distortion=distortion)
    assert meshed.mesh.geometry.cmaps[0].degree == 1
    assert area(meshed) == pytest.approx(6, rel=1e-13)
    _, cross, _ = jacobians(meshed)
    assert (cross[..., 2] * meshed.cell_normal_sign[:, None]).min() > 0
    assert meshed.length == pytest.approx(np.sqrt(13))
    inside = meshed.mesh.geometry.x[:, 0] * 3 % 1  # off the regular grid lines of spacing 1/3
    moved = np.abs(inside - np.rint(inside)).max() > 0.05
    assert moved == (distortion > 0)


def test_distortion_is_reproducible_and_scaled():
    size = 1 / 4
    regular, a, b = (
        np.sort(made(Rectangle(1, 1), mesh=(4, 4), distortion=d).mesh.geometry.x, axis=0)
        for d in (0.0, 0.2, 0.2)
    )
    np.testing.assert_array_equal(a, b)
    assert 0 < np.abs(a - regular).max() <= 0.2 * size + 1e-12


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_edges_and_points_are_where_they_should_be(cell, order):
    surface = Cylinder(2, 3, (0, 90))
    meshed = made(surface, mesh=(4, 3), cell=cell, geometry_order=order, distortion=0.2)
    counts = {name: len(facets) for name, facets in meshed.edges.items()}
    assert counts == {"left": 3, "right": 3, "bottom": 4, "top": 4}
    np.testing.assert_allclose(nodes_of(meshed, "left")[1], 0, atol=1e-14)
    np.testing.assert_allclose(nodes_of(meshed, "right")[0], 0, atol=1e-14)
    np.testing.assert_allclose(nodes_of(meshed, "bottom")[2], 0, atol=1e-14)
    np.testing.assert_allclose(nodes_of(meshed, "top")[2], 3, atol=1e-14)
    assert nodes_of(meshed, "top").shape[1] == 4 * order + 1
    np.testing.assert_allclose(meshed.points["right-top"], (0, 2, 3), atol=1e-14)
    for point in meshed.points.values():
        assert np.linalg.norm(meshed.mesh.geometry.x - point, axis=1).min() < 1e-14


def test_edges_of_a_sector():
    meshed = made(Disc(2, (0, 90)), mesh=(4, 5))
    assert {name: len(f) for name, f in meshed.edges.items()} == {"left": 5, "right": 5, "top": 4}
    np.testing.assert_allclose(np.linalg.norm(nodes_of(meshed, "top"), axis=0), 2)
    np.testing.assert_allclose(nodes_of(meshed, "left")[1], 0, atol=1e-14)
    np.testing.assert_allclose(nodes_of(meshed, "right")[0], 0, atol=1e-14)


def test_closed_surfaces_have_no_seam():
    meshed = made(Cylinder(1, 1), mesh=(6, 2))
    assert set(meshed.edges) == {"bottom", "top"}
    assert meshed.mesh.topology.index_map(0).size_global == 6 * 3
    assert len(dolfinx.mesh.exterior_facet_indices(meshed.mesh.topology)) == 12


def test_pole_mesh_counts_a_quarter():
    meshed = made(Sphere(1, azimuth=(0, 90)), mesh=(8, 8))
    assert meshed.mesh.topology.index_map(2).size_global == 3 * 16
    np.testing.assert_allclose(meshed.points["pole"], (0, 0, 1), atol=1e-14)


def test_normals_from_the_map_alone():
    meshed = made(Parametric(saddle), mesh=(4, 4))
    xi, eta = np.random.default_rng(1).uniform(0, 1, (2, 50))
    xi[:4], eta[:4] = (0, 0, 1, 1), (0, 1, 0, 1)
    t1 = np.stack([1 + 0 * xi, 0 * xi, 0.6 * np.cos(2 * xi) * eta])
    t2 = np.stack([0 * xi, 2 + 0 * xi, 0.3 * np.sin(2 * xi)])
    exact = np.cross(t1, t2, axis=0)
    exact /= np.linalg.norm(exact, axis=0)
    np.testing.assert_allclose(meshed.normal(saddle(xi, eta)), exact, atol=1e-8)
    assert set(meshed.cell_normal_sign) == {1}


def test_a_surface_of_the_users_own():
    class Cone(Surface):
        def position(self, xi, eta):
            return np.stack([(1 + eta) * np.cos(xi), (1 + eta) * np.sin(xi), eta])

    meshed = made(Cone(), mesh=(6, 4))
    assert area(meshed) == pytest.approx(1.5 * np.sqrt(2), rel=1e-5)
    np.testing.assert_allclose(
        meshed.normal(np.array([[1.5], [0], [0.5]])).ravel(),
        np.array([1, 0, -1]) / np.sqrt(2),
        atol=1e-8,
    )


def test_names_are_looked_up():
    meshed = made(Rectangle(2, 1), mesh=(3, 2))
    both = meshed.facets(("left", "bottom"), "clamped edge")
    np.testing.assert_array_equal(both, np.union1d(meshed.edges["left"], meshed.edges["bottom"]))
    np.testing.assert_array_equal(meshed.point("right-top", "probe"), (2, 1, 0))
    np.testing.assert_array_equal(meshed.point((1.0, 2.0, 3.0), "probe"), (1, 2, 3))
    with pytest.raises(
        SceneError, match="clamped edge: shell 's' has no edge 'x'; its edges are 'l"
    ):
        meshed.facets("x", "clamped edge")
    with pytest.raises(
        SceneError, match="probe: shell 's' has no point 'x'; its points are 'left-b"
    ):
        meshed.point("x", "probe")


PARALLEL = """
from mpi4py import MPI
import dolfinx.mesh, numpy as np
from shellmb.meshes.mesh import build_surface
from shellmb.errors import SceneError
from shellmb.scene import Disc, GmshModel, Isotropic, Rectangle, Shell, Sphere
comm, section = MPI.COMM_WORLD, Isotropic(1.0, 0.3, thickness=0.1)

def strip(gmsh, mesh):
    gmsh.model.occ.addRectangle(0, 0, 0, 2, 1)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", 1 / mesh[0])
    gmsh.model.addPhysicalGroup(1, [4], name="left")

def signature(shell, on):
    m = build_surface(shell, on)
    mesh, cells = m.mesh, m.mesh.topology.index_map(2).size_local
    middle = dolfinx.mesh.compute_midpoints(mesh, 2, np.arange(cells, dtype=np.int32))
    x = mesh.geometry.x[mesh.geometry.dofmaps[0][:, :3]]
    n = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) * m.cell_normal_sign[:, None]
    rows = [np.hstack([middle, n[:cells]])]
    for name in sorted(m.edges):
        local = m.mesh.topology.index_map(1).size_local
        owned = m.edges[name][m.edges[name] < local]
        rows.append(np.hstack([dolfinx.mesh.compute_midpoints(mesh, 1, owned)] * 2))
        # a facet of a named edge is flagged on every rank that has it
        mark = np.zeros(local + m.mesh.topology.index_map(1).num_ghosts)
        mark[m.edges[name]] = 1
        v = dolfinx.la.vector(m.mesh.topology.index_map(1))
        v.array[:] = mark
        v.scatter_forward()
        assert np.array_equal(v.array, mark)
    rows = np.vstack(rows)
    gathered = rows if on.size == 1 else np.vstack(on.allgather(rows))
    gathered = np.round(gathered, 10) + 0.0
    return gathered[np.lexsort(gathered.T)], m.length, sorted(m.points)

shells = [Shell("s", s, section, mesh=(6, 5), cell=c, distortion=d)
          for c in ("quad", "tri")
          for s, d in ((Rectangle(2, 1), 0.25), (Sphere(1.0), 0.0), (Disc(1.0, (0, 90)), 0.2),
                       (GmshModel(strip), 0.0))]
for shell in shells:
    one, two = signature(shell, MPI.COMM_SELF), signature(shell, comm)
    assert one[0].shape == two[0].shape, (shell, one[0].shape, two[0].shape)
    assert np.allclose(one[0][:, :3], two[0][:, :3], atol=1e-9) and one[1:] == two[1:], shell
try:
    build_surface(Shell("s", GmshModel(lambda gmsh, mesh: 1 / 0), section), comm)
except SceneError as error:
    print(f"{comm.rank} {error}\\n", end="", flush=True)
"""


@pytest.mark.mpi
def test_the_same_mesh_on_two_ranks(mpirun):
    out = mpirun(2, "-c", PARALLEL)
    for rank in (0, 1):
        assert f"{rank} shell 's': gmsh fails: division by zero" in out.splitlines()


@pytest.mark.parametrize(
    ("x", "order"),
    [
        (lambda a, b: a**4, 1),
        (lambda a, b: a**2, 1),
        (lambda a, b: a**3, 2),
        (lambda a, b: a + 0.2 * np.sin(2 * np.pi * a) * np.sin(2 * np.pi * b), 1),
    ],
    ids=["nearly none", "no normal at an edge", "middle nodes beyond the quarter points", "folded"],
)
def test_elements_that_are_turned_over_are_refused(x, order):
    surface = Parametric(lambda a, b: np.array([x(a, b), 0.5 * b, 0 * a]))
    shell = Shell("plate", surface, SECTION, mesh=(8, 4), geometry_order=order)
    with pytest.raises(SceneError, match="shell 'plate': an element is turned over"):
        Model(Scene("s", shell, supports=Clamped("left"), scheme="linear-statics"), MPI.COMM_SELF)


@pytest.mark.parametrize("order", [1, 2])
def test_a_pole_of_a_map_is_refused(order):
    surface = Parametric(lambda r, a: np.array([r * np.cos(a), r * np.sin(a), 0 * r]))
    shell = Shell("fan", surface, SECTION, mesh=(4, 4), geometry_order=order)
    with pytest.raises(SceneError, match=r"shell 'fan': .* has no normal, at"):
        Model(Scene("s", shell, supports=Clamped("right"), scheme="linear-statics"), MPI.COMM_SELF)
