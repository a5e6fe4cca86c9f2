"""Meshes that touch themselves: joined where nodes are near, refused where they are not."""

import warnings
from pathlib import Path
from typing import Any

from mpi4py import MPI

import meshio
import numpy as np
import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.meshes.files.joined import crossings, gaps
from shellmb.meshes.mesh import SurfaceMesh, build_surface
from shellmb.meshes.raw import RawMesh
from shellmb.scene import GmshFile, GmshModel, Isotropic, MeshFile, Shell

SECTION = Isotropic(E=70e9, nu=0.3, thickness=1e-3)
# a turned system of axes, in which no coordinate is round
TURNED = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, -1], [3, 0, 1]]))[0]


def patch(corners: Any, m: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and quadrilaterals of a bilinear patch of four corners."""
    s, t = np.meshgrid(np.linspace(0, 1, m + 1), np.linspace(0, 1, n + 1), indexing="ij")
    s, t = s.ravel()[:, None], t.ravel()[:, None]
    a, b, c, d = np.asarray(corners, dtype=float)
    points = (1 - s) * (1 - t) * a + s * (1 - t) * b + s * t * c + (1 - s) * t * d
    first = np.array([(n + 1) * i + j for i in range(m) for j in range(n)])
    return points, first[:, None] + [0, n + 1, n + 2, 1]


def flat(x0: float, x1: float, y0: float, y1: float, m: int, n: int) -> Any:
    return patch([(x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)], m, n)


def written(
    file: Path, parts: Any, cell: str = "quad", size: float = 1.0, axes: Any = None
) -> Path:
    """A file of several patches, each with its own nodes."""
    points, cells, count = [], [], 0
    for x, quads in parts:
        points.append(x @ (np.eye(3) if axes is None else axes))
        cells.append(quads + count)
        count += len(x)
    every = np.concatenate(cells)
    kind = "quad"
    if cell == "tri":
        kind, every = "triangle", np.concatenate([every[:, [0, 1, 2]], every[:, [0, 2, 3]]])
    meshio.write_points_cells(file, size * np.concatenate(points), [(kind, every)])
    return file


def built(file: Path, cell: Any = "quad", **options: Any) -> SurfaceMesh:
    return build_surface(
        Shell("part", MeshFile(file, **options), SECTION, cell=cell), MPI.COMM_SELF
    )


def count(surface: SurfaceMesh) -> int:
    return int(surface.mesh.topology.index_map(0).size_global)


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-6])
@pytest.mark.parametrize(("size", "axes"), [(1.0, None), (1e-3, TURNED)])
def test_seams_are_joined(tmp_path: Path, cell: str, gap: float, size: float, axes: Any) -> None:
    halves = [flat(0, 0.5, 0, 0.25, 8, 4), flat(0.5 + gap, 1, 0, 0.25, 8, 4)]
    file = written(tmp_path / "plate.vtk", halves, cell, size, axes)
    with pytest.warns(ShellmbWarning, match=r"5 nodes of its mesh lie on others and become one"):
        surface = built(file, cell)
    assert count(surface) == 17 * 5
    # the same apart, if asked for
    for options in ({"merge": 0.0}, {"merge": min(1e-3, 1e-2 * gap)}):
        if gap or options["merge"] == 0:
            with pytest.raises(SceneError, match=r"at 4 places, [0-9.e+-]+ m of sides"):
                built(file, cell, **options)
    with pytest.warns(ShellmbWarning) as said:
        assert count(built(file, cell, merge=0, gaps="keep")) == 2 * 9 * 5
    assert any("stay open" in str(w.message) for w in said)
    assert any("2 pieces that share no nodes: " in str(w.message) for w in said)


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize(("left", "right", "hanging"), [(1, 2, 1), (1, 4, 3), (2, 5, 4), (3, 4, 5)])
@pytest.mark.parametrize(("size", "axes"), [(1.0, None), (1e3, TURNED)])
def test_hanging_nodes_are_refused_where_they_are(
    tmp_path: Path, cell: str, left: int, right: int, hanging: int, size: float, axes: Any
) -> None:
    halves = [flat(0, 0.5, 0, 0.25, 4, left), flat(0.5, 1, 0, 0.25, 4, right)]
    file = written(tmp_path / "plate.vtk", halves, cell, size, axes)
    with pytest.raises(SceneError, match="elements must meet in common nodes") as error:
        with pytest.warns(ShellmbWarning, match="become one"):
            built(file, cell)
    middle = size * np.array([0.5, 0.25 / right, 0.0]) @ (np.eye(3) if axes is None else axes)
    if left < right:
        assert ", ".join(f"{v:.4g}" if v else "0" for v in middle) in str(error.value)
    with pytest.warns(ShellmbWarning) as said:
        built(file, cell, gaps="keep")
    (text,) = [str(w.message) for w in said if "stay open" in str(w.message)]
    places = text[text.index(" has ") :]
    # each hanging node is listed where there are few of them
    assert hanging > 3 or places.count("(") >= hanging


def round_patch(radii: Any, z: Any, m: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """A quarter of a surface of revolution: angle first."""
    x, quads = flat(0, 1, 0, 1, m, n)
    r, h = (np.interp(x[:, 1], (0, 1), ends) for ends in (radii, z))
    angle = np.pi / 2 * x[:, 0]
    return np.stack([r * np.cos(angle), r * np.sin(angle), h], axis=1), quads


@pytest.mark.parametrize(("radii", "z"), [((1, 1), (0, 1)), ((1, 2), (0, 0))])
@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_round_seams_with_other_numbers_of_elements(
    tmp_path: Path, radii: Any, z: Any, cell: str
) -> None:
    """The nodes between lie an arc's height off the side: cylinders, and rings in a plane."""
    more = [2 * b - a for a, b in (radii, z)]
    parts = [
        round_patch(radii, z, 4, 2),
        round_patch((radii[1], more[0]), (z[1], more[1]), 12, 2),
    ]
    file = written(tmp_path / "tube.vtk", parts, cell)
    with pytest.raises(SceneError, match=r"4 places, .* has .* on it"):
        with pytest.warns(ShellmbWarning, match="become one"):
            built(file, cell)


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_a_wall_stands_on_a_plate_between_its_nodes(tmp_path: Path, cell: str) -> None:
    wall = patch([(0.13, 0.33, 0), (0.83, 0.33, 0), (0.83, 0.33, 0.3), (0.13, 0.33, 0.3)], 3, 1)
    file = written(tmp_path / "wall.vtk", [flat(0, 1, 0, 1, 4, 4), wall], cell)
    with pytest.raises(SceneError, match=r"the node \(0\.13, 0\.33, 0\) lies on another element"):
        built(file, cell)


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_what_is_sound_passes_without_a_word(tmp_path: Path, cell: str) -> None:
    """Narrow strips, thin elements, wedges, slots, tubes, boxes."""
    narrow = [flat(0, 1, 0, 1e-3, 3, 1)]
    layered = [flat(0, 1, 0, 1e-2, 2, 5)]
    wedge = [patch([(0, 0, 0), (1, 0, 0), (1, 0.2, 0), (0, 0.01, 0)], 8, 2)]
    slanted = [patch([(0, 0, 0), (1, 0, 0), (0.9, 0.03, 0), (0.1, 0.03, 0)], 1, 2)]
    ring = [round_patch((1, 1), (0, 1), 9, 3)]
    thin_ring = [round_patch((1, 1.02), (0, 0), 3, 2)]
    for k, parts in enumerate((narrow, layered, wedge, slanted, ring, thin_ring)):
        for axes in (None, TURNED):
            file = written(tmp_path / f"{k}.vtk", parts, cell, 3.0, axes)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                built(file, cell)


def test_pieces_are_named(tmp_path: Path) -> None:
    apart = [flat(0, 1, 0, 1, 3, 3), flat(2, 3, 0, 1, 2, 2)]
    file = written(tmp_path / "apart.vtk", apart)
    with pytest.warns(ShellmbWarning, match=r"2 pieces that share no nodes: 9 .*, 4 elements"):
        built(file)
    corner = [flat(0, 1, 0, 1, 3, 3), flat(1, 2, 1, 2, 3, 3)]
    file = written(tmp_path / "corner.vtk", corner)
    with pytest.warns(ShellmbWarning) as said:
        built(file)
    assert any("2 pieces that meet in single nodes only" in str(w.message) for w in said)


@pytest.mark.parametrize(("cell", "counts"), [("quad", (1, 2)), ("tri", (2, 4))])
def test_few_elements(tmp_path: Path, cell: str, counts: tuple[int, int]) -> None:
    for m, many in zip((1, 2), counts, strict=True):
        surface = built(written(tmp_path / f"{m}.vtk", [flat(0, m, 0, 1, m, 1)], cell), cell)
        assert surface.mesh.topology.index_map(2).size_global == many
    alone = built(tmp_path / "2.vtk", cell, where=lambda x: (x[0] < 1) & (x[1] < 0.6))
    assert alone.mesh.topology.index_map(2).size_global == 1


def test_elements_without_area_and_elements_that_are_twice(tmp_path: Path) -> None:
    points, quads = flat(0, 1, 0, 1, 2, 2)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    file = tmp_path / "plate.vtk"

    def write(kind: str, cells: Any, more: Any = None) -> Path:
        x = points if more is None else np.concatenate([points, more])
        meshio.write_points_cells(file, x, [(kind, np.array(cells))])
        return file

    for flat_one in ([0, 3, 6], [0, 0, 3], [4, 4, 4]):
        write("triangle", [*triangles, flat_one])
        with pytest.warns(ShellmbWarning, match="1 element of its mesh has no area"):
            assert built(file, "tri").mesh.topology.index_map(2).size_global == 8
    write("quad", [*quads, [0, 1, 0, 1]])
    with pytest.warns(ShellmbWarning, match="1 element of its mesh has no area"):
        built(file)
    for again in (quads[1], quads[1][::-1]):
        write("quad", [*quads, again])
        with pytest.raises(SceneError, match=r"1 element .* there twice, at \(0\.25, 0\.75, 0\)"):
            built(file)
    # two elements that are triangles among quadrilaterals are cut with them
    write("quad", [[0, 3, 4, 4], [0, 4, 1, 0], *quads[1:]])
    with pytest.warns(ShellmbWarning, match="3 quadrilaterals and 2 triangles"):
        assert built(file).mesh.topology.index_map(2).size_global == 3 * 4 + 2 * 3
    write("quad", quads, [[np.nan, 0, 0]])
    with pytest.raises(SceneError, match="not finite"):
        built(file)


def two_faces(gap: float, split: bool, file: Path) -> Path:
    import gmsh

    gmsh.initialize(["test", "-v", "0"], False, False, False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        occ = gmsh.model.occ
        occ.addRectangle(0, 0, 0, 0.5, 0.25)
        if split:
            occ.addRectangle(0.5 + gap, 0, 0, 0.5, 0.1)
            occ.addRectangle(0.5 + gap, 0.1, 0, 0.5, 0.15)
        else:
            occ.addRectangle(0.5 + gap, 0, 0, 0.5, 0.25)
        occ.synchronize()
        gmsh.write(str(file))
    finally:
        gmsh.finalize()
    return file


@pytest.mark.parametrize("ending", ["step", "brep"])
@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-7, 1e-6])
def test_faces_of_cad_are_one_surface(
    tmp_path: Path, ending: str, split: bool, gap: float, capfd: Any
) -> None:
    file = two_faces(gap, split, tmp_path / f"plate.{ending}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surface = build_surface(
            Shell("plate", GmshFile(file), SECTION, mesh=(10, 1)), MPI.COMM_SELF
        )
    # four free borders, and nothing else
    mesh = surface.mesh
    to_cells = mesh.topology.connectivity(1, 2)
    free = [f for f in range(mesh.topology.index_map(1).size_local) if len(to_cells.links(f)) == 1]
    from dolfinx.mesh import entities_to_geometry

    x = mesh.geometry.x[entities_to_geometry(mesh, 1, np.array(free, dtype=np.int32))]
    scale = np.ptp(mesh.geometry.x, axis=0)[0]
    border = [np.abs(x[..., 0]) < 1e-5 * scale, np.abs(x[..., 0] - scale) < 1e-5 * scale]
    border += [x[..., 1] < 1e-5 * scale, x[..., 1] > (0.25 - 1e-5) * scale]
    assert np.any([b.all(axis=1) for b in border], axis=0).all()


