"""Strain energy densities per area that are not quadratic in the shell strains.

The strains at the height `z` are those of eq. (9): in-plane `eps + z kap`, transverse shear `gam`.
"""

from collections.abc import Callable, Mapping

import ufl
from ufl.core.expr import Expr

from shellmb.forms.shell import ShellStrains

# Gauss-Legendre rule with three points on [-1/2, 1/2]: exact for the quintic part of the energy in
# z
_GAUSS_3 = ((-0.3872983346207417, 5 / 18), (0.0, 8 / 18), (0.3872983346207417, 5 / 18))


def through_thickness(
    density: Callable[[Expr, Expr], Expr], strains: ShellStrains, thickness: Expr
) -> Expr:
    """Integrate a three-dimensional strain energy density over the thickness.

    Args:
        density: Energy per volume from the in-plane Green-Lagrange strain (11, 22, 2*12) and the
            transverse shear strain (2*13, 2*23), J/m^3.
        strains: Shell strains of eq. (9).
        thickness: Thickness, m.

    Returns:
        Energy per area, J/m^2.
    """
    return thickness * sum(
        weight * density(strains.eps + z * thickness * strains.kap, strains.gam)
        for z, weight in _GAUSS_3
    )


def neo_hookean(strains: ShellStrains, parameters: Mapping[str, Expr]) -> Expr:
    """Incompressible neo-Hookean shell, thickness stretch from incompressibility.

    `psi = mu/2 (tr C - 3)` with `C_33` such that `det C = 1`, which is the plane-stress condition
    of an incompressible material in closed form.

    Args:
        strains: Shell strains of eq. (9).
        parameters: `mu` (shear modulus, Pa), `thickness` (m), `shear_correction` (-).
    """
    return mooney_rivlin(strains, {**parameters, "mu1": parameters["mu"], "mu2": ufl.as_ufl(0.0)})


def mooney_rivlin(strains: ShellStrains, parameters: Mapping[str, Expr]) -> Expr:
    """Incompressible Mooney-Rivlin shell, thickness stretch from incompressibility.

    `psi = mu1/2 (tr C - 3) + mu2/2 (tr C^-1 - 3)`, a shear modulus of `mu1 + mu2`, with `C_33` as
    in `neo_hookean`, which it is without `mu2`.

    Args:
        strains: Shell strains of eq. (9).
        parameters: `mu1` and `mu2` (Pa), `thickness` (m), `shear_correction` (-).
    """
    mu1, mu2, thickness = (parameters[name] for name in ("mu1", "mu2", "thickness"))
    factor = parameters["shear_correction"]

    def density(e: Expr, gam: Expr) -> Expr:
        first, second = invariants(e, gam, factor)
        return (mu1 * first + mu2 * second) / 2

    return through_thickness(density, strains, thickness)


def invariants(e: Expr, gam: Expr, factor: Expr) -> tuple[Expr, Expr]:
    """`tr C - 3` and `tr C^-1 - 3` of an incompressible material in plane stress.

    `det C = det(C_plane) (C_33 - g . C_plane^-1 . g) = 1` gives `C_33`. Both are written without
    differences of ones: schemes divide the energy's round-off by squares of strains.

    Args:
        e: In-plane strain (11, 22, 2*12).
        gam: Transverse shear strain `g` (2*13, 2*23).
        factor: Shear correction.
    """
    # the trace of C_plane is 2 + a, its determinant 1 + d
    a, b = 2 * (e[0] + e[1]), 4 * e[0] * e[1] - e[2] ** 2
    d, shear = a + b, _sheared(e, gam)
    first = (a * d - b) / (1 + d) + factor * shear
    second = (d**2 - b) / (1 + d) + factor * ((2 + a) * shear - ufl.dot(gam, gam))
    return first, second


