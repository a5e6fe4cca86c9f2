"""Residuals of the fields of a system, assembled by DOLFINx; by our own loops in `loops`."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats, Ints
from shellmb.native.library import cell_dofs
from shellmb.system.assembly.fields import Field
from shellmb.system.assembly.loops import LoopResiduals

# a compiled residual with the numbers of the fields whose rows it has
RowForm = tuple[fem.Form, tuple[int, ...]]


class DolfinxResiduals:
    """Residuals form by form, by DOLFINx.

    Args:
        forms: Compiled forms with the numbers of the fields whose rows they are.
        fields: The fields.
        offsets: First place of each in the local arrays.
    """

    def __init__(
        self, forms: Sequence[RowForm], fields: Sequence[Field], offsets: Sequence[int]
    ) -> None:
        self._forms, self._fields, self._offsets = forms, fields, offsets

    @cached_property
    def _placed(self) -> list[tuple[fem.Form, Ints]]:
        """Forms with the places of their rows; found when they are first assembled by these."""
        tables = [
            cell_dofs(field.function.function_space) + int(offset)
            for field, offset in zip(self._fields, self._offsets, strict=False)
        ]
        found = []
        for form, rows in self._forms:
            if form.rank == 0:
                # a term of nothing
                continue
            (space,) = form.function_spaces
            own = cell_dofs(space)
            places = np.zeros(own.max(initial=-1) + 1, dtype=np.int64)
            places[own] = np.hstack([tables[k] for k in rows])
            found.append((form, places))
        return found

    def add(self, local: Floats) -> None:
        """Add them to the concatenated local arrays."""
        for form, places in self._placed:
            local[places] += fem.assemble_vector(form).array

    def refresh(self) -> None:
        """Take nothing: DOLFINx does at each assembly."""


# what assembles the residuals of all fields
Residuals = DolfinxResiduals | LoopResiduals
