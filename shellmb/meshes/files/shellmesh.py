"""From what a file or gmsh has to the mesh of a shell: one kind of cell, joined, looked through.

Nastran's and Abaqus' files have readers of our own, others meshio's.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError, warn
from shellmb.meshes.files.abaqus import read_abaqus
from shellmb.meshes.files.cards import DeckError
from shellmb.meshes.files.joined import (
    Gap,
    components,
    crossings,
    doubles,
    empty,
    gaps,
    joined,
    oriented,
)
from shellmb.meshes.files.kinds import Block, FileContent, by_type, cut, of_one_order
from shellmb.meshes.files.meshio_files import read_meshio
from shellmb.meshes.files.nastran import is_nastran, read_nastran
from shellmb.meshes.raw import FACETS, Cell, RawMesh, facets, shown, ties, true_at
from shellmb.scene import Hyperelastic, Isotropic, MeshFile, Shell, Wrinkling
from shellmb.scene.lookup import listed
from shellmb.scene.shells.gmsh_surfaces import Meshed
from shellmb.scene.values.validate import as_names

# endings that are Nastran's, and such as may be
NASTRAN, PERHAPS = {".bdf", ".nas", ".fem"}, {".dat"}
NAMES = {"quad": "quadrilaterals", "tri": "triangles"}
# how many places a message has
PLACES = 5


def file_mesh(shell: Shell) -> RawMesh:
    """Read the shell's mesh.

    Args:
        shell: A shell with a :class:`MeshFile`.

    Raises:
        SceneError: If the file cannot be read, or what it has makes no shell.
    """
    surface = shell.surface
    assert isinstance(surface, MeshFile)
    path, ending = surface.path, surface.path.suffix.lower()
    who = f"shell '{shell.name}': {path}"
    try:
        if ending in NASTRAN or (ending in PERHAPS and is_nastran(path)):
            found = read_nastran(path)
        elif ending == ".inp":
            found = read_abaqus(path)
        else:
            found = read_meshio(path, f"shell '{shell.name}'")
    except OSError as error:
        raise SceneError(f"{who} is not read ({error.strerror})") from error
    except DeckError as error:
        raise SceneError(f"{who}: {error}") from error
    return shell_mesh(found, shell, surface.group)


def shell_mesh(found: FileContent, shell: Shell, group: str | tuple[str, ...] | None) -> RawMesh:
    """The mesh of a shell.

    Args:
        found: What there is.
        shell: The shell; its surface tells how the mesh is taken.
        group: Group or groups of cells; None: all cells.

    Raises:
        SceneError: If there is no such group, there are no cells, they are others than the shell
            asks for, stand twice, or touch without being joined.
    """
    surface = shell.surface
    assert isinstance(surface, Meshed)
    who = f"shell '{shell.name}'"
    if not np.isfinite(found.x).all():
        raise SceneError(f"{who}: its mesh has nodes whose coordinates are not finite")
    chosen = _chosen(found, group, who)
    _refuse_directions(found, chosen, shell, who)
    x, blocks, order = of_one_order(found, chosen, surface.scale)
    blocks = _where(x, blocks, surface, who)
    same = _joined(x, blocks, surface, who)
    blocks = _with_area(x, [replace(b, rows=same[b.rows]) for b in blocks], order, who)
    # where none is given those of the file, quadrilaterals among others
    cell: Cell = shell.cell or ("quad" if any(b.cell == "quad" for b in blocks) else "tri")
    shell.check_degree(cell)
    x, rows, parent = _of_one_type(x, blocks, order, cell, shell.name)
    used, flat = np.unique(rows, return_inverse=True)
    x, rows = x[used], flat.reshape(rows.shape)
    # of each node that was read that of the shell, if it has it
    place = np.where(np.isin(same, used), np.searchsorted(used, same), -1)
    raw = RawMesh(
        x,
        rows,
        cell,
        order,
        (-1.0 if surface.flip else 1.0) * oriented(x, rows, cell, shell.name),
        edges=_edges({name: place[lines] for name, lines in found.lines.items()}, x, rows, cell),
        points={n: int(place[row]) for n, row in found.points.items() if place[row] >= 0},
        areas=_areas(found, {*surface.edges_where, *shell.areas}, parent),
    )
    _say_gaps(raw, surface, who)
    _say_pieces(raw, who)
    if len(places := crossings(raw)):
        warn(
            f"{who}: {_many(len(places), 'line', 'between nodes passes', 'between nodes pass')} "
            f"through other elements, near {_places(places, _size(raw.x))}: parts that cross are "
            "not joined there and move through one another; if they are joined, mesh them with "
            "common nodes along the line where they meet, as shells of their own (Join)"
        )
    if found.left_out:
        others = ", ".join(f"{n} {name}" for name, n in sorted(found.left_out.items()))
        warn(
            f"{who}: elements of its mesh that are no shells are omitted: {others}; add those that "
            "carry load to the scene"
        )
    return raw


def _many(count: int, thing: str, one: str, several: str) -> str:
    """A number of things of a mesh, with the verb that goes with it."""
    return (
        f"{count} {thing}{'' if count == 1 else 's'} of its mesh {one if count == 1 else several}"
    )


def _few(texts: Sequence[str], count: int) -> str:
    """The first of so many texts, and how many more there are."""
    more = f" and {count - PLACES} more" if count > PLACES else ""
    return ", ".join(texts[:PLACES]) + more


def _places(x: Floats, size: float) -> str:
    """Some positions in words."""
    return _few([shown(p, size) for p in x[:PLACES]], len(x))


def _size(x: Floats) -> float:
    return float(np.ptp(x, axis=0).max()) if len(x) else 0.0


def _chosen(found: FileContent, group: str | tuple[str, ...] | None, who: str) -> Sequence[int]:
    """Numbers of the cells of groups, ascending, or of all."""
    chosen: Sequence[int] = range(len(found.cells))
    if group is not None:
        for name in as_names(group):
            if name not in found.groups:
                raise SceneError(
                    f"{who}: the mesh has no set of cells '{name}'; it has "
                    f"{listed(found.groups) or 'none'}"
                )
        chosen = sorted({n for name in as_names(group) for n in found.groups[name]})
    if not chosen:
        there = ", ".join(sorted(found.left_out)) or "no cells"
        raise SceneError(
            f"{who}: the mesh has {there}; the cells of a shell must be triangles with 3 or 6 "
            "nodes or quadrilaterals with 4, 8 or 9"
        )
    return chosen


def _refuse_directions(found: FileContent, chosen: Sequence[int], shell: Shell, who: str) -> None:
    """Refuse directions of a file where stiffness depends on them and the scene gives none."""
    if shell.direction is not None or isinstance(
        shell.section, Isotropic | Wrinkling | Hyperelastic
    ):
        return
    count = len({*found.directed} & {*chosen})
    if count:
        raise SceneError(
            f"{who}: {count} elements of its mesh have material directions ({found.directions}), "
            "which are not read; direction must be a vector, or a function of positions, that says "
            "the same"
        )


def _where(x: Floats, blocks: list[Block], surface: Meshed, who: str) -> list[Block]:
    """Cells where the surface's function of the position is true in their middles."""
    if surface.where is None:
        return blocks
    middles = [x[block.vertices].mean(axis=1) for block in blocks]
    true = [true_at(surface.where, at[:, None], f"{who}: where")[:, 0] for at in middles]
    kept = [block.take(on) for block, on in zip(blocks, true, strict=True) if on.any()]
    if not kept:
        every = np.concatenate(middles)
        box = " to ".join(shown(end(every, axis=0), _size(every)) for end in (np.min, np.max))
        raise SceneError(
            f"{who}: where is true on no element of the mesh, whose middles lie in {box}; it must "
            "be true on some"
        )
    return kept


