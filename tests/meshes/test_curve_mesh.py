"""Meshes of beams: nodes and frames in the order of the line, on one rank and on several."""

from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.errors import SceneError
from shellmb.meshes.curve_mesh import LineMesh, build_line, line_mesh_from_nodes
from shellmb.meshes.spaces import beam_space
from shellmb.native import kernels
from shellmb.scene import Beam, CircularArc, CircularSection, Line, ParametricCurve

RADIUS = 2.0


def helix(xi: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(3 * xi), np.sin(3 * xi), 0.8 * xi])


CURVES = {
    "line": Line((0.1, 0.2, 0.3), (1.1, 2.2, 2.3)),
    "vertical": Line((0, 0, 1), (0, 0, 0)),
    "arc": CircularArc((0, 0, 0), (RADIUS, 0, 0), (0, 0, 1), 1.0),
    "circle": CircularArc((0, 0, 0), (RADIUS, 0, 0), (0, 1, 0), 2 * np.pi),
    "helix": ParametricCurve(helix),
}


def made(curve: Any, elements: int = 4, degree: int = 2, up: Any = None) -> LineMesh:
    beam = Beam("b", curve, CircularSection(1.0, 0.0, radius=0.1), elements=elements)
    # also such as a beam refuses
    vars(beam).update(degree=degree, up=up)
    return build_line(beam, MPI.COMM_WORLD)


def nodes_and_triads(line: LineMesh) -> tuple[np.ndarray, np.ndarray]:
    """Positions and frames as the function says, in the order of the line."""
    space = beam_space(line.mesh, line.degree).subspaces["w"]
    frames = line.frames(space).x.array.reshape(-1, 3, 3)
    order = np.argsort(line.numbers(space))
    return space.tabulate_dof_coordinates()[order], frames[order]


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("name", CURVES)
def test_nodes_follow_the_curve_and_frames_its_tangent(name: str, degree: int) -> None:
    curve = CURVES[name]
    line = made(curve, 8, degree)
    x, triads = nodes_and_triads(line)
    assert len(x) == 8 * degree + (not curve.closed)
    np.testing.assert_allclose(
        triads @ triads.transpose(0, 2, 1), np.tile(np.eye(3), (len(x), 1, 1)), atol=1e-14
    )
    assert np.all(np.linalg.det(triads) > 0)
    inner = {2: [0.5], 3: [(1 - 1 / np.sqrt(5)) / 2, (1 + 1 / np.sqrt(5)) / 2]}[degree]
    xi = np.concatenate([(e + np.array([0, *inner])) / 8 for e in range(8)] + [[1.0]])[: len(x)]
    # the geometry is quadratic in between its own nodes, which are those of degree 2
    np.testing.assert_allclose(
        x, curve.position(xi).T, atol=1e-14 if degree == 2 else 1e-3 * line.length
    )
    np.testing.assert_allclose(triads[:, 0], curve.tangent(xi).T, atol=1e-12)


@pytest.mark.parametrize("name", CURVES)
def test_elements_run_from_the_start_to_the_end(name: str) -> None:
    """The mesh's own tangent, by which strains are taken, is that of the frames."""
    line = made(CURVES[name], 16)
    D = line.frames(beam_space(line.mesh, 2).subspaces["w"])
    t = ufl.Jacobian(line.mesh)[:, 0]
    t = t / ufl.sqrt(ufl.dot(t, t))
    gap = ufl.dot(t, ufl.as_vector([D[k] for k in range(3)])) - 1
    error = fem.assemble_scalar(kernels.compiled(gap**2 * ufl.dx))
    # of second order in the angle of an element, at most 0.4
    assert np.sqrt(error / line.length) < 2e-3
    length = fem.assemble_scalar(kernels.compiled(fem.Constant(line.mesh, 1.0) * ufl.dx))
    assert length == pytest.approx(line.length, rel=1e-5)
    assert length == pytest.approx(CURVES[name].length, rel=1e-4)


