"""Motions that nothing holds in statics: the null space of the tangent at the start.

A body that moves as if it were rigid has no elastic force, and these motions are the only ones
without. So the null space is found among six motions of each body and the coordinates of joints,
which supports, joins and joints restrict: a small dense problem, with no factorisation of the
tangent. What is left is held by springs, motors and the user's terms if their forces change along
it. Loads hold nothing: a dead load is the same wherever its body is, and one that follows its body
turns with it. The stiffness that a body has because it carries a load (a pendulum that hangs, a
string under tension) is not there at the start, where all internal forces are zero.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.errors import UnheldError
from shellmb.model.body import Body, added
from shellmb.model.elements import ElementGroup
from shellmb.model.model import Model
from shellmb.model.reduced.modal import ModalTerms
from shellmb.model.unknowns import NOT_GIVEN, Unknowns
from shellmb.native.kernels import compiled
from shellmb.preprocessing.constraint_analysis.redundancy import RATE_STEP
from shellmb.preprocessing.constraint_analysis.rows import local_rows
from shellmb.scene.lookup import said
from shellmb.schemes.base import at_state
from shellmb.schemes.residuals.residual import interval_forces

# a motion along which constraints change by less than this part of what they change along others
NOTHING = 1e-8
# motion over which forces are compared, in lengths of the body; round-off of that difference
STEP, ROUND_OFF = 1e-4, 1e-9
# rows that are taken together, and bodies that are named
CHUNK, NAMED = 2000, 3
# parts of a motion below this are round-off
SMALL = 1e-6


@dataclass(frozen=True)
class Frame:
    """Frame to which motions of a body are relative.

    Args:
        middle: The point that translations are of, shape (3,), m.
        size: Length of the body, m.
    """

    middle: Floats
    size: float


def refuse_mechanisms(model: Model) -> None:
    """See that nothing can move freely in statics; collective.

    Args:
        model: The bodies, with consistent constraints.

    Raises:
        UnheldError: If something can; names the bodies and their motions.
    """
    motions = Motions(model)
    free = motions.free()
    if free.shape[1]:
        free = free @ motions.without_force(free)
    if not free.shape[1]:
        return
    # whether a potential holds its body is seen when that is solved
    kept = {name for group in model.potentials if group.holds for name in group.owners}
    members = {data.name: data.members[data.name].body for data in model.modal}
    every = {
        body: describe(motions.frames[body], free[6 * k : 6 * k + 6])
        for body, k in motions.blocks.items()
    }
    found = []
    for body, words in every.items():
        whole = model.scene.body(body).of or body
        # a place on a reduced body is kept with it, and moves with it
        if words and not {body, whole} & kept and (whole == body or not every[whole]):
            reduced: Any = members.get(body)
            described = getattr(reduced, "described", None)
            found.append(f"{said(described or model.scene.body(body))} can {words}")
    if not found:
        return
    count = len(found) - NAMED
    more = f", and {count} more {'body' if count == 1 else 'bodies'} can move" if count > 0 else ""
    raise UnheldError(
        f"statics: nothing holds these motions: {'; '.join(found[:NAMED])}{more}; add supports, "
        "joints or springs that do (a load does not), or let it move, as with scheme='ep'"
    )


class Motions:
    """Rigid motions of all bodies of a scene, and the coordinates of their joints.

    A motion is a vector: of each body a displacement of its middle, in lengths of the body, and a
    rotation about it, [rad]; then the coordinates, in radians or lengths of the scene.

    Args:
        model: The bodies.

    Attributes:
        blocks: Number of each body of the scene.
        frames: Middle and size of each.
    """

    def __init__(self, model: Model) -> None:
        self.model, self._comm = model, model.comm
        self._unknowns = Unknowns(model.bodies, model.comm)
        placed = [body for body in model.scene.bodies if body.placed]
        self.blocks = {body.name: k for k, body in enumerate(placed)}
        self.frames = {name: self._frame(name) for name in self.blocks}
        self._first: dict[str, int] = {}
        self.size = 6 * len(self.blocks)
        for group in model.mechanism.coordinate_groups:
            self._first[group.name] = self.size
            self.size += len(group.coordinates)
        self._index()

    def _frame(self, name: str) -> Frame:
        """Middle and size of a body; collective."""
        _, _, X, _ = self.model.nodes_of(name)
        low = np.min(self._comm.allgather(X.min(axis=0, initial=np.inf)), axis=0)
        high = np.max(self._comm.allgather(X.max(axis=0, initial=-np.inf)), axis=0)
        return Frame((low + high) / 2, float(np.linalg.norm(high - low)) or self.model.length)

    def _along(self, name: str) -> tuple[Body, Int32s, Ints, Floats]:
        """A body's local dofs with the motions as rows, shape (n,), (n, 6) and the columns."""
        body, nodes, X, D = self.model.nodes_of(name)
        u = body.mixed.nodal("u")[nodes]
        w = body.mixed.nodal("w")[nodes]
        return body, *self._rigid(name, u, w, X, D)

    def _rigid(
        self, name: str, u: Int32s, w: Int32s, X: Floats, D: Floats
    ) -> tuple[Int32s, Ints, Floats]:
        """Rigid motions of dofs at positions and directors that move with a body."""
        frame, turns = self.frames[name], np.eye(3)
        moves = np.zeros((*u.shape, 6))
        moves[:, :, :3] = frame.size * turns
        moves[:, :, 3:] = np.cross(turns, (X - frame.middle)[:, None]).transpose(0, 2, 1)
        leans = np.zeros((*D.shape, 6))
        leans[..., 3:] = np.cross(turns, D[:, :, None]).transpose(0, 1, 3, 2)
        rows = np.vstack([moves.reshape(-1, 6), leans.reshape(-1, 6)])
        dofs = np.concatenate([u.ravel(), w.ravel()])
        return dofs, np.tile(6 * self.blocks[name] + np.arange(6), (len(dofs), 1)), rows

    def _forced(self) -> Iterator[tuple[Body, Int32s, Ints, Floats]]:
        """List what terms may act on: bodies, and frames of bodies in modes."""
        yield from map(self._along, self.blocks)
        for terms in self.model.bodies:
            if isinstance(terms, ModalTerms):
                u, w = (terms.mixed.dofs[p].reshape(-1, n) for p, n in (("u1", 3), ("w1", 9)))
                X, D = np.tile(terms.center, (len(u), 1)), np.tile(np.eye(3), (len(u), 1, 1))
                yield terms, *self._rigid(terms.of, u, w, X, D)

    def _index(self) -> None:
        """Collect how unknowns that something holds or ties change with motions, on all ranks."""
        ties: list[tuple[Ints, Ints, Floats]] = []
        self._joined: list[tuple[Ints, Ints, Floats]] = []
        held = [np.zeros(0, dtype=np.int64)]
        for name in self.blocks:
            body, dofs, places, rows = self._along(name)
            number = self._unknowns.numbers[body.name][dofs]
            linked = self._unknowns.linked[body.name][dofs]
            ties.append((number[~linked], places[~linked], rows[~linked]))
            self._joined.append((number[linked], places[linked], rows[linked]))
            held.append(number[linked])
        for group in self.model.mechanism.coordinate_groups:
            x = self._unknowns.numbers[group.name][group.mixed.dofs["x"]]
            place = np.zeros((len(x), 6), dtype=np.int64)
            place[:, 0] = self._first[group.name] + group.nodes.item
            unit = 1.0 if group.kind == "rotation" else self.model.length
            ties.append((x, place, np.tile(unit * np.eye(6)[0], (len(x), 1))))
        given = self._unknowns.given([0.0], RATE_STEP * self.model.scene.dt)
        self._given = np.unique(given.numbers)
        self._tied = local_rows(self.model, self._unknowns, NOT_GIVEN)
        held += [self._given, *(row.columns for row in self._tied)]
        wanted = np.unique(np.concatenate(self._comm.allgather(np.concatenate(held))))
        none = held[0], np.zeros((0, 6), dtype=np.int64), np.zeros((0, 6))
        mine = [np.concatenate(each) for each in zip(none, *ties, strict=True)]
        here = np.isin(mine[0], wanted)
        every = self._comm.allgather([each[here] for each in mine])
        number, columns, values = (np.concatenate(each) for each in zip(*every, strict=True))
        self._numbers, first = np.unique(number, return_index=True)
        self._columns, self._values = columns[first], values[first]

    def _rows(self, numbers: Ints) -> Floats:
        """Evaluate how unknowns change with the motions, shape (n, motions)."""
        found = np.zeros((len(numbers), self.size))
        known = np.isin(numbers, self._numbers)
        place = np.searchsorted(self._numbers, numbers[known])
        np.add.at(
            found, (np.flatnonzero(known)[:, None], self._columns[place]), self._values[place]
        )
        return found

    def _units(self, numbers: Ints) -> Floats:
        """Size of the change of unknowns: a length, or one of those that turn, shape (n,)."""
        rows = self._rows(numbers)
        moves = np.arange(self.size) % 6 < 3
        moves[6 * len(self.blocks) :] = True
        size = np.linalg.norm(rows[:, moves], axis=1)
        # what does not move with a body is none of the terms
        return np.where(size > 0, size, np.isin(numbers, self._numbers))

    def _conditions(self) -> Iterator[tuple[Floats, Floats]]:
        """Yield what holds or ties motions, some rows at a time, and sizes of their terms."""
        # every rank knows what is given
        given = np.array_split(self._given, self._comm.size)[self._comm.rank]
        for k in range(0, len(given), CHUNK):
            yield self._rows(given[k : k + CHUNK]), self._units(given[k : k + CHUNK])
        for numbers, columns, values in self._joined:
            for k in range(0, len(numbers), CHUNK):
                part = slice(k, k + CHUNK)
                rows = -self._rows(numbers[part])
                np.add.at(rows, (np.arange(len(rows))[:, None], columns[part]), values[part])
                yield rows, self._units(numbers[part])
        for row in self._tied:
            size = np.abs(row.entries) @ self._units(row.columns)
            yield row.entries[None] @ self._rows(row.columns), np.array([size])
        for group in self.model.mechanism.element_groups:
            rows = self._springs(group)
            yield rows, np.ones(len(rows))

    def _springs(self, group: ElementGroup) -> Floats:
        """Coordinates that springs and motors hold."""
        rows = np.zeros((len(group.items), self.size))
        for k, (item, stiff) in enumerate(zip(group.items, group.holds(STEP), strict=True)):
            if stiff:
                rows[k, self._first[item.coordinate.group.name] + item.coordinate.item] = 1.0
        return rows

    def free(self) -> Floats:
        """Motions that no constraint and no spring holds, shape (motions, n); collective."""
        R = np.zeros((0, self.size))
        for rows, terms in self._conditions():
            size = np.linalg.norm(rows, axis=1)
            some = size > NOTHING * terms
            rows = rows[some] / size[some, None]
            R = np.linalg.qr(np.vstack([R, rows]), mode="r")
        R = np.vstack(self._comm.allgather(R))
        _, s, V = np.linalg.svd(np.vstack([R, np.zeros((self.size, self.size))]))
        return np.asarray(V[s <= NOTHING * max(s[0], 1.0)].T) if len(s) else np.zeros((0, 0))

    def without_force(self, free: Floats) -> Floats:
        """Combinations of motions along which no term of the user exerts a force; collective.

        Args:
            free: Motions, shape (motions, n).

        Returns:
            Shape (n, m).
        """
        count = free.shape[1]
        stiffness, size = np.zeros((count, count)), 0.0
        for body, dofs, columns, rows in self._forced():
            q, dq = fem.Function(body.mixed.space), ufl.TestFunction(body.mixed.space)
            time = fem.Constant(body.mixed.space.mesh, 0.0)
            extra = body.applied(q, None, dq, time)
            if body.name in self.model.own:
                # strains of the user's own may be of the place, as those of a foundation
                inner = interval_forces(body, at_state(q), dq)
                extra = added([extra, None if inner is None else -inner])
            if extra is None:
                continue
            form = compiled(extra)
            along = np.einsum("ik,ikm->im", rows, free[columns])

            def forces(step: Floats, q=q, form=form, dofs=dofs) -> Floats:  # type: ignore[no-untyped-def]
                q.x.array[dofs] = step
                return np.asarray(fem.assemble_vector(form).array[dofs])

            def work(step: Floats, forces=forces, along=along) -> Floats:  # type: ignore[no-untyped-def]
                return np.asarray(along.T @ forces(step))

            if body.name in self.model.own:
                # what round-off is of: forces where it strains
                strained = forces(STEP * np.linspace(0.0, 1.0, len(dofs)) ** 2)
                size = max(size, float(np.linalg.norm(strained) * np.linalg.norm(along)) / STEP)

            # of two steps, so that a force which grows with the cube of the motion has no slope
            for step, weight in ((STEP, -1 / 99), (STEP / 10, 100 / 99)):
                for k in range(count):
                    plus, minus = work(step * along[:, k]), work(-step * along[:, k])
                    stiffness[:, k] += weight * (plus - minus) / (2 * step)
                    size = max(size, float(np.max(np.abs([plus, minus]))) / step)
        stiffness = self._comm.allreduce(stiffness)
        size = max(self._comm.allgather(size))
        _, s, V = np.linalg.svd(stiffness)
        return np.asarray(V[s <= ROUND_OFF * max(s[0], size)].T)


