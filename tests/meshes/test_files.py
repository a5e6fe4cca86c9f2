"""What is read from which format: a small file of each row of the table of `docs/howto/cad.md`."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    EdgeForce,
    GmshFile,
    MeshFile,
    Probe,
    Rectangle,
    Scene,
    Shell,
)
from shellmb.scene.shells.gmsh_surfaces import READ

from .strips import (
    LENGTH,
    SECTION,
    WIDTH,
    area,
    built,
    cells_of,
    grid,
    halves,
    of_abaqus,
    of_gmsh,
    of_meshio,
    of_nastran,
    with_middles,
)

# format -> ending, writer, cell, numbers of cells, group that half of them has
FORMATS: dict[str, tuple[str, Callable[[Path], None], str, int, str | None]] = {
    "VTK text": ("vtk", of_meshio("quad", 1, binary=False), "quad", 8, None),
    "VTK binary": ("vtk", of_meshio("triangle", 1, binary=True), "tri", 16, None),
    "VTK quad8": ("vtk", of_meshio("quad8", 2), "quad", 8, None),
    "VTU": ("vtu", of_meshio("quad", 1), "quad", 8, None),
    "VTU quad9": ("vtu", of_meshio("quad9", 2), "quad", 8, None),
    "VTU triangle6": ("vtu", of_meshio("triangle6", 2), "tri", 16, None),
    "STL text": ("stl", of_meshio("triangle", 1, binary=False), "tri", 16, None),
    "STL binary": ("stl", of_meshio("triangle", 1, binary=True), "tri", 16, None),
    "gmsh 2 text": ("msh", of_gmsh(2.2, 0, 1), "quad", 8, "half0"),
    "gmsh 2 binary": ("msh", of_gmsh(2.2, 1, 2), "quad", 8, "half0"),
    "gmsh 4 text": ("msh", of_gmsh(4.1, 0, 2), "quad", 8, "half0"),
    "gmsh 4 binary": ("msh", of_gmsh(4.1, 1, 1), "quad", 8, "half0"),
    "gmsh 4 quad8": ("msh", of_gmsh(4.1, 0, 2, 1), "quad", 8, "half0"),
    "Nastran": ("bdf", of_nastran("CQUAD4", "small"), "quad", 8, "PID 7"),
    "Nastran large": ("nas", of_nastran("CQUAD4", "large"), "quad", 8, "PID 7"),
    "Nastran free": ("dat", of_nastran("CQUADR", "free"), "quad", 8, "PID 7"),
    "Nastran CQUAD8": ("bdf", of_nastran("CQUAD8", "small", 2), "quad", 8, "PID 7"),
    "Nastran CQUAD8 large": ("bdf", of_nastran("CQUAD8", "large", 2), "quad", 8, "PID 7"),
    "Nastran CTRIA3": ("fem", of_nastran("CTRIA3", "large"), "tri", 16, "PID 7"),
    "Nastran CTRIAR": ("bdf", of_nastran("CTRIAR", "free"), "tri", 16, "PID 7"),
    "Nastran CTRIA6": ("bdf", of_nastran("CTRIA6", "small", 2), "tri", 16, "PID 7"),
    "Abaqus S4R": ("inp", of_abaqus("S4R"), "quad", 8, "half"),
    "Abaqus S8": ("inp", of_abaqus("S8", 2), "quad", 8, "BOTH"),
    "Abaqus S8R": ("inp", of_abaqus("S8R", 2, True), "quad", 8, "half"),
    "Abaqus S3": ("inp", of_abaqus("S3", 1, True), "tri", 16, "half"),
    "Abaqus S6": ("inp", of_abaqus("S6", 2), "tri", 16, "half"),
    "Abaqus STRI65": ("inp", of_abaqus("STRI65", 2), "tri", 16, "half"),
}


@pytest.mark.parametrize("name", FORMATS)
def test_formats(tmp_path: Path, name: str) -> None:
    ending, write, cell, count, half = FORMATS[name]
    file = tmp_path / f"strip.{ending}"
    write(file)
    kinds: list[Any] = [MeshFile] + ([GmshFile] if ending == "msh" else [])
    for kind in kinds:
        group = None if kind is MeshFile or half is None else ("half0", "half1")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            mesh = built(kind(file, scale=0.5, group=group), cell)
        x = mesh.mesh.geometry.x
        assert cells_of(mesh) == count
        assert area(mesh) == pytest.approx(LENGTH * WIDTH / 4, rel=1e-6)
        # STL has single precision, small fields have six digits
        assert np.ptp(x, axis=0) == pytest.approx((LENGTH / 2, WIDTH / 2, 0.0), abs=1e-6)
        sides = mesh.cell_normal_sign
        turned = built(kind(file, flip=True, group=group), cell).cell_normal_sign
        assert (turned == -sides).all()
        if half is not None:
            part = (
                built(kind(file, group=half.lower() if half == "BOTH" else half), cell)
                if (half != "BOTH")
                else built(kind(file, group="Both"), cell)
            )
            assert cells_of(part) == count // 2
            assert np.ptp(part.mesh.geometry.x, axis=0)[0] == pytest.approx(LENGTH / 2, abs=1e-5)
            areas = mesh.areas["Both" if half == "BOTH" else half]
            assert len(areas) == count // 2
        if ending == "msh":
            assert len(mesh.edges["root"]) == 2
        with pytest.raises(SceneError, match="no set of cells 'nobody'"):
            built(kind(file, group="nobody"), cell)


@pytest.mark.parametrize("ending", ["med", "unv", "step", "brep"])
def test_formats_of_gmsh(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"strip.{ending}"
    of_gmsh(4.1, 0, 1)(file)
    grouped = ending in ("med", "unv")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh = built(GmshFile(file, scale=0.5, group=("half0", "half1") if grouped else None))
    size = np.ptp(mesh.mesh.geometry.x, axis=0)
    assert size[:2] / size[0] == pytest.approx((1, WIDTH / LENGTH), rel=1e-6)
    assert area(mesh) == pytest.approx(size[0] * size[1], rel=1e-6)
    assert len(mesh.areas) == (2 if grouped else 0)
    if grouped:
        assert cells_of(mesh) == 8


def test_the_documentation_has_all_of_them() -> None:
    page = (Path(__file__).parents[2] / "docs/howto/cad.md").read_text()
    for ending in ("med", "unv", "step", "brep", *(ending for ending, *_ in FORMATS.values())):
        assert f"`.{ending}`" in page
    for word in ("CQUAD8", "CTRIA6", "CTRIAR", "CQUADR", "S8R", "STRI65", "S6", "program"):
        assert word in page


def curved(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """A quarter of a cylinder of four elements with nodes on it."""
    points, cells = with_middles(*grid(4, 1), kind == "quad9")
    angle = np.pi / 2 * points[:, 0] / LENGTH
    return np.stack([np.cos(angle), np.sin(angle), points[:, 1]], axis=1), cells


def test_the_middle_of_eight_nodes_is_on_the_surface(tmp_path: Path) -> None:
    found = []
    for kind in ("quad8", "quad9"):
        points, cells = curved(kind)
        if kind == "quad9":
            angle = np.arctan2(points[cells[:, 8], 1], points[cells[:, 8], 0])
            points[cells[:, 8], 0], points[cells[:, 8], 1] = np.cos(angle), np.sin(angle)
        file = tmp_path / f"{kind}.vtk"
        meshio.write_points_cells(file, points, [(kind, cells)])
        found.append(area(built(MeshFile(file))))
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    # quadratic elements over 22.5 degrees are 1.5e-5 off an arc
    assert found[0] == pytest.approx(np.pi / 2, rel=1e-4)


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize("order", [1, 2])
def test_quadrilaterals_and_triangles_are_one_shell(tmp_path: Path, cell: Any, order: int) -> None:
    """Cut into one kind of cell, they bend as the strip of one kind does."""
    points, quads = grid()
    triangles, quads = halves(quads[4:]), quads[:4]
    blocks: list[Any] = [("quad", quads), ("triangle", triangles)]
    if order == 2:
        points, triangles = with_middles(points, triangles)
        more, quads = with_middles(points, quads)
        blocks, points = [("quad8", quads), ("triangle6", triangles)], more
    file = tmp_path / "strip.vtk"
    meshio.write_points_cells(file, points, blocks)
    ends = {"root": lambda x: x[0] < 1e-9, "tip": lambda x: x[0] > LENGTH - 1e-9}

    def tip(surface: Any, names: Any, kind: Any, mesh: Any) -> float:
        shell = Shell("strip", surface, SECTION, cell=kind, mesh=mesh)
        scene = Scene(
            "strip",
            shell,
            supports=Clamped(names[0]),
            loads=EdgeForce(names[1], (0, 0, 1.0)),
            probes=Probe("tip", (LENGTH, WIDTH / 2, 0.0)),
            scheme="linear-statics",
        )
        return float(execute(scene).column("tip")[-1])

    with pytest.warns(ShellmbWarning) as said:
        mixed = tip(MeshFile(file, edges_where=ends), ("root", "tip"), cell, (4, 2))
    (text,) = [str(w.message) for w in said if " cut " in str(w.message)]
    assert "4 quadrilaterals and 8 triangles, and cell is '" in text
    regular = tip(Rectangle(LENGTH, WIDTH), ("left", "right"), "quad", (8, 4))
    # other meshes of one strip; 4x2 and 8x4 quadrilaterals differ by 0.2 %, triangles by 2 %
    assert mixed == pytest.approx(regular, rel=1e-2 if cell == "quad" else 5e-2)


def test_a_program_for_gmsh_is_no_mesh(tmp_path: Path) -> None:
    """A file is read as what its ending says; only `.geo` is run."""
    ran = tmp_path / "ran"
    script = f'SystemCall "touch {ran}";\nRectangle(1) = {{0, 0, 0, 1, 1}};\n'
    for ending in (
        "msh",
        "step",
        "Step",
        "BREP",
        "iges",
        "Msh",
        "med",
        "unv",
        "stl",
        "txt",
        "pos",
        "vtk",
        "gz",
        "geo_unrolled",
        "Geo_Unrolled",
        "opt",
        "pro",
        "geo~",
        "xao",
        "brp",
        "mesh",
        "bdf",
    ):
        file = tmp_path / f"mesh.{ending}"
        for begin in (
            "",
            "\n\n",
            "// $MeshFormat\n",
            "\n$MeshFormat\n",
            "$MeshFormats\n",
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n",
            "$Comments\n$EndComments\n",
            "$NOD\n",
        ):
            file.write_text(begin + script)
            for kind in (GmshFile, MeshFile):
                with pytest.raises(SceneError), warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    built(kind(file), "tri")
    assert not ran.exists()
    # no ending but these is read at all, and the page lists them
    page = (Path(__file__).parents[2] / "docs/howto/cad.md").read_text()
    assert all(f"`{ending}`" in page for ending in READ)
    with pytest.raises(SceneError, match=r"geo_unrolled' is a program .* name it \.geo"):
        GmshFile(tmp_path / "mesh.geo_unrolled")
    with pytest.raises(SceneError, match=r"does not begin as a mesh .* must be named \.geo"):
        (tmp_path / "mesh.msh").write_text(script)
        GmshFile(tmp_path / "mesh.msh")


@pytest.mark.parametrize("ending", ["msh", "step", "BREP"])
def test_programs_beside_a_mesh_are_not_run(ending, tmp_path: Path) -> None:
    """Kind: files that nobody named, which a reader looks for beside the one that it is given."""
    import gmsh

    ran, file = tmp_path / "ran", tmp_path / f"mesh.{ending}"
    gmsh.initialize(["writes"], False, False, False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    if ending == "msh":
        gmsh.model.mesh.generate(2)
    gmsh.write(str(tmp_path / f"mesh.{ending.lower()}"))
    gmsh.finalize()
    (tmp_path / f"mesh.{ending.lower()}").rename(file)
    for beside in (f"{file}.opt", f"{file}.geo", f"{file}.pos", file.with_suffix(".opt")):
        Path(beside).write_text(f'SystemCall "touch {ran}";\n')
    found = built(GmshFile(file), "tri")
    assert len(found.mesh.geometry.x) > 8
    assert not ran.exists()


ENDINGS = ("off", "vtk", "vtu", "obj", "ply", "mdpa")


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("node", [-1, 3])
def test_cells_have_nodes_that_the_file_has(tmp_path: Path, ending: str, node: int) -> None:
    """Kind: a damaged file whose cells name nodes that it has not; -1 would be the last one."""
    path = tmp_path / f"damaged.{ending}"
    meshio.write(path, meshio.Mesh(np.eye(3), [("triangle", np.array([[0, 1, node]]))]))
    with pytest.raises(SceneError, match=f"with node {node}, counted from 0; there are 3 nodes"):
        built(MeshFile(path), cell="tri")


@pytest.mark.parametrize("ending", ["obj", "stl", "mdpa", "msh"])
def test_a_file_without_a_mesh_is_refused(tmp_path: Path, ending: str) -> None:
    """Kind: a file that its reader takes, and finds nothing in."""
    path = tmp_path / f"notes.{ending}"
    path.write_text("of a mesh, some notes\n")
    with pytest.raises(SceneError, match=r"notes\.\w+ (has no nodes|is not read)"):
        built(MeshFile(path), cell="tri")


@pytest.mark.parametrize("ending", ["ply", "node", "tec"])
def test_readers_that_wait_for_more_come_to_an_end(ending, tmp_path, monkeypatch) -> None:
    """Kind: files that are cut off, at whose end readers of meshio turn in circles."""
    file = tmp_path / f"a.{ending}"
    if ending == "node":
        file.touch()
    else:
        of_meshio("quad", 1)(file)
        content = file.read_bytes()
        end = content.index(b"end_header") if ending == "ply" else len(content) - 20
        file.write_bytes(content[:end])
    monkeypatch.setattr("shellmb.meshes.files.meshio_files.LEAST", 0.2)
    with pytest.raises(SceneError, match=r"a\.\w+ is not read .* as if it were cut off"):
        built(MeshFile(file))
