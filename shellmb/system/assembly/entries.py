"""Bounds on the entries in the rows of a block matrix, whose memory is then requested once."""

from collections.abc import Iterable, Sequence

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.native.library import cell_dofs
from shellmb.system.assembly.fields import Field
from shellmb.system.assembly.numbering import Numbering


def most_entries(
    comm: MPI.Comm, numbering: Numbering, fields: Sequence[Field], places: Iterable[tuple[int, int]]
) -> npt.NDArray[np.int32] | None:
    """Bound on the entries of each row: all columns of all cells around its unknown.

    Args:
        comm: Communicator.
        numbering: Numbers of the unknowns.
        fields: The fields.
        places: Blocks that are not empty, by row and column field.

    Returns:
        The bounds, shape (owned,). None on several ranks, whose rows have entries from cells of
        others, and where a block has its rows and columns from different meshes.
    """
    n = numbering
    if comm.size > 1:
        return None
    found = np.ones(n.owned, dtype=np.int64)
    tables = [cell_dofs(field.function.function_space) for field in fields]
    for i, j in places:
        rows, columns = tables[i], tables[j]
        if len(rows) != len(columns):
            return None
        numbers = n.local_to_global[rows.ravel() + n.offsets[i]]
        found += columns.shape[1] * np.bincount(numbers, minlength=n.owned)
    return np.minimum(found, n.owned).astype(PETSc.IntType)
