"""Groups of constraints at nodes with their multipliers, one for each kind."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats, Int32s
from shellmb.forms.constraints.held import Held, Law
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import set_constants
from shellmb.model.body import FixedDofs, PartScale
from shellmb.model.massless import NONE, NodeGroup, Places, Targets
from shellmb.model.multipliers import Constraints
from shellmb.native.expressions import values_at_states
from shellmb.scene.multibody.couplings import Relation
from shellmb.scene.multibody.joints import Joint
from shellmb.scene.values.user_functions import numbers_at

# a multiplier below this part of the group's force counts as zero
SMALL_FORCE = 1e-3
# step of differences of constraints that are not quadratic: both of their errors are some 1e-11
SMALL_STEP = 1e-5


class ConstraintGroup(NodeGroup):
    """Constraints of one kind at nodes or pairs of nodes, with a multiplier for each.

    Args:
        name: Name of the group.
        comm: Communicator.
        items: Number of items.
        count: Number of constraints of each.
        violation: The constraints as a function of the state, all at most quadratic, shape (n,).
        force: Size of the multipliers' forces; one number, or one for each constraint: N where
            positions are held, N m where directions are.
        sizes: What violations are relative to; one number, or one for each constraint: the length
            of the scene, m, where positions are held, 1 where directions are.
        switched: Whether single constraints may be switched off.
        targets: As of `NodeGroup`.
        own: As of `NodeGroup`; multipliers are a part "mu" besides.
        places: As of `NodeGroup`.

    Attributes:
        labels: Name of each item, for messages and results.
        allowed: Constraints that may act at all, shape (items, count): not the redundant ones.
        sizes: What violations of each constraint are relative to, shape (count,).
        quadratic: Whether they are at most quadratic in the state.
    """

    quadratic = True
    # whether what it holds has no inertia, and whether velocities obey
    inertialess = False
    moving = True
    # constraints that hold directions, and no positions
    directions: Sequence[int] = ()
    # whether its items have a direction of motion in their planes, as wheels have
    heads = False

    def __init__(
        self,
        name: str,
        comm: MPI.Comm,
        items: int,
        count: int,
        violation: Callable[[Expr], Expr],
        force: float | Sequence[float],
        sizes: float | Sequence[float] = 1.0,
        switched: bool = False,
        *,
        targets: Mapping[str, Targets] = NONE,
        own: Mapping[str, int] = NONE,
        places: Sequence[Places] = (),
    ) -> None:
        title = PartScale("mu", f"multiplier of {name}", SMALL_FORCE, "a smaller step", idle=True)
        parts = {**own, "mu": count}
        super().__init__(name, comm, items, targets, parts, places, (title,))
        self.jump_parts = frozenset({"mu"})
        self.violation, self.items, self.count = violation, items, count
        self.sizes = np.broadcast_to(np.asarray(sizes, dtype=float), (count,))
        self.force = fem.Constant(self.nodes.mesh, force)
        self.labels = [name] * items
        self.allowed = np.ones((items, count), dtype=bool)
        self._switched = np.ones((items, count), dtype=bool)
        self.on = self.per_item(self._switched, "on") if switched else None

    def move_along(self, own: Mapping[str, tuple[str, float]], advice: str) -> None:
        """Let parts of its own have velocities, and jumps of these, as the places have.

        Args:
            own: Title and size of each part, by name.
            advice: What to try if it does not converge.
        """
        scales = (PartScale(part, title, size, advice) for part, (title, size) in own.items())
        self.parts = (*self.parts, *scales)
        self.kinematic = frozenset(self.mixed.parts) - {"mu"}
        self.jump_parts = frozenset({*own, "mu"})

    def switch(self, on: Bools) -> None:
        """Switch single constraints on and off, shape (items, count)."""
        assert self.on is not None
        self._switched = on
        set_constants(self.on, self.nodes, (on & self.allowed).astype(float))

    def drop(self, item: int, component: int) -> None:
        """Leave a constraint that others imply out for good: its multiplier is kept at zero.

        Args:
            item: Which item.
            component: Which of its constraints.
        """
        self.allowed[item, component] = False
        rows = self.mixed.dofs["mu"].reshape(-1, self.count)[self.nodes.item == item]
        self.fixed.append(FixedDofs(rows[:, component]))

    @property
    def law(self) -> Law:
        """Functions that must vanish, and their rows in a step."""
        return Held(self.violation)

    @property
    def constraints(self) -> tuple[Constraints, ...]:
        """The group's own."""
        layout = self.layout
        held = self.law, lambda q: layout.part(q, "mu"), self.force, self.dx, self.errors
        return (Constraints(*held, self.inertialess, self.moving, self.on),)

    def heading(self, row: int, q: Floats) -> Floats:
        """Direction of motion in the plane of an item, shape (2,), if it `heads`.

        Args:
            row: Local cell.
            q: State of the group.
        """
        raise NotImplementedError

    def looked_at(self, state: Expr) -> Expr:
        """Values at a state, whose derivatives at the reference are looked at."""
        return self.violation(state)

    @cached_property
    def _evaluate(self) -> Callable[[Floats], Floats]:
        """Finds violations, shape (k, local items, count), at local arrays of some states."""
        state = fem.Function(self.mixed.space)
        return values_at_states(self.looked_at(state), state)

    def violations_at(self, states: Floats) -> Floats:
        """Values of the constraints at local arrays of some states, shape (k, dofs).

        Returns:
            One row per local item of each state, shape (k, local items, count).
        """
        return self._evaluate(states)

    @property
    def acting(self) -> Bools:
        """Constraints of the local items that act now, shape (local items, count)."""
        acting = self.allowed[self.nodes.item]
        if self.on is not None:
            rows = self.on.function_space.dofmap.list[:, 0]
            acting = acting & (self.on.x.array.reshape(-1, self.count)[rows] > 0)
        return acting

    def apart(self, q: fem.Function) -> Floats:
        """Violations of the local items, each relative to its size; what is switched off has none.

        What was left out as redundant counts: it has to hold all the same.

        Args:
            q: The state.

        Returns:
            Shape (local items, count).
        """
        return self.relative(self.violations_at(q.x.array[None])[0], self.switched_on)

    @property
    def switched_on(self) -> Bools:
        """Constraints of the local items that are not switched off, shape (local items, count)."""
        return np.asarray(self._switched[self.nodes.item])

    def relative(self, violations: Floats, on: Bools) -> Floats:
        """Sizes of violations, each relative to its own.

        Args:
            violations: Those of the local items, shape (..., local items, count).
            on: Which are not switched off, shape (..., local items, count); others have none.
        """
        return np.where(on, np.abs(violations) / self.sizes, 0.0)

    def said(self, component: int, apart: float) -> str:
        """A violation in words: "1.2e-03", a length, or "42 degrees".

        Args:
            component: Which constraint.
            apart: Its violation, relative to its size.
        """
        if component in self.directions:
            return f"{np.degrees(np.arcsin(min(apart, 1.0))):.3g} degrees"
        return f"{apart * self.sizes[component]:.3g}"

    def gradients(self, length: float, at: Floats | None = None) -> tuple[Floats, Int32s, Floats]:
        """Derivatives of the constraints at a state, without a form.

        Of quadratic constraints differences are exact.

        Args:
            length: Size of the scene, m.
            at: Local array of the state; None: the reference.

        Returns:
            Derivatives, shape (local items, count, columns), the local dofs they are along, shape
            (local items, columns), and what is large for these, shape (columns,).
        """
        sizes = {p: n for p, (_, n) in self.mixed.parts.items() if p != "mu"}
        dofs = np.hstack([self.mixed.dofs[p].reshape(-1, n) for p, n in sizes.items()])
        small = 1.0 if self.quadratic else SMALL_STEP
        unit = {p: length if p.startswith("u") else 1.0 for p in sizes}
        steps = [small * unit[p] for p, n in sizes.items() for _ in range(n)]
        columns = []
        middle = np.zeros(len(fem.Function(self.mixed.space).x.array)) if at is None else at
        for step, column in zip(steps, dofs.T, strict=True):
            aside = np.zeros(len(middle))
            aside[column] = step
            ahead, behind = self._evaluate(np.array([middle + aside, middle - aside]))
            columns.append((ahead - behind) / (2 * step))
        return np.stack(columns, axis=2), dofs, np.array(steps) / small

    def gaps(self, states: Floats) -> Floats:
        """Largest violations of the local items over local states, shape (states, local dofs)."""
        return np.asarray(np.max(np.abs(self.violations_at(states)), axis=0))

    def errors(self, states: Floats) -> Floats:
        """Largest violations on this rank, relative to their sizes, of some states, shape (k,)."""
        apart = self.relative(self.violations_at(states), self.switched_on)
        return np.asarray(np.max(apart, axis=(1, 2), initial=0.0))


