"""Small files of a strip in the formats that are read, and what is built of them."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mpi4py import MPI

import meshio
import numpy as np

from shellmb.meshes.mesh import SurfaceMesh, build_surface
from shellmb.scene import Isotropic, Shell

SECTION = Isotropic(E=1e7, nu=0.3, thickness=0.05)
LENGTH, WIDTH = 2.0, 1.0


def grid(m: int = 4, n: int = 2) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(np.linspace(0, LENGTH, m + 1), np.linspace(0, WIDTH, n + 1), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    first = np.array([(n + 1) * i + j for i in range(m) for j in range(n)])
    return points, first[:, None] + [0, n + 1, n + 2, 1]


def halves(quads: Any) -> np.ndarray:
    return np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3)


def with_middles(points: Any, cells: Any, centre: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Nodes in the middles of sides, and perhaps of cells, in the order of gmsh."""
    x, number, rows = list(points), {}, []
    for cell in cells.tolist():
        row = list(cell)
        for a, b in zip(cell, cell[1:] + cell[:1], strict=True):
            side = (min(a, b), max(a, b))
            if side not in number:
                number[side] = len(x)
                x.append((x[a] + x[b]) / 2)
            row.append(number[side])
        if centre:
            row.append(len(x))
            x.append(points[cell].mean(axis=0))
        rows.append(row)
    return np.array(x), np.array(rows)


def built(surface: Any, cell: Any = "quad", **options: Any) -> SurfaceMesh:
    return build_surface(
        Shell("strip", surface, SECTION, cell=cell, mesh=(4, 2), **options), MPI.COMM_SELF
    )


def cells_of(surface: SurfaceMesh) -> int:
    return int(surface.mesh.topology.index_map(2).size_global)


def area(surface: SurfaceMesh) -> float:
    from dolfinx import fem
    from ufl import dx

    return float(fem.assemble_scalar(fem.form(fem.Constant(surface.mesh, 1.0) * dx)))


def of_meshio(kind: str, order: int, **options: Any) -> Callable[[Path], None]:
    """Writes the strip with meshio."""

    def write(file: Path) -> None:
        points, cells = grid()
        if kind.startswith("triangle"):
            cells = halves(cells)
        if order == 2:
            points, cells = with_middles(points, cells, kind == "quad9")
        mesh = meshio.Mesh(points, [(kind, cells)])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            meshio.write(file, mesh, **options)

    return write


def of_gmsh(version: float, binary: int, order: int, incomplete: int = 0) -> Callable[[Path], None]:
    """Writes the strip with gmsh, with groups of both halves, an edge and a point."""

    def write(file: Path) -> None:
        import gmsh

        gmsh.initialize(["test", "-v", "0"], False, False, False)
        try:
            for name, value in (
                ("General.Terminal", 0),
                ("Mesh.MshFileVersion", version),
                ("Mesh.Binary", binary),
                ("Mesh.RecombineAll", 1),
                ("Mesh.SecondOrderIncomplete", incomplete),
            ):
                gmsh.option.setNumber(name, value)
            occ, model = gmsh.model.occ, gmsh.model
            parts = [(2, occ.addRectangle(k * LENGTH / 2, 0, 0, LENGTH / 2, WIDTH)) for k in (0, 1)]
            occ.fragment(parts[:1], parts[1:])
            occ.synchronize()
            for _, tag in model.getEntities(1):
                model.mesh.setTransfiniteCurve(tag, 3)
            for k, (_, tag) in enumerate(model.getEntities(2)):
                model.mesh.setTransfiniteSurface(tag)
                model.addPhysicalGroup(2, [tag], name=f"half{k}")
            for dim, tag in model.getEntities(1):
                if abs(model.getBoundingBox(dim, tag)[3]) < 1e-6:
                    model.addPhysicalGroup(1, [tag], name="root")
            model.mesh.generate(2)
            model.mesh.setOrder(order)
            if file.suffix in (".step", ".brep"):
                model.removePhysicalGroups()
            gmsh.write(str(file))
        finally:
            gmsh.finalize()

    return write


def card(*fields: Any, style: str) -> str:
    """A card of Nastran with small, large or free fields."""
    name, *rest = (f"{f:.6g}" if isinstance(f, float) else str(f) for f in fields)
    rest = [
        f if "." in f or not isinstance(v, float) else f + "."
        for f, v in zip(rest, fields[1:], strict=True)
    ]
    width, each, sep = {"small": (8, 8, ""), "large": (16, 4, ""), "free": (0, 8, ",")}[style]
    lines = [rest[k : k + each] for k in range(0, len(rest), each)]
    begins = [name + ("*" if style == "large" else "")]
    begins += [{"small": "+", "large": "*", "free": "+"}[style]] * (len(lines) - 1)
    if style == "free":
        return "\n".join(sep.join([b, *line]) for b, line in zip(begins, lines, strict=True))
    return "\n".join(
        f"{b:8s}" + "".join(f"{f:>{width}s}" for f in line)
        for b, line in zip(begins, lines, strict=True)
    )


def of_nastran(name: str, style: str, order: int = 1) -> Callable[[Path], None]:
    def write(file: Path) -> None:
        points, cells = grid()
        if "TRIA" in name:
            cells = halves(cells)
        if order == 2:
            points, cells = with_middles(points, cells)
        lines = ["SOL 101", "CEND", "BEGIN BULK", "$ a comment"]
        lines += [
            card("GRID", k + 1, "", *map(float, p), style=style) for k, p in enumerate(points)
        ]
        lines += [
            card(name, k + 1, 7 if k < len(cells) // 2 else 9, *(row + 1), style=style)
            for k, row in enumerate(cells)
        ]
        file.write_text("\n".join([*lines, "ENDDATA", ""]))

    return write


def of_abaqus(kind: str, order: int = 1, part: bool = False) -> Callable[[Path], None]:
    def write(file: Path) -> None:
        points, cells = grid()
        if kind in ("S3", "S3R", "S6", "STRI65", "STRI3"):
            cells = halves(cells)
        if order == 2:
            points, cells = with_middles(points, cells)
        lines = ["*Heading", " strip", "** a comment"]
        lines += ["*Part, name=strip"] if part else []
        lines += ["*Node"]
        shift = np.array([0.5, 0, 0]) if part else np.zeros(3)
        lines += [
            f"{k + 1}, {x:.9g}, {y:.9g}, {z:.9g}" for k, (x, y, z) in enumerate(points - shift)
        ]
        lines += [f"*Element, type={kind}, elset=skin"]
        for k, row in enumerate(cells):
            text = ", ".join(map(str, (k + 1, *(row + 1))))
            head, _, tail = text.rpartition(", ")
            lines += [head + ",", tail] if len(row) == 8 else [text]
        lines += ["*Elset, elset=half, generate", f"1, {len(cells) // 2}, 1"]
        lines += ["*Elset, elset=Both", "half,"]
        if part:
            lines += ["*End Part", "*Assembly, name=A", "*Instance, name=I, part=strip"]
            lines += ["0.5, 0, 0", "*End Instance", "*End Assembly"]
        file.write_text("\n".join([*lines, ""]))

    return write
