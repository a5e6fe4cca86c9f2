"""Laminates: plies, stacking sequences, the section they make, and what heat does to them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import KW_ONLY, replace
from typing import Annotated, Any, Literal

import numpy as np

from shellmb.errors import SceneError, warn
from shellmb.scene.shells.lamination import Layer, Layup
from shellmb.scene.shells.sections import FiniteAt, LinearSection, Moduli, PositiveAt, Value
from shellmb.scene.types import NONE, Listed, NonNegative, Positive, explained, number_or_nan
from shellmb.scene.values.damping import ShellTimes
from shellmb.scene.values.models import NaturalStrain
from shellmb.scene.values.validate import Sentences, described, extended, show

# usual laminates of carbon fibres are up to 1.4 times too stiff by the factor 5/6, sandwiches from
# 5 (honeycomb) to 1e6 times
STIFFER = 2.0


@extended("ply material")
class PlyMaterial(Moduli):
    """An orthotropic material, axis 1 along the fibres.

    Args:
        E1: Young's modulus along the fibres [Pa].
        E2: Young's modulus across [Pa].
        nu12: Contraction along 2 per extension along 1; ``|nu12| < sqrt(E1/E2)``.
        G12: In-plane shear modulus [Pa].
        G13: Transverse shear modulus of axis 1 [Pa].
        G23: Transverse shear modulus of axis 2 [Pa].
        density: Mass density [kg/m^3].
        strength: Strengths, for reserve factors against failure.
        relaxation: Prony series of its moduli; None: elastic.
    """


@described("ply")
class Ply:
    """One layer of a laminate.

    Args:
        material: Its material.
        thickness: Thickness [m]: a number, or a function of the position that may be zero where
            the ply is dropped.
        angle: From the shell's 1-direction to the fibres, right-handed about the normal [degrees]:
            a number, or a function of the position.
    """

    material: PlyMaterial
    thickness: PositiveAt
    angle: FiniteAt = 0.0


CORRECTION = "it must be a factor greater than 0 or 'energy'"


@described("laminate")
class Laminate(LinearSection):
    """A stack of plies.

    Args:
        plies: From the lower face to the upper one, along the normal.
        shear_correction: A factor on the transverse shear stiffness, or ``"energy"``: from the
            shear stresses that equilibrium asks for.
        offset: Height of the laminate's middle above the reference surface [m]: a number, or a
            function of the position; half the thickness where the surface is the lower face.
        stiffness_damping: Kelvin and Voigt's damping: a time [s], or a ``ShellDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
    """

    plies: Listed[Ply]
    _: KW_ONLY
    shear_correction: Annotated[Positive | Literal["energy"], explained(CORRECTION)] = 5 / 6
    offset: FiniteAt = 0.0
    stiffness_damping: ShellTimes = 0.0
    mass_damping: NonNegative = 0.0

    field_kinds = ("linear", "laminate")

    def _wrong(self) -> Sentences:
        """Check that there are plies, and warn of a factor that hides a soft core."""
        if not self.plies:
            yield "it has no plies; it must have one at least"
        if self.shear_correction == "energy" and any(
            len(set(s)) > 1 for s in self.generic.branches
        ):
            yield (
                "shear_correction is 'energy', and its plies relax differently; it must be a "
                "factor then"
            )
        for sentence in self.doubts:
            warn(sentence)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Warnings about a shear correction that hides a soft core."""
        return () if self.functions else self._doubts(self.generic)

    def at(self, x: Any, who: str = "") -> Layup:
        """The section at positions; warns as a constant section does."""
        found = super().at(x, who)
        for sentence in self._doubts(found):
            warn(sentence)
        return found

    def _doubts(self, layup: Layup) -> tuple[str, ...]:
        if self.shear_correction == "energy":
            return ()
        G = replace(layup, shear_correction="energy").G
        ratio = float(np.linalg.eigvals(np.linalg.solve(G, layup.G)).real.max(initial=0.0))
        if ratio <= STIFFER:
            return ()
        return (
            f"laminate: shear_correction is {self.shear_correction:.4g}, with which it is "
            f"{ratio:.2g} times as stiff against transverse shear as its plies in equilibrium "
            "are; it should be 'energy', unless the factor belongs to these plies",
        )

    @property
    def thickness(self) -> float:
        """Total thickness [m]."""
        return float(self._numbers.thickness)

    def layers_by(self, value: Value) -> tuple[Layer, ...]:
        """The plies in the axes of the shell."""
        return tuple(_layer(ply, f"plies[{k}]", value) for k, ply in enumerate(self.plies))

    @classmethod
    def from_stacking(
        cls,
        material: PlyMaterial,
        ply_thickness: float,
        stacking: str | Sequence[float],
        shear_correction: float | Literal["energy"] = 5 / 6,
        offset: float = 0.0,
    ) -> Laminate:
        """A laminate of equal plies.

        Args:
            material: Material of every ply.
            ply_thickness: Thickness of every ply [m].
            stacking: Angles from the lower face up [degrees], or their usual notation such as
                ``"[0/90/45]s"``; see :func:`stacking_angles`.
            shear_correction: As for the class.
            offset: As for the class [m].

        Returns:
            The laminate.
        """
        angles = stacking_angles(stacking) if isinstance(stacking, str) else tuple(stacking)
        plies = tuple(Ply(material, ply_thickness, angle) for angle in angles)
        return cls(plies, shear_correction=shear_correction, offset=offset)


