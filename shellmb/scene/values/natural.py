"""Strains that a body has without stress: heat, swelling, shrinkage, prestress."""

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BeforeValidator

from shellmb.scene.types import NONE, Finite, Listed, Vec3, vector
from shellmb.scene.values.user_functions import OfPosition
from shellmb.scene.values.validate import described


def _given(value: Any) -> Any:
    return value if callable(value) else vector(value)


Six = tuple[Finite, Finite, Finite, Finite, Finite, Finite]
Strains = Annotated[Vec3 | OfPosition, BeforeValidator(_given)]


@described("natural strain")
class NaturalStrain:
    """Strains of a shell without stress, in its material axes.

    Stresses follow from the difference between the strains of eq. (9) and these. A plate that is
    heated by ``T`` has ``membrane=(alpha T, alpha T, 0)``; one whose temperature grows by ``G`` per
    length along the normal has ``curvature=(alpha G, alpha G, 0)``. ``thermal_strain`` finds both,
    also of laminates.

    Args:
        membrane: Membrane strains (11, 22, 2*12) [-]; or a vectorised function of positions (3, n)
            that gives (3, n).
        curvature: Changes of curvature (11, 22, 2*12) [1/m]; or such a function.
        time: Factor over time; None: 1, and in statics the share of the load.
        plies: Strains that each ply would have alone, from the lower to the upper face, as
            ``thermal_strain`` finds them: (11, 22, 2*12) along and across its fibres at the
            reference surface [-], and their changes along the normal [1/m]. The section holds the
            plies together, which leaves stresses in them without resultants. None: every ply has
            the strains of the section, and no stress.
    """

    membrane: Strains = (0.0, 0.0, 0.0)
    curvature: Strains = (0.0, 0.0, 0.0)
    time: Callable[[float], float] | None = None
    plies: Listed[Six] = NONE


@described("natural strain of a beam")
class BeamNaturalStrain:
    """Strains of a beam without stress, along its directors.

    Args:
        extension: Strain along the line [-].
        curvature: Twist, and curvatures about d2 and d3 [1/m].
        time: Factor over time; None: 1, and in statics the share of the load.
    """

    extension: Finite = 0.0
    curvature: Vec3 = (0.0, 0.0, 0.0)
    time: Callable[[float], float] | None = None