def test_faces_of_a_model_that_only_touch_are_joined_or_named() -> None:
    def model(gmsh: Any, mesh: Any) -> None:
        occ = gmsh.model.occ
        occ.addRectangle(0, 0, 0, 0.5, 0.3)
        occ.addRectangle(0.5, 0, 0, 0.5, 0.2)
        occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.09)

    with pytest.raises(SceneError, match="touches itself without being joined"):
        with pytest.warns(ShellmbWarning):
            build_surface(Shell("plate", GmshModel(model), SECTION), MPI.COMM_SELF)


@pytest.mark.parametrize(("apart", "found"), [(0.004, True), (0.0065, False)])
@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_nodes_lie_on_sides_within_a_hundredth_of_the_shorter(
    apart: float, found: bool, scale: float
) -> None:
    """A small cell of side 0.5 above the side of a larger one of side 1, whatever the unit."""
    (x, one), (y, two) = flat(0, 1, 0, 1, 1, 1), flat(1, 1.5, 0.25, 0.75, 1, 1)
    y = y + np.array([0.0, 0.0, apart])
    cells = np.concatenate([one, two + len(x)])[:, [0, 1, 3, 2]]
    normals = np.tile([0.0, 0.0, 1.0], (2, 1))
    nothing: Any = {}
    raw = RawMesh(
        scale * np.concatenate([x, y]), cells, "quad", 1, normals, nothing, nothing, nothing
    )
    assert bool(gaps(raw)) == found


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize(("size", "axes"), [(1.0, None), (1e-3, TURNED)])
@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_parts_that_cross_between_their_nodes_are_named(
    tmp_path: Path, cell: str, size: float, axes: Any, tilt: float
) -> None:
    """A plate through another one, across its elements and along their sides, beside and above."""

    def wall(x: float, low: float, y: float = 0.1) -> Any:
        ends = [(x, y), (x + tilt, 1 - y)]
        foot, top = ([(*end, z) for end in ends] for z in (low, low + 0.5))
        return patch([*foot, *top[::-1]], 5, 3)

    def said(*where: float) -> str:
        mesh = [flat(0, 1, 0, 1, 4, 4), wall(*where)]
        file = written(tmp_path / "cross.vtk", mesh, cell, size, axes)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ShellmbWarning)
            built(file, cell)
        return " ".join(str(each.message) for each in caught)

    assert "through other elements" in said(0.43, -0.2)
    # lines through sides of the plate
    assert "through other elements" in said(0.43, -0.2, 0.25)
    for nothing in (said(1.2, -0.2), said(0.43, 0.02), said(0.43, -0.6)):
        assert "through other elements" not in nothing


def test_layers_of_a_roll_do_not_cross() -> None:
    """A sheet that is rolled up three times, in facets, of layers within half a side."""
    x, quads = flat(0, 1, 0, 1, 60, 3)
    angle, radius = 6 * np.pi * x[:, 0], 0.2 + 0.1 * x[:, 0]
    rolled = np.stack([radius * np.cos(angle), radius * np.sin(angle), x[:, 1]], axis=1)
    normals, nothing = np.zeros((len(quads), 3)), dict[str, Any]()
    made = RawMesh(rolled, quads[:, [0, 1, 3, 2]], "quad", 1, normals, nothing, nothing, nothing)
    assert len(crossings(made)) == 0
