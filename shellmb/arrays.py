"""Types of NumPy arrays, by what they hold, and real numbers of what is given."""

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Int32s = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Complex = npt.NDArray[np.complex128]


def reals(given: Any, who: str = "it") -> Floats:
    """Real numbers in an array: of complex ones NumPy would drop the imaginary parts.

    Args:
        given: The numbers.
        who: What errors call them.

    Raises:
        TypeError: If something is complex, or no number.
        ValueError: If something is no number, or rows differ in length.
    """
    found = np.asarray(given)
    if np.iscomplexobj(found):
        raise TypeError(f"{who} has complex numbers")
    return np.asarray(found, dtype=float)


def reals_or_nan(given: Any) -> Floats:
    """Real numbers in an array; one NaN where something else is given.

    Args:
        given: Numbers, or anything.
    """
    try:
        return reals(given)
    except (OverflowError, TypeError, ValueError):
        return np.array(np.nan)