def test_named_points_are_the_ends() -> None:
    line = made(CURVES["line"])
    assert set(line.points) == {"start", "end"}
    x, _ = nodes_and_triads(line)
    np.testing.assert_allclose([line.points["start"], line.points["end"]], x[[0, -1]], atol=1e-14)
    assert line.length == pytest.approx(3.0, rel=1e-14)
    assert set(made(CURVES["circle"]).points) == {"start"}


def test_the_third_director_is_the_projection_of_up() -> None:
    up = np.array([0.3, -0.2, 1.0])
    _, triads = nodes_and_triads(made(CURVES["helix"], up=tuple(up)))
    across = up - (triads[:, 0] @ up)[:, None] * triads[:, 0]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    np.testing.assert_allclose(triads[:, 2], across, atol=1e-14)


@pytest.mark.parametrize(
    ("name", "third"), [("line", (-2, -4, 5)), ("vertical", (1, 0, 0)), ("arc", (0, 0, 1))]
)
def test_without_up_the_third_director_is_z_or_else_another_axis(name: str, third: Any) -> None:
    _, triads = nodes_and_triads(made(CURVES[name]))
    expected = np.array(third) / np.linalg.norm(third)
    np.testing.assert_allclose(triads[:, 2], np.tile(expected, (len(triads), 1)), atol=1e-12)


def test_without_up_frames_do_not_turn_about_the_tangent() -> None:
    """The angle against the Frenet normal grows as minus the torsion, whatever the mesh."""
    torsion = 3 * 0.8 / (9 + 0.64)
    for elements in (4, 7):
        line = made(CURVES["helix"], elements)
        x, triads = nodes_and_triads(line)
        normal = -x * [1, 1, 0]
        angle = np.unwrap(
            np.arctan2(
                np.sum(np.cross(triads[:, 0], normal) * triads[:, 2], axis=1),
                np.sum(normal * triads[:, 2], axis=1),
            )
        )
        s = np.sqrt(9 + 0.64) * np.linspace(0, 1, len(x))
        # the transport is of fourth order on at least 256 intervals
        np.testing.assert_allclose(angle - angle[0], -torsion * s, atol=1e-7)


def test_frames_of_a_closed_curve_close() -> None:
    """A trefoil turns a transported frame by an angle, which is spread over the way."""

    def trefoil(xi: np.ndarray) -> np.ndarray:
        a = 2 * np.pi * xi
        r = 2 + np.cos(3 * a)
        return np.stack([r * np.cos(2 * a), r * np.sin(2 * a), np.sin(3 * a)])

    _, triads = nodes_and_triads(made(ParametricCurve(trefoil), 60))
    turns = np.sum(triads[:, 2] * np.roll(triads[:, 2], -1, axis=0), axis=1)
    # over the seam as elsewhere
    assert turns[-1] == pytest.approx(turns[0], abs=1e-3)
    assert np.min(turns) > 0.95


def test_a_line_of_given_nodes_keeps_its_third_directors() -> None:
    """Along an arc of a cylinder whose directors are its normals; also closed."""
    for angle, closed in ((1.0, False), (2 * np.pi, True)):
        a = np.linspace(0, angle, 17)[: 16 if closed else 17]
        normal = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
        line = line_mesh_from_nodes("b", MPI.COMM_WORLD, RADIUS * normal, 2, normal, 2, closed)
        x, triads = nodes_and_triads(line)
        np.testing.assert_allclose(x, RADIUS * normal, atol=1e-14)
        np.testing.assert_array_equal(triads[:, 2], normal)
        tangent = np.cross([0, 0, 1], normal)
        np.testing.assert_allclose(triads[:, 0], tangent, atol=1e-12)
        np.testing.assert_allclose(triads[:, 1], np.tile([0, 0, 1], (len(x), 1)), atol=1e-12)
        assert line.length == pytest.approx(RADIUS * angle, rel=1e-3)


