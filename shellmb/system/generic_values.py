"""States and parameters in general position, at which nothing is zero by chance."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from dolfinx import fem
from ufl import Form


@contextmanager
def general_position(forms: Sequence[Form]) -> Iterator[None]:
    """For a moment, all that forms depend on has such values.

    Args:
        forms: The forms.
    """
    # in the order of the forms and not of a set, so that each run finds the same entries
    functions = dict.fromkeys(c for form in forms for c in form.coefficients())
    arrays = [c.x.array for c in functions if isinstance(c, fem.Function)]
    constants = dict.fromkeys(c for form in forms for c in form.constants())
    arrays += [c.value for c in constants if isinstance(c, fem.Constant)]
    kept = [array.copy() for array in arrays]
    general = np.random.default_rng(0)
    for array in arrays:
        # near what is not zero: directors stay on their side of a curved surface
        size = np.max(np.abs(array), initial=0.0)
        array[...] += general.uniform(0.5, 1.5, array.shape) * (0.1 * size or 1.0)
    try:
        yield
    finally:
        for array, values in zip(arrays, kept, strict=True):
            array[...] = values
