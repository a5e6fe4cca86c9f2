"""Decks of Nastran and Abaqus: details that change the mesh, and were passed over in silence."""

import re
import warnings
from pathlib import Path

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.meshes.files.abaqus import read_abaqus
from shellmb.meshes.mesh import build_surface
from shellmb.scene import MeshFile, Shell

from .strips import LENGTH, SECTION, WIDTH, area, built, of_abaqus, of_nastran

HALF = LENGTH * WIDTH / 2


def deck(folder: Path, old: str = "", new: str = "", kind: str = "CQUAD4", order: int = 1) -> Path:
    """The strip in free fields, with something in place of something else."""
    file = folder / "a.bdf"
    of_nastran(kind, "free", order)(file)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    return file


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("GRID,2,", "=,*1,=,*1.,==\nGRID,2,", "repeats the card before it"),
        # NASTRAN takes what is behind the eighth field for the name of the next line
        ("\nENDDATA", "\nCQUAD4,99,7,1,4,5,2,0.,0.,,77\nENDDATA", "has more than 8 fields"),
        ("\nENDDATA", "\nGRID*,99,0,1.,2.,3.,4.\nENDDATA", "has more than 4 fields"),
        (
            "\nENDDATA",
            "\nCQUAD8,99,7,1,2,3,4,5,6,+A\n+B,7,8\nENDDATA",
            "CQUAD8 99 goes on in a line 'A', but the next one is '+B'",
        ),
        (
            "\nENDDATA",
            "\n" + f"{'GRID*':8s}{99:16d}{0:16d}{1.0:16f}{2.0:16f}*X\n*Y{3.0:22f}\nENDDATA",
            "GRID 99 goes on in a line 'X', but the next one is '*Y'",
        ),
        ("\nENDDATA", "\n  include 'no.bdf'\nENDDATA", "includes 'no.bdf'; there is no such"),
    ],
)
def test_lines_of_nastran_that_mean_something_else(old, new, said, tmp_path: Path) -> None:
    """Kind: a line that is read as another card, or as a part of it."""
    with pytest.raises(SceneError, match=re.escape(said)):
        built(MeshFile(deck(tmp_path, old, new)))


def test_lines_of_nastran_that_are_right(tmp_path: Path) -> None:
    """Names of continuations, numbers of lines, long cards of which no mesh is made."""
    lines = [
        "SPC1,1,123456,1,2,3,4,5,6,7,8,9,10",
        "SET,1,=,2",
        f"{'CQUAD4':8s}" + "".join(f"{v:8d}" for v in (9, 9, 11, 14, 15, 12)) + " " * 16 + "00012",
        f"{'GRID*':8s}{99:16d}{0:16d}{1.0:16f}{2.0:16f}*X\n*X      {3.0:16f}",
    ]
    file = deck(tmp_path, "CQUAD4,8,", "$ replaced,", order=1)
    file.write_text(file.read_text().replace("ENDDATA", "\n".join([*lines, "ENDDATA"])))
    mesh = built(MeshFile(file))
    # the last of eight is written in small fields
    assert area(mesh) == pytest.approx(LENGTH * WIDTH, rel=1e-12)


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("PCOMP,7,0.0,,,,,,\n,1,0.02,0.,,1,0.03,90.,", "4 Z0 of PCOMP"),
        ("PCOMP,7,-0.025,,,,,,\n,1,0.02,0.,,1,0.03,90.,", None),
        ("PCOMP,7,,,,,,,\n,1,0.02,0.,,1,0.03,90.,", None),
        # half of the plies, which have the thickness of the first
        ("PCOMP,7,-0.04,,,,,,SYM\n,1,0.02,0.,,1,,90.,", None),
        ("PCOMP,7,-0.02,,,,,,SYM\n,1,0.02,0.,,1,,90.,", "4 Z0 of PCOMP"),
        ("PCOMP,8,0.0,,,,,,\n,1,0.02,0.,,1,0.03,90.,", None),
        ("PSHELL,7,1,0.05,1,,1\n,,,,,0.01", "4 ZOFFS of PSHELL"),
        ("PSHELL,7,1,0.05,1,,1,,0.\n,-0.025,0.025", None),
    ],
)
def test_offsets_that_properties_have_are_named(card, said, tmp_path: Path) -> None:
    """Kind: shells beside their nodes, by whatever card."""
    file = deck(tmp_path, "\nENDDATA", f"\n{card}\nENDDATA")
    if said is None:
        built(MeshFile(file))
        return
    with pytest.warns(ShellmbWarning, match=said):
        built(MeshFile(file))


