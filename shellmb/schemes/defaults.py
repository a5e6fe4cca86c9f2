"""Schemes that are made of sub-intervals."""

from __future__ import annotations

from dolfinx import fem

from shellmb.model.body import Body
from shellmb.schemes.base import Levels, Scheme, StepForms
from shellmb.schemes.residuals.residual import IntervalForms


class Defaults(Scheme):
    """Members of `Scheme` that a scheme without states in between need not write.

    Velocities do not jump, and nothing is known of a dissipation.
    """

    def forms(self, body: Body, levels: Levels, dt: fem.Constant) -> StepForms:
        """Residuals of one body by the sub-intervals of the stages."""
        return IntervalForms(body, self, levels, dt)
