"""Decks of Nastran and Abaqus: coordinate systems, what is left out, what is wrong."""

from pathlib import Path
from typing import Any

from mpi4py import MPI

import meshio
import numpy as np
import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.meshes.mesh import SurfaceMesh, build_surface
from shellmb.scene import Isotropic, MeshFile, Orthotropic, Shell

from .strips import LENGTH, WIDTH, area, built, card, grid, of_abaqus, of_nastran


def test_coordinate_systems_of_nastran(tmp_path: Path) -> None:
    """Chains of all kinds lead to the same quarter of a cylinder, in axes of the deck's own."""
    turn = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, -1], [3, 0, 1]]))[0]
    turn *= np.linalg.det(turn)
    origin = np.array([10.0, -3.0, 2.0])
    polar = [(1.0, theta, z) for theta in np.linspace(0, 90, 5) for z in (0.0, 1.0)]
    local = np.array(
        [(r * np.cos(np.radians(t)), r * np.sin(np.radians(t)), z) for r, t, z in polar]
    )
    right = origin + local @ turn
    # spherical coordinates of the same places
    size = np.linalg.norm(local, axis=1)
    ball = np.stack(
        [
            size,
            np.degrees(np.arccos(local[:, 2] / size)),
            np.degrees(np.arctan2(local[:, 1], local[:, 0])),
        ],
        axis=1,
    )
    axes = [*origin, *(origin + turn[2]), *(origin + turn[0] + 0.3 * turn[2])]
    plain = [0.0, 0, 0, 0, 0, 2, 3, 0, 1]

    def deck(system: int, places: Any, cards: Any, style: str, usual: bool = False) -> Path:
        lines = ["BEGIN BULK", *(card(*c, style=style) for c in cards)]
        if usual:
            lines.append(card("GRDSET", "", system, "", "", "", "", style=style))
        for k, place in enumerate(places):
            named = "" if usual else system
            lines.append(
                card("GRID", k + 1, named, *(float(f"{v:.10g}") for v in place), style=style)
            )
        for k in range(4):
            nodes = 2 * k + np.array([1, 3, 4, 2])
            lines.append(card("CQUAD4", k + 1, 1, *nodes, style=style))
        file = tmp_path / f"{system}{style}{usual}.bdf"
        # nodes that define systems belong to no element
        file.write_text("\n".join([*lines, "ENDDATA", ""]))
        return file

    def of(kind: str, cid: int, base: int, points: Any) -> tuple[Any, ...]:
        return (f"CORD2{kind}", cid, base, *map(float, points))

    node = [("GRID", 90 + k, 0, *map(float, p)) for k, p in enumerate(np.reshape(axes, (3, 3)))]
    cases = [
        (1, polar, [of("C", 1, 0, axes)], False),
        (1, polar, [of("C", 1, 0, axes)], True),
        (2, ball, [of("S", 2, 0, axes)], False),
        (3, local, [of("R", 3, 0, axes)], False),
        # a cylindrical system in a rectangular one; and by nodes, with a second one on the card
        (4, polar, [of("C", 4, 3, plain), of("R", 3, 0, axes)], False),
        (5, polar, [*node, ("CORD1C", 5, 90, 91, 92, 6, 90, 91, 92)], False),
        (6, ball, [*node, ("CORD1S", 5, 90, 91, 92, 6, 90, 91, 92)], False),
        # axes given in a cylindrical system: r, theta, z
        (7, polar, [of("C", 7, 1, [0, 0, 0, 0, 0, 1, 1, 0, 0]), of("C", 1, 0, axes)], False),
    ]
    for style in ("large", "free"):
        for system, places, cards, usual in cases:
            mesh = built(MeshFile(deck(system, places, cards, style, usual)))
            x = mesh.mesh.geometry.x
            away = np.linalg.norm(x[:, None] - right, axis=2)
            # six digits of a field
            assert away.min(axis=1) == pytest.approx(0, abs=1e-4), (style, system)
            assert away.min(axis=0) == pytest.approx(0, abs=1e-4), (style, system)
    for cards, said in (
        ([], "GRID 1 is given in the coordinate system 8, which the deck does not define"),
        ([("CORD3G", 8, "E301", 0, 0)], "the coordinate system CORD3G 8; it must be one of CORD1R"),
        ([of("C", 8, 9, plain), of("R", 9, 8, plain)], "is defined by itself"),
        ([of("C", 8, 0, [0.0, 0, 0, 0, 0, 1, 0, 0, 2])], "are on one line"),
    ):
        with pytest.raises(SceneError, match=said):
            built(MeshFile(deck(8, polar, cards, "free")))


