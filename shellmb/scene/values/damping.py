"""Damping of a section: times by which stresses of the strains' rates follow from stiffnesses."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BeforeValidator

from shellmb.scene.values.validate import NonNegative, described, number


@described("shell damping")
class ShellDamping:
    """Damping times of a shell's section, one for each part of the stiffness.

    Args:
        membrane: Of membrane strains [s].
        bending: Of bending strains [s].
        shear: Of transverse shear strains [s].
    """

    membrane: NonNegative = 0.0
    bending: NonNegative = 0.0
    shear: NonNegative = 0.0

    @property
    def times(self) -> tuple[float, float, float]:
        """Membrane, bending, shear [s]."""
        return self.membrane, self.bending, self.shear


@described("beam damping")
class BeamDamping:
    """Damping times of a beam's section, one for each part of the stiffness.

    Args:
        axial: Of the axial strain at the centroid [s].
        shear: Of both shear strains [s].
        torsion: Of the twist [s].
        bending: Of both curvatures [s].
    """

    axial: NonNegative = 0.0
    shear: NonNegative = 0.0
    torsion: NonNegative = 0.0
    bending: NonNegative = 0.0

    @property
    def times(self) -> tuple[float, ...]:
        """Damping times of the six strains: axial, shear, shear, twist, bending, bending [s]."""
        return self.axial, self.shear, self.shear, self.torsion, self.bending, self.bending


def _one_or(several: type) -> BeforeValidator:
    """One time for all, or an object that says several."""

    def check(value: Any) -> Any:
        if isinstance(value, several):
            return value
        try:
            time = number(value)
        except (TypeError, ValueError):
            time = math.nan
        if not (0 <= time < math.inf):
            raise ValueError(
                f"it must be a time in seconds, 0 or more, or a {several.__name__} of such times"
            )
        return time

    return BeforeValidator(check)


ShellTimes = Annotated[Any, _one_or(ShellDamping)]
BeamTimes = Annotated[Any, _one_or(BeamDamping)]