def _layer(ply: Ply, name: str, value: Value) -> Layer:
    thickness = value(f"{name}.thickness", ply.thickness, "not negative")
    return ply.material.layer(thickness).turned(value(f"{name}.angle", ply.angle, None))


_NUMBER = r"[+-]?\d+(?:\.\d*)?"
_STACKING = re.compile(rf"\[\s*({_NUMBER}(?:\s*[/,]\s*{_NUMBER})*)\s*\](\d*)\s*_?(s?)")


def stacking_angles(notation: str) -> tuple[float, ...]:
    """Angles of the plies from the lower face up.

    ``"[0/90/45]"`` are three plies; a number behind the bracket repeats them (``"[45/-45]4"``), an
    ``s`` mirrors what precedes it (``"[0/90]s"`` is 0, 90, 90, 0); ``"[0/90]2s"`` does both.

    Args:
        notation: The stacking sequence; ``/`` or ``,`` between the angles.

    Returns:
        The angles [degrees].

    Raises:
        SceneError: If the notation cannot be read.
    """
    match = _STACKING.fullmatch(notation.strip()) if isinstance(notation, str) else None
    if match is None:
        raise SceneError(
            f"laminate: stacking is {show(notation)}; it must read like '[0/90/45]s' or '[45/-45]4'"
        )
    angles = tuple(float(a) for a in re.split(r"\s*[/,]\s*", match[1])) * int(match[2] or 1)
    if not angles:
        raise SceneError(f"laminate: stacking is {show(notation)}; it must repeat once at least")
    return angles + angles[::-1] if match[3] else angles


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
    # its branches, if any, are relaxed or strained at once by then
    layup = section.generic.at_rest
    temperature = _finite("temperature", temperature)
    gradient = _finite("gradient", gradient)
    several = list(expansions) if isinstance(expansions, Sequence) else [expansions]
    if len(several) != len(layup.layers):
        raise SceneError(
            f"thermal strain: there are {len(several)} expansions; there must be "
            f"{len(layup.layers)}, one for each layer"
        )
    plies = list[Any]()
    for given in several:
        along, *across = given if isinstance(given, Sequence | np.ndarray) else [given]
        two = [_finite("expansions", part) for part in (along, *(across or [along]))]
        plies.append(tuple(size * part for size in (temperature, gradient) for part in (*two, 0.0)))
    e = layup.natural_strain(plies).tolist()
    return NaturalStrain(tuple(e[:3]), tuple(e[3:]), time, plies if len(plies) > 1 else NONE)


def _finite(name: str, value: Any) -> float:
    found = number_or_nan(value)
    if not np.isfinite(found):
        raise SceneError(f"thermal strain: {name} is {show(value)}; it must be a finite number")
    return found
