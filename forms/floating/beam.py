"""Strains of a beam that are linear in what it moves by relative to a floating frame.

As those of a shell (`floating.shell`). Directors stay orthonormal, and so the changes
`g_k = d_k - R D_k` have a symmetric part of second order, `-(g_k . g_m)/2` along `R D_m`, which is
no rotation; it is put back.
"""

from collections.abc import Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.beam import Line, LineTangents, bilinear, combined, line_tangents, rest_tangents
from shellmb.forms.floating.frame import Moved, Turned, carried
from shellmb.forms.frame import Vectors, vectors
from shellmb.forms.surface import along


def carried_tangents(frame: Expr, ref: Line) -> LineTangents:
    """Changes of the reference's tangent and directors that turn with the frame."""
    f, rest = vectors(frame), rest_tangents(ref)
    d, ds = (_three([carried(f, V) for V in some]) for some in (rest.d, rest.ds))
    return LineTangents(carried(f, rest.x1), d, ds)


def turned(w: Expr, ref: Line) -> list[Turned]:
    """Material vectors whose mean rotation is the frame's: the directors."""
    return list(zip(vectors(ref.D), vectors(w), strict=True))


def linear_strains(moved: Moved, ref: Line) -> Expr:
    """Strains (Gamma, K) of a state, shape (6,).

    Args:
        moved: Displacement, changes of the directors, changes of the frame's directors.
        ref: Reference line.
    """
    u, w, frame = moved
    t, r, rest = line_tangents(u, w, ref), carried_tangents(frame, ref), rest_tangents(ref)
    leans = _leans(t, r)
    kept = bilinear(ref, rest, _kept(leans, leans, ref)) / 2
    return bilinear(ref, rest, combined([(1, t), (1, r)])) + bilinear(ref, r, t) + kept


def linear_slope(
    ref: Line, c: Expr | None, states: Sequence[tuple[Expr, Moved]], change: Moved
) -> Expr:
    """Change of these strains, taken at `c` times the reference and weighted states, shape (6,).

    Args:
        ref: Reference line.
        c: Share of the reference; None: none.
        states: Weights with states.
        change: Change of the state.
    """
    rest = [] if c is None else [(c, rest_tangents(ref))]
    t = [(weight, line_tangents(u, w, ref)) for weight, (u, w, _) in states]
    r = [(weight, carried_tangents(frame, ref)) for weight, (_, _, frame) in states]
    dt, dr = line_tangents(change[0], change[1], ref), carried_tangents(change[2], ref)
    found = bilinear(ref, combined([*r, *rest]), dt) + bilinear(ref, combined([*t, *rest]), dr)
    if not states:
        return found
    leans = _leans(combined(t), combined(r))
    return found + bilinear(ref, rest_tangents(ref), _kept(leans, _leans(dt, dr), ref))


def _three(some: Sequence[Expr]) -> Vectors:
    return some[0], some[1], some[2]


def _leans(t: LineTangents, r: LineTangents) -> Vectors:
    return _three([a - b for a, b in zip(t.d, r.d, strict=True)])


def _kept(g: Vectors, h: Vectors, ref: Line) -> LineTangents:
    """Changes `(g_k . h_m + h_k . g_m)/2 D_m` of the directors; the line stays."""
    D, Ds = vectors(ref.D), vectors(along(ref.D, ref.t))

    def put(k: int, V: Vectors) -> Expr:
        sizes = [(ufl.dot(g[k], h[m]) + ufl.dot(h[k], g[m])) / 2 for m in range(3)]
        return sizes[0] * V[0] + sizes[1] * V[1] + sizes[2] * V[2]

    d, ds = (_three([put(k, V) for k in range(3)]) for V in (D, Ds))
    return LineTangents(0 * ref.t, d, ds)
