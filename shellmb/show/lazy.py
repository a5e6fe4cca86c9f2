"""An array over states whose numbers are read from the files of the states when they are used."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from xarray.backends import BackendArray
from xarray.core import indexing

from shellmb.files.grids import read_values


class OnFiles(BackendArray):
    """Values of one array in files of states.

    Args:
        files: A file for each state.
        name: Name of the array, or `values.POSITION`.
        shape: Of one state.
    """

    def __init__(self, files: Sequence[Path], name: str, shape: tuple[int, ...]) -> None:
        self._files, self._name = list(files), name
        self.shape = (len(self._files), *shape)
        self.dtype = np.dtype(float)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.BASIC, self._read
        )

    def _read(self, key: tuple[Any, ...]) -> Any:
        first, *rest = key
        if not isinstance(first, slice):
            return read_values(self._files[first], self._name)[tuple(rest)]
        files = self._files[first]
        empty = np.empty((0, *self.shape[1:]))
        states = np.array([read_values(file, self._name) for file in files]) if files else empty
        return states[(slice(None), *rest)]
