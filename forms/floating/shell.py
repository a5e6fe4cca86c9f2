"""Strains of a shell that are linear in what it moves by relative to a floating frame.

With the tangents `T = (x_,a, d, d_,a)` the strains of eq. (9) are `C(T, T)/2 - C(T_0, T_0)/2`, `C`
being bilinear (`shell.bilinear`). Relative to a frame that turns by `R` their linear part is

    C(R T_0, T - R T_0) = C(R T_0, T) - C(T_0, T_0)

which is bilinear in the unknowns of the frame and of the shell, and unchanged by rotations; so it
is quadratic in the state, as the exact measure is. Tensions do not stiffen bending here, and what
bends does not shorten. A director keeps its length, and so its component along the reference
director falls by `|d - R D|^2/2`; linear theory has none of that, and it is put back.
"""

from collections.abc import Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.floating.frame import Moved, Turned, carried
from shellmb.forms.frame import vectors
from shellmb.forms.shell import (
    ShellStrains,
    Tangents,
    bilinear,
    combined,
    reference_tangents,
    tangents,
)
from shellmb.forms.surface import Surface


def carried_tangents(frame: Expr, surf: Surface) -> Tangents:
    """Changes of the reference's tangents that turn with the frame."""
    f = vectors(frame)
    return Tangents(*(carried(f, V) for V in reference_tangents(surf)))


def turned(u: Expr, w: Expr, surf: Surface) -> list[Turned]:
    """Material vectors whose mean rotation is the frame's: tangents and director."""
    x1, x2, d, *_ = tangents(u, w, surf)
    return list(zip((surf.e1, surf.e2, surf.D), (x1, x2, d), strict=True))


def linear_strains(moved: Moved, surf: Surface) -> ShellStrains:
    """Strains of a state.

    Args:
        moved: Displacement, change of the director, changes of the frame's directors.
        surf: Reference surface.
    """
    u, w, frame = moved
    t, r, rest = tangents(u, w, surf), carried_tangents(frame, surf), reference_tangents(surf)
    both = combined([(1, t), (1, r)])
    lean = t.d - r.d
    kept = ufl.dot(lean, lean) / 2
    parts = (bilinear(rest, both), bilinear(r, t), _lengths(surf))
    return ShellStrains(*(a + b + kept * c for a, b, c in zip(*parts, strict=True)))


def linear_slope(
    surf: Surface, c: Expr | None, states: Sequence[tuple[Expr, Moved]], change: Moved
) -> ShellStrains:
    """Change of these strains, taken at `c` times the reference and weighted states.

    Args:
        surf: Reference surface.
        c: Share of the reference; None: none.
        states: Weights with states.
        change: Change of the state.
    """
    rest = [] if c is None else [(c, reference_tangents(surf))]
    t = [(weight, tangents(u, w, surf)) for weight, (u, w, _) in states]
    r = [(weight, carried_tangents(frame, surf)) for weight, (_, _, frame) in states]
    dt, dr = tangents(change[0], change[1], surf), carried_tangents(change[2], surf)
    found = [bilinear(combined([*r, *rest]), dt), bilinear(combined([*t, *rest]), dr)]
    if not states:
        return ShellStrains(*(a + b for a, b in zip(*found, strict=True)))
    leans = [weight * (a.d - b.d) for (weight, a), (_, b) in zip(t, r, strict=True)]
    kept = ufl.dot(sum(leans[1:], leans[0]), dt.d - dr.d)
    parts = zip(*found, _lengths(surf), strict=True)
    return ShellStrains(*(a + b + kept * c for a, b, c in parts))


def _lengths(surf: Surface) -> ShellStrains:
    """What a director that is longer by one has in the strains."""
    rest = reference_tangents(surf)
    return bilinear(rest, Tangents(0 * rest.x1, 0 * rest.x2, *rest[2:]))