def test_what_is_no_shell_is_named(tmp_path: Path) -> None:
    deck, model, lines = tmp_path / "a.bdf", tmp_path / "a.inp", tmp_path / "a.vtk"
    of_nastran("CQUAD4", "small")(deck)
    more = [
        card("CBAR", 90, 2, 1, 4, 0.0, 0.0, 1.0, style="small"),
        card("CONM2", 91, 1, 0, 2.0, style="small"),
        card("RBE2", 92, 1, 123, 2, 3, style="small"),
        card("CORD2R", 1, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, style="small"),
    ]
    text = deck.read_text()
    deck.write_text(text.replace("ENDDATA", "\n".join([*more, "ENDDATA"])))
    with pytest.warns(
        ShellmbWarning, match=r"no shells are omitted: 1 CBAR, 1 CONM2, 1 RBE2; add those"
    ):
        built(MeshFile(deck))
    of_abaqus("S4R")(model)
    extra = ["*Element, type=B31", "90, 1, 2", "91, 2, 3", "*Tie, name=t", "a, b"]
    model.write_text(model.read_text() + "\n".join(extra))
    with pytest.warns(ShellmbWarning, match=r"no shells are omitted: 1 \*TIE, 2 B31;"):
        built(MeshFile(model))
    points, quads = grid()
    meshio.write_points_cells(lines, points, [("quad", quads), ("line", quads[:3, :2])])
    with pytest.warns(ShellmbWarning, match="no shells are omitted: 3 cells 'line'"):
        built(MeshFile(lines))


def test_offsets_of_elements_are_named(tmp_path: Path) -> None:
    deck, model = tmp_path / "a.bdf", tmp_path / "a.inp"
    of_nastran("CQUAD4", "free")(deck)
    text = deck.read_text().replace("\nCQUAD4,1,7,1,4,5,2", "\nCQUAD4,1,7,1,4,5,2,0.,1.5-3")
    deck.write_text(text)
    with pytest.warns(ShellmbWarning, match="1 ZOFFS of CQUAD4"):
        built(MeshFile(deck))
    of_abaqus("S4")(model)
    model.write_text(model.read_text() + "*Shell Section, elset=skin, offset=0.5\n0.1, 5\n")
    with pytest.warns(ShellmbWarning, match=r"1 OFFSET of \*SHELL SECTION"):
        built(MeshFile(model))


FIBRES = Orthotropic(E1=1e10, E2=1e9, nu12=0.3, G12=5e8, G13=5e8, G23=4e8, thickness=1e-3)


def along(surface: MeshFile, cell: Any, section: Any = FIBRES, **options: Any) -> SurfaceMesh:
    return build_surface(Shell("s", surface, section, cell=cell, **options), MPI.COMM_SELF)


@pytest.mark.parametrize(
    ("element", "given", "count"),
    [
        ("CQUAD4", "30.", 1),
        ("CQUAD4", "5", 1),
        ("CQUAD4", "0", 1),
        ("CQUAD4", "0.", 0),
        ("CTRIA3", "-45.0", 1),
        ("S4", "", 8),
    ],
)
def test_directions_of_elements_are_refused(element, given, count, tmp_path: Path) -> None:
    """Kind: what a file says of an element that its section depends on: angles, and systems."""
    file, cell = tmp_path / ("a.bdf" if given else "a.inp"), "tri" if "TRI" in element else "quad"
    if given:
        of_nastran(element, "free")(file)
        lines = file.read_text().splitlines()
        first = next(k for k, line in enumerate(lines) if line.startswith(element))
        lines[first] += f",{given}"
        file.write_text("\n".join(lines))
    else:
        of_abaqus(element)(file)
        more = "*Shell Section, elset=SKIN, orientation=fibres\n0.1, 5\n"
        file.write_text(file.read_text() + more)
    surface = MeshFile(file)
    along(surface, cell, Isotropic(1e9, 0.3, thickness=1e-3))
    along(surface, cell, direction=(1, 0, 0))
    if not count:
        along(surface, cell)
        return
    with pytest.raises(SceneError, match=rf"{count} elements .*not read; direction must be"):
        along(surface, cell)


