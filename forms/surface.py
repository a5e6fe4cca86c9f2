"""Local orthonormal basis of the reference surface and derivatives along it.

===========  ==================================================  =======  ===========
symbol       name                                                unit     equation
===========  ==================================================  =======  ===========
`e1`, `e2`   unit tangent vectors of the reference surface       -        (3)
`D`          reference director (unit normal at the nodes)       -        (3), `e_3`
`v_,a`       derivative of a field along `e_a`                   [v]/m    below (2)
===========  ==================================================  =======  ===========
"""

from typing import NamedTuple

import ufl
from ufl.core.expr import Expr


class Surface(NamedTuple):
    """Reference surface of a shell.

    Args:
        e1: Unit tangent vector along the material direction, shape (3,).
        e2: Unit tangent vector completing a right-handed triad with the director, shape (3,).
        D: Reference director, shape (3,).
    """

    e1: Expr
    e2: Expr
    D: Expr


def unit(v: Expr) -> Expr:
    """Vector of unit length along `v`."""
    return v / ufl.sqrt(ufl.dot(v, v))


def surface(jacobian: Expr, direction: Expr, D: Expr) -> Surface:
    """Orthonormal triad of eq. (3), with `e1` the material direction projected on the surface.

    Args:
        jacobian: Jacobian of the reference surface, shape (3, 2).
        direction: Material 1-direction, shape (3,); need not be tangent, must not be normal.
        D: Reference director, shape (3,); only its side of the surface is used for the basis.

    Returns:
        The triad `e1, e2` (exactly tangent) and the director.
    """
    normal = unit(ufl.cross(jacobian[:, 0], jacobian[:, 1]))
    # the cell's own normal may point either way; the director says which way is up
    normal = ufl.sign(ufl.dot(normal, D)) * normal
    e1 = unit(direction - ufl.dot(direction, normal) * normal)
    return Surface(e1, ufl.cross(normal, e1), D)


def along(v: Expr, e: Expr) -> Expr:
    """Derivative of the vector field `v` along the unit tangent `e`, shape (3,)."""
    return ufl.dot(ufl.grad(v), e)
