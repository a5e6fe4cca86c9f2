"""Strains of shells and beams that are linear in what these move by relative to a floating frame.

With the tangents `T = (x_,a, d, d_,a)` the strains of eq. (9) are `C(T, T)/2 - C(T_0, T_0)/2`, `C`
being bilinear (`shell.strain_form`). Relative to a frame that turns by `R` their linear part is

    C(R T_0, T - R T_0) = C(R T_0, T) - C(T_0, T_0)

which is bilinear in the unknowns of the frame and of the body, and unchanged by rotations; so it
is quadratic in the state, as the exact measure is. Tensions do not stiffen bending here, and what
bends does not shorten. A director keeps its length, and so its component along the reference
director falls by `|d - R D|^2/2`; linear theory has none of that, and it is put back.

Directors of a beam stay orthonormal, and so the changes `g_k = d_k - R D_k` have a symmetric part
of second order, `-(g_k . g_m)/2` along `R D_m`, which is no rotation; it is put back, too.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms import beam, shell
from shellmb.forms.beam import Line, LineTangents
from shellmb.forms.floating.frame import Moved, Turned, carried
from shellmb.forms.frame import Vectors, vectors
from shellmb.forms.measure import Measure, quadratic
from shellmb.forms.shell import Surface, Tangents, along


class Apart(NamedTuple):
    """Parts of the strains.

    Args:
        here: Tangents and directors, or their changes.
        frame: The same of the reference as the frame carries it.
        lean: Director of the shell, or directors of the beam, less those of the frame.
    """

    here: Any
    frame: Any
    lean: Any


def turned_with_shell(u: Expr, w: Expr, surf: Surface) -> list[Turned]:
    """Material vectors whose mean rotation is the frame's: tangents and director."""
    return list(zip((surf.e1, surf.e2, surf.D), shell.tangents(u, w, surf)[:3], strict=True))


def turned_with_beam(w: Expr, ref: Line) -> list[Turned]:
    """Material vectors whose mean rotation is the frame's: the directors."""
    return list(zip(vectors(ref.D), vectors(w), strict=True))


def of_shell(surf: Surface, moved: Callable[[Expr], Moved]) -> Measure:
    """Small strains (eps, kap, gam) of a shell relative to the frame, shape (8,).

    Args:
        surf: Reference surface.
        moved: Displacement, change of the director and changes of the frame's directors in a state.
    """
    rest, strains = shell.reference_tangents(surf), shell.strain_form
    # what a director that is longer by one has in the strains
    lengths = strains(rest, rest._replace(x1=0 * rest.x1, x2=0 * rest.x2))

    def form(a: Apart, b: Apart) -> Expr:
        kept = ufl.dot(a.lean, b.lean)
        return strains(a.frame, b.here) + strains(a.here, b.frame) + kept * lengths

    def apart(q: Expr) -> Apart:
        u, w, frame = moved(q)
        t, f = shell.tangents(u, w, surf), vectors(frame)
        r = Tangents(*(carried(f, V) for V in rest))
        return Apart(t, r, t.d - r.d)

    return quadratic(form, Apart(rest, rest, 0 * surf.D), apart)


def of_beam(ref: Line, moved: Callable[[Expr], Moved]) -> Measure:
    """Small strains (Gamma, K) of a beam relative to the frame, shape (6,).

    Args:
        ref: Reference line.
        moved: Displacement, changes of the directors and of the frame's directors in a state.
    """
    rest = beam.rest_tangents(ref)

    def form(a: Apart, b: Apart) -> Expr:
        kept = beam.strain_form(ref, rest, _kept(a.lean, b.lean, ref))
        one, other = beam.strain_form(ref, a.frame, b.here), beam.strain_form(ref, a.here, b.frame)
        return one + other + kept

    def apart(q: Expr) -> Apart:
        u, w, frame = moved(q)
        t, f = beam.line_tangents(u, w, ref), vectors(frame)
        d, ds = (tuple(carried(f, V) for V in some) for some in (rest.d, rest.ds))
        lean = tuple(x - y for x, y in zip(t.d, d, strict=True))
        return Apart(t, LineTangents(carried(f, rest.x1), d, ds), lean)

    return quadratic(form, Apart(rest, rest, (0 * ref.t,) * 3), apart)


def _kept(g: Vectors, h: Vectors, ref: Line) -> LineTangents:
    """Changes `(g_k . h_m + h_k . g_m)/2 D_m` of the directors; the line stays."""
    D, Ds = vectors(ref.D), vectors(along(ref.D, ref.t))

    def put(k: int, V: Vectors) -> Expr:
        sizes = [(ufl.dot(g[k], h[m]) + ufl.dot(h[k], g[m])) / 2 for m in range(3)]
        return sizes[0] * V[0] + sizes[1] * V[1] + sizes[2] * V[2]

    d, ds = (tuple(put(k, V) for k in range(3)) for V in (D, Ds))
    return LineTangents(0 * ref.t, d, ds)
