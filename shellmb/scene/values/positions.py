"""Functions of the position: vectorised, of reference positions (3, n)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shellmb.errors import SceneError
from shellmb.scene.values.validate import in_words

OfPosition = Callable[[Any], Any]
Several = list | tuple
# what could be made a float, and is not meant as one, by NumPy's kinds
NO_NUMBERS = {"b": "truth values", "c": "complex numbers"}


def values_at(
    function: OfPosition, x: NDArray[np.float64], size: int, who: str
) -> NDArray[np.float64]:
    """Checked values at points.

    Args:
        function: The function.
        x: Positions, shape (3, n).
        size: Number of components; 1: a scalar.
        who: What messages call it.

    Returns:
        Shape (size, n), of a scalar (n,).

    Raises:
        SceneError: If it fails, or gives another shape, a number that is not finite, or other
            numbers when it is called again.
    """
    try:
        given = function(x)
        # components may be of several kinds, of which an array would make one
        parts = [given, *given] if isinstance(given, Several) else [given]
        kinds = {np.asarray(part).dtype.kind for part in parts} & NO_NUMBERS.keys()
        value = np.zeros(0) if kinds else np.array(given, dtype=float)
        # each rank, and each quantity that needs it, asks for itself
        again = value if kinds else np.asarray(function(x), dtype=float)
    except (Exception, SystemExit) as error:
        raise SceneError(
            f"{who} fails ({in_words(error)}); it must be written for an array of positions"
        ) from error
    if kinds:
        said = " and ".join(NO_NUMBERS[kind] for kind in sorted(kinds))
        raise SceneError(f"{who} gives {said}; it must give real numbers")
    wanted = x.shape[1:] if size == 1 else (size, *x.shape[1:])
    if value.shape != wanted:
        raise SceneError(
            f"{who} gives an array of shape {value.shape} for positions of shape {x.shape}; "
            f"it must give {'the same shape' if wanted == x.shape else wanted}"
        )
    if not np.isfinite(value).all():
        raise SceneError(f"{who} gives a number that is not finite")
    if not np.array_equal(value, again):
        raise SceneError(
            f"{who} gives other values when it is called again; it must depend on positions only: "
            "make random numbers once, outside of it and with a seed"
        )
    return value


def check_sign(
    value: NDArray[np.float64], x: NDArray[np.float64], who: str, strictly: bool
) -> None:
    """Refuse values of a scalar function that are negative.

    Args:
        value: The values, shape (n,).
        x: Positions, shape (3, n).
        who: What messages call them.
        strictly: Whether zero is refused, too.

    Raises:
        SceneError: Says where one is.
    """
    if (value <= 0).any() if strictly else (value < 0).any():
        worst = int(np.argmin(value))
        place = tuple(float(f"{c:.4g}") for c in x[:, worst])
        raise SceneError(
            f"{who} is {value[worst]:.4g} at {place}; it must be "
            f"{'greater than' if strictly else 'at least'} 0 everywhere"
        )
