"""Natural strains of heated sections, by plies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shellmb.errors import SceneError
from shellmb.scene.shells.sections import LinearSection
from shellmb.scene.values.natural import NaturalStrain
from shellmb.scene.values.validate import number, show


def thermal_strain(
    section: LinearSection,
    expansions: float | Sequence[Any],
    temperature: float,
    gradient: float = 0.0,
    time: Any = None,
) -> NaturalStrain:
    """Natural strains of a heated section, at which it carries no resultants.

    Args:
        section: The section, the same everywhere.
        expansions: Coefficient of expansion, or one for each layer from the lower to the upper
            face; each a number, or two, along and across the fibres [1/K].
        temperature: Change of the temperature at the reference surface [K].
        gradient: Its change per length along the normal [K/m].
        time: Factor over time, as of `NaturalStrain`.

    Raises:
        SceneError: If there is another number of coefficients, or the section varies.
    """
    if not isinstance(section, LinearSection) or section.functions:
        raise SceneError(
            f"thermal strain: the section is {show(section)}; it must be linear, and the same "
            "everywhere"
        )
    layup = section.generic
    temperature = _finite("temperature", temperature)
    gradient = _finite("gradient", gradient)
    several = list(expansions) if isinstance(expansions, Sequence) else [expansions]
    if len(several) != len(layup.layers):
        raise SceneError(
            f"thermal strain: there are {len(several)} expansions; there must be "
            f"{len(layup.layers)}, one for each layer"
        )
    forces, moments = np.zeros(3), np.zeros(3)
    z = [float(height) for height in layup.heights]
    for layer, given, low, high in zip(layup.layers, several, z, z[1:], strict=False):
        along, *across = given if isinstance(given, Sequence | np.ndarray) else [given]
        two = [_finite("expansions", part) for part in (along, *(across or [along]))]
        own = np.array(two)
        stress = layer.plane @ _turned(own, float(layer.angle))
        first, second, third = ((high**k - low**k) / k for k in (1, 2, 3))
        forces += stress * (temperature * first + gradient * second)
        moments += stress * (temperature * second + gradient * third)
    A, B, D = (np.asarray(part, dtype=float) for part in (layup.A, layup.B, layup.D))
    e = np.linalg.solve(np.block([[A, B], [B, D]]), np.concatenate([forces, moments]))
    return NaturalStrain(tuple(e[:3].tolist()), tuple(e[3:].tolist()), time)


def _finite(name: str, value: Any) -> float:
    try:
        found = number(value)
    except (TypeError, ValueError):
        found = float("nan")
    if not np.isfinite(found):
        raise SceneError(f"thermal strain: {name} is {show(value)}; it must be a finite number")
    return found


def _turned(own: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    """Expansions along and across the fibres as strains 11, 22, 2*12 of the shell's axes."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    a, b = own
    return np.array([a * c * c + b * s * s, a * s * s + b * c * c, 2 * (a - b) * c * s])