def ogden(strains: ShellStrains, parameters: Mapping[str, Expr]) -> Expr:
    """Incompressible Ogden shell of one to three terms, thickness stretch from incompressibility.

    `psi = sum mu_k/alpha_k (l_1^alpha_k + l_2^alpha_k + l_3^alpha_k - 3)`, a shear modulus of
    `sum mu_k alpha_k/2`, which transverse shear has at all stretches: R. W. Ogden, Proc. R. Soc.
    Lond. A 326 (1972) 565-584. With `alpha_1 = 2` alone it is `neo_hookean`.

    Args:
        strains: Shell strains of eq. (9).
        parameters: `mu1`, `alpha1` and, as they are needed, `mu2`, `alpha2`, `mu3`, `alpha3` (Pa,
            -), `thickness` (m), `shear_correction` (-).
    """
    terms = [
        (parameters[f"mu{k}"], parameters[f"alpha{k}"]) for k in (1, 2, 3) if f"mu{k}" in parameters
    ]
    thickness, factor = parameters["thickness"], parameters["shear_correction"]
    modulus = sum(mu * alpha for mu, alpha in terms) / 2

    def density(e: Expr, gam: Expr) -> Expr:
        plane = sum(mu / alpha * powers(e, alpha) for mu, alpha in terms)
        return plane + modulus / 2 * factor * _sheared(e, gam)

    return through_thickness(density, strains, thickness)


# above it stretches differ enough for their logarithms; below, what these terms leave is round-off
ALIKE = 2e-3
TERMS = 5


def powers(e: Expr, alpha: Expr) -> Expr:
    """`l_1^alpha + l_2^alpha + l_3^alpha - 3` of an incompressible body without transverse shear.

    Of the eigenvalues of `C_plane` with trace `2 m` and determinant `j^2` this is

        2 p cosh(alpha/2 arcosh(m/j)) + 1/p^2 - 3,      p = j^(alpha/2),

    a smooth function also where the stretches are equal. It is written without differences of ones.

    Args:
        e: In-plane strain (11, 22, 2*12).
        alpha: Exponent.
    """
    a, b = 2 * (e[0] + e[1]), 4 * e[0] * e[1] - e[2] ** 2
    j = ufl.sqrt(1 + a + b)
    # tanh(alpha ln(j)/4), by which p - 1 and p + 1 are known
    half = ufl.tanh(alpha * log_of_one_and(a + b) / 8)
    more = 2 * half / (1 - half)
    p = 1 + more
    # m/j - 1
    y = ((e[0] - e[1]) ** 2 + e[2] ** 2) / (j * (1 + a / 2 + j))
    return more**2 * (2 * p + 1) / p**2 + 2 * p * _cosh_less_one(alpha / 2, y)


def log_of_one_and(d: Expr) -> Expr:
    """`ln(1 + d)`, by a series in `d/(2 + d)` where `d` is small."""
    near = ufl.lt(d**2, ALIKE**2)
    w = ufl.conditional(near, d, 0.0) / (2 + ufl.conditional(near, d, 0.0))
    series = 2 * w * (1 + w**2 * (1 / 3 + w**2 / 5))
    return ufl.conditional(near, series, ufl.ln(1 + ufl.conditional(near, 1.0, d)))


def _cosh_less_one(n: Expr, y: Expr) -> Expr:
    """`cosh(n arcosh(1 + y)) - 1`, by Chebyshev's series in `y` where `y` is small."""
    series: Expr | float = 1.0
    for k in range(TERMS, 0, -1):
        series = 1 + series * y * (n**2 - k**2) / ((2 * k + 1) * (k + 1))
    near = ufl.lt(y, ALIKE)
    far = ufl.conditional(near, 1.0, y)
    s = ufl.ln(1 + far + ufl.sqrt(far * (2 + far)))
    return ufl.conditional(near, n**2 * y * series, ufl.cosh(n * s) - 1)


def _sheared(e: Expr, gam: Expr) -> Expr:
    """`g . C_plane^-1 . g`, by which transverse shear stretches the thickness."""
    c11, c22, c12 = 1 + 2 * e[0], 1 + 2 * e[1], e[2]
    square = c22 * gam[0] ** 2 - 2 * c12 * gam[0] * gam[1] + c11 * gam[1] ** 2
    return square / (c11 * c22 - c12**2)


