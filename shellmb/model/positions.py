"""Functions of the position as fields on a shell's nodes."""

import numpy as np
from dolfinx import fem

from shellmb.build.spaces import MixedSpace
from shellmb.scene.positions import OfPosition


def interpolated(function: OfPosition, mixed: MixedSpace, name: str) -> fem.Function:
    """A vector (3, n), or a number (n,), of reference positions (3, n), at the nodes.

    Args:
        function: The function.
        mixed: Space of the shell, whose displacement has the nodes.
        name: Name of the field.
    """
    space = mixed.subspaces["u"]
    if np.ndim(function(np.zeros((3, 1)))) == 1:
        space = space.sub(0).collapse()[0]
    field = fem.Function(space, name=name)
    field.interpolate(function)
    return field
