"""Shells joined along edges, and beams glued to shells.

Of a reinforcing beam the displacements of its nodes are those of the shell (Boolean identification,
section 5 of the paper). A shell's director carries no moment about itself, so the beam's frame is
connected to it by the shell revolute joint, `e1 . E3 = e2 . E3 = 0` (eq. 35), or, for the same
result with fewer unknowns, the beam's third director is the shell's.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats, Int32s, Ints
from shellmb.errors import SceneError
from shellmb.forms.constraints.joints import KINDS, Place, locked_kink
from shellmb.meshes.surfaces.shell_lines import ShellLine, shell_line
from shellmb.model.body import FixedDofs, NodeLink
from shellmb.model.frames.beam import BeamModel
from shellmb.model.locations.nodes import ON_NODE, Nodes, shared_nodes, shown
from shellmb.model.shells.shell import ShellModel
from shellmb.model.supports.prescribed import NodalConstraint, NodalVector, Prescribed
from shellmb.model.supports.supports import turning
from shellmb.scene import Beam, Glue, Join, Scene
from shellmb.scene.loads.supports import Driven
from shellmb.scene.lookup import said

# surfaces whose normals differ by less than this along the edge are one smooth surface [degrees]
SMOOTH = 3.0


def join_shells(
    join: Join, first: ShellModel, second: ShellModel
) -> tuple[list[NodeLink], NodalConstraint | None]:
    """Links of the second shell to the first, and the constraint of a kink.

    Args:
        join: Description.
        first: Shell whose nodes are kept.
        second: Shell whose edge nodes become nodes of the first.

    Raises:
        SceneError: If the nodes of the two edges do not coincide, or the normals are opposite.
    """
    who = f"join of '{first.name}' and '{second.name}'"
    a = shared_nodes(first, join.at, who)
    b = shared_nodes(second, join.second_at, who)
    _coincide(a, b, first, who)
    cosine = np.sum(a.director * b.director, axis=1)
    degrees = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    smooth = join.kind == "smooth" or (join.kind == "auto" and float(np.max(degrees)) < SMOOTH)
    if float(np.max(degrees)) > 180 - SMOOTH or (smooth and float(np.min(cosine)) <= 0):
        raise SceneError(
            f"{who}: the normals of the two shells point to opposite sides along the edge; "
            "turn one of the surfaces over"
        )
    if not smooth and float(np.min(degrees)) < SMOOTH:
        raise SceneError(
            f"{who}: the surfaces are smooth at some of the edge's nodes and kinked at others; "
            "split the edge, or give kind='smooth'"
        )
    parts = ("u", "w", "lam") if smooth else ("u",)
    links = [_link(second, first.name, a, b, part) for part in parts]
    if smooth:
        mean = a.director + b.director
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
        for body, nodes in ((first, a), (second, b)):
            _set_directors(body, nodes, mean)
        return links, None
    scale = float(first.section.force.value) * first.surface_mesh.length
    vectors: dict[str, NodalVector] = {
        "d1": (first.name, a.dofs["w"], a.director),
        "d2": (second.name, b.dofs["w"], b.director),
    }
    # the angle between the directors of both shells is locked at each node of the edge
    return links, NodalConstraint(
        f"kink between '{first.name}' and '{second.name}'",
        first.surface_mesh.mesh.comm,
        vectors,
        lambda d1, d2, angle: [locked_kink(d1, d2, angle)],
        scale,
        a.x,
        data=cosine[:, None],
    )


def _coincide(a: Nodes, b: Nodes, first: ShellModel, who: str) -> None:
    if len(a.x) != len(b.x):
        raise SceneError(
            f"{who}: the edges have {len(a.x)} and {len(b.x)} nodes; they must have the same nodes"
        )
    steps = np.linalg.norm(np.diff(a.x, axis=0), axis=1)
    if float(np.min(steps, initial=np.inf)) < ON_NODE * first.surface_mesh.length:
        raise SceneError(
            f"{who}: edges of '{first.name}' lie on each other; it must be joined along one of them"
        )
    gap = float(np.max(np.linalg.norm(a.x - b.x, axis=1)))
    if gap > 2 * ON_NODE * first.surface_mesh.length:
        raise SceneError(f"{who}: nodes of the two edges are {gap:.3g} apart; they must coincide")


def _link(body: ShellModel, target: str, a: Nodes, b: Nodes, part: str) -> NodeLink:
    """Link a part of `body` at its nodes `b` to the nodes `a` of the target."""
    local = body.mixed.space.dofmap.index_map.global_to_local(b.dofs[part].ravel())
    here = local >= 0
    return NodeLink(np.asarray(local[here], dtype=np.int32), target, a.dofs[part].ravel()[here])


def _set_directors(body: ShellModel, nodes: Nodes, directors: np.ndarray) -> None:
    """Give nodes a new reference director, on every rank that holds them."""
    index_map = body.mixed.space.dofmap.index_map
    local = index_map.global_to_local(nodes.dofs["w"].ravel())
    here = local >= 0
    # place of each mixed dof in the director's space, whose nodes are in the order of the parts'
    place = np.full(index_map.size_local + index_map.num_ghosts, -1)
    place[body.mixed.dofs["w"]] = np.arange(len(body.mixed.dofs["w"]))
    body.director.x.array[place[local[here]]] = directors.ravel()[here]


# the rows of the shell revolute joint behind those of the displacements, which are identified
ALIGNED = slice(3, 5)


def line_along(beam: Beam, shell: ShellModel) -> ShellLine:
    """The line of a shell's mesh along which a beam runs; collective.

    Args:
        beam: Description of the beam.
        shell: The shell that its curve names, with its final directors.

    Raises:
        SceneError: If the line does not follow element edges.
    """
    directors = shell.node_directors()[:, 0]
    return shell_line(beam, shell.shell.surface, shell.domain, shell.mixed, directors)


@dataclass(frozen=True)
class Glued:
    """A beam with the nodes of the shell that are its own.

    Args:
        glue: Description.
        beam: The beam.
        shell: The shell.
        line: Their common nodes.
        turns: Whether both have rotary inertia, and so jumps of directors' velocities.
    """

    glue: Glue
    beam: BeamModel
    shell: ShellModel
    line: ShellLine
    turns: bool

    @property
    def shares_director(self) -> bool:
        """Decide whether there is one director for both.

        Where only one of them has inertia, jumps of velocity of the two differ: eq. (35), with the
        same result.
        """
        return self.glue.kind == "director" and self.turns

    @property
    def numbers(self) -> Ints:
        """Number along the line of each local node of the beam."""
        return self.line.line.numbers(self.beam.mixed.subspaces["u"])

    def rows(self, part: str) -> Int32s:
        """Local dofs of a part of the beam, one row per local node."""
        size = self.beam.mixed.parts[part][1]
        return self.beam.mixed.dofs[part].reshape(-1, size)

    def link(self, part: str, columns: slice = slice(None)) -> NodeLink:
        """Some components of a part of the beam are the part of the shell."""
        rows = self.rows(part)[:, columns]
        targets = self.line.dofs[part][self.numbers]
        return NodeLink(rows.ravel(), self.shell.name, targets.ravel())

    def beam_dofs(self) -> Ints:
        """Global dofs of the beam's directors in the order of the line, shape (n, 9)."""
        numbers, rows = self.numbers, self.rows("w")
        pairs = (numbers, self.beam.mixed.numbers(rows))
        found = np.zeros((len(self.line.x), 9), dtype=np.int64)
        for where, dofs in self.beam.domain.mesh.comm.allgather(pairs):
            found[where] = dofs
        return found

    def held(self) -> Bools:
        """At which nodes of the line supports hold the shell's director still, shape (n,)."""
        still = [f.dofs for f in self.shell.fixed if not f.moving]
        local = np.concatenate([*still, np.zeros(0, dtype=np.int32)]).astype(np.int32)
        gathered = self.shell.domain.mesh.comm.allgather(self.shell.mixed.numbers(local))
        return np.asarray(np.isin(self.line.dofs["w"], np.concatenate(gathered)).all(axis=1))

    def driven(self, support: Driven) -> Bools:
        """At which nodes of the line a support moves the shell's director, shape (n,)."""
        nodes = shared_nodes(self.shell, support.at, support.label)
        return np.asarray(np.isin(self.line.dofs["w"], nodes.dofs["w"]).all(axis=1))

    def check_turned(self, support: Driven, where: Bools, prescribed: Prescribed) -> None:
        """Check that no support of the beam holds what one turns with the shell; collective.

        Args:
            support: The support of the shell.
            where: At which nodes of the line it moves the director, shape (n,).
            prescribed: What the supports hold.

        Raises:
            SceneError: Names the supports.
        """
        turns = support.rotation is not None and any(map(support.rotation, prescribed.times))
        for x, dofs in zip(self.line.x[where], self.beam_dofs()[where], strict=True):
            _, others = prescribed.held(self.beam.name, dofs)
            if turns and others:
                raise SceneError(
                    f"{others[0]} and {said(support)} {support.at!r} contradict one another on "
                    f"{said(self.beam.beam)}: at {shown(x)} the latter turns the beam with "
                    f"{said(self.shell.shell)}, and the former holds it; one must be left out"
                )

    def clamp(self, where: Bools, turned: Callable[[Floats, float], Floats] | None = None) -> None:
        """Prescribe the frames at nodes of the line.

        A support that takes the shell's director takes the whole end of the beam with it, drilling
        included.

        Args:
            where: Which nodes, shape (n,).
            turned: What vectors are changed by at a time; None: they are held.
        """
        here = where[self.numbers]
        own = slice(0, 6) if self.shares_director else slice(0, 9)
        rows = self.rows("w")[here][:, own]
        D = self.beam.node_directors()[here][:, : rows.shape[1] // 3]
        change = None if turned is None else lambda t: turned(D, t).ravel()
        lam = self.rows("lam")[here]
        if self.shares_director:
            lam = np.delete(lam, 2, axis=1)
        self.beam.fixed += [FixedDofs(rows.ravel(), change), FixedDofs(lam.ravel())]


def _aligned(d1: Expr, d2: Expr, E3: Expr) -> list[Expr]:
    """Eq. (35) of a beam's first two directors and the shell's."""
    nowhere, joint = 0 * E3, KINDS["shell revolute"]
    rows = joint.constraints(Place(nowhere, (d1, d2)), Place(nowhere, (E3,)), nowhere)
    return rows[ALIGNED]


def _shell_revolutes(items: Sequence[tuple[Glued, Ints]], turns: bool) -> NodalConstraint:
    """Eq. (35) at nodes that beams and shells share.

    Args:
        items: Beams with their shells, and numbers of the nodes along each line that have it.
        turns: Whether frames and shells have rotary inertia, and so jumps of directors' velocities.
    """
    w = np.concatenate([glued.beam_dofs()[k] for glued, k in items])
    E3 = np.concatenate([glued.line.dofs["w"][k] for glued, k in items])
    triads = np.concatenate([glued.line.line.triads[k] for glued, k in items])
    beams = [glued.beam.name for glued, k in items for _ in k]
    shells = [glued.shell.name for glued, k in items for _ in k]
    made = NodalConstraint(
        "shell revolute joints of beams" + ("" if turns else " without rotary inertia"),
        items[0][0].beam.domain.mesh.comm,
        {
            "d1": (beams, w[:, :3], triads[:, :3]),
            "d2": (beams, w[:, 3:6], triads[:, 3:6]),
            "E3": (shells, E3, triads[:, 6:]),
        },
        _aligned,
        max(glued.beam.force_size * glued.beam.beam.section.size for glued, _ in items),
        np.concatenate([glued.line.x[k] for glued, k in items]),
        2,
    )
    made.labels = [
        f"glue of '{g.beam.name}' and '{g.shell.name}' at ({', '.join(f'{c:g}' for c in x)})"
        for g, k in items
        for x in g.line.x[k]
    ]
    made.inertialess, made.moving = not turns, turns
    if not turns:
        made.jump_parts = frozenset()
    return made


def glue_beams(
    scene: Scene,
    beams: Mapping[str, BeamModel],
    shells: Mapping[str, ShellModel],
    lines: Mapping[str, ShellLine],
) -> list[Glued]:
    """Glue beams to shells: what both have at a node is one unknown.

    Args:
        scene: The scene.
        beams: Beams by name; their links are filled in.
        shells: Shells by name.
        lines: Lines by name of the beam that runs along it.
    """
    found = []
    for glue in scene.glues:
        beam, shell = beams[glue.beam], shells[glue.shell]
        jumps = beam.jump_parts & shell.jump_parts
        glued = Glued(glue, beam, shell, lines[beam.name], scene.static or "w" in jumps)
        beam.links += (glued.link("u"),)
        if glued.shares_director:
            # one director, and one multiplier of its length: both bodies add to its equations
            beam.links += (glued.link("w", slice(6, 9)), glued.link("lam", slice(2, 3)))
        found.append(glued)
    return found


def hold_glued(scene: Scene, every: Sequence[Glued], given: Prescribed) -> list[NodalConstraint]:
    """Hold frames of beams on shells where supports hold these, and align others; collective.

    Args:
        scene: The scene.
        every: Glued beams, whose supports and those of their shells must be there already.
        given: What these hold.

    Returns:
        The constraints of eq. (35), in one group for all beams that share their kernels.
    """
    groups: dict[bool, list[tuple[Glued, Ints]]] = {}
    for glued in every:
        held = glued.held()
        glued.clamp(held)
        supports: tuple[Any, ...] = scene.supports
        for support in supports:
            driven = support.rotation or support.translation
            if driven and scene.bodies_of(support)[0].name == glued.shell.name:
                moved = glued.driven(support) & ~held
                glued.check_turned(support, moved, given)
                who = f"the support Driven({support.at!r}) of '{glued.shell.name}'"
                glued.clamp(moved, turning(support, who)[1])
                held |= moved
        nodes = np.flatnonzero(~held)
        if not glued.shares_director and len(nodes):
            groups.setdefault(glued.turns, []).append((glued, nodes))
    return [_shell_revolutes(items, turns) for turns, items in groups.items()]
