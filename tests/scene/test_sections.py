"""Stiffness and mass of sections."""

import numpy as np
import pytest

from shellmb.scene import Isotropic, Laminate, Orthotropic, Ply, PlyMaterial, stacking_angles

# the composite of the paper's example 6.3; the shear moduli 13 and 23 are not given there
ANTENNA = PlyMaterial(E1=138e9, E2=8.96e9, nu12=0.3, G12=7.1e9, G13=7.1e9, G23=3.5e9, density=1600)
SOFT = PlyMaterial(E1=25.0, E2=1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.2)


def test_antenna_lay_up():
    """D and A of docs/reference/literature.md, laminates."""
    section = Laminate.from_stacking(ANTENNA, 125e-6, "[0,90,45,-45,45,-45]_s")
    assert section.thickness == pytest.approx(1.5e-3)
    D, A = section.D, section.A
    got = D[0, 0], D[1, 1], D[0, 1], D[2, 2], D[0, 2], D[1, 2]
    np.testing.assert_allclose(got, (20.95, 15.88, 3.136, 4.372, 1.014, 1.014), rtol=5e-4)
    got = A[0, 0], A[1, 1], A[0, 1], A[2, 2]
    np.testing.assert_allclose(got, (8.236e7, 8.236e7, 3.256e7, 3.915e7), rtol=5e-4)
    assert not section.coupled
    assert section.mass[1] == 0
    np.testing.assert_allclose(section.mass, (2.4, 0, 1600 * 1.5e-3**3 / 12), rtol=1e-12)


def test_isotropic_is_the_textbook_one():
    E, nu, h = 3.0, 0.3, 0.2
    section = Isotropic(E, nu, thickness=h, density=5.0)
    plane = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    np.testing.assert_allclose(section.A, plane * h, rtol=1e-14)
    np.testing.assert_allclose(section.D, plane * h**3 / 12, rtol=1e-14)
    np.testing.assert_allclose(section.G, 5 / 6 * h * E / 2 / (1 + nu) * np.eye(2), rtol=1e-14)
    assert not section.coupled


@pytest.mark.parametrize("z0", [0.3, -0.1])
def test_offset_is_steiners_theorem(z0):
    plies = (Ply(SOFT, 0.1, 0), Ply(SOFT, 0.2, 30))
    middle, moved = Laminate(plies), Laminate(plies, offset=z0)
    np.testing.assert_allclose(moved.A, middle.A)
    np.testing.assert_allclose(moved.B, middle.B + z0 * middle.A)
    np.testing.assert_allclose(moved.D, middle.D + 2 * z0 * middle.B + z0**2 * middle.A)
    np.testing.assert_allclose(moved.G, middle.G)
    m, s, i = Isotropic(1, 0.3, thickness=0.1, density=2.0, offset=z0).mass
    np.testing.assert_allclose((m, s, i), (0.2, 0.2 * z0, 2 * 0.1**3 / 12 + 0.2 * z0**2))


def test_turning_the_material_by_90_degrees_swaps_its_axes():
    section = Orthotropic(25.0, 1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.2, thickness=0.1, angle=90)
    swapped = Orthotropic(1.0, 25.0, nu12=0.25 / 25, G12=0.5, G13=0.2, G23=0.5, thickness=0.1)
    for name in "ABDG":
        np.testing.assert_allclose(getattr(section, name), getattr(swapped, name), atol=1e-14)
    assert not section.D[:2, 2].any()


@pytest.mark.parametrize("angle", [17.0, -75.0, 200.0])
def test_turning_leaves_invariants(angle):
    straight = Orthotropic(25.0, 1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.2, thickness=0.1)
    turned = Orthotropic(
        25.0, 1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.2, thickness=0.1, angle=angle
    )
    scale = np.diag([1, 1, np.sqrt(2)])  # Mandel's notation makes the turn orthogonal
    for a, b in ((straight.A, turned.A), (straight.D, turned.D)):
        np.testing.assert_allclose(
            np.linalg.eigvalsh(scale @ a @ scale), np.linalg.eigvalsh(scale @ b @ scale)
        )
    np.testing.assert_allclose(np.linalg.eigvalsh(straight.G), np.linalg.eigvalsh(turned.G))


def test_energy_shear_of_a_homogeneous_section_is_five_sixths():
    for angle in (0, 30, 90):
        constant = Laminate.from_stacking(SOFT, 0.1, [angle] * 4)
        energy = Laminate.from_stacking(SOFT, 0.1, [angle] * 4, shear_correction="energy")
        np.testing.assert_allclose(energy.G, constant.G, rtol=1e-12, atol=1e-14)
    isotropic = PlyMaterial(E1=1, E2=1, nu12=0.3, G12=1 / 2.6, G13=1 / 2.6, G23=1 / 2.6)
    energy = Laminate.from_stacking(isotropic, 0.5, "[0]2s", shear_correction="energy")
    np.testing.assert_allclose(energy.G, Isotropic(1, 0.3, thickness=2).G, rtol=1e-12, atol=1e-14)


def test_energy_shear_of_a_sandwich():
    """Soft core, stiff faces of the same Poisson's ratio: the integral of tau^2/G by hand."""
    core = PlyMaterial(E1=1, E2=1, nu12=0.3, G12=1 / 2.6, G13=1 / 2.6, G23=1 / 2.6)
    face = PlyMaterial(E1=100, E2=100, nu12=0.3, G12=100 / 2.6, G13=100 / 2.6, G23=100 / 2.6)
    c, t = 1.0, 0.1
    plies = (Ply(face, t), Ply(core, c), Ply(face, t))
    section = Laminate(plies, shear_correction="energy")
    top = c / 2 + t
    stiffness = (100 * (top**3 - (c / 2) ** 3) + (c / 2) ** 3) * 2 / 3  # of a beam, nu scaled out
    z = np.linspace(0, top, 200_001)
    z = (z[1:] + z[:-1]) / 2
    in_face = z > c / 2
    moment_of_face = 100 * (top**2 - np.maximum(z, c / 2) ** 2) / 2
    tau = (moment_of_face + np.where(in_face, 0, ((c / 2) ** 2 - z**2) / 2)) / stiffness
    flexibility = 2 * np.sum(tau**2 / np.where(in_face, 100, 1) * 2.6) * top / len(z)
    np.testing.assert_allclose(section.G, np.eye(2) / flexibility, rtol=1e-4, atol=1e-12)


def test_energy_shear_is_symmetric_and_positive_for_unbalanced_laminates():
    G = Laminate.from_stacking(SOFT, 0.1, [0, 30, 70], shear_correction="energy").G
    np.testing.assert_array_equal(G, G.T)
    assert np.linalg.eigvalsh(G).min() > 0


@pytest.mark.parametrize(
    ("notation", "angles"),
    [
        ("[0]", (0,)),
        ("[0/90/45]", (0, 90, 45)),
        ("[0/90]s", (0, 90, 90, 0)),
        ("[45/-45]2", (45, -45, 45, -45)),
        ("[0, +22.5]2s", (0, 22.5, 0, 22.5, 22.5, 0, 22.5, 0)),
        ("[0/90]_s", (0, 90, 90, 0)),
    ],
)
def test_stacking_notation(notation, angles):
    assert stacking_angles(notation) == angles
