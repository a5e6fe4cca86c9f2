"""Navier's solutions of laminates against the tables, and against the isotropic plate."""

import math

import numpy as np
import pytest

from shellmb.demos.references.plates import Plate
from shellmb.demos.verification import tables
from shellmb.demos.verification.laminates import Edges, Stiffness, sinusoidal_deflection
from tests.analytic.solutions import rectangle_frequencies, wave_frequencies

A, E2, RHO, NU12 = 2.0, 3e9, 1600.0, 0.25


def laminate(
    angles: list[float], thickness: float, E1: float, G12: float, G23: float, kappa: float = 5 / 6
) -> Stiffness:
    """Classical lamination of equal plies; moduli as multiples of `E2`, with G13 = G12."""
    nu21 = NU12 / E1
    Q = np.zeros((3, 3))
    Q[:2, :2] = np.array([[E1, NU12], [NU12, 1.0]]) / (1 - NU12 * nu21)
    Q[2, 2] = G12
    z = np.linspace(-thickness / 2, thickness / 2, len(angles) + 1)
    A, B, D, G = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((2, 2))
    for angle, low, high in zip(np.radians(angles), z[:-1], z[1:], strict=True):
        c, s = math.cos(angle), math.sin(angle)
        T = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, 0]])
        T[2, 2] = c * c - s * s
        ply = E2 * T.T @ Q @ T
        R = np.array([[c, s], [-s, c]])
        A += ply * (high - low)
        B += ply * (high**2 - low**2) / 2
        D += ply * (high**3 - low**3) / 3
        G += kappa * E2 * R.T @ np.diag([G12, G23]) @ R * (high - low)
    return Stiffness(A, B, D, G)


@pytest.mark.parametrize("a_over_h", [4, 10, 20, 50, 100])
@pytest.mark.parametrize("layup", ["0/90/90/0", "0/90/0", "0/90"])
def test_cross_ply_deflection(layup: str, a_over_h: float) -> None:
    h = A / a_over_h
    stiffness = laminate([float(x) for x in layup.split("/")], h, 25, 0.5, 0.2)
    w = 100 * sinusoidal_deflection("SS-1", stiffness, A, A, 7.0) * E2 * h**3 / (7.0 * A**4)
    assert w == pytest.approx(tables.laminate_deflection(layup, a_over_h), abs=5.1e-6)


@pytest.mark.parametrize("layup", ["0/90/90/0", "0/90/0", "0/90"])
def test_stiff_in_shear_is_the_classical_plate(layup: str) -> None:
    h = A / 4
    stiffness = laminate([float(x) for x in layup.split("/")], h, 25, 0.5, 0.2, kappa=1e6)
    w = 100 * sinusoidal_deflection("SS-1", stiffness, A, A, 7.0) * E2 * h**3 / (7.0 * A**4)
    # the table's CLPT column does not depend on a/h but by its round-off for thin plates
    assert w == pytest.approx(tables.laminate_deflection(layup, 4, "CLPT"), abs=5.1e-6)


@pytest.mark.parametrize("a_over_h", [4, 10, 100])
@pytest.mark.parametrize("b_over_a", [1.0, 3.0])
def test_angle_ply_deflection(b_over_a: float, a_over_h: float) -> None:
    h, b = A / a_over_h, b_over_a * A
    stiffness = laminate([45, -45], h, 40, 0.5, 0.6)
    w = 100 * sinusoidal_deflection("SS-2", stiffness, A, b, 7.0) * E2 * h**3 / (7.0 * A**4)
    assert w == pytest.approx(tables.angle_ply_deflection(b_over_a, a_over_h), abs=5.1e-6)


LAYUPS: list[tuple[str, Edges, list[float]]] = [
    ("0/90/90/0 equal plies", "SS-1", [0, 90, 90, 0]),
    ("45/-45", "SS-2", [45, -45]),
    ("(45/-45)x4", "SS-2", [45, -45] * 4),
]


@pytest.mark.parametrize(("name", "edges", "angles"), LAYUPS)
def test_frequency(name: str, edges: Edges, angles: list[float]) -> None:
    scaled, expected = {}, {}
    for a_over_h in (2, 4, 5, 10, 20, 25, 50, 100):
        h = A / a_over_h
        stiffness = laminate(angles, h, 40, 0.6, 0.5)
        omega = wave_frequencies(edges, stiffness, (RHO * h, RHO * h**3 / 12), A, A)[0]
        scaled[a_over_h] = omega * A**2 / h * math.sqrt(RHO / E2)
        expected[a_over_h] = tables.laminate_frequency(name, a_over_h)
    assert scaled == pytest.approx(expected, abs=5.1e-5)


@pytest.mark.parametrize("edges", ["SS-1", "SS-2"])
def test_isotropic_plate_is_a_laminate(edges: Edges) -> None:
    plate = Plate(7e9, 0.3, 0.2, density=RHO)
    unit = np.array([[1, 0.3, 0], [0.3, 1, 0], [0, 0, 0.35]])
    D = plate.bending * unit
    stiffness = Stiffness(12 / 0.2**2 * D, 0 * D, D, plate.shear * np.eye(2))
    mass = (RHO * 0.2, RHO * 0.2**3 / 12)
    # a membrane mode may lie below the fifth bending mode: look for the value among all five
    for mode in ((1, 1), (1, 2), (3, 2)):
        omega = rectangle_frequencies(plate, A, 1.5, [mode])[0]
        found = wave_frequencies(edges, stiffness, mass, A, 1.5, mode)
        assert min(abs(found / omega - 1)) < 1e-12


def test_other_couplings_are_refused() -> None:
    with pytest.raises(ValueError, match="needs a cross-ply laminate"):
        sinusoidal_deflection("SS-1", laminate([45, -45], 0.1, 25, 0.5, 0.2), A, A, 1.0)
    with pytest.raises(ValueError, match="needs an antisymmetric angle-ply laminate"):
        sinusoidal_deflection("SS-2", laminate([0, 90], 0.1, 25, 0.5, 0.2), A, A, 1.0)
