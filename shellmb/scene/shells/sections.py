"""Sections: what a piece of shell resists with, and what it weighs."""

import math
from collections.abc import Callable
from dataclasses import KW_ONLY
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.scene.shells import lamination
from shellmb.scene.shells.lamination import Layer, Layup
from shellmb.scene.shells.strength import Strength
from shellmb.scene.types import Finite, NonNegative, Positive
from shellmb.scene.values.damping import Damped, Prony, ShellTimes
from shellmb.scene.values.user_functions import OfPosition, check_sign, values_at
from shellmb.scene.values.validate import Sentences, described

type Mass = tuple[float, float, float]

Least = Literal["positive", "not negative"]

if TYPE_CHECKING:
    # mostly numbers: who reads one knows whether it is
    PositiveAt = Any
    FiniteAt = Any
else:
    PositiveAt = Positive | OfPosition
    FiniteAt = Finite | OfPosition
# value of a parameter that may be a function of the position, from its name in messages, what is
# given, and what values of a function have to be
type Value = Callable[[str, Any, Least | None], Any]

PoissonRatio = Annotated[float, Field(gt=-1, lt=0.5, allow_inf_nan=False)]


class Section(Damped):
    """Base class of the sections of shells.

    Attributes:
        thickness: Total thickness [m].
        mass: ``(m, s_star, I_star)`` of eq. 16: mass [kg/m^2], its first [kg/m] and its second
            moment [kg] about the reference surface, all per unit area of it.
        field_kinds: Kinds of `FieldKind.bodies` of shells with it.
    """

    # membrane, bending and shear
    strains = 3
    linear = False
    field_kinds: ClassVar[tuple[str, ...]] = ()

    if TYPE_CHECKING:
        # a real property here would become the default of the subclasses' field
        @property
        def thickness(self) -> Any: ...  # noqa: D102

    @property
    def mass(self) -> Mass:
        """``(m, s_star, I_star)`` per unit area, of a homogeneous layer."""
        one: Any = self
        return one.density * one.thickness, 0.0, one.density * one.thickness**3 / 12

    @property
    def doubts(self) -> tuple[str, ...]:
        """Warnings about choices that are possible but hardly meant, a sentence each."""
        return ()


class LinearSection(Section):
    """A section whose resultants are linear in the strains.

    ``[N; M] = [[A, B], [B, D]] [eps; kappa]`` and ``Q = G gamma`` in the order 11, 22, 12 with
    engineering shears (2 eps_12, 2 kappa_12), and 13, 23, all along the material axes of the shell.

    Thicknesses, angles and the offset may be functions of the position: vectorised, of reference
    positions (3, n), they give (n,) numbers. Then the section has numbers at positions only,
    :meth:`at`, and its own ``A``, ``B``, ``D``, ``G`` and ``mass`` raise an error.
    """

    shear_correction: float | Literal["energy"]
    offset: Any
    label: ClassVar[str]
    linear = layered = True
    field_kinds: ClassVar[tuple[str, ...]] = ("linear",)

    def layers_by(self, value: Value) -> tuple[Layer, ...]:
        """The section from its lower to its upper face.

        Args:
            value: Gives the value of each parameter that may be a function of the position.
        """
        raise NotImplementedError

    def _layup(self, value: Value) -> Layup:
        offset = value("offset", self.offset, None)
        layers = tuple(layer.long_term for layer in self.layers_by(value))
        return Layup(layers, self.shear_correction, offset)

    @cached_property
    def functions(self) -> dict[str, OfPosition]:
        """Parameters that are functions of the position, by their names."""
        found: dict[str, OfPosition] = {}

        def note(name: str, given: Any, least: Least | None) -> Any:
            if callable(given):
                found[name] = given
            return 1.0

        self._layup(note)
        return found

    def at(self, x: Any, who: str = "") -> Layup:
        """The section at a position (3,), or with a further axis at many (3, n).

        Args:
            x: Reference positions [m].
            who: Whose section it is, for messages.

        Raises:
            SceneError: If a function fails, or a thickness is not positive somewhere.
        """
        points = np.asarray(x, dtype=float)
        many = points.reshape(3, -1)
        said = f"{who}: {self.label}" if who else self.label

        def value(name: str, given: Any, least: Least | None) -> Any:
            if not callable(given):
                return given
            what = f"{said}: {name}"
            found = values_at(given, many, 1, what)
            if least is not None:
                check_sign(found, many, what, strictly=least == "positive")
            return found.reshape(points.shape[1:])[()]

        layup = self._layup(value)
        total = np.broadcast_to(layup.thickness, points.shape[1:]).ravel()
        check_sign(total, many, f"{said}: thickness", strictly=True)
        return layup

    @cached_property
    def generic(self) -> Layup:
        """A section whose zeros are zero everywhere, whatever its functions of the position."""
        numbers = {f: k for k, f in enumerate(dict.fromkeys(self.functions.values()))}

        def value(name: str, given: Any, least: Least | None) -> Any:
            # numbers in no relation to one another, but for the same function
            return 1.0 + math.sqrt(2 + numbers[given]) if callable(given) else given

        return self._layup(value)

    @property
    def _numbers(self) -> Layup:
        if self.functions:
            names = ", ".join(self.functions)
            raise SceneError(
                f"{self.label}: {names} is a function of the position, so the section has numbers "
                "at positions only: use section.at((x, y, z))"
            )
        return self.generic

    @property
    def A(self) -> Floats:
        """Membrane stiffness, shape (3, 3) [N/m]."""
        return self._numbers.A

    @property
    def B(self) -> Floats:
        """Coupling of membrane and bending, shape (3, 3) [N]."""
        return self._numbers.B

    @property
    def D(self) -> Floats:
        """Bending stiffness, shape (3, 3) [N m]."""
        return self._numbers.D

    @property
    def G(self) -> Floats:
        """Transverse shear stiffness with its correction, shape (2, 2) [N/m]."""
        return self._numbers.G

    @property
    def coupled(self) -> bool:
        """Decide whether ``B`` differs from zero, anywhere."""
        return bool(np.any(self.generic.B))

    @property
    def relaxes(self) -> bool:
        """Decide whether a layer has a Prony series."""
        return any(layer.relaxation is not None for layer in self.generic.layers)

    @property
    def relaxed(self) -> bool:
        """Decide whether all of its branches begin relaxed."""
        given = (layer.relaxation for layer in self.generic.layers)
        return all(one is None or one.relaxed for one in given)

    @property
    def mass(self) -> Mass:
        """``(m, s_star, I_star)`` per unit area."""
        m, s, inertia = self._numbers.mass
        return float(m), float(s), float(inertia)

    @property
    def masses(self) -> tuple[bool, ...]:
        """Find which of ``(m, s_star, I_star)`` differ from zero, anywhere."""
        return tuple(map(bool, self.generic.mass))


