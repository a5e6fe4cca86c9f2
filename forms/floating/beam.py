"""Strains of a beam that are linear in what it moves by relative to a floating frame.

As those of a shell (`floating.shell`). Directors stay orthonormal, and so the changes
`g_k = d_k - R D_k` have a symmetric part of second order, `-(g_k . g_m)/2` along `R D_m`, which is
no rotation; it is put back.
"""

from collections.abc import Callable
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.beam import Line, LineTangents, line_tangents, rest_tangents, strain_form
from shellmb.forms.floating.frame import Moved, Turned, carried
from shellmb.forms.frame import Vectors, vectors
from shellmb.forms.measure import Measure, quadratic
from shellmb.forms.shell import along


def carried_tangents(frame: Expr, ref: Line) -> LineTangents:
    """Changes of the reference's tangent and directors that turn with the frame."""
    f, rest = vectors(frame), rest_tangents(ref)
    d, ds = (tuple(carried(f, V) for V in some) for some in (rest.d, rest.ds))
    return LineTangents(carried(f, rest.x1), d, ds)


def turned(w: Expr, ref: Line) -> list[Turned]:
    """Material vectors whose mean rotation is the frame's: the directors."""
    return list(zip(vectors(ref.D), vectors(w), strict=True))


class Apart(NamedTuple):
    """Parts of the strains.

    Args:
        here: Tangent and directors, or their changes.
        frame: The same of the reference as the frame carries it.
        lean: Directors of the beam less those of the frame.
    """

    here: LineTangents
    frame: LineTangents
    lean: Vectors


def strain_measure(ref: Line, moved: Callable[[Expr], Moved]) -> Measure:
    """Small strains (Gamma, K) relative to the frame, shape (6,).

    Args:
        ref: Reference line.
        moved: Displacement, changes of the directors and of the frame's directors in a state.
    """
    rest = rest_tangents(ref)

    def form(a: Apart, b: Apart) -> Expr:
        kept = strain_form(ref, rest, _kept(a.lean, b.lean, ref))
        return strain_form(ref, a.frame, b.here) + strain_form(ref, a.here, b.frame) + kept

    def apart(q: Expr) -> Apart:
        u, w, frame = moved(q)
        t, r = line_tangents(u, w, ref), carried_tangents(frame, ref)
        return Apart(t, r, tuple(x - y for x, y in zip(t.d, r.d, strict=True)))

    none = 0 * ref.t
    return quadratic(form, Apart(rest, rest, (none, none, none)), apart)


def _kept(g: Vectors, h: Vectors, ref: Line) -> LineTangents:
    """Changes `(g_k . h_m + h_k . g_m)/2 D_m` of the directors; the line stays."""
    D, Ds = vectors(ref.D), vectors(along(ref.D, ref.t))

    def put(k: int, V: Vectors) -> Expr:
        sizes = [(ufl.dot(g[k], h[m]) + ufl.dot(h[k], g[m])) / 2 for m in range(3)]
        return sizes[0] * V[0] + sizes[1] * V[1] + sizes[2] * V[2]

    d, ds = (tuple(put(k, V) for k in range(3)) for V in (D, Ds))
    return LineTangents(0 * ref.t, d, ds)
