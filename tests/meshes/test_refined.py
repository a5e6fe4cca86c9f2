"""Uniform refinement: elements keep their shapes, named edges, points and areas their places."""

from pathlib import Path
from typing import Any, Literal

import meshio
import numpy as np
import pytest

import shellmb as sm
from shellmb.meshes.raw import RawMesh, boundary_facets, cell_cross, facets, refined, vertex_count
from shellmb.meshes.surfaces.structured import structured_mesh
from shellmb.scene import Scene
from tests.meshes.strips import SECTION, grid

Cell = Literal["quad", "tri"]
ROUND_OFF = 1e-12


def curved(cell: Cell, order: int) -> RawMesh:
    """A quarter of a cylinder with everything named that can be."""
    surface = sm.Cylinder(1.0, 2.0, angles=(0.0, 90.0))
    shell = sm.Shell("pipe", surface, SECTION, mesh=(3, 2), cell=cell, geometry_order=order)
    raw = structured_mesh(shell)
    return RawMesh(
        **{**vars(raw), "areas": {"some": np.array([0, 2]), "last": np.array([len(raw.cells) - 1])}}
    )


def size(raw: RawMesh) -> float:
    """Sum of the flat elements between the vertices."""
    corners = raw.x[raw.cells[:, : vertex_count(raw.cell)]]
    share = 0.5 if raw.cell == "tri" else 0.25
    return float(np.linalg.norm(cell_cross(corners), axis=1).sum()) * share


@pytest.mark.parametrize("times", [2, 3])
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_everything_stays_where_it_is(cell: Cell, order: int, times: int) -> None:
    raw = curved(cell, order)
    fine = refined(raw, times)
    corners = vertex_count(cell)
    assert fine.cells.shape == (len(raw.cells) * times**2, raw.cells.shape[1])
    # no node twice, none unused, all of the old vertices
    assert len(np.unique(fine.x.round(9), axis=0)) == len(fine.x)
    assert set(fine.cells.ravel()) == set(range(len(fine.x)))
    old = {tuple(p) for p in raw.x[np.unique(raw.cells[:, :corners])].round(9)}
    assert old <= {tuple(p) for p in fine.x[np.unique(fine.cells[:, :corners])].round(9)}
    every = {tuple(f) for f in facets(fine.cells, cell).reshape(-1, 2).tolist()}
    both = boundary_facets(fine.cells, cell)[0], boundary_facets(raw.cells, cell)[0]
    assert len(both[0]) == times * len(both[1])
    for name, pairs in raw.edges.items():
        lines = fine.edges[name]
        assert len(lines) == times * len(pairs)
        assert {tuple(sorted(p)) for p in lines.tolist()} <= every
        assert {tuple(p) for p in raw.x[pairs].reshape(-1, 3).round(9)} <= {
            tuple(p) for p in fine.x[lines].reshape(-1, 3).round(9)
        }
    for name, node in raw.points.items():
        assert fine.x[fine.points[name]] == pytest.approx(raw.x[node], abs=ROUND_OFF)
    for name, cells in raw.areas.items():
        assert len(fine.areas[name]) == len(cells) * times**2
        middles = fine.x[fine.cells[fine.areas[name]]].mean(axis=1)
        parents = raw.x[raw.cells[cells]].mean(axis=1)
        away = np.linalg.norm(middles[:, None] - parents[None], axis=2).min(axis=1)
        assert (away < 0.75).all()
    # positive sides, and orientation within elements
    cross = cell_cross(fine.x[fine.cells[:, :corners]])
    before = np.repeat(cell_cross(raw.x[raw.cells[:, :corners]]), times**2, axis=0)
    assert (np.sum(cross * before, axis=1) > 0).all()
    assert (np.sum(fine.normals * np.repeat(raw.normals, times**2, axis=0), axis=1) > 0).all()
    if order == 1 and cell == "tri":
        assert size(fine) == pytest.approx(size(raw), rel=ROUND_OFF)
    if order == 2:
        # nearer to the cylinder, from the inside
        assert size(raw) < size(fine) < np.pi
        # parabolas through the old nodes, whose radius is off by some 1e-3
        assert np.linalg.norm(fine.x[:, :2], axis=1) == pytest.approx(1.0, abs=2e-3)


def clamped(surface: Any, scheme: str = "static") -> Scene:
    """A strip from a file that bends under pressure."""
    return Scene(
        "strip",
        sm.Shell("strip", surface, SECTION, cell="quad"),
        supports=sm.Clamped("root"),
        loads=sm.Pressure(10.0),
        probes=sm.Probe("tip", (2.0, 1.0, 0.0), component=2),
        scheme=scheme,
    )