def isotropic_quadratic(strains: ShellStrains, parameters: Mapping[str, Expr]) -> Expr:
    """Isotropic linear section as an energy density, to compare both paths with each other.

    Args:
        strains: Shell strains of eq. (9).
        parameters: `E` (Pa), `nu` (-), `thickness` (m), `shear_correction` (-).
    """
    h = parameters["thickness"]
    return h * _plane_stress(strains.eps, parameters) + _bent_and_sheared(strains, parameters)


def tension_field(strains: ShellStrains, parameters: Mapping[str, Expr]) -> Expr:
    """Isotropic membrane that wrinkles, with the bending stiffness of its thickness.

    Of the principal strains `e1 >= e2` its energy per volume is a part of tension, which is least
    over all shortenings that wrinkles may add, and what is left, times `compression`:

        taut      e2 >= -nu e1           that of plane stress
        wrinkled  e1 > 0, e2 < -nu e1    E e1^2/2: tension along the wrinkles alone
        slack     e1 <= 0                0

    A. C. Pipkin, IMA J. Appl. Math. 36 (1986) 85-99; a split with the rest of a stiffness after
    D. Zhang and J. Kiendl, Comput. Methods Appl. Mech. Eng. 432 (2024) 117386. Convex, with
    stresses that are continuous. Where principal strains are equal it is taut or slack, so roots
    of zero are not met. At rest it is taut.

    Args:
        strains: Shell strains of eq. (9).
        parameters: `E` (Pa), `nu` (-), `thickness` (m), `shear_correction` (-), `compression` (-).
    """
    tension, _, _ = tensile(strains.eps, parameters)
    membrane = parameters["thickness"] * tension + compressive(strains.eps, parameters)
    return membrane + _bent_and_sheared(strains, parameters)


def compressive(e: Expr, parameters: Mapping[str, Expr]) -> Expr:
    """Energy per area that is kept of compression in `tension_field`; arguments as in `tensile`."""
    tension, _, _ = tensile(e, parameters)
    kept = parameters["compression"] * (_plane_stress(e, parameters) - tension)
    return parameters["thickness"] * kept


def tensile(e: Expr, parameters: Mapping[str, Expr]) -> tuple[Expr, Expr, Expr]:
    """Energy of tension of `tension_field`, J/m^3, and conditions of being taut, and not slack.

    Args:
        e: In-plane strain (11, 22, 2*12).
        parameters: As of `tension_field`.
    """
    E, nu = parameters["E"], parameters["nu"]
    mean, square = (e[0] + e[1]) / 2, ((e[0] - e[1]) ** 2 + e[2] ** 2) / 4
    # e2 + nu e1 >= 0 and e1 > 0, without roots
    taut = ufl.And(ufl.ge(mean, 0.0), ufl.ge((1 + nu) ** 2 * mean**2, (1 - nu) ** 2 * square))
    pulled = ufl.Or(ufl.gt(mean, 0.0), ufl.gt(square, mean**2))
    wrinkled = ufl.And(pulled, ufl.Not(taut))
    first = mean + ufl.sqrt(ufl.conditional(wrinkled, square, 1.0))
    wavy = ufl.conditional(wrinkled, E * first**2 / 2, 0.0)
    return ufl.conditional(taut, _plane_stress(e, parameters), wavy), taut, pulled


def _plane_stress(e: Expr, parameters: Mapping[str, Expr]) -> Expr:
    """Energy per volume of an isotropic material in plane stress."""
    E, nu = parameters["E"], parameters["nu"]
    squares = e[0] ** 2 + e[1] ** 2 + 2 * nu * e[0] * e[1] + (1 - nu) / 2 * e[2] ** 2
    return E / (1 - nu**2) * squares / 2


def _bent_and_sheared(strains: ShellStrains, parameters: Mapping[str, Expr]) -> Expr:
    """Energy per area of bending and transverse shear of an isotropic layer."""
    h, modulus = parameters["thickness"], parameters["E"] / 2 / (1 + parameters["nu"])
    shear = h * parameters["shear_correction"] * modulus * ufl.dot(strains.gam, strains.gam) / 2
    return h**3 / 12 * _plane_stress(strains.kap, parameters) + shear
