"""Edges of shells that turn about one another: points along the edges, their frames and angles.

At each node of one edge the place on the other is held (a spherical joint). The angle of the
directors about the edge is that of unit vectors `p` and `r`, across it in either surface, and `n`
completes a frame. All three are unknowns of quadratic rows, with the directors `d1, d2` and the
tangent `t` of the edge, which is linear in the nodes around:

    p . p = 1,  p . t = 0,  p . d1 = 0
    n . n = 1,  n . t = 0,  n . p = 0
    r . r = 1,  r . t = 0,  r . d2 = 0

So `(n . r, p . r)` are cosine and sine of an angle, quadratic in the unknowns, of length one, and
all that is true of rotations of joints (`forms.constraints.coordinates`) is true here. Directors
are free to lean along the edge. On a rigid body or the ground there is a frame already, and `r`
alone is unknown. Where nodes of two edges do not coincide, those of the finer edge are held on the
other one, between its nodes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.locations.ends import End
from shellmb.model.massless import Scale


class Sum(NamedTuple):
    """A vector as a weighted sum of nodal vectors of a body.

    Args:
        body: Name of the body in the system.
        dofs: Global dofs of the nodal vectors, shape (m, 3).
        weights: Their weights, shape (m,).
    """

    body: str
    dofs: Ints
    weights: Floats


@dataclass(frozen=True)
class Point:
    """A point of a hinge.

    Args:
        label: Name of the hinge.
        x: Its place, shape (3,), m.
        axis: Axis of the hinge, shape (3,).
        normals: Directors of both shells there, of a frame the second one's twice, shape (2, 3).
        tangent: Change of the tangent: of nodes around it on an edge, or directors of a frame.
        director: Change of the director of the first shell; None: it is a frame.
        place: Displacement of the point, of one node or of several around it.
        second: Change of the second shell's director.
    """

    label: str
    x: Floats
    axis: Floats
    normals: Floats
    tangent: Sum
    director: Sum | None
    place: Sum
    second: Sum

    @property
    def key(self) -> tuple[int, int, int]:
        """Key that points with common kernels share: numbers of nodes around them."""
        across = 0 if self.director is None else len(self.director.weights)
        return len(self.tangent.weights), across, len(self.place.weights)

    @property
    def vectors(self) -> Floats:
        """Vectors `n, p, r` in the reference configuration as rows, shape (3, 3)."""
        return vectors(self.axis, *self.normals)


def vectors(tangent: Floats, first: Floats, second: Floats) -> Floats:
    """Vectors `n, p, r` for a tangent and two directors, of any length, as rows, shape (3, 3)."""
    t = tangent / np.linalg.norm(tangent)
    p, r = np.cross(t, first), np.cross(t, second)
    p, r = p / np.linalg.norm(p), r / np.linalg.norm(r)
    return np.array([np.cross(p, t), p, r])


class EdgeFrames(ConstraintGroup):
    """Vectors across edges of shells at points of hinges, as unknowns.

    Args:
        name: Name in the system.
        scale: Communicator and sizes.
        points: The points, all of one `key`.
    """

    def __init__(self, name: str, scale: Scale, points: Sequence[Point]) -> None:
        along, across, inside = points[0].key
        between = inside > 1
        own = [*(("n", "p") if across else ()), "r", *(("u",) if between else ())]
        # those that are displacements begin with u, by which lengths are told from directions
        sums = {"ut": [p.tangent for p in points], "d": [p.second for p in points]}
        sums |= {"a": [p.director for p in points if p.director is not None]} if across else {}
        sums |= {} if between else {"u": [p.place for p in points]}
        self.directions = tuple(range(9 if across else 3))
        count = len(self.directions) + 3 * between
        targets = {
            f"{s}{k}": ([i.body for i in items], np.array([i.dofs[k] for i in items]))
            for s, items in sums.items()
            for k in range(len(items[0].weights))
        }

        def violation(q: Expr) -> Expr:
            part = self.layout.part

            def total(name: str, weights: Expr | None, size: int) -> Expr:
                moved = [part(q, f"{name}{k}") for k in range(size)]
                if weights is None:
                    return moved[0]
                return sum((weights[k] * v for k, v in enumerate(moved)), start=0 * moved[0])

            t, first, d, *starts = (
                ufl.as_vector([given[3 * k + i] for i in range(3)]) for k in range(6)
            )
            n, p, r = (
                start + part(q, which) if which in own else start
                for start, which in zip(starts, "npr", strict=True)
            )
            t, d = t + total("ut", tangent, along), d + part(q, "d0")
            rows = [(ufl.dot(r, r) - 1) / 2, ufl.dot(r, t), ufl.dot(r, d)]
            if across:
                first = first + total("a", director, across)
                rows += [(ufl.dot(p, p) - 1) / 2, ufl.dot(p, t), ufl.dot(p, first)]
                rows += [(ufl.dot(n, n) - 1) / 2, ufl.dot(n, p), ufl.dot(n, t)]
            if within is not None:
                inner = total("ut", within, inside)
                rows += [part(q, "u")[i] - inner[i] for i in range(3)]
            return ufl.as_vector(rows)

        sizes = scale.of(count, self.directions)
        parts = dict.fromkeys(own, 3)
        super().__init__(
            name, scale.comm, len(points), count, violation, *sizes, targets=targets, own=parts
        )
        given = self.per_item([[p.axis, *p.normals, *p.vectors] for p in points], "given")

        def weights(items: Sequence[Sum]) -> Expr | None:
            several = len(items[0].weights) > 1
            return self.per_item([i.weights for i in items], "weights") if several else None

        tangent, within = weights(sums["ut"]), weights([p.place for p in points])
        director = weights(sums["a"]) if across else None
        sizes_of = {part: scale.length if part == "u" else 1.0 for part in own}
        titles = {part: (f"vectors of {name}", size) for part, size in sizes_of.items()}
        self.move_along(titles, "a smaller step")
        self.labels = [point.label for point in points]
        self._points, self._place = list(points), "u" if between else "u0"
        self._dofs = {part: self.numbers(part) for part in (*own, self._place)}

    def follow(self, q: Floats) -> None:
        """Find the unknowns of its own from the bodies, whose values a local state has.

        Args:
            q: The state, which is changed.
        """
        parts = self.mixed.parts
        rows = {p: q[self.mixed.dofs[p]].reshape(-1, 3) for p in parts if p != "mu"}
        for row, item in enumerate(self.nodes.item):
            point = self._points[item]

            def total(of: Sum, name: str, row: int = row) -> Floats:
                return sum(
                    (w * rows[f"{name}{k}"][row] for k, w in enumerate(of.weights)), np.zeros(3)
                )

            first, second = point.normals
            if point.director is not None:
                first = first + total(point.director, "a")
            turned = vectors(
                point.axis + total(point.tangent, "ut"), first, second + rows["d0"][row]
            )
            found = dict(zip("npr", turned - point.vectors, strict=True))
            if "u" in parts:
                found["u"] = total(point.place, "ut")
            for name in found.keys() & parts.keys():
                q[self.mixed.dofs[name].reshape(-1, 3)[row]] = found[name]

    def ends(self, k: int) -> tuple[End | None, End]:
        """Places with two vectors on the first shell, if it is one, and one on the second."""
        point, dofs = self._points[k], self._dofs
        u, x, directors = dofs[self._place][k], point.x, point.vectors
        second = End(self.name, point.second.body, {"u": u, "w": dofs["r"][k]}, x, directors[2:], x)
        if point.director is None:
            return None, second
        w = np.concatenate([dofs["n"][k], dofs["p"][k]])
        first = End(self.name, point.director.body, {"u": u, "w": w}, x, directors[:2], x)
        return first, second
