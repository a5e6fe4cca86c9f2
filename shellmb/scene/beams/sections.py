"""Sections of beams: stiffness and mass about the reference line; any, and given by its numbers.

A section has the axes d2 and d3, and a point of it the coordinates (y2, y3) from the reference
line. Its strains are ``e = Gamma + K x y`` with ``y = (0, y2, y3)``: ``e_11 = Gamma_1 + y3 K_2 -
y2 K_3``, ``2 e_12 = Gamma_2 - y3 K_1``, ``2 e_13 = Gamma_3 + y2 K_1``.
"""

from __future__ import annotations

import math
from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from shellmb.errors import SceneError
from shellmb.scene.values.damping import BeamDamping, BeamTimes
from shellmb.scene.values.relaxation import Prony
from shellmb.scene.values.validate import Finite, NonNegative, Positive, described, numbers, show

type Matrix = NDArray[np.float64]
type BeamMass = tuple[float, tuple[float, float], tuple[float, float, float]]

Pair = tuple[Finite, Finite]


class BeamSection:
    """Base class of the sections of beams.

    Attributes:
        size: Size of the cross-section [m].
        stiffness: Of the resultants by the strains, shape (6, 6) [N, N m, N m^2], in the order
            axial, shear along d2, along d3, twist, bending about d2, about d3.
        stiffness_damping: Time by which the rate of the strains adds to them [s], or a
            ``BeamDamping``.
        mass_damping: Mass-proportional damping [1/s].
        relaxation: Prony series of its stiffness; None: elastic.
    """

    stiffness_damping: Any = 0.0
    mass_damping: Any = 0.0
    relaxation: Prony | None = None

    if TYPE_CHECKING:
        # real properties here would become the defaults of the subclasses' fields
        @property
        def size(self) -> float: ...  # noqa: D102

        @property
        def stiffness(self) -> Matrix: ...  # noqa: D102

    @property
    def mass(self) -> BeamMass:
        """``(m, (s2, s3), (I22, I23, I33))`` per unit length of the reference line.

        Mass [kg/m], its first moments ``int rho y2, int rho y3`` [kg], and its second moments
        ``int rho y2^2, int rho y2 y3, int rho y3^2`` [kg m].
        """
        raise NotImplementedError

    @property
    def damping_times(self) -> tuple[float, ...]:
        """Damping times of the six strains, in the order of the stiffness [s]."""
        given = self.stiffness_damping
        return given.times if isinstance(given, BeamDamping) else (float(given),) * 6

    @property
    def relaxes(self) -> bool:
        """Decide whether it has a Prony series."""
        return self.relaxation is not None

    @property
    def relaxed(self) -> bool:
        """Decide whether all of its branches begin relaxed."""
        return self.relaxation is None or self.relaxation.relaxed

    @property
    def long_term(self) -> Matrix:
        """The stiffness that is left when all branches are relaxed, shape (6, 6)."""
        C = np.asarray(self.stiffness, dtype=float)
        return C if self.relaxation is None else self.relaxation.long_term * C

    @property
    def masses(self) -> tuple[bool, bool, bool]:
        """Find which of the mass, its first and its second moments differ from zero."""
        m, first, second = self.mass
        return bool(m), any(first), any(second)


def _stiffness(value: Any) -> Matrix:
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

    def __post_init__(self) -> None:
        """Check that energies are positive, and fill in the size.

        Raises:
            SceneError: If the stiffness is not symmetric and positive definite, or no
                distribution of mass has such moments.
        """
        C = self.stiffness
        scale = np.sqrt(np.abs(np.outer(C.diagonal(), C.diagonal())))
        if (np.abs(C - C.T) > 1e-9 * scale).any():
            i, j = np.unravel_index(np.argmax(np.abs(C - C.T)), C.shape)
            raise SceneError(
                f"general section: stiffness[{i}, {j}] is {C[i, j]:g} and [{j}, {i}] is "
                f"{C[j, i]:g}; it must be symmetric"
            )
        C = (C + C.T) / 2
        if not (C.diagonal() > 0).all() or np.linalg.eigvalsh(C / scale).min() <= 1e-14:
            raise SceneError(
                f"general section: stiffness has the diagonal {show(C.diagonal())} and is not "
                "positive definite; it must be"
            )
        self._check_mass()
        C.flags.writeable = False
        object.__setattr__(self, "stiffness", C)
        if not self.size:
            object.__setattr__(self, "size", math.sqrt(12 * max(C[4, 4], C[5, 5]) / C[0, 0]))

    def _check_mass(self) -> None:
        (s2, s3), (i22, i23, i33) = self.first_moments, self.second_moments
        moments = np.array([[self.mass_per_length, s2, s3], [s2, i22, i23], [s3, i23, i33]])
        d = np.sqrt(np.maximum(moments.diagonal(), 0.0))
        # each row in its own size
        scaled = moments / np.outer(np.where(d > 0, d, 1.0), np.where(d > 0, d, 1.0))
        if moments[d == 0].any() or np.linalg.eigvalsh(scaled).min() < -1e-9:
            raise SceneError(
                f"general section: mass_per_length {show(self.mass_per_length)} with first_moments "
                f"{show(self.first_moments)} and second_moments {show(self.second_moments)} belong "
                "to no distribution of mass; their matrix [[m, s2, s3], [s2, I22, I23], "
                "[s3, I23, I33]] must be positive semidefinite"
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
