"""Sections of beams: stiffness and mass about the reference line, given by numbers or by a shape.

A section has the axes d2 and d3, and a point of it the coordinates (y2, y3) from the reference
line. Its strains are ``e = Gamma + K x y`` with ``y = (0, y2, y3)``: ``e_11 = Gamma_1 + y3 K_2 -
y2 K_3``, ``2 e_12 = Gamma_2 - y3 K_1``, ``2 e_13 = Gamma_3 + y2 K_1``.
"""

import math
from dataclasses import KW_ONLY
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from shellmb.arrays import Floats
from shellmb.scene.types import Finite, NonNegative, Positive, numbers
from shellmb.scene.values.damping import BeamTimes, Damped, Prony
from shellmb.scene.values.validate import Sentences, described, extended, show

type BeamMass = tuple[float, tuple[float, float], tuple[float, float, float]]

Pair = tuple[Finite, Finite]
PoissonRatio = Annotated[float, Field(gt=-1, le=0.5, allow_inf_nan=False)]


class BeamSection(Damped):
    """Base class of the sections of beams.

    Attributes:
        size: Size of the cross-section [m].
        stiffness: Of the resultants by the strains, shape (6, 6) [N, N m, N m^2], in the order
            axial, shear along d2, along d3, twist, bending about d2, about d3.
    """

    strains = 6

    if TYPE_CHECKING:
        # real properties here would become the defaults of the subclasses' fields
        @property
        def size(self) -> float: ...  # noqa: D102

        @property
        def stiffness(self) -> Floats: ...  # noqa: D102

    @property
    def long_term(self) -> Floats:
        """The stiffness that is left when all branches are relaxed, shape (6, 6)."""
        C = np.asarray(self.stiffness, dtype=float)
        return C if self.relaxation is None else self.relaxation.long_term * C


def _stiffness(value: Any) -> Floats:
    try:
        array = numbers(value)
    except (TypeError, ValueError):
        array = np.zeros(0)
    array = np.diag(array) if array.shape == (6,) else array
    if array.shape != (6, 6) or not np.isfinite(array).all():
        raise ValueError("it must be 6 by 6 finite numbers, or the 6 of a diagonal")
    return array


@described("general section")
class GeneralSection(BeamSection):
    """Stiffness and mass as they are given.

    Args:
        stiffness: About the reference line in the order axial, shear along d2, along d3, twist,
            bending about d2, about d3: (6, 6), or its diagonal (6,) [N, N m, N m^2].
        mass_per_length: Mass per unit length [kg/m].
        first_moments: ``(int rho y2, int rho y3)`` [kg].
        second_moments: ``(int rho y2^2, int rho y2 y3, int rho y3^2)`` [kg m].
        size: Size of the cross-section [m]; left out: the side of a square as stiff.
        stiffness_damping: Kelvin and Voigt's damping: a time [s], or a ``BeamDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
        relaxation: Prony series of its stiffness; None: elastic.
    """

    stiffness: Annotated[Any, BeforeValidator(_stiffness)]
    mass_per_length: NonNegative = 0.0
    _: KW_ONLY
    first_moments: Pair = (0.0, 0.0)
    second_moments: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    size: Positive = 0.0
    stiffness_damping: BeamTimes = 0.0
    mass_damping: NonNegative = 0.0
    relaxation: Prony | None = None

    def _wrong(self) -> Sentences:
        """Check that energies are positive, and fill in the size."""
        C = self.stiffness
        scale = np.sqrt(np.abs(np.outer(C.diagonal(), C.diagonal())))
        if (np.abs(C - C.T) > 1e-9 * scale).any():
            i, j = np.unravel_index(np.argmax(np.abs(C - C.T)), C.shape)
            yield (
                f"stiffness[{i}, {j}] is {C[i, j]:g} and [{j}, {i}] is {C[j, i]:g}; it must be "
                "symmetric"
            )
        C = (C + C.T) / 2
        if not (C.diagonal() > 0).all() or np.linalg.eigvalsh(C / scale).min() <= 1e-14:
            yield (
                f"stiffness has the diagonal {show(C.diagonal())} and is not positive definite; it "
                "must be"
            )
        yield from self._wrong_mass()
        C.flags.writeable = False
        object.__setattr__(self, "stiffness", C)
        if not self.size:
            object.__setattr__(self, "size", math.sqrt(12 * max(C[4, 4], C[5, 5]) / C[0, 0]))

    def _wrong_mass(self) -> Sentences:
        (s2, s3), (i22, i23, i33) = self.first_moments, self.second_moments
        moments = np.array([[self.mass_per_length, s2, s3], [s2, i22, i23], [s3, i23, i33]])
        d = np.sqrt(np.maximum(moments.diagonal(), 0.0))
        # each row in its own size
        scaled = moments / np.outer(np.where(d > 0, d, 1.0), np.where(d > 0, d, 1.0))
        if moments[d == 0].any() or np.linalg.eigvalsh(scaled).min() < -1e-9:
            yield (
                f"mass_per_length {show(self.mass_per_length)} with first_moments "
                f"{show(self.first_moments)} and second_moments {show(self.second_moments)} belong "
                "to no distribution of mass; their matrix [[m, s2, s3], [s2, I22, I23], [s3, I23, "
                "I33]] must be positive semidefinite"
            )

    def __eq__(self, other: object) -> bool:
        """Decide whether all parameters are equal."""
        if not isinstance(other, GeneralSection):
            return NotImplemented
        mine, theirs = (
            (s.mass, s.size, s.stiffness_damping, s.mass_damping, s.relaxation)
            for s in (self, other)
        )
        return mine == theirs and np.array_equal(self.stiffness, other.stiffness)

    def __hash__(self) -> int:
        """By the mass and the size."""
        return hash((self.mass, self.size))

    @property
    def mass(self) -> BeamMass:
        """``(m, (s2, s3), (I22, I23, I33))`` per unit length."""
        return self.mass_per_length, self.first_moments, self.second_moments