def test_the_parts_of_the_space_list_nodes_in_the_same_order() -> None:
    """A state that is set part by part has its values at the same nodes."""
    line = made(CURVES["helix"], 5, 3)
    mixed = beam_space(line.mesh, 3)
    assert {name: size for name, (_, size) in mixed.parts.items()} == {
        "u": 3,
        "w": 9,
        "N": 3,
        "lam": 6,
    }
    q, x = fem.Function(mixed.space), mixed.nodes("u")
    for name in ("u", "w", "lam"):
        values = np.tile(x, (1, 3))[:, : mixed.parts[name][1]]
        q.x.array[mixed.dofs[name]] = values.ravel()
    first = {name: start for name, (start, _) in mixed.parts.items()}
    gap = sum(
        (q[first[a] + k] - q[first[b] + k]) ** 2
        for a, b in (("u", "w"), ("u", "lam"))
        for k in range(3)
    )
    assert fem.assemble_scalar(kernels.compiled(gap * ufl.dx)) < 1e-28


@pytest.mark.parametrize(
    ("curve", "elements", "up", "message"),
    [
        (CURVES["line"], 4, (1, 2, 2), r"up is \(1, 2, 2\); it is tangent .* at \(0.1, 0.2, 0.3\)"),
    ],
)
def test_what_cannot_be_meshed(curve: Any, elements: int, up: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        made(curve, elements, up=up)


def test_a_director_along_the_line_is_refused() -> None:
    x = np.linspace(0, 1, 5)[:, None] * np.array([1.0, 0, 0])
    third = np.tile([1.0, 0, 0], (5, 1))
    with pytest.raises(SceneError, match="must run along the shell"):
        line_mesh_from_nodes("b", MPI.COMM_WORLD, x, 1, third, 1)


PARALLEL = """
from mpi4py import MPI
import numpy as np, ufl
from dolfinx import fem
from shellmb.meshes.curve_mesh import build_line
from shellmb.meshes.spaces import beam_space
from shellmb.scene import Beam, CircularArc, CircularSection
comm = MPI.COMM_WORLD
for angle in (1.0, 2 * np.pi):
    for elements in (3, 8):
        arc = CircularArc((0, 0, 0), (2, 0, 0), (0, 0, 1), angle)
        line = build_line(Beam("b", arc, CircularSection(1.0, 0.0, radius=0.1), elements), comm)
        space = beam_space(line.mesh, 2).subspaces["w"]
        D, n = line.frames(space), space.dofmap.index_map.size_local
        x = space.tabulate_dof_coordinates()
        # the first director of a circle is across its radius, on owned and ghost nodes alike
        first = D.x.array.reshape(-1, 3, 3)[:, 0]
        error = np.abs(first - np.cross([0, 0, 1], x) / 2).max(initial=0)
        assert error < 1e-12, error
        values = D.x.array.copy()
        D.x.scatter_forward()
        assert (values == D.x.array).all()
        numbers = np.sort(np.concatenate(comm.allgather(line.numbers(space)[:n])))
        assert (numbers == np.arange(2 * elements + (angle < 6))).all(), numbers
        form = fem.form(fem.Constant(line.mesh, 1.0) * ufl.dx)
        length = comm.allreduce(fem.assemble_scalar(form))
        cells = comm.allgather(line.mesh.topology.index_map(1).size_local)
        if comm.rank == 0:
            print(f"{elements} {length:.12f} {line.length:.6f} {min(cells)}")
"""


@pytest.mark.mpi
def test_lines_are_the_same_on_more_ranks_even_if_some_get_no_element(mpirun) -> None:
    one, four = (mpirun(ranks, "-c", PARALLEL).splitlines() for ranks in (1, 4))
    assert [line.split()[:3] for line in one] == [line.split()[:3] for line in four]
    assert [line.split()[3] for line in four] == ["0", "2", "0", "2"]
