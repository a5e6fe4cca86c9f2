"""Places on bodies that joints, springs and loads act on, and one end of a group of them.

A place is a node of a body with an offset in its directors. A group of joints of one kind lives on
one node mesh; the nodal unknowns of its ends are those of the bodies (Boolean identification,
section 5 of the paper).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.forms.constraints.joints import Place
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import variation
from shellmb.meshes.nodes import NodeMesh, constant_vector
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.massless import Targets


@dataclass(frozen=True)
class End:
    """A place on a body, the same on all ranks.

    Args:
        body: Name of the body in the system.
        owner: Name of the body in the scene.
        dofs: Global dofs of the node: "u" of shape (3,), "w" of shape (3 m,).
        node: Reference position of the node, shape (3,), m.
        directors: Reference directors as rows, shape (m, 3): one of a shell, three of a frame, two
            of an edge of a shell: the director and the vector across the edge.
        point: Reference position of the place, shape (3,), m; of a shell along its director.
    """

    body: str
    owner: str
    dofs: dict[str, Ints]
    node: Floats
    directors: Floats
    point: Floats

    @property
    def framed(self) -> bool:
        """Decide whether the node has a full frame."""
        return len(self.directors) == 3

    @property
    def offset(self) -> Floats:
        """Components of `point - node` along the directors, shape (m,), m."""
        return np.asarray(self.directors @ (self.point - self.node))

    def needed(self, vectors: int) -> int:
        """Number of directors that matter to a joint that needs so many vectors here."""
        return len(self.directors) if vectors > 0 or np.any(self.offset != 0) else 0


class EndGroup:
    """One end of each of a list of joints.

    Args:
        ends: The places; their bodies have the same number of directors.
        axes: Vectors of each place in the reference configuration as rows, shape (n, 3, 3).
        tag: "1" or "2", ends the names of the parts.
        turns: Whether the directors matter; if not, their unknowns are left out.
    """

    def __init__(self, ends: Sequence[End], axes: Floats, tag: str, turns: bool) -> None:
        self.ends, self.tag, self.turns = list(ends), tag, turns
        self.count = len(ends[0].directors) if turns else 0
        # joints on the director of a shell are mostly at its node: then there is no arm to it
        self._arms = self.count > 1 or (turns and any(np.any(end.offset) for end in ends))
        self.parts = {f"u{tag}": 3} | ({f"w{tag}": 3 * self.count} if turns else {})
        rows = []
        for end, frame in zip(ends, axes, strict=True):
            row = [end.point]
            if turns and self.count > 1:
                # e_a = E_a + R_ak w_k with R_ak = E_a . D_k
                row += [end.offset, frame.ravel(), (frame @ end.directors.T).ravel()]
            elif turns:
                row += [end.directors[0], *([end.offset] if self._arms else [])]
            rows.append(np.concatenate(row))
        self._rows = np.array(rows)

    def bind(self, nodes: NodeMesh) -> None:
        """Take the group's node mesh, with one node for each place."""
        self._nodes = nodes
        self._data = constant_vector(nodes, self._rows, f"place{self.tag}")

    @property
    def targets(self) -> dict[str, Targets]:
        """Parts of the group's space with what they are of the bodies."""
        bodies, sources = [end.body for end in self.ends], zip(self.parts, ("u", "w"), strict=False)
        return {
            part: (bodies, np.array([end.dofs[source] for end in self.ends]))
            for part, source in sources
        }

    def place(self, q: Expr, layout: Layout) -> Place:
        """The place at a state of the group."""
        data, u = self._data, layout.part(q, f"u{self.tag}")
        x = ufl.as_vector([data[k] for k in range(3)]) + u
        if not self.turns:
            return Place(x, ())
        w = layout.part(q, f"w{self.tag}")
        if self.count == 1:
            if self._arms:
                x = x + data[6] * w
            return Place(x, (ufl.as_vector([data[3 + k] for k in range(3)]) + w,))
        n = self.count
        W = [ufl.as_vector([w[3 * k + i] for i in range(3)]) for k in range(n)]
        x = x + sum((data[3 + k] * W[k] for k in range(n)), start=0 * u)
        vectors = []
        for a in range(3):
            reference = ufl.as_vector([data[3 + n + 3 * a + i] for i in range(3)])
            turned = sum((data[12 + n + n * a + k] * W[k] for k in range(n)), start=0 * u)
            vectors.append(reference + turned)
        return Place(x, tuple(vectors))

    def moments(self, q: Floats, forces: Floats, mixed: MixedSpace) -> Floats:
        """Moments of forces on the local directors of frames, shape (n, 3), N m.

        Args:
            q: A state's array.
            forces: Forces on all local dofs.
            mixed: The group's space.
        """
        rows = mixed.dofs[f"w{self.tag}"]
        D = np.array([self.ends[k].directors for k in self._nodes.item]).reshape(-1, 3, 3)
        turned = np.cross(D + q[rows].reshape(-1, 3, 3), forces[rows].reshape(-1, 3, 3))
        return np.asarray(turned.sum(axis=1))


def change_of(place: Callable[[Expr], Place], at: Expr, dq: Expr) -> Place:
    """Motion of a place by a rate or variation of the state."""
    moved = variation(_Vectors(place), at, dq)
    x, *e = (ufl.as_vector([moved[k + i] for i in range(3)]) for k in range(0, len(moved), 3))
    return Place(x, tuple(e))


@dataclass(frozen=True)
class _Vectors:
    """Position and vectors of a place at a state as one, whose derivative is taken once.

    Args:
        place: Gives the place.
    """

    place: Callable[[Expr], Place]

    def __call__(self, q: Expr) -> Expr:
        """The vector, shape (3 n,)."""
        x, e = self.place(q)
        return ufl.as_vector([v[i] for v in (x, *e) for i in range(3)])


def end_pair(
    ends: Sequence[tuple[End, End]], axes: Sequence[Floats], directors: Sequence[int]
) -> tuple[EndGroup, ...]:
    """Both ends of each of a list of joints.

    Args:
        ends: The places on the first and the second bodies.
        axes: Vectors of both places of each joint, shape (2, 3, 3).
        directors: Number of directors that matter at the first and at the second places.
    """
    return tuple(
        EndGroup([pair[k] for pair in ends], np.array(axes)[:, k], f"{k + 1}", directors[k] > 0)
        for k in range(2)
    )


def frame_about(axis: Sequence[float] | Floats) -> Floats:
    """A right-handed orthonormal frame as rows, its third vector along `axis`."""
    e3 = np.asarray(axis, dtype=float)
    e3 = e3 / np.linalg.norm(e3)
    # the coordinate axis that is least parallel gives the most accurate cross product
    other = np.eye(3)[int(np.argmin(np.abs(e3)))]
    e1 = np.cross(other, e3)
    e1 /= np.linalg.norm(e1)
    return np.array([e1, np.cross(e3, e1), e3])
