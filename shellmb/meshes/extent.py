"""Sizes with which floating-point numbers can compute."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from shellmb.errors import SceneError

# squares of squares of what lies between have finite reciprocals
SMALLEST, LARGEST = 1e-60, 1e60


def check_extent(sizes: npt.ArrayLike, unit: str, who: str) -> None:
    """Refuse elements whose sizes vanish or overflow when they are multiplied.

    Args:
        sizes: Lengths or areas of elements; zero, of degenerate ones, is for others to judge.
        unit: Their unit.
        who: The body, for the error.

    Raises:
        SceneError: Names the first such size.
    """
    sizes = np.ravel(sizes)
    wrong = sizes[((sizes > 0) & (sizes < SMALLEST)) | (sizes > LARGEST)]
    if len(wrong):
        raise SceneError(
            f"{who}: an element has {wrong[0]:.3g} {unit}; it must have between {SMALLEST:g} and "
            f"{LARGEST:g} {unit}, so give lengths in other units"
        )