def describe(frame: Frame, motions: Floats) -> str:
    """Possible motions of a body, as "translate along y and turn about x"; empty if none.

    Args:
        frame: Middle and size of the body.
        motions: Displacements of the middle in lengths of the body over rotations, shape (6, n).
    """
    U, s, _ = np.linalg.svd(motions, full_matrices=False)
    basis = U[:, s > SMALL]
    if basis.shape[1] in (0, 6):
        return "move freely" if basis.shape[1] else ""
    shifts, turns = basis[:3] * frame.size, basis[3:]
    _, s, V = np.linalg.svd(turns)
    rank = int(np.sum(s > SMALL))
    pure = _orthonormal(shifts @ V[rank:].T)
    said = []
    if pure.shape[1]:
        said.append(f"translate along {_listed([_name(a) for a in _axes(pure)])}")
    # of a motion that turns nothing round-off has directions, too
    axes = _axes(_orthonormal(turns)) if rank else []
    moves = [shifts @ np.linalg.lstsq(turns, axis, rcond=SMALL)[0] for axis in axes]
    moves = [move - pure @ (pure.T @ move) for move in moves]
    words = [_name(axis) for axis in axes]
    common = None if pure.shape[1] or not axes else _common_point(frame, axes, moves)
    for k, (axis, move) in enumerate(zip(axes, moves, strict=True)):
        if not pure.shape[1] and common is None:
            words[k] += f" through {_point(frame.middle + np.cross(axis, move), frame.size)}"
        if abs(move @ axis) > SMALL * frame.size:
            words[k] += f" while it moves by {move @ axis:.3g} m per radian along it"
    if axes:
        where = "" if common is None else f" through {_point(common, frame.size)}"
        said.append(f"turn about {_listed(words)}{where}")
    return " and ".join(said)