@pytest.mark.parametrize(
    ("ending", "old", "new", "said"),
    [
        ("bdf", "ENDDATA", "CQUAD4,99,7,1,2,77,3\nENDDATA", "CQUAD4 99 has the node 77 in field 5"),
        (
            "bdf",
            "ENDDATA",
            "CQUAD4,99,7,1,2,x,3\nENDDATA",
            "field 5 of CQUAD4 99 7 is 'x'; it must",
        ),
        (
            "bdf",
            "ENDDATA",
            "GRID,99,,1.0,one\nENDDATA",
            "field 4 of GRID 99 .* 'one'; it must be a",
        ),
        ("bdf", "ENDDATA", "INCLUDE 'no.bdf'\nENDDATA", "includes 'no.bdf'; there is no such file"),
        ("bdf", "ENDDATA", "INCLUDE 'a.bdf'\nENDDATA", "the files go round in a circle"),
        ("inp", "*Elset", "*Ngen\n1, 3, 1\n*Elset", r"\*NGEN is not read; write nodes"),
        ("inp", "*Node", "*Node, system=C", r"\*NODE, SYSTEM is not read"),
        ("inp", "*Node", "*Node, input=n.txt", r"\*NODE, INPUT is not read"),
        ("inp", "*Heading", "*Include, input=no.inp", "includes 'no.inp'; there is no such file"),
        ("bdf", "ENDDATA", "GRID,1,,5.,5.,5.\nENDDATA", "GRID 1 is there twice and differs"),
        (
            "bdf",
            "ENDDATA",
            "CORD2R,5,0,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n"
            "CORD2R,5,0,1.,0.,0.,0.,0.,1.\n,1.,0.,0.\nENDDATA",
            "CORD2R 5 is there twice and differs",
        ),
        ("inp", "*Elset", "*Node\n1, 5., 5., 5.\n*Elset", "node 1 is there twice, at different"),
        # a second block that is numbered from one again took the place of the first, in silence
        (
            "inp",
            "*Elset",
            "*Element, type=S4\n1, 2, 5, 6, 3\n*Elset",
            "element 1 is there twice, with different nodes",
        ),
        ("inp", "8, 11, 14, 15, 12", "8, 11, 14, 15, 77", "element 8 has the node 77"),
        ("inp", "8, 11, 14, 15, 12", "8, 11, 14, 15, a", r"the lines of \*ELEMENT are not read"),
    ],
)
def test_files_that_are_wrong(tmp_path: Path, ending: str, old: str, new: str, said: str) -> None:
    file = tmp_path / f"a.{ending}"
    (of_nastran("CQUAD4", "free") if ending == "bdf" else of_abaqus("S4"))(file)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(SceneError, match=said):
        built(MeshFile(file))


def test_nodes_that_are_written_twice_alike_are_one(tmp_path: Path) -> None:
    deck, model = tmp_path / "a.bdf", tmp_path / "a.inp"
    of_nastran("CQUAD4", "free")(deck)
    deck.write_text(deck.read_text().replace("ENDDATA", "GRID,1,0,0.,0.0,0.,0,\nENDDATA"))
    of_abaqus("S4")(model)
    model.write_text(model.read_text() + "*Node\n1, 0., 0.\n*Element, type=S4\n1, 1, 4, 5, 2\n")
    for file in (deck, model):
        assert area(built(MeshFile(file))) == pytest.approx(LENGTH * WIDTH, rel=1e-12)


def test_included_files_and_middles_left_empty(tmp_path: Path) -> None:
    deck, model = tmp_path / "a.bdf", tmp_path / "a.inp"
    of_nastran("CQUAD8", "free", 2)(deck)
    lines = deck.read_text().splitlines()
    grids = [line for line in lines if line.startswith("GRID")]
    (tmp_path / "more").mkdir()
    (tmp_path / "more/nodes.bdf").write_text("\n".join(grids))
    rest = [line for line in lines if not line.startswith("GRID")]
    at = rest.index("BEGIN BULK") + 1
    rest.insert(at, "INCLUDE 'more/nodes.bdf'")
    # fields seven and eight are the last of the card's first line
    k = next(i for i, line in enumerate(rest) if line.startswith("CQUAD8,1,"))
    rest[k + 1] = "+,,"
    deck.write_text("\n".join(rest))
    assert area(built(MeshFile(deck, merge=1e-2))) == pytest.approx(LENGTH * WIDTH, rel=1e-6)
    of_abaqus("S4")(model)
    text = model.read_text()
    a, b = text.index("*Node"), text.index("*Element")
    (tmp_path / "more/nodes.inp").write_text(text[a:b])
    model.write_text(text[:a] + "*INCLUDE, INPUT=more/nodes.inp\n" + text[b:])
    assert area(built(MeshFile(model))) == pytest.approx(LENGTH * WIDTH, rel=1e-6)


def test_sets_are_not_counted_up_without_end(tmp_path: Path) -> None:
    """Kind: a line of a deck that asks for more than a memory holds."""
    path = tmp_path / "endless.inp"
    path.write_text("*NODE\n1, 0, 0, 0\n*ELSET, ELSET=A, GENERATE\n1, 1000000000000, 1\n")
    with pytest.raises(SceneError, match=r"GENERATE goes from 1 to 1000000000000, beyond"):
        built(MeshFile(path), "tri")