def _joined(x: Floats, blocks: list[Block], surface: Meshed, who: str) -> Ints:
    """For each node the one that it becomes; says where parts of a mesh are joined by it."""
    same, far = joined(x, blocks, surface.merge)
    # nodes between corners may have been made for each cell by itself
    corners = np.concatenate([block.vertices.ravel() for block in blocks])
    used, uses = np.unique(corners, return_counts=True)
    gone = used[same[used] != used]
    # where no cells share nodes, as in STL, this is how they are joined
    if len(gone) and (uses.max() > 1 or far > 1e-9):
        one, several = "lies on another and becomes one with it", "lie on others and become one"
        joint = _many(len(gone), "node", one, f"{several} with them")
        warn(
            f"{who}: {joint}, up to "
            f"{np.linalg.norm(x[gone] - x[same[gone]], axis=1).max():.2g} m away, at "
            f"{_places(x[gone], _size(x[used]))}; with merge=0 they stay apart"
        )
    return same


def _with_area(x: Floats, blocks: list[Block], order: int, who: str) -> list[Block]:
    """Cells without those that have no area; quadrilaterals with a corner twice are triangles."""

    def said(block: Block, which: Any, one: str, several: str, what: str) -> str:
        at = x[block.vertices[which]].mean(axis=1)
        return f"{who}: {_many(len(at), 'element', one, several)} {what}, at {_places(at, size)}"

    size, found = _size(x), list[Block]()
    for each in blocks:
        none = empty(x, each)
        if none.any():
            warn(said(each, none, "has", "have", "no area and no part in the shell"))
        block = each.take(~none)
        ends = block.rows[:, np.array(FACETS[block.cell])]
        short = ends[:, :, 0] == ends[:, :, 1]
        twice = (np.diff(np.sort(block.vertices, axis=1), axis=1) == 0).any(axis=1)
        as_triangle = (short.sum(axis=1) == 1) & (order == 1) & (block.cell == "quad")
        if (wrong := twice & ~as_triangle).any():
            says = said(block, wrong, "has", "have", "a node twice")
            raise SceneError(f"{says}; their nodes must be different ones")
        if len(again := doubles(block)):
            says = said(block, again, "is", "are", "there twice")
            raise SceneError(f"{says}; each must be there once")
        found.append(block.take(~as_triangle))
        if as_triangle.any():
            ring = block.rows[as_triangle][:, [0, 1, 3, 2]]
            keep = ring != np.roll(ring, 1, axis=1)
            found.append(Block("tri", ring[keep].reshape(-1, 3), block.parents[as_triangle]))
    kept = [block for block in by_type(found) if len(block.rows)]
    if not kept:
        raise SceneError(f"{who}: all elements of its mesh are without area; some must have one")
    return kept


