"""Sections of beams from their shape: rectangle, circle, tube, of one isotropic material."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from shellmb.errors import SceneError
from shellmb.scene.beams.sections import BeamMass, BeamSection
from shellmb.scene.values.damping import BeamTimes
from shellmb.scene.values.relaxation import Prony
from shellmb.scene.values.validate import Finite, NonNegative, Positive, described, show

type Matrix = NDArray[np.float64]

PoissonRatio = Annotated[float, Field(gt=-1, le=0.5, allow_inf_nan=False)]
Pair = tuple[Finite, Finite]


class _Shape(BeamSection):
    """A homogeneous isotropic section with two planes of symmetry, its centroid off the line."""

    E: float
    nu: float | None
    density: float
    offset: tuple[float, float]
    G: float | None
    label: str

    @property
    def shear_modulus(self) -> float:
        """Shear modulus [Pa]."""
        if self.G is not None:
            return self.G
        assert self.nu is not None
        return self.E / (2 * (1 + self.nu))

    @property
    def _nu(self) -> float:
        return self.E / (2 * self.shear_modulus) - 1

    @property
    def area(self) -> float:
        """Area [m^2]."""
        raise NotImplementedError

    @property
    def second_moments(self) -> tuple[float, float]:
        """``int y2^2, int y3^2`` about the centroid [m^4]."""
        raise NotImplementedError

    @property
    def torsion_constant(self) -> float:
        """Torsion constant [m^4]."""
        raise NotImplementedError

    @property
    def shear_factors(self) -> tuple[float, float]:
        """Shear corrections along d2 and d3 [-]."""
        raise NotImplementedError

    def _check(self) -> None:
        if (self.nu is None) == (self.G is None):
            raise SceneError(
                f"{self.label}: nu is {show(self.nu)} and G is {show(self.G)}; exactly one of "
                "them must be given, the other None"
            )

    @cached_property
    def stiffness(self) -> Matrix:
        """Stiffness, shape (6, 6); the centroid is the centre of torsion too."""
        E, G, A = self.E, self.shear_modulus, self.area
        along2, along3 = self.second_moments
        k2, k3 = self.shear_factors
        values = (E * A, k2 * G * A, k3 * G * A, G * self.torsion_constant, E * along3, E * along2)
        return shifted(np.diag(values), self.offset)

    @cached_property
    def mass(self) -> BeamMass:
        """``(m, (s2, s3), (I22, I23, I33))`` per unit length."""
        y2, y3 = self.offset
        m = self.density * self.area
        along2, along3 = (self.density * i for i in self.second_moments)
        return m, (m * y2, m * y3), (along2 + m * y2**2, m * y2 * y3, along3 + m * y3**2)


def shifted(stiffness: Matrix, offset: tuple[float, float]) -> Matrix:
    """Stiffness about the reference line of a section whose origin is at ``offset``.

    The strains at the origin are ``Gamma + K x y, K``.

    Args:
        stiffness: About the section's own origin, shape (6, 6).
        offset: ``(y2, y3)`` of that origin [m].
    """
    y2, y3 = offset
    change = np.eye(6)
    change[:3, 3:] = [[0, y3, -y2], [-y3, 0, 0], [y2, 0, 0]]
    return np.asarray(change.T @ stiffness @ change)


@described("rectangular section")
class RectangularSection(_Shape):
    """A rectangle.

    Args:
        E: Young's modulus [Pa].
        nu: Poisson's ratio, in (-1, 0.5]; None where ``G`` is given.
        width: Extent along d2 [m].
        height: Extent along d3 [m].
        density: Mass density [kg/m^3].
        shear_correction: Factor on both shear stiffnesses.
        offset: ``(y2, y3)`` of the centroid from the reference line [m].
        G: Shear modulus in place of ``nu`` [Pa].
        stiffness_damping: Kelvin and Voigt's damping: a time [s], or a ``BeamDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
        relaxation: Prony series of its moduli; None: elastic.
    """

    E: Positive
    nu: PoissonRatio | None
    _: KW_ONLY
    width: Positive
    height: Positive
    density: NonNegative = 0.0
    shear_correction: Positive = 5 / 6
    offset: Pair = (0.0, 0.0)
    G: Positive | None = None
    stiffness_damping: BeamTimes = 0.0
    mass_damping: NonNegative = 0.0
    relaxation: Prony | None = None

    def __post_init__(self) -> None:
        """Check the moduli."""
        self._check()

    @property
    def size(self) -> float:
        """The longer side [m]."""
        return max(self.width, self.height)

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return self.width * self.height

    @property
    def second_moments(self) -> tuple[float, float]:
        """``int y2^2, int y3^2`` about the centroid [m^4]."""
        b, h = self.width, self.height
        return h * b**3 / 12, b * h**3 / 12

    @property
    def torsion_constant(self) -> float:
        """Torsion constant [m^4] (Timoshenko and Goodier, Theory of Elasticity, art. 109)."""
        a, b = max(self.width, self.height), min(self.width, self.height)
        n = np.arange(1, 200, 2.0)
        # 1 - tanh converges at once; the sum of 1/n^5 over odd n is 31/32 zeta(5)
        rest = np.sum((1 - np.tanh(n * math.pi * a / (2 * b))) / n**5)
        total = 31 / 32 * 1.0369277551433699 - rest
        return float(a * b**3 / 3 * (1 - 192 / math.pi**5 * b / a * total))

    @property
    def shear_factors(self) -> tuple[float, float]:
        """Shear corrections [-]."""
        return self.shear_correction, self.shear_correction


class _Round(_Shape):
    """A circle with or without a concentric hole."""

    radius: float
    shear_correction: float | None
    hole: float

    @property
    def size(self) -> float:
        """The outer diameter [m]."""
        return 2 * self.radius

    @property
    def area(self) -> float:
        """Area [m^2]."""
        # written so that a thin wall does not cancel
        return math.pi * (self.radius - self.hole) * (self.radius + self.hole)

    @property
    def second_moments(self) -> tuple[float, float]:
        """``int y2^2, int y3^2`` about the centroid [m^4]."""
        i = self.area * (self.radius**2 + self.hole**2) / 4
        return i, i

    @property
    def torsion_constant(self) -> float:
        """The polar moment [m^4]."""
        return 2 * self.second_moments[0]

    @property
    def shear_factors(self) -> tuple[float, float]:
        """Shear corrections [-], given or by Cowper, J. Appl. Mech. 33 (1966) 335-340, table 1."""
        if self.shear_correction is not None:
            return self.shear_correction, self.shear_correction
        nu, m = self._nu, self.hole / self.radius
        p = (1 + m**2) ** 2
        k = 6 * (1 + nu) * p / ((7 + 6 * nu) * p + (20 + 12 * nu) * m**2)
        return k, k


@described("circular section")
class CircularSection(_Round):
    """A full circle.

    Args:
        E: Young's modulus [Pa].
        nu: Poisson's ratio, in (-1, 0.5]; None where ``G`` is given.
        radius: Radius [m].
        density: Mass density [kg/m^3].
        shear_correction: Factor on both shear stiffnesses; None: Cowper's.
        offset: ``(y2, y3)`` of the centre from the reference line [m].
        G: Shear modulus in place of ``nu`` [Pa].
        stiffness_damping: Kelvin and Voigt's damping: a time [s], or a ``BeamDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
        relaxation: Prony series of its moduli; None: elastic.
    """

    E: Positive
    nu: PoissonRatio | None
    _: KW_ONLY
    radius: Positive
    density: NonNegative = 0.0
    shear_correction: Positive | None = None
    offset: Pair = (0.0, 0.0)
    G: Positive | None = None
    stiffness_damping: BeamTimes = 0.0
    mass_damping: NonNegative = 0.0
    relaxation: Prony | None = None

    hole = 0.0

    def __post_init__(self) -> None:
        """Check the moduli."""
        self._check()


@described("tubular section")
class TubularSection(_Round):
    """A circular tube.

    Args:
        E: Young's modulus [Pa].
        nu: Poisson's ratio, in (-1, 0.5]; None where ``G`` is given.
        radius: Outer radius [m].
        thickness: Thickness of the wall, less than the radius [m].
        density: Mass density [kg/m^3].
        shear_correction: Factor on both shear stiffnesses; None: Cowper's.
        offset: ``(y2, y3)`` of the centre from the reference line [m].
        G: Shear modulus in place of ``nu`` [Pa].
        stiffness_damping: Kelvin and Voigt's damping: a time [s], or a ``BeamDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
        relaxation: Prony series of its moduli; None: elastic.
    """

    E: Positive
    nu: PoissonRatio | None
    _: KW_ONLY
    radius: Positive
    thickness: Positive
    density: NonNegative = 0.0
    shear_correction: Positive | None = None
    offset: Pair = (0.0, 0.0)
    G: Positive | None = None
    stiffness_damping: BeamTimes = 0.0
    mass_damping: NonNegative = 0.0
    relaxation: Prony | None = None

    def __post_init__(self) -> None:
        """Check the moduli and the wall.

        Raises:
            SceneError: If the wall fills the tube.
        """
        self._check()
        if self.thickness >= self.radius:
            raise SceneError(
                f"tubular section: thickness is {show(self.thickness)}; it must be less than the "
                f"radius {show(self.radius)}, or use CircularSection"
            )

    @property
    def hole(self) -> float:  # type: ignore[override]
        """The inner radius [m]."""
        return self.radius - self.thickness
