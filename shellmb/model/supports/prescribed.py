"""Constraints at single nodes, and prescribed values of each node.

Values are collected before anything is fixed. A support prescribes components of a nodal vector,
rows `normal . q = value(t)` of linear equations. Going through those of a node one after the other,
a row that is a combination of the ones before it is repeated; if the same combination of their
values is another one, the supports contradict one another.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.forms.constraints import joints as nodal_forms
from shellmb.model.body import FixedDofs, PrescribedTurn
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.locations.nodes import Meshed, Nodes, said_point, shown
from shellmb.model.unknowns import Dof, linked_to
from shellmb.scene.lookup import said

# body of each of some nodes, or of all, global dofs of a nodal vector, shape (n, 3), and what these
# are changes of, shape (n, 3); None: zero
NodalVector = tuple[str | Sequence[str], Ints, Floats | None]


class NodalConstraint(ConstraintGroup):
    """Constraints at each of a list of nodes, with their multipliers.

    Args:
        name: Name of the constraint.
        comm: Communicator.
        vectors: Nodal vectors by name.
        constraints: Function of these vectors, and of the data if there are some; gives scalars.
        force: Size of the multipliers' forces, N where positions are held, N m where directors are.
        x: Positions of the nodes, for messages, shape (n, 3), m.
        count: Number of constraints at each node.
        size: What violations are relative to: a length, m, or 1 where directors are held.
        data: Values that the constraints need at each node, shape (n, m).
    """

    def __init__(
        self,
        name: str,
        comm: MPI.Comm,
        vectors: Mapping[str, NodalVector],
        constraints: Callable[..., Sequence[Expr]],
        force: float,
        x: Floats,
        count: int = 1,
        size: float = 1.0,
        data: Floats | None = None,
    ) -> None:
        def violation(q: Expr) -> Expr:
            changes = {part: self.layout.part(q, part) for part in vectors}
            values = [self._rest[p] + w if p in self._rest else w for p, w in changes.items()]
            return ufl.as_vector(constraints(*values, *self._data))

        targets = {
            part: ([of] * len(dofs) if isinstance(of, str) else of, dofs)
            for part, (of, dofs, _) in vectors.items()
        }
        super().__init__(name, comm, len(x), count, violation, force, size, targets=targets)
        rest = {part: values for part, (_, _, values) in vectors.items() if values is not None}
        self._rest = {part: self.per_item(values, part) for part, values in rest.items()}
        self._data = [] if data is None else [self.per_item(data, "data")]
        extent = float(np.max(np.abs(x))) or 1.0
        self.labels = [f"{name} at {said_point(node, extent)}" for node in x]


def plane(
    name: str,
    comm: MPI.Comm,
    body: str,
    vectors: Mapping[str, Ints],
    normals: Floats,
    force: float,
    x: Floats,
    size: float,
    arms: Floats | None = None,
) -> NodalConstraint:
    """Changes of nodal vectors stay in the planes with the given normals.

    Args:
        name: Name of the constraint.
        comm: Communicator.
        body: Name of the body.
        vectors: Global dofs of the vectors by names, shape (n, 3) each: of one, and of those that
            are added to it.
        normals: Unit normals, shape (n, 3).
        force: Size of the multiplier's force, N, or moment, N m.
        x: Positions of the nodes, for messages, shape (n, 3), m.
        size: What violations are relative to: the body's length, m, or 1 of a director.
        arms: What the vectors that are added are multiplied by, shape (n, m), m.
    """

    def constraint(first: Expr, *others: Expr) -> list[Expr]:
        *added, data = others
        moved = sum((data[3 + k] * vector for k, vector in enumerate(added)), start=first)
        return [nodal_forms.in_plane(moved, ufl.as_vector([data[i] for i in range(3)]))]

    parts = {part: (body, dofs, None) for part, dofs in vectors.items()}
    data = normals if arms is None else np.hstack([normals, arms])
    return NodalConstraint(name, comm, parts, constraint, force, x, size=size, data=data)


# directions closer than this to an axis (one minus the cosine) count as parallel to it
PARALLEL = 1e-9
# a unit vector whose part outside those before it is below this counts as dependent
DEPENDENT = 1e-6
# values that differ by less, relative to themselves or to the body, are equal: far above round-off
EQUAL, EQUAL_SIZE = 1e-9, 1e-12
# a director may be longer than one by this much: as many digits as a user may give
LONGER = 1e-6

WHAT = {"u": "displacement", "w": "change of the director"}


@dataclass(frozen=True)
class Rows:
    """Equations `normal . q = value(t)` that a support prescribes, the same on all ranks.

    Args:
        support: What messages call the support.
        body: The body.
        described: Its description in the scene.
        part: "u" or "w".
        nodes: Node of each row.
        normals: Unit vectors, shape (n, size).
        value: Function of time that gives the values, shape (n,); None: zero.
        turn: The rotation that the values are of; None: they are of none.
    """

    support: str
    body: Meshed
    described: Any
    part: str
    nodes: Nodes
    normals: Floats
    value: Callable[[float], Floats] | None = None
    turn: PrescribedTurn | None = None

    @property
    def dofs(self) -> Ints:
        """Global dofs of the vectors, shape (n, size)."""
        return self.nodes.dofs[self.part]


@dataclass
class _Node:
    """Held part of one nodal vector: an orthonormal basis with values over time."""

    basis: list[Floats] = field(default_factory=list)
    sides: list[Floats] = field(default_factory=list)
    supports: list[str] = field(default_factory=list)
    fixed: set[Dof] = field(default_factory=set)


class Prescribed:
    """Collects the rows of all supports.

    Args:
        aliases: Dofs that are those of another body, with what they are.
        times: Times at which values are compared, s.
        linear: Whether changes of directors are small.

    Attributes:
        rows: The rows of all supports.
        planes: Constraints in directions that are no axes, and off nodes.
    """

    def __init__(
        self, aliases: Mapping[Dof, Dof], times: Sequence[float], linear: bool = False
    ) -> None:
        self._aliases, self.times, self._linear = aliases, times, linear
        self.rows: list[Rows] = []
        self.planes: list[NodalConstraint] = []
        self._nodes: dict[Dof, _Node] = {}

    def held(self, body: str, dofs: Ints) -> tuple[Floats, list[str]]:
        """Orthonormal directions in which a nodal vector is fixed, (k, 3), and by what supports.

        Args:
            body: Name of the body.
            dofs: Global dofs of the vector, shape (size,); of all directors of a frame, which are
                held together, the first one is looked at.
        """
        node = self._nodes.get(linked_to(self._aliases, (body, int(dofs[0]))), _Node())
        return np.array(node.basis).reshape(-1, 3), node.supports

    def settle(self) -> None:
        """Fix the dofs of all bodies; directions that are no axes have constraints.

        Raises:
            SceneError: If supports contradict one another; names them and their values.
        """
        oblique: dict[tuple[str, str], list[tuple[Rows, int]]] = {}
        # whole axes first: what they hold needs no multiplier
        for rows in self.rows:
            values = np.zeros((len(rows.dofs), len(self.times)))
            if rows.value is not None:
                values = np.stack([rows.value(t) for t in self.times], axis=1)
            axis = np.argmax(np.abs(rows.normals), axis=1)
            size = np.take_along_axis(rows.normals, axis[:, None], axis=1)[:, 0]
            parallel = 1 - np.abs(size) < PARALLEL
            signs = np.sign(size)
            each = np.flatnonzero(parallel)
            kept = [
                self._hold_axis(rows, k, int(axis[k]), signs[k] * values[k]) for k in each.tolist()
            ]
            new = each[np.array(kept, dtype=bool)]
            _fix(rows.body, rows.dofs[new, axis[new]], _of_axes(rows, new, signs[new]), rows.turn)
            oblique.setdefault((rows.body.name, rows.part), []).extend(
                (rows, k) for k in np.flatnonzero(~parallel).tolist()
            )
        for items in oblique.values():
            found = [(r, k) for r, k in items if self._hold(r, k, 0.0, r.normals[k])]
            if found:
                self.planes.append(_planes(found))
        self._directors()

    def _node(self, rows: Rows, k: int, first: int = 0) -> _Node:
        dof = linked_to(self._aliases, (rows.body.name, int(rows.dofs[k, first])))
        return self._nodes.setdefault(dof, _Node())

    def _hold_axis(self, rows: Rows, k: int, axis: int, side: Floats) -> bool:
        """Hold one component; False if the body has it fixed already."""
        # each director of a frame by itself: one of them may be that of a shell
        first = axis - axis % 3
        node, dof = self._node(rows, k, first), (rows.body.name, int(rows.dofs[k, axis]))
        self._hold(rows, k, side, np.eye(3)[axis - first], first)
        # a dof that belongs to a joined body is fixed in both, as it is in one
        if dof in node.fixed:
            return False
        node.fixed.add(dof)
        return True

    def _hold(self, rows: Rows, k: int, side: Any, vector: Floats, first: int = 0) -> bool:
        """Hold a node in a direction; False if it is already held there.

        Raises:
            SceneError: If it is held there at another value.
        """
        node = self._node(rows, k, first)
        rest, implied, involved = vector.copy(), np.zeros(len(self.times)), []
        for held, values, support in zip(node.basis, node.sides, node.supports, strict=True):
            share = float(held @ rest)
            rest -= share * held
            implied += share * values
            involved += [support] if abs(share) > DEPENDENT else []
        length = float(np.linalg.norm(rest))
        wanted = np.broadcast_to(np.asarray(side, dtype=float), implied.shape)
        if length >= DEPENDENT:
            node.basis.append(rest / length)
            node.sides.append((wanted - implied) / length)
            node.supports.append(rows.support)
            return True
        scale = rows.body.domain.length if rows.part == "u" else 1.0
        allowed = EQUAL * np.maximum(np.abs(wanted), np.abs(implied)) + EQUAL_SIZE * scale
        excess = np.abs(wanted - implied) - allowed
        if np.max(excess) > 0:
            worst = int(np.argmax(excess))
            axis = int(np.argmax(np.abs(vector)))
            parallel = 1 - abs(vector[axis]) < PARALLEL
            along = "xyz"[axis] if parallel else shown(vector)
            raise SceneError(
                f"{' and '.join(dict.fromkeys(involved))} and {rows.support} contradict one "
                f"another on {said(rows.described)}: at {shown(rows.nodes.x[k])} the "
                f"{WHAT[rows.part]} along {along} is {implied[worst]:.6g} by the former and "
                f"{wanted[worst]:.6g} by the latter at t = {self.times[worst]:g}; they must "
                "agree, or one must be left out"
            )
        return False

    def _directors(self) -> None:
        """Multipliers of directors that are given have nothing left to do; lengths must be one.

        Raises:
            SceneError: If a prescribed director is longer or shorter than one.
        """
        seen: set[Dof] = set()
        for rows in self.rows:
            if rows.part != "w":
                continue
            full = []
            for k in range(len(rows.dofs)):
                dof = (rows.body.name, int(rows.dofs[k, 0]))
                if dof in seen:
                    continue
                seen.add(dof)
                node = self._node(rows, k)
                # all directors of a frame are held together
                whole = len(node.basis) == 3
                if rows.normals.shape[1] == 3:
                    self._check_length(rows, k, node, whole)
                if whole:
                    full.append(k)
            _fix(rows.body, rows.nodes.dofs["lam"][full].ravel(), None)

    def _check_length(self, rows: Rows, k: int, node: _Node, whole: bool) -> None:
        before, change = np.array(node.basis) @ rows.nodes.director[k], np.array(node.sides)
        lengths = np.linalg.norm(before[:, None] + change, axis=0)
        wrong = np.abs(lengths - 1) if whole else lengths - 1
        if self._linear:
            # a finite rotation is welcome as well as what keeps the length to first order
            small = np.abs(before @ change) if whole else np.zeros(len(self.times))
            wrong = np.minimum(wrong, small)
        worst = int(np.argmax(wrong))
        if wrong[worst] > LONGER:
            raise SceneError(
                f"{rows.support}: it makes the director of {said(rows.described)} at "
                f"{shown(rows.nodes.x[k])} {lengths[worst]:.6g} long at "
                f"t = {self.times[worst]:g}; the director must keep its length 1"
            )


def _of_axes(rows: Rows, new: Ints, signs: Floats) -> Callable[[float], Floats] | None:
    """Values over time of rows along axes; None: zero."""
    value = rows.value
    return None if value is None else lambda t: signs * value(t)[new]


def _fix(
    body: Meshed,
    dofs: Ints,
    value: Callable[[float], Floats] | None,
    turn: PrescribedTurn | None = None,
) -> None:
    """Fix global dofs on the ranks that hold them, owned or ghost."""
    if not len(dofs):
        return
    local = body.mixed.space.dofmap.index_map.global_to_local(np.asarray(dofs, dtype=np.int64))
    here = local >= 0
    given = None if value is None else lambda t: np.asarray(value(t))[here]
    body.fixed.append(FixedDofs(np.asarray(local[here], dtype=np.int32), given, turn))


def _planes(found: Sequence[tuple[Rows, int]]) -> NodalConstraint:
    """The constraint of one body and part in directions that are no axes."""
    rows = found[0][0]
    body, part = rows.body, rows.part
    kind = "displacement" if part == "u" else "director"
    dofs = np.array([r.dofs[k] for r, k in found])
    normals = np.array([r.normals[k] for r, k in found])
    size = body.domain.length if part == "u" else 1.0
    scale = body.force_size * body.domain.length / size
    name = f"{kind} plane of '{body.name}'"
    x = np.array([r.nodes.x[k] for r, k in found])
    return plane(name, body.domain.mesh.comm, body.name, {"q": dofs}, normals, scale, x, size)