@described("isotropic section")
class Isotropic(LinearSection):
    """One isotropic elastic layer.

    Args:
        E: Young's modulus [Pa].
        nu: Poisson's ratio, in (-1, 0.5).
        thickness: Thickness [m]: a number, or a function of the position.
        density: Mass density [kg/m^3].
        shear_correction: Factor on the transverse shear stiffness.
        offset: Height of the layer's middle above the reference surface [m]: a number, or a
            function of the position; half the thickness where the surface is the lower face.
        stiffness_damping: Kelvin and Voigt's damping: a time [s], or a ``ShellDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
        strength: Strengths, for reserve factors against failure.
        relaxation: Prony series of its moduli; None: elastic.
    """

    E: Positive
    nu: PoissonRatio
    thickness: PositiveAt
    density: NonNegative = 0.0
    _: KW_ONLY
    shear_correction: Positive = 5 / 6
    offset: FiniteAt = 0.0
    stiffness_damping: ShellTimes = 0.0
    mass_damping: NonNegative = 0.0
    strength: Strength | None = None
    relaxation: Prony | None = None

    def layers_by(self, value: Value) -> tuple[Layer, ...]:
        """The single layer."""
        shear = self.E / (2 * (1 + self.nu))
        plane = lamination.plane_stress(self.E, self.E, self.nu, shear)
        thickness = value("thickness", self.thickness, "positive")
        transverse, own = shear * np.eye(2), (self.strength, self.relaxation)
        return (Layer(plane, transverse, self.density, thickness, 0.0, *own),)