def _of_one_type(
    x: Floats, blocks: list[Block], order: int, wanted: Cell, name: str
) -> tuple[Floats, Ints, Ints]:
    """Cells of the shell's type, and the number of the one that each is a part of."""
    if len(blocks) == 1:
        cell = blocks[0].cell
        if cell != wanted:
            raise SceneError(
                f"shell '{name}': the mesh has {NAMES[cell]}; cell must be '{cell}', not '{wanted}'"
            )
        return x, blocks[0].rows, blocks[0].parents
    counts = {block.cell: len(block.rows) for block in blocks}
    x, rows, parent = cut(x, blocks, order, wanted)
    done = (
        "each quadrilateral is cut into four of them, each triangle into three"
        if wanted == "quad"
        else "each quadrilateral is cut in two"
    )
    warn(
        f"shell '{name}': its mesh has {counts['quad']} quadrilaterals and {counts['tri']} "
        f"triangles, and cell is '{wanted}': {done}, {len(rows)} elements in all"
    )
    return x, rows, parent


def _edges(lines: dict[str, Ints], x: Floats, rows: Ints, cell: Cell) -> dict[str, Ints]:
    """Facets of the mesh on each named line; lines without any are left out."""
    if not lines:
        return {}
    # where cells are cut, a side is two: through the node that lies in its middle
    beside = ties(facets(rows, cell).reshape(-1, 2))
    edges = {}
    for name, nodes in lines.items():
        pairs = []
        for first, last in np.sort(nodes, axis=1).tolist():
            if last in beside.get(first, ()):
                pairs.append((first, last))
                continue
            for middle in beside.get(first, set()) & beside.get(last, set()):
                to_ends = x[[first, last]] - x[middle]
                length = np.linalg.norm(to_ends, axis=1)
                if np.linalg.norm(to_ends.sum(axis=0)) < 0.3 * length.sum():
                    pairs += [(min(end, middle), max(end, middle)) for end in (first, last)]
        if pairs:
            edges[name] = np.unique(np.array(pairs, dtype=np.int64), axis=0)
    return edges


