"""Functions of the position: vectorised, of reference positions (3, n)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shellmb.errors import SceneError
from shellmb.scene.values.validate import in_words

__all__ = ["OfPosition", "values_at"]

OfPosition = Callable[[Any], Any]


def values_at(
    function: OfPosition, x: NDArray[np.float64], size: int, who: str
) -> NDArray[np.float64]:
    """Its values, checked.

    Args:
        function: The function.
        x: Positions, shape (3, n).
        size: Number of components; 1: a scalar.
        who: What messages call it.

    Returns:
        Shape (size, n), of a scalar (n,).

    Raises:
        SceneError: If it fails, or gives another shape or a number that is not finite.
    """
    try:
        value = np.asarray(function(x), dtype=float)
    except Exception as error:
        raise SceneError(
            f"{who} fails ({in_words(error)}); it must be written for an array of positions"
        ) from error
    wanted = x.shape[1:] if size == 1 else (size, *x.shape[1:])
    if value.shape != wanted:
        raise SceneError(
            f"{who} gives an array of shape {value.shape} for positions of shape {x.shape}; "
            f"it must give {'the same shape' if wanted == x.shape else wanted}"
        )
    if not np.isfinite(value).all():
        raise SceneError(f"{who} gives a number that is not finite")
    return value