@described("orthotropic material")
class Moduli:
    """Base class of orthotropic materials, and of the section that is one layer of one.

    Args:
        E1: Young's modulus along axis 1 [Pa].
        E2: Young's modulus along axis 2 [Pa].
        nu12: Contraction along 2 per extension along 1; ``|nu12| < sqrt(E1/E2)``.
        G12: In-plane shear modulus [Pa].
        G13: Transverse shear modulus of axis 1 [Pa].
        G23: Transverse shear modulus of axis 2 [Pa].
        density: Mass density [kg/m^3].
        strength: Strengths, for reserve factors against failure.
        relaxation: Prony series of its moduli; None: elastic.
    """

    E1: Positive
    E2: Positive
    _: KW_ONLY
    nu12: Finite
    G12: Positive
    G13: Positive
    G23: Positive
    density: NonNegative = 0.0
    strength: Strength | None = None
    relaxation: Prony | None = None

    def _wrong(self) -> Sentences:
        """Check that the strain energy in plane stress is positive."""
        bound = math.sqrt(self.E1 / self.E2)
        if abs(self.nu12) >= bound:
            yield "nu12", f"its magnitude must be less than sqrt(E1/E2) = {bound:.4g}"

    def layer(self, thickness: Any) -> Layer:
        """A layer of it, along its axes."""
        plane = lamination.plane_stress(self.E1, self.E2, self.nu12, self.G12)
        shear, own = np.diag([self.G13, self.G23]), (self.strength, self.relaxation)
        return Layer(plane, shear, self.density, thickness, 0.0, *own)


@described("orthotropic section")
class Orthotropic(Moduli, LinearSection):
    """One orthotropic elastic layer, turned by ``angle`` from the shell's material 1-direction.

    Args:
        E1: Young's modulus along the layer's axis 1 [Pa].
        E2: Young's modulus along axis 2 [Pa].
        nu12: Contraction along 2 per extension along 1; ``|nu12| < sqrt(E1/E2)``.
        G12: In-plane shear modulus [Pa].
        G13: Transverse shear modulus of axis 1 [Pa].
        G23: Transverse shear modulus of axis 2 [Pa].
        thickness: Thickness [m]: a number, or a function of the position.
        density: Mass density [kg/m^3].
        angle: From the shell's 1-direction to axis 1, right-handed about the normal [degrees]: a
            number, or a function of the position.
        shear_correction: Factor on the transverse shear stiffness.
        offset: Height of the layer's middle above the reference surface [m]: a number, or a
            function of the position; half the thickness where the surface is the lower face.
        stiffness_damping: Kelvin and Voigt's damping: a time [s], or a ``ShellDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
        strength: Strengths, for reserve factors against failure.
        relaxation: Prony series of its moduli; None: elastic.
    """

    _: KW_ONLY
    thickness: PositiveAt
    angle: FiniteAt = 0.0
    shear_correction: Positive = 5 / 6
    offset: FiniteAt = 0.0
    stiffness_damping: ShellTimes = 0.0
    mass_damping: NonNegative = 0.0

    def layers_by(self, value: Value) -> tuple[Layer, ...]:
        """The single layer, its axes turned."""
        layer = self.layer(value("thickness", self.thickness, "positive"))
        return (layer.turned(value("angle", self.angle, None)),)


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
        stiffness_damping: Kelvin and Voigt's damping with the stiffness of the reference: a time
            [s], or a ``ShellDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
    """

    energy: Callable[..., Any]
    parameters: dict[str, Finite]
    _: KW_ONLY
    thickness: Positive
    density: NonNegative = 0.0
    stiffness: Positive
    stiffness_damping: ShellTimes = 0.0
    mass_damping: NonNegative = 0.0


@described("wrinkling section")
class Wrinkling(Section):
    """An isotropic membrane that wrinkles and goes slack in place of carrying compression.

    Wrinkles are not resolved: where one principal strain would give compression, the membrane is in
    tension along the other one alone; where both are negative it is slack. Bending and transverse
    shear have the stiffness of the thickness. See :func:`shellmb.forms.materials.tension_field`.

    Args:
        E: Young's modulus [Pa].
        nu: Poisson's ratio, in (-1, 0.5).
        thickness: Thickness [m].
        density: Mass density [kg/m^3].
        compression: Part of the stiffness in compression that is kept, in [0, 1]; 1 is
            :class:`Isotropic`. It holds slack regions in place. A run warns where it stores much.
        shear_correction: Factor on the transverse shear stiffness.
        stiffness_damping: Kelvin and Voigt's damping with the stiffness of the taut membrane: a
            time [s], or a ``ShellDamping``.
        mass_damping: Damping in proportion to the mass, a rate [1/s].
    """

    E: Positive
    nu: PoissonRatio
    thickness: Positive
    density: NonNegative = 0.0
    _: KW_ONLY
    compression: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 1e-4
    shear_correction: Positive = 5 / 6
    stiffness_damping: ShellTimes = 0.0
    mass_damping: NonNegative = 0.0

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of its energy by name."""
        names = "E", "nu", "thickness", "compression", "shear_correction"
        return {name: float(getattr(self, name)) for name in names}

    @property
    def stiffness(self) -> float:
        """Size of the membrane stiffness [N/m]."""
        return float(self.E * self.thickness)