def _common_point(frame: Frame, axes: list[Floats], moves: list[Floats]) -> Floats | None:
    """The point that all rotations leave where it is, the nearest one to the middle."""
    crosses = np.vstack([np.cross(axis, np.eye(3)).T for axis in axes])
    wanted = -np.concatenate(moves)
    to = np.linalg.lstsq(crosses, wanted, rcond=SMALL)[0]
    left = crosses @ to - wanted
    return None if np.max(np.abs(left)) > SMALL * frame.size else frame.middle + to


def _orthonormal(vectors: Floats) -> Floats:
    """Basis of what vectors span, shape (3, n)."""
    U, s, _ = np.linalg.svd(vectors, full_matrices=False)
    return np.asarray(U[:, s > SMALL * max(np.max(s, initial=0.0), 1e-300)])


def _axes(basis: Floats) -> list[Floats]:
    """Directions that span a space, x, y and z before others."""
    found = [e for e in np.eye(3) if np.linalg.norm(e - basis @ (basis.T @ e)) < SMALL]
    if len(found) == basis.shape[1]:
        return found
    held = np.array(found).reshape(-1, 3).T
    rest = _orthonormal(basis - held @ (held.T @ basis)).T
    # the first component that is not zero is positive
    return found + [a * np.sign(a[np.argmax(np.abs(a) > SMALL)]) for a in rest]


def _name(axis: Floats) -> str:
    for name, e in zip("xyz", np.eye(3), strict=True):
        if np.linalg.norm(axis - e) < SMALL:
            return name
    return _point(axis, 1.0)


def _point(x: Floats, size: float) -> str:
    rounded = np.where(np.abs(x) < SMALL * size, 0.0, x)
    return f"({', '.join(f'{c:.4g}' for c in rounded)})"


def _listed(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else words[0]