def _areas(found: FileContent, others: set[str], parent: Ints) -> dict[str, Ints]:
    """Cells of each group that is a part of the surface, unless the scene has another such name."""
    every = np.unique(parent)
    areas = {}
    for name, group in found.groups.items():
        numbers = np.unique(group)
        inside = np.isin(numbers, every)
        part = len(numbers) and inside.all() and len(numbers) < len(every)
        if part and name not in others:
            areas[name] = np.flatnonzero(np.isin(parent, numbers))
    return areas


def _say_gaps(raw: RawMesh, surface: Meshed, who: str) -> None:
    """Refuse places where the mesh touches itself without being joined, or name them."""
    found = gaps(raw)
    if not found:
        return
    size = _size(raw.x)

    def said(gap: Gap) -> str:
        first, *last = (shown(end, size) for end in gap.ends)
        if not last:
            return f"the node {first} lies on another element"
        on = _places(raw.x[list(gap.nodes)], size)
        return f"the side of {gap.length:.4g} m from {first} to {last[0]} has {on} on it"

    places = [said(gap) for gap in found]
    more = f"; {len(places) - PLACES} more" if len(places) > PLACES else ""
    length = sum(gap.length for gap in found)
    text = (
        f"{who}: its mesh touches itself without being joined at {len(places)} "
        f"place{'s' if len(places) > 1 else ''}, {length:.4g} m of sides: "
        f"{'; '.join(places[:PLACES])}{more}"
    )
    if surface.gaps == "keep":
        warn(f"{text}; they stay open, as gaps='keep' says")
        return
    raise SceneError(
        f"{text}; elements must meet in common nodes: mend the mesh, raise merge (now "
        f"{surface.merge:g}, in parts of a side) if they are apart, or leave them open with "
        "gaps='keep'"
    )


def _say_pieces(raw: RawMesh, who: str) -> None:
    """Name the pieces of a mesh that nothing in it joins, or that meet in single nodes only."""
    corners, count = raw.vertices, len(raw.cells)
    sides = facets(raw.cells, raw.cell).reshape(-1, 2)
    side = np.unique(sides, axis=0, return_inverse=True)[1].reshape(count, -1)
    for parts, how in ((corners, "share no nodes"), (side, "meet in single nodes only")):
        owner = np.repeat(np.arange(count), parts.shape[1])
        label = components(count + int(parts.max()) + 1, owner, count + parts.ravel())[:count]
        pieces, first, counts = np.unique(label, return_index=True, return_counts=True)
        if len(pieces) == 1:
            continue
        at = [shown(raw.x[corners[k]].mean(axis=0), _size(raw.x)) for k in first]
        each = [
            f"{n} element{'s' if n > 1 else ''} around {p}" for n, p in zip(counts, at, strict=True)
        ]
        warn(
            f"{who}: its mesh is in {len(each)} pieces that {how}: {_few(each, len(each))}; what "
            "holds one of them does not hold the others"
        )
        return
