"""Sub-intervals: eqs. (17), (19)-(22) and (32) of the paper, of which EP and ED are made.

Over a sub-interval from `q_a` to `q_b` a row is, with what the inertia sees of the step,

    h.dq + S.De(q_m) dq + lambda.Dg(q_m) dq = p.dq,   g(q_b) = 0,   q_m = (q_a + q_b)/2  (17), (19)

    S = C [(e_a + e_b)/2 + beta (e_b - e_a)/2]                                           (22), (32)

because `e_b - e_a = De(q_m)(q_b - q_a)` (20), so that without `beta` the stress works the change of
the strain energy (21). To the path with the mean `x` and the chord `D` these are, as numbers:
"""

from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.steps.discrete import mean, stress_average
from shellmb.forms.steps.mixed import Interval
from shellmb.schemes.notation import Acting, D, De, e, x

A, B = x - D / 2, x + D / 2


def averaged(beta: float) -> Floats:
    """Strain of which the stress is, eqs. (22) and (32); without a jump `beta` is zero."""
    return stress_average(e(A), e(B), beta)


def acting(beta: float) -> Acting:
    """The stress of a sub-interval, and the strain at its middle that it acts on, eq. (20)."""
    return Acting(averaged(beta), De(x))


# the stress of a single state acts on the strain there
AT_STATE = Acting(e(x), De(x))


def interval(a: Expr, b: Expr, beta: Expr | float = 0.0) -> Interval:
    """The sub-interval from `a` to `b`: forces at its mid-point, constraints at its end."""
    return Interval(a=a, b=b, mid=mean(a, b), unknown=b, beta=beta)


def at_state(q: Expr) -> Interval:
    """A single state, as in statics."""
    return Interval(a=q, b=q, mid=q, unknown=q, beta=0.0)
