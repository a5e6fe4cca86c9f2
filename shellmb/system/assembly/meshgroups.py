"""The fields and forms of a system mesh by mesh, as the loops over cells take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.native.assembler import is_native
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.deferred import DeferredValues
from shellmb.system.assembly.loops import LoopResiduals, MeshCells, PlacedForm, Rows
from shellmb.system.assembly.residuals import DolfinxResiduals, Residuals


@dataclass(frozen=True)
class MeshGroup:
    """The fields on one mesh of a system.

    Args:
        system: The system.
        numbers: Numbers of the fields.
        cells: The cells.
    """

    system: BlockSystem
    numbers: list[int]
    cells: MeshCells

    @property
    def residuals(self) -> Rows:
        """The cells with the residual forms on them."""
        numbers = self.numbers
        return self.cells, [
            (form, tuple(numbers.index(k) for k in rows), -1)
            for form, rows in self.system.residual_forms
            if rows[0] in numbers
        ]

    def jacobians(self) -> list[PlacedForm]:
        """Derivatives of the residuals as `FormLoop` takes them."""
        numbers = self.numbers
        return [
            (form, (numbers.index(i),), numbers.index(j))
            for (i, j), forms in self.system.jacobians.items()
            if i in numbers
            for form in forms
        ]


def mesh_groups(system: BlockSystem) -> list[MeshGroup]:
    """All meshes of a system with the fields on each."""
    groups: dict[int, list[int]] = {}
    for k, field in enumerate(system.fields):
        groups.setdefault(id(field.function.function_space.mesh), []).append(k)
    offsets = system.numbering.offsets
    return [
        MeshGroup(
            system,
            numbers,
            MeshCells(
                [system.fields[k] for k in numbers],
                [int(offsets[k]) for k in numbers],
                [system.held[k] for k in numbers],
            ),
        )
        for numbers in groups.values()
    ]


def residuals_of_steps(
    system: BlockSystem, number: int, forms: Sequence[fem.Form], steps: int
) -> DeferredValues:
    """Make what assembles residuals of one field alone, with its own local dofs, in many steps.

    Args:
        system: The system.
        number: Number of the field.
        forms: Compiled residuals.
        steps: How many steps are kept.
    """
    field = system.fields[number]
    residuals: Residuals
    if is_native():
        cells = MeshCells([field], [0], [system.held[number]])
        residuals = LoopResiduals([(cells, [(form, (0,), -1) for form in forms])])
    else:
        residuals = DolfinxResiduals([(form, (0,)) for form in forms], [field], [0])

    def find() -> Floats:
        found = np.zeros(field.size_all)
        residuals.refresh()
        residuals.add(found)
        return found

    return DeferredValues(find, field.size_all, steps)
