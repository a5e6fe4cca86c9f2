"""Modes are true, also where elements are free to move: none is below the first true one.

The kind: frequencies and load factors of motions that the strains of elements might not see, which
would be below all true ones. The true ones are known: they do not go with the thickness.
"""

import numpy as np
import pytest

import shellmb as sm
from shellmb.arrays import Floats
from shellmb.demos.verification.problems.linear_shells import compressed_cylinder
from shellmb.running.rotating.campbell import campbell

# first true frequency along a free square, Hz (Rayleigh-Ritz; `tests/model/test_triangles.py`)
TRUE = 1971.0
FLAT, CURVED = sm.Rectangle(1.0, 0.7), sm.Cylinder(1.0, 0.7, angles=(0.0, 60.0))


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize(("n", "thickness"), [(2, 1e-2), (3, 1e-3), (2, 0.2)])
def test_no_frequency_is_below_the_first_true_one(cell: str, n: int, thickness: float) -> None:
    section = sm.Isotropic(E=70e9, nu=0.3, thickness=thickness, density=2700.0)
    edges = ("left", "right", "top", "bottom")
    held = sm.Fixed(edges, displacement=(None, 0, None), director=(0, 0, 0))
    surface = sm.Rectangle(1, 1, axis1=(0, 0, 1), axis2=(1, 0, 0))
    plate = sm.Shell("foil", surface, section, mesh=(n, n), cell=cell)  # type: ignore[arg-type]
    scene = sm.Scene("free", plate, supports=held, scheme="ep4", dt=1e-4, t_end=1e-3)
    found = sm.modes(scene, count=11 if n == 2 else 26)
    squares = np.asarray(found.fields["foil"]["displacement"]) ** 2
    along = squares[..., [0, 2]].sum((1, 2)) > 0.5 * squares.sum((1, 2))
    frequencies = np.array(found.frequencies)
    assert np.sum(along & (frequencies < 1.0)) == 3
    # two per cent: the first true one on 2x2 elements is one per cent high
    assert not np.any(along & (frequencies < 0.98 * TRUE) & (frequencies > 1.0))
    # high modes across the sheet are not those of better elements, of which it is said
    assert all("beside elements of degree 3" in said for said in found.warnings)


@pytest.mark.parametrize("surface", [FLAT, CURVED])
@pytest.mark.parametrize(("cell", "degree"), [("quad", 2), ("quad", 3), ("tri", 2)])
def test_six_motions_are_free_and_all_others_bend(cell, degree, surface) -> None:
    """Kind: bending that forces do not see is soft, strains that they see twice lock.

    Other frequencies go with the thickness, on one element too. 0.2 % of those of thick ones are
    curvature and shear.
    """
    found = []
    for thickness in (1e-2, 1e-4):
        section = sm.Isotropic(1.0, 0.3, thickness=thickness, density=1.0)
        piece = sm.Shell("piece", surface, section, mesh=(1, 1), cell=cell, degree=degree)
        scene = sm.Scene("piece", piece, scheme="ep", dt=1.0, t_end=1.0)
        found.append(np.array(sm.modes(scene, count=8).frequencies) / thickness)
    assert np.all(np.abs(np.array(found)[:, :6]) < 1e-6)
    assert found[0][6:] == pytest.approx(found[1][6:], rel=5e-3)
    assert np.all(found[1][6:] > 0.7)


@pytest.mark.parametrize("mesh", [(4, 16), (3, 9)])
def test_triangles_do_not_buckle_by_themselves(mesh: tuple[int, int]) -> None:
    """The classical load of a cylinder is that of its section, whatever the elements."""
    found = sm.modes(compressed_cylinder("tri", mesh), buckling=True, count=2)
    # three elements a half-wave: the load is within four per cent
    assert found.load_factors[0] == pytest.approx(1.0, rel=0.04)


def test_a_foil_that_spins_has_no_others() -> None:
    """Centrifugal forces resist what elements might not: true ones begin at twenty kilohertz."""
    section = sm.Isotropic(E=70e9, nu=0.3, thickness=1e-5, density=2700.0)
    surface = sm.Rectangle(0.1, 0.1, origin=(-0.05, -0.05, 0.0))
    flat = sm.Fixed(("left", "right", "top", "bottom"), (None, None, 0), director=(0, 0, 0))
    foil = sm.Shell("foil", surface, section, mesh=(2, 2))
    scene = sm.Scene("spun", foil, supports=flat, scheme="ep4", dt=1e-4, t_end=1e-3)
    for found in campbell(scene, [0.0, 300.0], count=12, axis=(0, 0, 1)).modes:
        frequencies = np.abs(found.values.imag) / (2 * np.pi)
        assert not np.any((frequencies > 500) & (frequencies < 0.98 * 10 * TRUE))


