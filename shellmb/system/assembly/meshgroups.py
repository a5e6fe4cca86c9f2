"""The fields and forms of a system mesh by mesh, as the loops over cells take them."""

from __future__ import annotations

from dataclasses import dataclass

from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.loops import MeshCells, PlacedForm, Rows


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
