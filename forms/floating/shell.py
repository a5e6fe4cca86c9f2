"""Strains of a shell that are linear in what it moves by relative to a floating frame.

With the tangents `T = (x_,a, d, d_,a)` the strains of eq. (9) are `C(T, T)/2 - C(T_0, T_0)/2`, `C`
being bilinear (`shell.strain_form`). Relative to a frame that turns by `R` their linear part is

    C(R T_0, T - R T_0) = C(R T_0, T) - C(T_0, T_0)

which is bilinear in the unknowns of the frame and of the shell, and unchanged by rotations; so it
is quadratic in the state, as the exact measure is. Tensions do not stiffen bending here, and what
bends does not shorten. A director keeps its length, and so its component along the reference
director falls by `|d - R D|^2/2`; linear theory has none of that, and it is put back.
"""

from collections.abc import Callable
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.floating.frame import Moved, Turned, carried
from shellmb.forms.frame import vectors
from shellmb.forms.measure import Measure, quadratic
from shellmb.forms.shell import Surface, Tangents, reference_tangents, strain_form, tangents


def carried_tangents(frame: Expr, surf: Surface) -> Tangents:
    """Changes of the reference's tangents that turn with the frame."""
    f = vectors(frame)
    return Tangents(*(carried(f, V) for V in reference_tangents(surf)))


def turned(u: Expr, w: Expr, surf: Surface) -> list[Turned]:
    """Material vectors whose mean rotation is the frame's: tangents and director."""
    x1, x2, d, *_ = tangents(u, w, surf)
    return list(zip((surf.e1, surf.e2, surf.D), (x1, x2, d), strict=True))


class Apart(NamedTuple):
    """Parts of the strains.

    Args:
        here: Tangents and director, or their changes.
        frame: The same of the reference as the frame carries it.
        lean: Director of the shell less that of the frame, shape (3,).
    """

    here: Tangents
    frame: Tangents
    lean: Expr


def strain_measure(surf: Surface, moved: Callable[[Expr], Moved]) -> Measure:
    """Small strains (eps, kap, gam) relative to the frame, shape (8,).

    Args:
        surf: Reference surface.
        moved: Displacement, change of the director and changes of the frame's directors in a state.
    """
    rest = reference_tangents(surf)
    # what a director that is longer by one has in the strains
    lengths = strain_form(rest, rest._replace(x1=0 * rest.x1, x2=0 * rest.x2))

    def form(a: Apart, b: Apart) -> Expr:
        kept = ufl.dot(a.lean, b.lean)
        return strain_form(a.frame, b.here) + strain_form(a.here, b.frame) + kept * lengths

    def apart(q: Expr) -> Apart:
        u, w, frame = moved(q)
        t, r = tangents(u, w, surf), carried_tangents(frame, surf)
        return Apart(t, r, t.d - r.d)

    return quadratic(form, Apart(rest, rest, 0 * surf.D), apart)
