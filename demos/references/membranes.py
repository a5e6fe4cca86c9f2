"""Membranes that wrinkle: closed forms of tension-field theory, and a published airbag."""

import math

# Deflection of the middle of a square airbag of 1.2 m from corner to corner, 0.6 mm thick, E = 588
# MPa, nu = 0.4, under 5 kPa, m: P. Contri and B. A. Schrefler, Commun. Appl. Numer. Methods 4
# (1988) 5-15, and those who repeat it, 0.216 to 0.217
AIRBAG, AIRBAG_SPREAD = 0.2165, 0.005


def wrinkled_band(m: float) -> float:
    """Part of the height of a stretched strip that a moment in its plane wrinkles.

    M. Stein and J. M. Hedgepeth, NASA TN D-813 (1961).

    Args:
        m: Moment over axial force and height, `M/(P H)`, below 1/2.
    """
    return max(0.0, 3 * m - 0.5)


def stretched_strip_curvature(m: float, strain: float, height: float) -> float:
    """Curvature of a stretched strip under a moment in its plane, 1/m: as `wrinkled_band`.

    Args:
        m: As of `wrinkled_band`.
        strain: Strain by the axial force alone, `P/(E H t)`.
        height: Height `H`, m.
    """
    if m <= 1 / 6:
        return 12 * m * strain / height
    # 2 m = 1 - 2/3 sqrt(2 P/(E H^2 t curvature))
    return 2 * strain / height / (1.5 * (1 - 2 * m)) ** 2


def sheared_energy(E: float, angle: float) -> float:
    """Energy per volume of a membrane in simple shear, in tension along one direction, J/m^3.

    H. Wagner's tension field (1929), with Green's strain: `E e^2/2` of its larger principal value.

    Args:
        E: Young's modulus, Pa.
        angle: Displacement over height.
    """
    e = angle**2 / 4 + math.hypot(angle**2 / 4, angle / 2)
    return E * e**2 / 2
