"""Contact with the faces of a shell in the steps of a scheme, as a coupling of the system."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import ConvergenceError
from shellmb.model.shell_contact.faces import FacesContact, Touching
from shellmb.model.shell_contact.mean_distance_slopes import mean_slope, mixed
from shellmb.model.shell_contact.uncovered_contact import Meeting
from shellmb.scene.lookup import said
from shellmb.schemes.base import END, Levels
from shellmb.schemes.pieces import START, START_RATE, Pieces
from shellmb.simulate.couplings.contact_forces import (
    Block,
    Ends,
    FacetFriction,
    Force,
    PointForces,
    StepStresses,
    blocks,
)
from shellmb.system.couplings import Entries, SharedDofs, joined

# times a motion that was larger than expected for which pairs are found anew
AHEAD = 1.2


class Side(NamedTuple):
    """Some of the slots.

    Args:
        body: Name of the body.
        X: Reference positions, or directors, shape (n, 3).
        dofs: Dofs of their changes in the body's space, three for each.
        arms: Components of offsets along k directors, shape (n, k).
        turns: Dofs of the changes of these, 3 k for each.
    """

    body: str
    X: Floats
    dofs: SharedDofs
    arms: Floats
    turns: SharedDofs

    def at(self, arrays: Mapping[str, Floats], state: Mapping[str, float]) -> Floats:
        """Positions, or directors, at a state of the step, shape (n, 3); collective."""

        def now(dofs: SharedDofs) -> Floats:
            parts = (share * arrays[name][dofs.local] for name, share in state.items())
            return np.asarray(dofs.gathered(sum(parts, np.zeros(()))))

        found = self.X + now(self.dofs).reshape(-1, 3)
        if self.arms.size:
            changes = now(self.turns).reshape(*self.arms.shape, 3)
            found += np.einsum("nk,nki->ni", self.arms, changes)
        return np.asarray(found)


class Acting(NamedTuple):
    """Forces of a step.

    Args:
        touching: The pairs that feel them.
        nodes: Numbers of the nodes in the slots of the distances, points first, shape (p, k).
        normal: Forces along distances.
        friction: Friction, if there is any.
    """

    touching: Touching
    nodes: Ints
    normal: list[Force]
    friction: list[Force]


class FacesCoupling:
    """Forces of one contact with the faces of a shell, the same on all ranks; collective.

    Its dofs are those of all slots (points, the shell's nodes, then directors), stage by stage.

    Args:
        comm: Communicator.
        contact: The contact.
        levels: Functions of both bodies by their names.
        pieces: The steps of the scheme.
        offsets: First local dof of each field by body and stage.

    Attributes:
        dofs: Dofs of all slots at all stages.
        changed: Whether its entries are others than those that the matrix was made for.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        contact: FacesContact,
        levels: Mapping[str, Levels],
        pieces: Pieces,
        offsets: Mapping[tuple[str, str], int],
    ) -> None:
        self.contact, self.name, self._pieces = contact, contact.item.name, pieces
        self._stages = tuple(pieces.rows)
        self._stresses = StepStresses(comm, pieces, contact.law)
        rubs, directors = contact.item.friction > 0, contact.d.shape[1]
        self._rubbing = FacetFriction(comm, contact.law, directors) if rubs else None
        self._last = len(pieces.states) - 1
        self._arrays = {name: _arrays(levels[name]) for name in (contact.holder, contact.shell)}

        none = np.zeros((0, 0)), np.zeros(0, dtype=np.int64)

        def side(body: str, X: Floats, dofs: Ints, arms: tuple[Floats, Ints] = none) -> Side:
            owned = levels[body].q.function_space.dofmap.index_map.local_range
            first, second = (SharedDofs.of(comm, some, owned) for some in (dofs, arms[1]))
            return Side(body, X, first, arms[0], second)

        holder = contact.holder
        self._sides = (
            side(holder, contact.y, contact.y_dofs, (contact.arms, contact.arm_dofs)),
            side(contact.shell, contact.x, contact.x_dofs),
            side(holder, contact.d.reshape(-1, 3), contact.d_dofs),
        )
        self._whole = side(holder, contact.whole, contact.whole_dofs, contact.whole_arms)
        # behind the slots are the directors that points are turned with
        self._slots = sum(len(part.X) for part in self._sides)
        self._count = self._slots + contact.arms.size
        listed = [*((part.body, part.dofs) for part in self._sides), (holder, self._sides[0].turns)]
        self.dofs = joined(
            comm, [dofs.shifted(offsets[body, s]) for s in self._stages for body, dofs in listed]
        )
        self._wider = 0.0
        self.candidates = contact.candidates(contact.y, contact.x)
        self._pattern = contact.coupled(self.candidates)
        self.changed = False

    def _places(self, stage: str, slots: Ints) -> Ints:
        """Numbers of the dofs of a stage in slots, shape (..., 3)."""
        first = self._stages.index(stage) * self._count
        return 3 * (first + slots[..., None]) + np.arange(3)

    def _at(self, state: Mapping[str, float]) -> tuple[Floats, Floats]:
        """Positions of points and nodes at a state of the step."""
        y, x = (self._side(side, state) for side in self._sides[:2])
        return y, x

    def _side(self, side: Side, state: Mapping[str, float]) -> Floats:
        """Positions, or directors, at a state of the step, shape (n, 3)."""
        return side.at(self._arrays[side.body], state)

    def _turned(self, places: Ints) -> Iterator[tuple[Ints, Ints, Floats]]:
        """Shares that dofs of points have in directors, one director after the other.

        Args:
            places: Numbers of dofs.

        Yields:
            Which of them are of points, the numbers of the directors' dofs, and the shares, m.
        """
        arms = self.contact.arms
        slot = places // 3 % self._count
        here = np.flatnonzero(slot < len(arms))
        for k in range(arms.shape[1]):
            further = self._slots + slot[here] * arms.shape[1] + k - slot[here]
            yield here, places[here] + 3 * further, arms[slot[here], k]

    def start(self) -> tuple[Floats, Floats]:
        """Positions of points and nodes at the start of the step."""
        return self._at({START: 1.0})

    def end(self) -> tuple[Floats, Floats]:
        """Positions of points and nodes at its end."""
        return self._at({END: 1.0})

    def _acting(self, derivatives: bool) -> Acting | None:
        states = [self._at(state) for state in self._pieces.states]
        touching = self.contact.touching(self.candidates, states)
        if touching is None:
            return None
        places, of = touching.places, touching.families
        stresses = self._stresses.at(touching.law, touching.distances)
        points = touching.point[of.owner]
        nodes = np.column_stack([points, len(self.contact.y) + touching.nodes])

        def along(ends: tuple[int, int], forces: PointForces, shares: Mapping[str, float]) -> Force:
            a, b = (places[k] for k in ends)
            mix = mixed(of, a.distance, b.distance)
            return Force(shares, forces, mean_slope(a, b, derivatives), mix, ends, nodes)

        normal = []
        for n, (ends, forces) in enumerate(zip(self._pieces.ends, stresses.pieces, strict=True)):
            shares = {row: some[n] for row, some in self._pieces.rows.items()}
            normal.append(along(ends, forces, shares))
        whole = (0, self._last)
        if stresses.damped is not None:
            normal.append(along(whole, stresses.damped, self._pieces.total))
        return Acting(touching, nodes, normal, self._friction(touching, nodes, stresses.normal))

    def _friction(
        self, touching: Touching, nodes: Ints, pressed: PointForces | None
    ) -> list[Force]:
        if self._rubbing is None or pressed is None:
            return []
        contact, of = self.contact, touching.families
        directors = contact.directors(touching.point[of.owner])
        slots = np.column_stack([nodes, len(contact.y) + len(contact.x) + directors])
        ends = self._ends(slots)
        a, b = (touching.places[k].distance for k in (0, self._last))
        found = self._rubbing.at(touching, ends)
        total = self._pieces.total
        return [Force(total, pressed, found, mixed(of, a, b), (0, self._last), slots)]

    def _ends(self, slots: Ints) -> Ends:
        """Positions of slots at both ends of the step."""
        states = self._pieces.states
        first, last = (
            np.concatenate([self._side(side, states[k]) for side in self._sides])[slots]
            for k in (0, self._last)
        )
        return first, last

    def residual(self) -> tuple[Ints, Floats]:
        """Numbers of dofs and forces on them."""
        acting, places, values = self._acting(False), [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
        if acting is None:
            return places[0], values[0]
        for force in acting.normal + acting.friction:
            on_slots = force.on_slots(acting.touching.families)
            for stage, share in force.shares.items():
                if share:
                    places.append(self._places(stage, force.nodes).ravel())
                    values.append(share * on_slots.ravel())
        dofs, loads = np.concatenate(places), np.concatenate(values)
        more = [(turns, arm * loads[here]) for here, turns, arm in self._turned(dofs)]
        found = zip((dofs, loads), *more, strict=True)
        return tuple(np.concatenate(some) for some in found)  # type: ignore[return-value]

    def jacobian(self) -> Entries:
        """Derivatives of the forces."""
        acting = self._acting(True)
        none = np.zeros(0, dtype=np.int64)
        found = [Entries(none, none, np.zeros(0))]
        if acting is None:
            return found[0]
        touching = acting.touching
        for force in acting.normal + acting.friction:
            for block in blocks(force, touching.families, touching.places, acting.nodes):
                found += self._entries(block, force.shares)
        rows, columns, values = (np.concatenate(some) for some in zip(*found, strict=True))
        return self._with_turns(Entries(rows, columns, values))

    def _with_turns(self, entries: Entries) -> Entries:
        """Entries, and those of the directors that points turn with."""
        rows, columns, values = entries
        made = [entries]
        for here, turns, arm in self._turned(rows):
            made.append(Entries(turns, columns[here], arm * values[here]))
        rows, columns, values = (np.concatenate(some) for some in zip(*made, strict=True))
        made = [Entries(rows, columns, values)]
        for here, turns, arm in self._turned(columns):
            made.append(Entries(rows[here], turns, arm * values[here]))
        return Entries(*(np.concatenate(some) for some in zip(*made, strict=True)))

    def _entries(self, block: Block, shares: Mapping[str, float]) -> Iterator[Entries]:
        """Entries of derivatives in all rows and columns."""
        for column in self._stages:
            weights = [state.get(column, 0.0) for state in self._pieces.states]
            parts = [w * d for w, d in zip(weights, block.by, strict=True) if w and d is not None]
            if not parts:
                continue
            values = sum(parts[1:], parts[0])
            here = np.flatnonzero(values)
            j = self._places(column, block.columns)[:, None, None]
            for row, share in shares.items():
                if not share:
                    continue
                i = self._places(row, block.rows)[:, :, :, None, None]
                one, two = (np.broadcast_to(k, values.shape).ravel()[here] for k in (i, j))
                yield Entries(one, two, share * values.ravel()[here])

    def pattern(self) -> tuple[Ints, Ints]:
        """All entries that candidates may have."""
        one, other = self._pattern.nonzero()
        rows, columns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for row in self._stages:
            for column in self._stages:
                i, j = self._places(row, one)[:, :, None], self._places(column, other)[:, None]
                rows.append(np.broadcast_to(i, (len(one), 3, 3)).ravel())
                columns.append(np.broadcast_to(j, (len(one), 3, 3)).ravel())
        self.changed = False
        i, j = np.concatenate(rows), np.concatenate(columns)
        return self._with_turns(Entries(i, j, np.zeros(len(i))))[:2]

    def look(self, dt: float) -> None:
        """Before a step: find pairs again where something may have come near.

        Args:
            dt: Length of the step, s.
        """
        self._stresses.dt = dt
        if self._rubbing is not None:
            self._rubbing.dt = dt
        y, x = self.start()
        if self.candidates.moved(y, x) > 0.5:
            self._find(y, x, 0.0)

    def covered(self) -> bool:
        """Decide whether the pairs are all that could touch in the step; if not, find more."""
        states = [self._at(state) for state in self._pieces.states]
        if max(self.candidates.moved(y, x) for y, x in states) <= 1:
            return True
        y, x = self.end()
        # the next solution begins at the start again, and may end elsewhere
        most = max(
            float(np.max(np.linalg.norm(a - b, axis=1), initial=0.0))
            for state in (self.start(), *states)
            for a, b in zip(state, (y, x), strict=True)
        )
        self._find(y, x, 2 * AHEAD * most)
        return False

    def state(self) -> dict[str, Any]:
        """Memory of the next steps beside the state: pairs, and entries of the matrix."""
        found, pattern = self.candidates, self._pattern
        entries = {"entries": pattern.indices, "rows": pattern.indptr}
        return {"y": found.y, "x": found.x, "wider": self._wider} | entries

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take that up."""
        self._wider = float(state["wider"])
        self.candidates = self.contact.candidates(state["y"], state["x"], self._wider)
        entries, rows = state["entries"], state["rows"]
        has = np.ones(len(entries)), entries, rows
        self._pattern, self.changed = type(self._pattern)(has, shape=self._pattern.shape), True

    def _find(self, y: Floats, x: Floats, slack: float) -> None:
        self._wider = slack
        self.candidates = self.contact.candidates(y, x, slack)
        pattern = self.contact.coupled(self.candidates)
        if pattern.multiply(self._pattern).nnz < pattern.nnz:
            self._pattern, self.changed = pattern, True

    def check(self) -> None:
        """See that nothing has passed through the shell.

        Raises:
            ConvergenceError: If a point has.
        """
        contact = self.contact
        point = contact.through(self.candidates, self.start(), self.end())
        if point is None:
            return
        place = ", ".join(f"{c:.4g}" for c in contact.y[point])
        raise ConvergenceError(
            f"{said(contact.item)}: the point of '{contact.body}' that was at ({place}) passes "
            f"through '{contact.shell}' within a step; use a smaller step or a larger stiffness",
            contact.item.name,
        )

    def energy(self) -> float:
        """Energy of the contact at the start of the step, J."""
        touching = self.contact.touching(self.candidates, [self.start()])
        if touching is None:
            return 0.0
        distances = np.repeat(touching.distances, len(self._pieces.states), axis=1)
        return float(self._stresses.at(touching.law, distances).energy.sum())

    def depth(self) -> float:
        """Penetration of the deepest point at the start of the step, m."""
        touching = self.contact.touching(self.candidates, [self.start()])
        reach = self.contact.law.reach
        return 0.0 if touching is None else float(np.max(reach - touching.distances, initial=0.0))

    def meeting(self) -> Meeting | None:
        """Deepest place between the points at the start of the step, if there is one."""
        y, x = (self._side(side, {START: 1.0}) for side in (self._whole, self._sides[1]))
        found = self.candidates
        return self.contact.between.meeting(y, x, 0.0 if len(found.point) else found.slack)

    def loss(self) -> tuple[float, float]:
        """Energies that the step dissipates: by the scheme, and by damping and friction, J."""
        item = self.contact.item
        loses = self._pieces.alpha or item.relative_damping or item.friction
        acting = self._acting(False) if loses else None
        if acting is None:
            return 0.0, 0.0
        touching = acting.touching
        stresses = self._stresses.at(touching.law, touching.distances)
        spent = 0.0
        if stresses.damped is not None:
            g = touching.distances
            spent += float(stresses.damped.values @ (g[:, -1] - g[:, 0]))
        for force in acting.friction:
            first, last = self._ends(force.nodes)
            spent += float(np.vdot(force.on_slots(touching.families), last - first))
        return float(stresses.loss.sum()), spent

    def forces(self) -> tuple[Floats, Floats]:
        """Mean forces on the points over the step just solved: normal ones, friction, (n, 3), N."""
        acting = self._acting(False)
        if acting is None:
            return np.zeros((0, 3)), np.zeros((0, 3))
        of, none = acting.touching.families, np.zeros((len(acting.nodes), 3))
        found = []
        for some in (acting.normal, acting.friction):
            parts = [force.shares[END] * force.on_slots(of)[:, 0] for force in some]
            found.append(-np.add.reduceat(sum(parts, none), of.first))
        return found[0], found[1]


def _arrays(levels: Levels) -> dict[str, Floats]:
    found = {stage: function.x.array for stage, function in levels.unknown.items()}
    found[START] = levels.q.x.array
    if levels.scaled:
        (rate,) = levels.scaled.values()
        found[START_RATE] = rate.x.array
    return found
