"""Types of NumPy arrays, by what they hold, and arrays of what a user gives."""

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Int32s = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Complex = npt.NDArray[np.complex128]


def floats_or_nan(given: Any) -> Floats:
    """What is given as an array; one NaN where it is none of numbers.

    Args:
        given: Numbers, or anything.
    """
    try:
        return np.asarray(given, dtype=float)
    except (OverflowError, TypeError, ValueError):
        return np.array(np.nan)