def on_file(folder: Path, m: int, n: int) -> Path:
    points, quads = grid(m, n)
    file = folder / f"strip{m}.vtk"
    meshio.write_points_cells(file, points, [("quad", quads)])
    return file


def surface(file: Path, refine: int = 1) -> sm.MeshFile:
    return sm.MeshFile(file, edges_where={"root": lambda x: x[0] < 1e-9}, refine=refine)


def test_a_refined_file_is_the_finer_file(tmp_path: Path) -> None:
    def tip(of: sm.MeshFile) -> float:
        run = sm.run(clamped(of, "linear-statics"), pictures=False)
        return float(run.history["tip"].iloc[-1])

    here = tip(surface(on_file(tmp_path, 4, 2), 2))
    # what is lost to round-off in a thin strip
    assert here == pytest.approx(tip(surface(on_file(tmp_path, 8, 4))), rel=1e-8)


def test_meshes_of_files_have_errors(tmp_path: Path) -> None:
    # 2.6e-4 and 3.5e-4; on 4x2 elements the true error happens to be 4e-6
    file = on_file(tmp_path, 3, 2)
    run = sm.run(clamped(surface(file)), errors=True, pictures=False)
    right = sm.run(clamped(surface(file, 4)), pictures=False).history["tip"].iloc[-1]
    found = run.errors.loc["tip:end"]
    assert 0 < abs(found["value"] - right) <= found["error"] <= 10 * abs(found["value"] - right)
    with pytest.raises(sm.SceneError, match="refine is 0"):
        surface(file, 0)


def test_a_study_refines_meshes_of_files(tmp_path: Path) -> None:
    """A study without axes divides what a file has, and its errors are those of the mesh."""
    scene = clamped(surface(on_file(tmp_path, 4, 2)), "linear-statics")
    found = sm.study(scene, out=tmp_path / "study")
    assert list(found.table["divide"]) == [1, 2]
    assert found.findings[0].judged.not_refined == ()
    fine = clamped(surface(on_file(tmp_path, 16, 8)), "linear-statics")
    tips = [
        float(sm.run(each, pictures=False).history["tip"].iloc[-1])
        for each in (scene.with_options(divide=2), fine)
    ]
    # the reference is the finer file; round-off as above
    assert found.table["error"].iloc[1] == pytest.approx(abs(tips[0] / tips[1] - 1), rel=1e-4)


def test_what_is_divided(tmp_path: Path) -> None:
    """Elements of files, and counts of all other meshes; CAD has counts, too."""
    step = tmp_path / "part.step"
    step.write_text("")
    read = surface(on_file(tmp_path, 4, 2), 3)
    surfaces = {"read": read, "made": sm.GmshFile(step), "strip": sm.Rectangle(1.0, 0.2)}
    steel = sm.Isotropic(2e11, 0.3, thickness=0.01, density=7850.0)
    bodies = [sm.Shell(n, s, steel, mesh=(4, 2)) for n, s in surfaces.items()]
    section = sm.CircularSection(2e11, 0.3, radius=0.02, density=7850.0)
    beam = sm.Beam("beam", sm.Line((0, 1, 0), (1, 1, 0)), section)
    scene = sm.Scene("all", bodies, beams=beam, scheme="ep", t_end=1.0, dt=0.1)
    fine = scene.with_options(divide=2)
    assert fine.shells[0].surface.refine == 6
    assert [s.mesh for s in fine.shells] == [(4, 2), (8, 4), (8, 4)]
    assert fine.beams[0].elements == 2 * beam.elements
    one = scene.with_options(divide=2, body="made")
    assert [s.mesh for s in one.shells] == [(4, 2), (8, 4), (4, 2)]
    assert one.shells[0].surface.refine == 3
    assert scene.with_options(mesh=(6, 3), body="made").shells[1].mesh == (6, 3)
    with pytest.raises(sm.SceneError, match=r"mesh is \(6, 3\).*read from a file; divide refines"):
        scene.with_options(mesh=(6, 3))
    for wrong in (0, -1, 1.5):
        with pytest.raises(sm.SceneError, match=f"divide is {wrong}; it must be a whole number"):
            scene.with_options(divide=wrong)
    with pytest.raises(sm.SceneError, match="body is 'part'"):
        scene.with_options(divide=2, body="part")
