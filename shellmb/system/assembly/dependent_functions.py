"""Functions that follow the unknown ones, in one call of `unknowns.c`."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from shellmb.native import library as native
from shellmb.native.assembler import is_native
from shellmb.native.library import CArrays
from shellmb.system.assembly.fields import DependentFunctions


def following(followers: Sequence[DependentFunctions]) -> Callable[[], None]:
    """Make what gives functions that follow others their values.

    Args:
        followers: The functions.
    """
    return Following(followers) if is_native() else partial(_follow, followers)


def _follow(followers: Sequence[DependentFunctions]) -> None:
    for some in followers:
        sources = [source.x.array for source in some.sources]
        for function, row in zip(some.functions, some.weights, strict=True):
            # what is always zero stays so
            if np.any(row):
                function.x.array[:] = sum(w * s for w, s in zip(row, sources, strict=True) if w)


class Following:
    """Gives functions that are combinations of others their values.

    Args:
        followers: The functions, whose arrays live as long as this object.

    Attributes:
        members: For C, in the order of the arguments.
    """

    def __init__(self, followers: Sequence[DependentFunctions]) -> None:
        self._lib, self._pointer = native.cells().lib, CArrays()
        sizes, terms, sources, weights, targets = [], [], [], [], []
        for some in followers:
            for function, row in zip(some.functions, some.weights, strict=True):
                # what is always zero stays so
                of = [k for k, weight in enumerate(row) if weight]
                if of:
                    sizes.append(len(function.x.array))
                    terms.append(len(of))
                    targets.append(self._pointer(function.x.array))
                    sources += [self._pointer(some.sources[k].x.array) for k in of]
                    weights += [row[k] for k in of]
        self.members: dict[str, Any] = {
            "followers": len(sizes),
            "sizes": self._pointer(np.array(sizes or [0], dtype=np.int32)),
            "terms": self._pointer(np.array(terms or [0], dtype=np.int32)),
            "from": self._pointer.many("double *", sources),
            "weights": self._pointer(np.array(weights or [0.0])),
            "to": self._pointer.many("double *", targets),
        }

    def __call__(self) -> None:
        """Take the values of their sources."""
        self._lib.follow(*self.members.values())