def test_offsets_of_abaqus_that_are_none(tmp_path: Path) -> None:
    file = tmp_path / "a.inp"
    of_abaqus("S4")(file)
    file.write_text(file.read_text() + "*Shell Section, elset=skin, offset=0.\n0.1, 5\n")
    built(MeshFile(file))


# --- Abaqus: parts, instances, sets ---------------------------------------------------------------
def model(folder: Path, assembly: str, more: str = "") -> Path:
    """A part of 4 x 2 elements with the set `half`, and an assembly."""
    file = folder / "a.inp"
    of_abaqus("S4", part=True)(file)
    text = file.read_text()
    part = text[: text.index("*Assembly")].replace("*End Part", more + "*End Part")
    file.write_text(f"{part}*Assembly, name=A\n{assembly}\n*End Assembly\n")
    return file


TWO = """*Instance, name="One", part=strip
*End Instance
*Instance, name=Two, part=strip
0., 0., 3.
0., 0., 3., 0., 1., 3., 90.
*End Instance
"""


def area_of(file: Path, group: str) -> float:
    shell = Shell("strip", MeshFile(file, group=group), SECTION, mesh=(4, 2))
    return area(build_surface(shell, MPI.COMM_SELF))


@pytest.mark.parametrize(
    ("lines", "halves"),
    [
        ("*Elset, elset=chosen, instance=Two\nhalf,", 1),
        ("*Elset, elset=chosen, instance=ONE\n1, 2, 3, 4\n", 1),
        ("*Elset, elset=chosen\nOne.half, two.Half", 2),
        ("*Elset, elset=chosen\nOne.1, One.2, One.3, One.4", 1),
        (
            "*Elset, elset=a, instance=One, generate\n1, 4\n*Elset, elset=b, instance=Two\n1, 2, "
            "3, 4\n*Elset, elset=chosen\na, b",
            2,
        ),
        ("*Elset, elset=chosen, instance=Two\nskin", 2),
    ],
)
def test_sets_of_assemblies_have_all_their_elements(lines, halves, tmp_path: Path) -> None:
    """Kind: names of elements and sets that were taken for unknown ones, which counted as empty."""
    with warnings.catch_warnings():
        # where both are chosen they are loose pieces
        warnings.simplefilter("ignore", ShellmbWarning)
        found = area_of(model(tmp_path, f"{TWO}{lines}\n"), "chosen")
    assert found == pytest.approx(halves * HALF, rel=1e-9)


@pytest.mark.parametrize(
    ("lines", "more", "said"),
    [
        (TWO + "*Elset, elset=chosen\nThree.half", "", "the set 'chosen' has 'Three.half' in it"),
        (TWO + "*Elset, elset=chosen, instance=One\nhalves", "", "'chosen' has 'halves' in it"),
        ("", "*Elset, elset=chosen\nlater\n*Elset, elset=later\n1\n", "'chosen' has 'later' in it"),
        ("*Instance, name=I, part=plate\n*End Instance\n", "", "of the part 'plate', which is not"),
        ("*Instance, name=I, library=old\n*End Instance\n", "", "is of another run"),
        (TWO, "*Imperfection, file=buckling, step=1\n1, 0.1\n", r"*IMPERFECTION is not read"),
    ],
)
def test_what_is_not_there_is_no_empty_set(lines, more, said, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=re.escape(said)):
        built(MeshFile(model(tmp_path, lines, more)))