# what has functions of time in its constraints
Prescribed = Joint | Relation


class GivenValues:
    """Functions of time of the items of a group, as many of each.

    Their changes since the time 0 are the part "s" of the group's space. So constraints are
    functions of the state alone, and what moves the values does the work.

    Args:
        items: Descriptions with their functions.

    Attributes:
        parts: Sizes of the parts of the group's space.
    """

    def __init__(self, items: Sequence[Prescribed]) -> None:
        self._items = items
        self._start: fem.Function | None = None
        count = len(items[0].given) if items else 0
        self.parts = {"s": count} if count else {}

    def _at(self, t: float) -> Floats:
        said = [(item, f"{item.said}: value over time") for item in self._items]
        values = [[numbers_at(f(t), t, who, 1, i.above) for f in i.given] for i, who in said]
        return np.array(values, dtype=float)

    def values(self, q: Expr, layout: Layout) -> list[Expr]:
        """Values at a state of the group."""
        if self._start is None:
            return []
        change, start = layout.part(q, "s"), self._start
        if not start.ufl_shape:
            return [start + change]
        return [start[k] + change[k] for k in range(start.ufl_shape[0])]

    def prescribe(self, group: NodeGroup) -> None:
        """Prescribe them.

        Args:
            group: The group.
        """
        if not self.parts:
            return
        first = self._at(0.0)
        self._start = group.per_item(first, "given")
        dofs, here = group.mixed.dofs["s"], group.nodes.item
        group.kinematic |= {"s"}
        group.jump_parts |= {"s"}
        group.fixed.append(FixedDofs(dofs, lambda t: (self._at(t) - first)[here].ravel()))
