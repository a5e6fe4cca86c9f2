"""Values over time that constraints contain: unknowns of a group that are prescribed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import NodeMesh, constant_vector
from shellmb.model.body import FixedDofs, TimeFunction
from shellmb.model.massless import Massless
from shellmb.scene.checks.locations import numbers_at


class Prescribed(Protocol):
    """A joint or coupling of a scene."""

    @property
    def said(self) -> str:
        """Name that messages use for it."""
        ...

    @property
    def given(self) -> Sequence[TimeFunction]:
        """Functions of time that its constraints contain."""
        ...


class GivenValues:
    """Functions of time of the items of a group, as many of each.

    Their changes since the time 0 are the part "s" of the group's space. So constraints are
    functions of the state alone, and what moves the values does the work.

    Args:
        nodes: Node mesh of the group.
        items: Descriptions with their functions.
    """

    forms_read = ("_start",)

    def __init__(self, nodes: NodeMesh, items: Sequence[Prescribed]) -> None:
        self._nodes, self._items = nodes, items
        self._first = self._at(0.0)
        self._start = constant_vector(nodes, self._first, "given") if self.parts else None

    @property
    def parts(self) -> dict[str, int]:
        """Sizes of the parts of the group's space."""
        return {"s": len(self._items[0].given)} if self._items[0].given else {}

    def _at(self, t: float) -> Floats:
        values = [
            [numbers_at(f(t), t, f"{item.said}: value over time") for f in item.given]
            for item in self._items
        ]
        return np.array(values, dtype=float)

    def values(self, q: Expr, layout: Layout) -> list[Expr]:
        """Values at a state of the group."""
        if self._start is None:
            return []
        change, start = layout.part(q, "s"), self._start
        if not start.ufl_shape:
            return [start + change]
        return [start[k] + change[k] for k in range(start.ufl_shape[0])]

    def prescribe(self, group: Massless) -> None:
        """Prescribe them.

        Args:
            group: The group.
        """
        if self._start is None:
            return
        dofs, here = group.mixed.dofs["s"], self._nodes.item
        group.kinematic |= {"s"}
        group.jump_parts |= {"s"}
        group.fixed.append(
            FixedDofs(dofs, lambda t: (self._at(t) - self._first)[here].ravel(), True)
        )