def octant(xi: Floats, eta: Floats) -> Floats:
    """An eighth of a sphere, but for three degrees about its pole."""
    along, up = np.pi / 2 * xi, np.deg2rad(87) * eta
    rows = np.cos(up) * np.cos(along), np.cos(up) * np.sin(along), np.sin(up)
    return RADIUS * np.stack(rows)


RADIUS, WAVE = 0.05, np.sqrt(70e9 / 2700.0)


def lamb(n: int) -> float:
    """Lower frequency of a sphere that does not bend, Hz (H. Lamb, Proc. LMS 14 (1882) 50-56)."""
    terms = 1 - 0.3**2, -(n * (n + 1) + 1 + 3 * 0.3), n * (n + 1) - 2
    return float(np.sqrt(np.roots(terms).min())) * WAVE / RADIUS / (2 * np.pi)


@pytest.mark.parametrize(
    ("strain", "n", "metre"),
    [(1e-4, 8, 1.0), (1e-3, 8, 1e3), pytest.param(1e-4, 16, 1.0, marks=pytest.mark.slow)],
)
def test_those_of_a_pressurised_sphere_are_true(strain: float, n: int, metre: float) -> None:
    """Across a curved surface motions that only the prestress resists alternate as well."""
    pascal = metre**-2
    t, E = 1e-4 * RADIUS * metre, 70e9 * pascal
    section = sm.Isotropic(E=E, nu=0.3, thickness=t, density=2700.0 * metre**-4)
    held = [(None, 0, None), (0, None, None), (None, None, 0), (0, 0, None)]
    scene = sm.Scene(
        "octant",
        sm.Shell("foil", sm.Parametric(lambda a, b: metre * octant(a, b)), section, mesh=(n, n)),
        supports=[
            sm.Fixed(edge, displacement=u)
            for edge, u in zip(("left", "right", "bottom", "top"), held, strict=True)
        ],
        loads=sm.Pressure(2 * strain * E / (1 - 0.3) * t / (RADIUS * metre)),
        scheme="static",
        dt=1.0,
        t_end=1.0,
    )
    found = sm.modes(scene, loaded=True, count=12)
    # even ones, each as often as it has symmetric shapes; the last are higher by what pressure adds
    expected = [lamb(2)] * 2 + [lamb(4)] * 3 + [lamb(6)] * 4
    np.testing.assert_allclose(found.frequencies[:9], expected, rtol=2e-3 + 35 * strain)


def test_a_sheet_that_tension_alone_holds_across_its_surface_is_true() -> None:
    """Of a drum no mode has elastic energy, up to those of a wave in each element."""
    section = sm.Isotropic(E=70e9, nu=0.3, thickness=1e-4, density=2700.0)
    tension = 1e-3 * 70e9 / (1 - 0.3) * 1e-4
    free = {"left": (0, None, 0), "bottom": (None, 0, 0)}
    free |= dict.fromkeys(("right", "top"), (None, None, 0))
    scene = sm.Scene(
        "drum",
        sm.Shell("foil", sm.Rectangle(1, 1), section, mesh=(4, 4)),
        supports=[sm.Fixed(edge, displacement=u) for edge, u in free.items()],
        loads=[sm.EdgeForce("right", (tension, 0, 0)), sm.EdgeForce("top", (0, tension, 0))],
        scheme="static",
        dt=1.0,
        t_end=1.0,
    )
    found = sm.modes(scene, loaded=True, count=40)
    drum = np.sqrt(tension / (2700.0 * 1e-4)) / 2 * np.sqrt([2, 5, 5, 8, 10, 10])
    np.testing.assert_allclose(found.frequencies[:6], drum, rtol=0.02)
    squares = np.asarray(found.fields["foil"]["displacement"]) ** 2
    along = squares[..., :2].sum((1, 2)) > 0.5 * squares.sum((1, 2))
    # waves along it begin at two kilohertz
    assert found.frequencies[-1] < TRUE
    assert not np.any(along) and not found.warnings
