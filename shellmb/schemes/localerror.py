"""What a scheme is off by in one step, as a derivative of the motion.

A scheme of order p is off by `factor * h^(p + 1) * q^(p + 1)` at the end of a step from an exact
state. In a vibration and in steady rotation of frequency w these are `(w h)^3/12` of the amplitude
for EP (the mid-point rule), `(w h)^5/720` for EP4 (Gauss' method with two stages), and
`alpha (w h)^4/72` for ED3 (Radau IIA with alpha = 1).
"""

from __future__ import annotations

from dataclasses import dataclass

from shellmb.schemes.base import Scheme
from shellmb.schemes.quadratic import QuadraticInTime

# of ED in large motion, where it is of second order: measured (`docs/theory/stepcontrol.md`)
ED_FACTOR = 1 / 48
# with less dissipation the error of fourth order is the larger one in steps of practical length
LEAST_ALPHA = 0.1


@dataclass(frozen=True)
class LocalError:
    """The error of a step.

    Args:
        degree: Derivative of the motion that it is proportional to, and power of the step.
        factor: Of both.
    """

    degree: int
    factor: float

    @property
    def order(self) -> int:
        """Order of the scheme."""
        return self.degree - 1

    def per_radian(self, angle: float) -> float:
        """Error of a motion by the time it has turned by one radian, relative to its amplitude.

        Args:
            angle: By which it turns in a step, rad.
        """
        return float(self.factor * angle**self.order)


def local_error(scheme: Scheme) -> LocalError:
    """That of a dynamic scheme; where nothing else is known that of the mid-point rule.

    Args:
        scheme: The scheme.
    """
    if isinstance(scheme, QuadraticInTime):
        if scheme.alpha == 0:
            return LocalError(5, 1 / 720)
        return LocalError(4, max(scheme.alpha, LEAST_ALPHA) / 72)
    if scheme.dissipation()[1] is not None:
        return LocalError(3, ED_FACTOR)
    return LocalError(3, 1 / 12) if scheme.order > 1 else LocalError(2, 1 / 2)
