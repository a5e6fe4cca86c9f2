"""Relaxation: generalised Maxwell branches over a step.

A branch is a spring of stiffness `C` in series with a dashpot. With the strain `V` of the dashpot
and that of the spring, `X = e - V`,

    S = C X,      tau V' = X                                                                    (V1)

`X` has over a step the mean and the first moment that the scheme takes of an elastic strain, with
its `alpha`, and (V1) holds for both:

    X_0 = (X_i + X_f - x)/2,   X_1 = (X_f - X_i)/2 + alpha x/2,   x = bow of X,                 (V2)
    V_f - V_i = (h/tau) X_0,   3 (bow of V) = (h/tau) X_1

so that with `r = h/tau` both follow from the start, and the change and the bow of the strain,

    [1 + r/2        -r/6   ] [X_0]   [X_i + (e_f - e_i - bow)/2   ]
    [  r/2     1 + alpha r/6] [X_1] = [(e_f - e_i + alpha bow)/2  ]                             (V3)

point by point: there are no unknowns. EP has neither bow nor second row. ED is linear in both of
its sub-intervals; with `bow = e_i - e_j` its rows see the stresses of `X_0` (f) and of `X_0 - X_1`
(j), which are (22) and (32). The stresses act as those of the scheme do, so that exactly

    S_0.(e_f - e_i) + S_1.bow = change of X.C X/2
                                 + r [X_0.C X_0 + X_1.C X_1/3] + alpha x.C x/2             (V4)

What the branch dissipates is never negative. At constant strain a step multiplies `X` by the
approximation of `exp(-r)` that the scheme has of linear systems: Pade's of order 2 in EP, of order
4 in ED without dissipation and in EP4, of order 3 with `alpha = 1`, there of zero limit.

===========  ==========================================================  ==========
symbol       name                                                        unit
===========  ==========================================================  ==========
`C`          stiffness of the branch                                     N/m, ...
`tau`        relaxation time                                             s
`X, V`       strains of its spring and of its dashpot                    -, 1/m
`X_0, X_1`   mean and first moment of `X` over the step                  -, 1/m
===========  ==========================================================  ==========
"""

import ufl
from ufl.core.expr import Expr

from shellmb.forms.steps.mixed import Stiffness


class Branch(Stiffness):
    """Stress of the springs of branches, of strains as they are or of those of the cells."""

    def matrix(self) -> Expr:
        """Stiffness as energy and modes have it, read off the stress: its rows in turn."""
        size = range(self.C.ufl_shape[0])
        columns = [self.stress(ufl.unit_vector(k, len(size)))[0] for k in size]
        return ufl.as_vector([column[i] for i in size for column in columns])
