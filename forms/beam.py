"""Kinematics and mixed virtual work of the geometrically exact beam, frames in place of rotations.

At every node there are the displacement `u` and the changes `w1, w2, w3` of three directors, so
that `x = X + u` and `d_k = D_k + w_k`; `d1` is the tangent of the reference line, `d2` and `d3` are
the axes of the cross-section. Shear strains and curvatures are those of J. C. Simo (CMAME 49
(1985) 55-70), the directors are interpolated, and so the strains do not depend on rigid motions
(P. Betsch, P. Steinmann, Int. J. Numer. Meth. Engng 54 (2002) 1775-1788). The axial strain is that
of the line itself, as in a shell (eq. 9):

    Gamma_1 = (x' . x' - X' . X')/2
    Gamma_k = d_k . x' - D_k . X',  k = 2, 3
    K_1 = (d2' . d3 - d3' . d2)/2 - ref.,  and cyclic

Simo's axial strain `d1 . x' - 1` differs from it by squares of strains. With interpolated directors
it holds no tension: these are of unit length at the nodes only, and where neighbours point in
opposite directions, what is between them sees next to nothing of the stretch.

Where forces are coupled to curvatures the line meant is that along which an axial force does not
bend: `x + c_k d_k` with the tension centre `c = (-H_13, H_12)`. Its strains `g` are those above,
with the reference length `r_1 = D_1 . X_c'` and what it leans by, `r_k = D_k . X_c'`,

    g_1 = [(x_c' . x_c' - X_c' . X_c')/2 - r_2 g_2 - r_3 g_3]/r_1,  g_k = d_k . x_c' - r_k

and `Gamma` is what is left when they are carried back to the reference line, `g - H_c K`. So `N`
and `M` act on the reference line as ever, a beam does not depend on the line that describes it, and
small strains are those of Simo for any curvature and twist at rest.

===========  ==============================================  =======
symbol       name                                            unit
===========  ==============================================  =======
`Gamma`      axial strain, shear strains along d2 and d3     -
`K`          twist, curvatures about d2 and d3               1/m
`N`          axial force, shear forces along d2 and d3       N
`M`          torque, bending moments about d2 and d3         N m
`A, B, D`    stiffness about the line: [[A, B], [B^T, D]]    N, N m..
`H`          `A^-1 B`, leads from the line to the centroid   m
`D_0`        bending stiffness without force, `D - B^T H`    N m^2
===========  ==============================================  =======

All strains are quadratic in `(u, w)`, which is what eq. (20) needs, and written in them so that
nothing cancels in thin beams. The forces are independent and discontinuous between elements, the
moments follow from the curvatures, and everything is integrated with as many Gauss points as the
degree of the element:

    W = [N . (Gamma + H K) - N . A^-1 N / 2 + K . D_0 K / 2] dx_red

That neither locks nor, in one dimension, leaves any spurious mode. With independent moments as well
the energy is the same, but Newton's method no longer rolls a beam up in one load step.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.frame import ACROSS, Vectors, vectors
from shellmb.forms.measure import Measure, quadratic
from shellmb.forms.shell import along, unit
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import MixedSection


class Line(NamedTuple):
    """Reference line of a beam.

    Args:
        t: Unit tangent, shape (3,).
        D: Reference directors D1, D2, D3 one after the other, shape (9,).
        centre: Tension centre along D2 and D3, shape (2,), m; None: the line itself.
    """

    t: Expr
    D: Expr
    centre: Expr | None = None


class LinePoint(NamedTuple):
    """Quantities on which a term of the user's in the weak form of a beam may depend.

    A term is a function of this that returns the virtual work, per reference length, of forces that
    act on the beam; it enters the energy balance.

    Args:
        u: Displacement at the mid-point, shape (3,), m.
        w: Changes of the directors at the mid-point, shape (9,).
        v: Velocity over the sub-interval, shape (3,), m/s; None in statics.
        dw_dt: Velocity of the directors, shape (9,), 1/s; None in statics.
        du: Variation of the displacement.
        dw: Variation of the directors.
        line: Reference line.
        time: Time, s; what depends on it is averaged over a step.
        x: Current position, shape (3,), m.
        d: Current directors one after the other, shape (9,).
        strain_rate: Rates of the strains (Gamma, K) over the sub-interval, shape (6,), 1/s and
            1/(m s); None in statics.
        dstrain: Variation of the strains, shape (6,).
    """

    u: Expr
    w: Expr
    v: Expr | None
    dw_dt: Expr | None
    du: Expr
    dw: Expr
    line: Line
    time: Expr
    x: Expr
    d: Expr
    strain_rate: Expr | None
    dstrain: Expr


def line(jacobian: Expr, D: Expr, centre: Expr | None = None) -> Line:
    """Reference line with its unit tangent.

    Args:
        jacobian: Jacobian of the reference line, shape (3, 1).
        D: Reference directors, shape (9,).
        centre: Tension centre along D2 and D3, shape (2,), m; None: the line itself.
    """
    return Line(unit(jacobian[:, 0]), D, centre)


class LineTangents(NamedTuple):
    """Tangents that strains depend on: the derivative of the position, the directors and theirs.

    Args:
        x1: Derivative of the position of the tension centre along the line, shape (3,).
        d: Directors.
        ds: Their derivatives, 1/m.
    """

    x1: Expr
    d: Vectors
    ds: Vectors


def rest_tangents(ref: Line) -> LineTangents:
    """Tangent and directors of the reference configuration."""
    ds = vectors(along(ref.D, ref.t))
    return LineTangents(at_centre(ref, ref.t, ds), vectors(ref.D), ds)


def line_tangents(u: Expr, w: Expr, ref: Line) -> LineTangents:
    """Changes of tangent and directors by a displacement and changes of the directors."""
    ds = vectors(along(w, ref.t))
    return LineTangents(at_centre(ref, along(u, ref.t), ds), vectors(w), ds)


def at_centre(ref: Line, x1: Expr, ds: Vectors) -> Expr:
    """Derivative of the position of the tension centre, shape (3,).

    Args:
        ref: Reference line.
        x1: Derivative of the position of the line, shape (3,).
        ds: Derivatives of the directors, 1/m.
    """
    return x1 if ref.centre is None else x1 + ref.centre[0] * ds[1] + ref.centre[1] * ds[2]


def axial_strain(a: LineTangents, b: LineTangents) -> Expr:
    """Axial strain `(x' . x' - X' . X')/2` as a bilinear form; see `forms.measure`."""
    return ufl.dot(a.x1, b.x1)


def shear_strains(a: LineTangents, b: LineTangents) -> list[Expr]:
    """Shear strains `d_k . x' - D_k . X'` along `d2` and `d3` as bilinear forms."""
    return [ufl.dot(a.d[k], b.x1) + ufl.dot(b.d[k], a.x1) for k in (1, 2)]


def curvatures(a: LineTangents, b: LineTangents) -> list[Expr]:
    """Twist and curvatures `(d2' . d3 - d3' . d2)/2` and cyclic, as bilinear forms, 1/m."""

    def half(k: int, m: int) -> Expr:
        """The product `d_k' . d_m / 2`."""
        return (ufl.dot(a.ds[k], b.d[m]) + ufl.dot(b.ds[k], a.d[m])) / 2

    return [half(k, m) - half(m, k) for k, m in ACROSS]


def strain_form(ref: Line, a: LineTangents, b: LineTangents) -> Expr:
    """All strains (Gamma, K) as a symmetric bilinear form, shape (6,)."""
    stretch, shear, turns = axial_strain(a, b), shear_strains(a, b), curvatures(a, b)
    if ref.centre is None:
        return ufl.as_vector([stretch, *shear, *turns])
    rest, (c2, c3) = rest_tangents(ref), ref.centre
    r1, r2, r3 = (ufl.dot(D, rest.x1) for D in rest.d)
    stretch = (stretch - r2 * shear[0] - r3 * shear[1]) / r1
    carried = [c3 * turns[1] - c2 * turns[2], -c3 * turns[0], c2 * turns[0]]
    at_line = [g - moved for g, moved in zip([stretch, *shear], carried, strict=True)]
    return ufl.as_vector([*at_line, *turns])


def strain_measure(ref: Line, moved: Callable[[Expr], tuple[Expr, Expr]]) -> Measure:
    """Strains (Gamma, K), which are quadratic, shape (6,).

    Args:
        ref: Reference line.
        moved: Displacement and changes of the directors in a state.
    """

    def form(a: LineTangents, b: LineTangents) -> Expr:
        return strain_form(ref, a, b)

    return quadratic(form, rest_tangents(ref), lambda q: line_tangents(*moved(q), ref))


def halves(e: Expr) -> tuple[Expr, Expr]:
    """`Gamma` and `K` of the strains, or forces and moments of the resultants."""
    return ufl.as_vector([e[0], e[1], e[2]]), ufl.as_vector([e[3], e[4], e[5]])


def acting(ref: Line, e: Expr, N: Expr, M: Expr) -> tuple[Expr, Expr]:
    """Forces and moments along the directors that balance loads, shape (3,) each, N and N m.

    `N` does work on squares, as a second Piola-Kirchhoff stress: the force of the section is
    `N_1 x_c'/r_1`, less what that leans by at rest, and `N_k d_k`, at the tension centre.

    Args:
        ref: Reference line.
        e: Strains, shape (6,).
        N: Forces that do work on them, shape (3,), N.
        M: Moments that do, shape (3,), N m.
    """
    (g1, g2, g3), (c2, c3), r1 = (e[0], e[1], e[2]), (0.0, 0.0), 1.0
    if ref.centre is not None:
        c2, c3 = ref.centre
        g1, g2, g3 = g1 + c3 * e[4] - c2 * e[5], g2 - c3 * e[3], g3 + c2 * e[3]
        r1 = ufl.dot(vectors(ref.D)[0], rest_tangents(ref).x1)
    along_d1 = ufl.sqrt(1 + 2 * g1 / r1 - (g2**2 + g3**2) / r1**2)
    force = ufl.as_vector([N[0] * along_d1, N[1] + N[0] * g2 / r1, N[2] + N[0] * g3 / r1])
    if ref.centre is None:
        return force, M
    return force, M + ufl.cross(ufl.as_vector([0, c2, c3]), force - N)


@dataclass(frozen=True)
class BeamMixed(MixedSection):
    """Hellinger-Reissner form of a linear section; densities per reference length.

    Args:
        A_inv: Inverse of the stiffness of the forces, shape (3, 3), 1/N.
        D0: Bending stiffness without force, `D - B^T A^-1 B`, shape (3, 3), N m^2.
        N0: Size of the forces, by which their unknowns are of the size of strains, N.
        H: Coupling `A^-1 B`, shape (3, 3), m; None without, and then none of its terms exists.
        held: Strains of `Gamma` that are constrained to zero by forces that are multipliers, as in
            `LinearMixed`: of the others only `A_inv` is the inverse then.
        slack: Compliance of the multipliers, 1/N; None without any.
    """

    A_inv: Expr
    D0: Expr
    N0: Expr
    H: Expr | None = None
    held: tuple[int, ...] = ()
    slack: Expr | None = None

    def _give(self, N: Expr) -> Expr:
        """Strain of the forces, shape (3,)."""
        if not self.held:
            return self.A_inv * N
        free = [k for k in range(3) if k not in self.held]
        strain = {k: self.slack * N[k] for k in self.held}
        if free:
            own = self.A_inv * ufl.as_vector([N[k] for k in free])
            strain |= {k: own[i] for i, k in enumerate(free)}
        return ufl.as_vector([strain[k] for k in range(3)])

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """Components of `there` for constrained strains, of `elsewhere` for others, shape (3,)."""
        if not self.held:
            return elsewhere
        return ufl.as_vector([there[k] if k in self.held else elsewhere[k] for k in range(3)])

    def _at_state(self, elastic: Expr, N: Expr) -> Expr:
        """Forces of a state: multipliers from its strains, shape (3,)."""
        return N if self.slack is None else self.where_held(elastic / self.slack, N)

    def _elastic(self, Gamma: Expr, K: Expr) -> Expr:
        """Strain that the forces belong to, shape (3,)."""
        return Gamma if self.H is None else Gamma + self.H * K

    def _moments(self, N: Expr, K: Expr) -> Expr:
        """Moments of forces and curvatures, shape (3,)."""
        M = self.D0 * K
        return M if self.H is None else M + ufl.transpose(self.H) * N

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Forces along the directors, shape (3,), N."""
        return self.N0 * layout.part(q, "N")

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Stress conjugate to `Gamma` and `K`, shape (6,); linear in strains and forces."""
        return (ufl.as_vector([*N, *self._moments(N, halves(e)[1])]),)

    def gap(self, mean: Expr, end: Expr, N: Expr, dN: Expr) -> tuple[Expr]:
        """Work on strains less those of the forces: of the end, or of the mean if constrained."""
        elastic = self.where_held(*(self._elastic(*halves(e)) for e in (mean, end)))
        return (ufl.dot(dN, elastic - self._give(N)),)

    def stored(self, e: Expr, N: Expr) -> tuple[Expr]:
        """Mixed strain energy of any strains and forces, J/m."""
        Gamma, K = halves(e)
        N = self._at_state(self._elastic(Gamma, K), N)
        forces = ufl.dot(N, self._elastic(Gamma, K)) - ufl.dot(N, self._give(N)) / 2
        return (forces + ufl.dot(K, self.D0 * K) / 2,)

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> tuple[Expr]:
        """Half the work of the stress jump on the strain jump, elastic part of eq. (34), J/m."""
        N = self.forces(layout, b) - self.forces(layout, a)
        Gamma, K = halves(strain.value(b) - strain.value(a))
        N = self._at_state(self._elastic(Gamma, K), N)
        return ((ufl.dot(N, Gamma) + ufl.dot(self._moments(N, K), K)) / 2,)
