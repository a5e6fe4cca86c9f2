"""The fields and forms of a system mesh by mesh, as the loops over cells take them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from dolfinx import fem

from shellmb.arrays import Floats, Ints
from shellmb.native.assembler import is_native
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import Field
from shellmb.system.assembly.functionals import DolfinxResiduals, Residuals, RowForm
from shellmb.system.assembly.loops import LoopResiduals, MeshCells, PlacedForm, Rows


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
        return _rows(self.numbers, self.cells, self.system.residual_forms)

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
    found = _by_mesh(system.fields, system.numbering.offsets, system.held)
    return [MeshGroup(system, *each) for each in found]


def _by_mesh(
    fields: Sequence[Field], offsets: Sequence[int] | Ints, held: Sequence[npt.NDArray[np.int8]]
) -> Iterator[tuple[list[int], MeshCells]]:
    """Numbers of the fields on each mesh, with its cells."""
    groups: dict[int, list[int]] = {}
    for k, field in enumerate(fields):
        groups.setdefault(id(field.function.function_space.mesh), []).append(k)
    for numbers in groups.values():
        places = [int(offsets[k]) for k in numbers]
        yield numbers, MeshCells([fields[k] for k in numbers], places, [held[k] for k in numbers])


def _rows(numbers: list[int], cells: MeshCells, forms: Sequence[RowForm]) -> Rows:
    """Cells with the forms on them, whose rows are numbered among the fields of the mesh."""
    placed = [(form, rows) for form, rows in forms if rows[0] in numbers]
    return cells, [(form, tuple(map(numbers.index, rows)), -1) for form, rows in placed]


def residuals_of(
    fields: Sequence[Field],
    offsets: Sequence[int],
    held: Sequence[npt.NDArray[np.int8]],
    forms: Sequence[RowForm],
) -> Residuals:
    """Make what assembles linear forms into the local arrays of some fields.

    Args:
        fields: The fields.
        offsets: First place of each in the concatenated local arrays.
        held: Which of their local dofs have given values.
        forms: Compiled forms with the numbers of the fields whose rows they have.
    """
    if not is_native():
        return DolfinxResiduals(forms, fields, offsets)
    return LoopResiduals(_rows(*each, forms) for each in _by_mesh(fields, offsets, held))


def residuals_of_fields(
    system: BlockSystem, forms: Mapping[int, Sequence[fem.Form]]
) -> Callable[[], Floats]:
    """Make what assembles residuals of some fields alone, with their own local dofs.

    Args:
        system: The system.
        forms: Compiled residuals by the number of their field.

    Returns:
        Finds them, of the fields one behind the other.
    """
    fields = [system.fields[number] for number in forms]
    offsets = np.cumsum([0, *(field.size_all for field in fields)])
    held = [system.held[number] for number in forms]
    rows = [(form, (k,)) for k, some in enumerate(forms.values()) for form in some]
    residuals = residuals_of(fields, offsets[:-1].tolist(), held, rows)

    def find() -> Floats:
        found = np.zeros(offsets[-1])
        residuals.refresh()
        residuals.add(found)
        return found

    return find
