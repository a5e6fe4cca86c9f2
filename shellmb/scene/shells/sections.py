"""Sections: what a piece of shell resists with, and what it weighs."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from shellmb.errors import SceneError
from shellmb.scene.shells import lamination
from shellmb.scene.shells.lamination import Layer, Stiffness
from shellmb.scene.values.validate import Finite, NonNegative, Positive, described, show

__all__ = ["Hyperelastic", "Isotropic", "LinearSection", "Orthotropic", "Section"]

type Matrix = NDArray[np.float64]
type Mass = tuple[float, float, float]

PoissonRatio = Annotated[float, Field(gt=-1, lt=0.5, allow_inf_nan=False)]


class Section:
    """Any section.

    Attributes:
        thickness: Total thickness [m].
        mass: ``(m, s_star, I_star)`` of eq. 16: mass [kg/m^2], its first [kg/m] and its second
            moment [kg] about the reference surface, all per unit area of it.
    """

    if TYPE_CHECKING:
        # a real property here would become the default of the subclasses' field
        @property
        def thickness(self) -> float: ...  # noqa: D102

    @property
    def mass(self) -> Mass:
        """``(m, s_star, I_star)`` per unit area."""
        raise NotImplementedError


class LinearSection(Section):
    """A section whose resultants are linear in the strains.

    ``[N; M] = [[A, B], [B, D]] [eps; kappa]`` and ``Q = G gamma`` in the order 11, 22, 12 with
    engineering shears (2 eps_12, 2 kappa_12), and 13, 23, all along the material axes of the shell.
    """

    shear_correction: float | Literal["energy"]
    offset: float

    @property
    def layers(self) -> tuple[Layer, ...]:
        """The section from its lower to its upper face."""
        raise NotImplementedError

    @cached_property
    def _stiffness(self) -> Stiffness:
        return lamination.stiffness(self.layers, self.shear_correction, self.offset)

    @property
    def A(self) -> Matrix:
        """Membrane stiffness, shape (3, 3) [N/m]."""
        return self._stiffness.A

    @property
    def B(self) -> Matrix:
        """Coupling of membrane and bending, shape (3, 3) [N]."""
        return self._stiffness.B

    @property
    def D(self) -> Matrix:
        """Bending stiffness, shape (3, 3) [N m]."""
        return self._stiffness.D

    @property
    def G(self) -> Matrix:
        """Transverse shear stiffness with its correction, shape (2, 2) [N/m]."""
        return self._stiffness.G

    @property
    def coupled(self) -> bool:
        """Whether ``B`` differs from zero."""
        return bool(np.any(self.B))

    @cached_property
    def mass(self) -> Mass:
        """``(m, s_star, I_star)`` per unit area."""
        return lamination.mass(self.layers, self.offset)


@described("isotropic section")
class Isotropic(LinearSection):
    """One isotropic elastic layer.

    Args:
        E: Young's modulus [Pa].
        nu: Poisson's ratio, in (-1, 0.5).
        thickness: Thickness [m].
        density: Mass density [kg/m^3].
        shear_correction: Factor on the transverse shear stiffness.
        offset: Height of the layer's middle above the reference surface [m].
    """

    E: Positive
    nu: PoissonRatio
    thickness: Positive
    density: NonNegative = 0.0
    shear_correction: Positive = 5 / 6
    offset: Finite = 0.0

    @property
    def layers(self) -> tuple[Layer, ...]:
        """The single layer."""
        shear = self.E / (2 * (1 + self.nu))
        plane = lamination.plane_stress(self.E, self.E, self.nu, shear)
        return (Layer(plane, shear * np.eye(2), self.density, self.thickness),)


def check_stable(what: str, E1: float, E2: float, nu12: float) -> None:
    """Refuse moduli with which the plane-stress energy is not positive.

    Raises:
        SceneError: If ``|nu12| >= sqrt(E1/E2)``.
    """
    bound = math.sqrt(E1 / E2)
    if abs(nu12) >= bound:
        raise SceneError(
            f"{what}: nu12 is {show(nu12)}; "
            f"its magnitude must be less than sqrt(E1/E2) = {bound:.4g}"
        )


@described("orthotropic section")
class Orthotropic(LinearSection):
    """One orthotropic elastic layer, turned by ``angle`` from the shell's material 1-direction.

    Args:
        E1: Young's modulus along the layer's axis 1 [Pa].
        E2: Young's modulus along axis 2 [Pa].
        nu12: Contraction along 2 per extension along 1; ``|nu12| < sqrt(E1/E2)``.
        G12: In-plane shear modulus [Pa].
        G13: Transverse shear modulus of axis 1 [Pa].
        G23: Transverse shear modulus of axis 2 [Pa].
        thickness: Thickness [m].
        density: Mass density [kg/m^3].
        angle: From the shell's 1-direction to axis 1, right-handed about the normal [degrees].
        shear_correction: Factor on the transverse shear stiffness.
        offset: Height of the layer's middle above the reference surface [m].
    """

    E1: Positive
    E2: Positive
    nu12: Finite
    G12: Positive
    G13: Positive
    G23: Positive
    thickness: Positive
    density: NonNegative = 0.0
    angle: Finite = 0.0
    shear_correction: Positive = 5 / 6
    offset: Finite = 0.0

    def __post_init__(self) -> None:
        """Check that the strain energy is positive."""
        check_stable("orthotropic section", self.E1, self.E2, self.nu12)

    @property
    def layers(self) -> tuple[Layer, ...]:
        """The single layer, its axes turned."""
        plane = lamination.plane_stress(self.E1, self.E2, self.nu12, self.G12)
        transverse = np.diag([self.G13, self.G23])
        layer = Layer(plane, transverse, self.density, self.thickness)
        return (layer.turned(self.angle),)


@described("hyperelastic section")
class Hyperelastic(Section):
    """A strain energy per unit area of the reference surface, written by the user in UFL.

    Args:
        energy: ``energy(strains, parameters) -> ufl expression``; ``strains`` has the fields
            ``eps``, ``kap`` (3,) and ``gam`` (2,) of :class:`shellmb.forms.shell.ShellStrains`, in
            the shell's material axes, ``parameters`` the names below as UFL constants.
        parameters: Values of the material parameters by name.
        thickness: Thickness [m].
        density: Mass density [kg/m^3].
        stiffness: Size of the membrane stiffness, as E times thickness [N/m]; scales the
            unknowns and does not change the solution.
    """

    energy: Callable[..., Any]
    parameters: dict[str, Finite]
    thickness: Positive
    density: NonNegative
    stiffness: Positive

    @property
    def mass(self) -> Mass:
        """``(m, s_star, I_star)`` per unit area, of a homogeneous layer."""
        h = self.thickness
        return (self.density * h, 0.0, self.density * h**3 / 12)
