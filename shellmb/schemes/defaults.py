"""Schemes whose steps are made of sub-intervals."""

from __future__ import annotations

from dolfinx import fem

from shellmb.model.body import Body
from shellmb.schemes.base import Levels, Scheme, StepForms
from shellmb.schemes.residuals.residual import IntervalForms


class Defaults(Scheme):
    """A scheme whose steps are made of sub-intervals, one for each of its stages.

    It need not write the members of `Scheme` that have a default: these are of a scheme without
    states in between, whose velocities do not jump, and of whose dissipation nothing is known.
    """

    def forms(self, body: Body, levels: Levels, dt: fem.Constant) -> StepForms:
        """Residuals of one body by the sub-intervals of the stages."""
        return IntervalForms(body, self, levels, dt)