def test_instances_with_meshes_of_their_own(tmp_path: Path) -> None:
    """Two of one empty part: each has its own nodes and elements, and is placed for itself."""
    place = "*Node\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, {x}, 1., 0.\n4, 0., 1., 0.\n"
    lines = "*Part, name=p\n*End Part\n*Assembly, name=A\n"
    for name, x, move in (("one", 1.0, "0., 0., 0."), ("two", 2.0, "0., 0., 5.")):
        lines += f"*Instance, name={name}, part=p\n{move}\n{place.format(x=x)}"
        lines += f"*Element, type=S4R, elset={name}\n1, 1, 2, 3, 4\n*End Instance\n"
    file = tmp_path / "own.inp"
    file.write_text(lines + "*End Assembly\n")
    for name, size, z in (("one", 1.0, 0.0), ("two", 1.5, 5.0)):
        shell = Shell("s", MeshFile(file, group=name), SECTION)
        mesh = build_surface(shell, MPI.COMM_SELF)
        assert area(mesh) == pytest.approx(size, rel=1e-12)
        np.testing.assert_allclose(mesh.mesh.geometry.x[:, 2], z, atol=1e-12)


# places of an instance, and where the node at (1, 0, 0) is then, worked out by hand: translated,
# then turned by degrees, right-handed about the line from one point to another
MOVES = {
    "where it is": ("", (1.0, 0.0, 0.0)),
    "translated": ("10., 20., 30.\n", (11.0, 20.0, 30.0)),
    "turned": ("0., 0., 0.\n0., 0., 0., 0., 0., 2., 90.\n", (0.0, 1.0, 0.0)),
    "turned the other way": ("0., 0., 0.\n0., 0., 2., 0., 0., 0., 90.\n", (0.0, -1.0, 0.0)),
    "both": ("10., 20., 30.\n10., 20., 0., 10., 20., 5., 90.\n", (10.0, 21.0, 30.0)),
    "about a line apart": ("3., 0., 0.\n2., 0., 0., 2., 0., -1., 90.\n", (2.0, -2.0, 0.0)),
    "by a third": ("0., 0., 0.\n0., 0., 0., 1., 1., 1., 120.\n", (0.0, 1.0, 0.0)),
}


@pytest.mark.parametrize("case", MOVES)
def test_instances_are_where_the_file_says(case: str, tmp_path: Path) -> None:
    """Kind: each of translation, axis, sense and centre of the rotation of an instance."""
    move, wanted = MOVES[case]
    file = tmp_path / "a.inp"
    file.write_text(
        "*Part, name=p\n*Node\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 1., 1., 0.\n"
        "*Element, type=S3\n1, 1, 2, 3\n*End Part\n*Assembly, name=A\n"
        f"*Instance, name=i, part=p\n{move}*End Instance\n*End Assembly\n"
    )
    x = read_abaqus(file).x
    assert np.linalg.norm(x - wanted, axis=1).min() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("ending", ["bdf", "inp"])
@pytest.mark.parametrize(("files", "said"), [(12, ""), (101, ""), (102, "at most 100 deep")])
def test_files_may_include_one_another_deeply(
    ending: str, files: int, said: str, tmp_path: Path
) -> None:
    """Eleven files one in the other are no circle; a file within itself is."""
    first = tmp_path / f"0.{ending}"
    (of_nastran("CQUAD4", "free") if ending == "bdf" else of_abaqus("S4"))(first)
    text = first.read_text()
    for k in range(files - 1):
        name = f"{k + 1}.{ending}"
        line = f"INCLUDE '{name}'\n" if ending == "bdf" else f"*Include, input={name}\n"
        (tmp_path / f"{k}.{ending}").write_text(line)
    (tmp_path / f"{files - 1}.{ending}").write_text(text)
    if said:
        with pytest.raises(SceneError, match=said):
            built(MeshFile(first))
        return
    assert area(built(MeshFile(first))) == pytest.approx(LENGTH * WIDTH, rel=1e-12)
    (tmp_path / f"{files - 1}.{ending}").write_text(line.replace(name, f"1.{ending}"))
    with pytest.raises(SceneError, match="the files go round in a circle"):
        built(MeshFile(first))