@described("section of a shape")
class _Shape(BeamSection):
    """A homogeneous isotropic section with two planes of symmetry, its centroid off the line."""

    E: Positive
    nu: PoissonRatio | None
    _: KW_ONLY
    density: NonNegative = 0.0
    offset: Pair = (0.0, 0.0)
    G: Positive | None = None
    stiffness_damping: BeamTimes = 0.0
    mass_damping: NonNegative = 0.0
    relaxation: Prony | None = None

    label: ClassVar[str]

    @property
    def shear_modulus(self) -> float:
        """Shear modulus [Pa]."""
        if self.G is not None:
            return self.G
        assert self.nu is not None
        return self.E / (2 * (1 + self.nu))

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

    def _wrong(self) -> Sentences:
        """Check the moduli."""
        if (self.nu is None) == (self.G is None):
            yield (
                f"nu is {show(self.nu)} and G is {show(self.G)}; exactly one of them must be "
                "given, the other None"
            )

    @cached_property
    def stiffness(self) -> Floats:
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


def shifted(stiffness: Floats, offset: tuple[float, float]) -> Floats:
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

    _: KW_ONLY
    width: Positive
    height: Positive
    shear_correction: Positive = 5 / 6

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


@described("round section")
class _Round(_Shape):
    """A circle with or without a concentric hole."""

    _: KW_ONLY
    radius: Positive
    shear_correction: Positive | None = None

    # inner radius
    hole: ClassVar[float] = 0.0

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
        # Poisson's ratio that belongs to both moduli
        nu, m = self.E / (2 * self.shear_modulus) - 1, self.hole / self.radius
        p = (1 + m**2) ** 2
        k = 6 * (1 + nu) * p / ((7 + 6 * nu) * p + (20 + 12 * nu) * m**2)
        return k, k


@extended("circular section")
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

    _: KW_ONLY
    thickness: Positive

    def _wrong(self) -> Sentences:
        """Check the moduli and the wall."""
        if self.thickness >= self.radius:
            yield (
                f"thickness is {show(self.thickness)}; it must be less than the radius "
                f"{show(self.radius)}, or use CircularSection"
            )

    @property
    def hole(self) -> float:  # type: ignore[override]
        """The inner radius [m]."""
        return self.radius - self.thickness
