"""Damping of a section: times of Kelvin and Voigt, and relaxation, given as a Prony series."""

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, InstanceOf

from shellmb.errors import SceneError
from shellmb.scene.types import Finite, NonNegative, Positive, explained, number
from shellmb.scene.values.validate import described, plain, show


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


TIME = "it must be a time in seconds, 0 or more, or a {} of such times"
ShellTimes = Annotated[
    NonNegative | InstanceOf[ShellDamping], explained(TIME.format("ShellDamping"))
]
BeamTimes = Annotated[NonNegative | InstanceOf[BeamDamping], explained(TIME.format("BeamDamping"))]


@described("WLF shift")
class WLF:
    """Shift of relaxation times with temperature, by Williams, Landel and Ferry.

    The factor on all times is ``10^(-C1 (T - reference)/(C2 + T - reference))``.

    Args:
        C1: First constant [-].
        C2: Second constant [K].
        reference: Temperature at which the times are as given [K, or degrees Celsius].
        temperature: Temperature of the body, in the same unit.
    """

    C1: Positive
    C2: Positive
    reference: Finite
    temperature: Finite

    def __post_init__(self) -> None:
        """Check that the formula holds at the temperature.

        Raises:
            SceneError: If ``temperature <= reference - C2``, or the factor is no number.
        """
        above = self.temperature - self.reference
        if not self.C2 + above > 0:
            raise SceneError(
                f"WLF shift: temperature is {show(self.temperature)}; it must be above reference - "
                f"C2 = {show(self.reference - self.C2)}, where the times are infinite"
            )
        if abs(self.C1 * above / (self.C2 + above)) > 100:
            raise SceneError(
                f"WLF shift: temperature is {show(self.temperature)}, where the times are shifted "
                "by more than 100 decades; it must be nearer to reference, "
                f"{show(self.reference)}"
            )

    @property
    def factor(self) -> float:
        """Factor on the times."""
        above = self.temperature - self.reference
        return float(10 ** (-self.C1 * above / (self.C2 + above)))


def _terms(value: Any) -> tuple[tuple[float, float], ...]:
    try:
        found = tuple((number(g), number(tau)) for g, tau in plain(value))
    except (TypeError, ValueError):
        raise ValueError("it must be pairs (share, time [s])") from None
    if not found:
        raise ValueError("it must have at least one pair (share, time [s])")
    for k, (g, tau) in enumerate(found):
        if not 0 < g < math.inf:
            raise ValueError(f"share {k} is {show(g)}; each share must be positive and finite")
        if not 0 < tau < math.inf:
            raise ValueError(f"time {k} is {show(tau)}; each time must be positive and finite")
    return found


SHIFT = "it must be a positive factor on the times, or a WLF"


@described("Prony series")
class Prony:
    """Relaxation of all moduli of a section or of a ply by generalised Maxwell branches.

    After a strain at once each modulus falls as ``1 - sum g (1 - exp(-t/tau))`` of the
    instantaneous one, or as ``1 + sum g exp(-t/tau)`` of the long-term one.

    Args:
        terms: Pairs ``(g, tau)``: share of the given moduli [-], and relaxation time [s].
        moduli: Whether the moduli of the section are ``"instantaneous"`` or ``"long-term"``.
        shift: Factor on all times, or a ``WLF`` that gives it.
        relaxed: Whether the branches are relaxed at the start: a motion begins without stress in
            them, and statics has the long-term stiffness. If not, the start counts as strained at
            once, and statics has the instantaneous stiffness.
    """

    terms: Annotated[Any, BeforeValidator(_terms)]
    moduli: Literal["instantaneous", "long-term"] = "instantaneous"
    shift: Annotated[Positive | InstanceOf[WLF], explained(SHIFT)] = 1.0
    relaxed: bool = True

    def __post_init__(self) -> None:
        """Check that a stiffness is left in the long term.

        Raises:
            SceneError: If the shares of instantaneous moduli add up to one or more, or a shifted
                time is no number.
        """
        total = sum(g for g, _ in self.terms)
        for _, tau in self.terms:
            time = tau * self._factor
            if not 0 < time < math.inf:
                raise SceneError(
                    f"Prony series: shift is {show(self.shift)}, with which the time {show(tau)} "
                    f"is {show(time)} s; each shifted time must be positive and finite"
                )
        if self.moduli == "instantaneous" and not total < 1:
            raise SceneError(
                f"Prony series: the shares of terms add up to {show(total)}, so the long-term "
                "modulus would not be positive; they must add up to less than 1, or moduli must be "
                "'long-term'"
            )

    @property
    def _factor(self) -> float:
        return float(self.shift.factor if isinstance(self.shift, WLF) else self.shift)

    @property
    def long_term(self) -> float:
        """Long-term modulus over the given one."""
        return 1 - sum(g for g, _ in self.terms) if self.moduli == "instantaneous" else 1.0

    @property
    def branches(self) -> dict[tuple[float, bool], float]:
        """Stiffness of the branches over the long-term one, by shifted time and `relaxed`."""
        found: dict[tuple[float, bool], float] = {}
        for g, tau in self.terms:
            key = self._factor * tau, self.relaxed
            found[key] = found.get(key, 0.0) + g / self.long_term
        return found

    @property
    def at_rest(self) -> float:
        """Modulus of statics over the given one."""
        rest = 0.0 if self.relaxed else sum(self.branches.values())
        return self.long_term * (1 + rest)


class Damped:
    """Base class of the sections of shells and beams: what resists, weighs, damps and may relax.

    Attributes:
        stiffness_damping: Time by which the rate of the strains adds to them [s], or an object that
            says one for each part of the stiffness.
        mass_damping: Mass-proportional damping [1/s].
        relaxation: Prony series of its stiffness; None: elastic.
        strains: How many damping times there are.
        linear: Whether its resultants are linear in the strains.
        layered: Whether it has layers, whose stresses follow from its resultants.
    """

    stiffness_damping: Any = 0.0
    mass_damping: Any = 0.0
    relaxation: Prony | None = None
    strains: ClassVar[int]
    linear: ClassVar[bool] = True
    layered: ClassVar[bool] = False

    @property
    def mass(self) -> tuple[Any, Any, Any]:
        """Mass, its first and its second moments."""
        raise NotImplementedError

    @property
    def generic(self) -> Any:
        """A section whose zeros are zero everywhere, also where it varies."""
        return self

    @property
    def masses(self) -> tuple[bool, ...]:
        """Find which of the mass, its first and its second moments differ from zero anywhere."""
        return tuple(bool(np.any(part)) for part in self.mass)

    @property
    def damping_times(self) -> tuple[float, ...]:
        """Damping times of the strains, in the order of the stiffness [s]."""
        given = self.stiffness_damping
        return getattr(given, "times", None) or (float(given),) * self.strains

    @property
    def relaxes(self) -> bool:
        """Decide whether it has a Prony series."""
        return self.relaxation is not None

    @property
    def relaxed(self) -> bool:
        """Decide whether all of its branches begin relaxed."""
        return self.relaxation is None or self.relaxation.relaxed
