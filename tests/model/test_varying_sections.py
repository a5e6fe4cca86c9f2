"""Sections whose thickness, angles and offset are functions of the position."""

from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
from scipy.integrate import quad

import shellmb as sm
from shellmb.errors import SceneError, ShellmbWarning
from shellmb.model.model import Model
from shellmb.observers.files.output_parts import drawn_mesh
from shellmb.running.execute import execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Isotropic,
    Join,
    Laminate,
    Orthotropic,
    Ply,
    PlyMaterial,
    Probe,
    Rectangle,
    Scene,
    Shell,
)

L, B, E, RHO, P = 1.0, 0.2, 1e9, 1000.0, 0.002
THICK, THIN = 0.02, 0.01
CARBON = PlyMaterial(E1=138e9, E2=9e9, nu12=0.3, G12=7e9, G13=7e9, G23=3e9, density=1600.0)


def taper(x: Any) -> Any:
    return THICK + (THIN - THICK) * x[0] / L


def step(x: Any) -> Any:
    return np.where(np.asarray(x[0]) < L / 2, THICK, THIN)


def strip(section: Any, mesh: Any = (8, 1), **more: Any) -> Scene:
    shell = Shell("strip", Rectangle(L, B), section, mesh=mesh, **more)
    return Scene(
        "strip",
        shell,
        supports=Clamped("left"),
        loads=EdgeForce("right", (0, 0, P / B)),
        probes=Probe("tip", (L, 0, 0), component=2),
        scheme="linear-statics",
    )


def tip(scene: Scene) -> float:
    return float(execute(scene).column("tip")[-1])


def exact(thickness: Any) -> float:
    """Timoshenko's cantilever whose `E I` varies, under a force at its tip."""

    def slope(x: float) -> float:
        h = float(thickness((x,)))
        return P * (L - x) ** 2 / (E * B * h**3 / 12) + P / (5 / 6 * E / 2 * B * h)

    return float(quad(slope, 0, L, points=[L / 2])[0])


@pytest.mark.parametrize("thickness", [taper, step])
def test_tip_of_a_cantilever(thickness) -> None:
    """Of fourth order: 5e-4 with eight elements, 3e-5 with 20; a step is at an edge of some."""
    section = Isotropic(E, 0.0, thickness=thickness)
    assert tip(strip(section, (20, 1))) == pytest.approx(exact(thickness), rel=4e-5)


def test_on_triangles() -> None:
    """Thickness constant in each: of second order, as these elements are."""
    coarse, fine = (
        tip(strip(Isotropic(E, 0.0, thickness=taper), (n, 2), cell="tri")) / exact(taper) - 1
        for n in (8, 16)
    )
    assert abs(fine) < 1.2e-3 and abs(coarse) > 3 * abs(fine)


def test_a_wedge_rings() -> None:
    """Kirchhoff's cantilever wedge, its edge sharp: 5.315, 15.207, 30.020 (Conway and Dubil)."""
    section = Isotropic(E, 0.0, thickness=lambda x: THIN * (1 - x[0] / L), density=RHO)
    modes = natural_modes(strip(section, (16, 1)), count=4)
    lifts = np.array([shape["strip"][:, 2].sum() for shape in modes.shapes])
    found = modes.omega[np.abs(lifts) > 1e-6 * np.abs(lifts).max()]
    # 4e-4: the third mode on 16 elements (2.1e-3 on eight); those that twist have no mean
    found = found * L**2 / np.sqrt(E * THIN**2 / 12 / RHO)
    np.testing.assert_allclose(found, (5.315, 15.207, 30.020), rtol=4e-4)


def test_a_soft_core_that_varies_is_doubted_as_any_other() -> None:
    foam = PlyMaterial(E1=1e7, E2=1e7, nu12=0.3, G12=4e6, G13=4e6, G23=4e6)
    core = Ply(foam, lambda x: 0.02 + 0.01 * x[0])
    section = Laminate((Ply(CARBON, 1e-3), core, Ply(CARBON, 1e-3)))
    with pytest.warns(ShellmbWarning, match="shear_correction is 0.8333, with which it is"):
        section.at((0.5, 0.0, 0.0))


def test_functions_that_are_constant_are_numbers() -> None:
    given = Orthotropic(
        1e9, 1e8, nu12=0.2, G12=1e8, G13=1e8, G23=1e8, thickness=0.01, angle=30.0, offset=0.002
    )
    varying = Orthotropic(
        1e9,
        1e8,
        nu12=0.2,
        G12=1e8,
        G13=1e8,
        G23=1e8,
        thickness=lambda x: 0 * x[0] + 0.01,
        angle=lambda x: 0 * x[0] + 30.0,
        offset=lambda x: 0 * x[0] + 0.002,
    )
    assert tip(strip(varying, (2, 1))) == pytest.approx(tip(strip(given, (2, 1))), rel=1e-10)


def test_mass_of_a_wedge_with_a_flat_face() -> None:
    """Built to one side: the middle of the section is half of its thickness above the surface."""
    section = Isotropic(E, 0.0, thickness=taper, density=RHO, offset=lambda x: taper(x) / 2)
    shell = Shell("wedge", Rectangle(L, B), section, mesh=(2, 1), model="rigid")
    model = Model(Scene("wedge", shell, scheme="ep", dt=1.0, t_end=1.0), MPI.COMM_WORLD)
    assert model.rigid is not None
    body = model.rigid.bodies[0]
    area = L * (THICK + THIN) / 2
    x = L / 3 * (THICK + 2 * THIN) / (THICK + THIN)
    # int h^2/2 dx / int h dx
    z = L / 6 * (THICK**2 + THICK * THIN + THIN**2) / area
    assert body.mass == pytest.approx(RHO * B * area, rel=1e-12)
    # nodes are looked at a millionth of an element inside
    np.testing.assert_allclose(body.center, (x, B / 2, z), rtol=1e-6)


def lay_up(first: Any, second: Any) -> Laminate:
    return Laminate((Ply(CARBON, 1e-3, first), Ply(CARBON, 1e-3, second)))


def test_a_lay_up_that_changes_half_way() -> None:
    """0/90 to 90/0, as two shells that are joined; coupled, so that signs count."""
    left, right = lay_up(0, 90), lay_up(90, 0)
    halves = (
        Shell("left", Rectangle(L / 2, B), left, mesh=(4, 2)),
        Shell("right", Rectangle(L / 2, B, origin=(L / 2, 0, 0)), right, mesh=(4, 2)),
    )
    pull = (40.0, 0.0, 1.0)
    joined = Scene(
        "joined",
        halves,
        supports=Clamped("left", body="left"),
        joins=Join("left", "right", "right", "left"),
        loads=EdgeForce("right", pull, body="right"),
        probes=[Probe(n, (L, B, 0), body="right", component=k) for k, n in enumerate("xyz")],
        scheme="linear-statics",
    )
    one = strip(
        lay_up(
            lambda x: np.where(x[0] < L / 2, 0.0, 90.0), lambda x: np.where(x[0] < L / 2, 90.0, 0.0)
        ),
        (8, 2),
    )
    one = sm.Scene(
        "one",
        one.shells,
        supports=one.supports,
        loads=EdgeForce("right", pull),
        probes=[Probe(n, (L, B, 0), component=k) for k, n in enumerate("xyz")],
        scheme="linear-statics",
    )
    wanted, found = ([execute(s).rows[-1][n] for n in "xyz"] for s in (joined, one))
    # the size of resultants is that of the whole shell
    np.testing.assert_allclose(found, wanted, rtol=1e-8)


def test_plies_that_are_dropped() -> None:
    """A ply of no thickness is none, in stiffness, in mass and in stresses."""
    section = Laminate(
        (
            Ply(CARBON, 1e-3, 0.0),
            Ply(CARBON, lambda x: np.where(x[0] < L / 2, 1e-3, 0.0), 45.0),
            Ply(CARBON, 1e-3, 0.0),
        ),
        offset=lambda x: np.where(x[0] < L / 2, 1.5e-3, 1e-3),
    )
    for place, stack in ((0.1, (0, 45, 0)), (0.9, (0, 0))):
        h = 1e-3 * len(stack)
        plain = Laminate.from_stacking(CARBON, 1e-3, stack, offset=h / 2)
        here = section.at((place, 0.0, 0.0))
        for name in "ABDG":
            np.testing.assert_allclose(getattr(here, name), getattr(plain, name), rtol=1e-12)
        assert here.thickness == pytest.approx(h)
        np.testing.assert_allclose(here.mass, plain.mass, rtol=1e-12)
    model = Model(strip(section, (2, 1)), MPI.COMM_WORLD)
    drawn = drawn_mesh(model.shells["strip"])
    np.testing.assert_allclose(np.sort(drawn.cells["thickness"]), [2e-3, 3e-3])


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            lambda: Isotropic(E, 0.0, thickness=lambda x: 0.01 - 0.02 * x[0]),
            r"shell 'strip': isotropic section: thickness is -0.009 at \(0.95, 0.01, 0.0\); it "
            "must be greater than 0 everywhere",
        ),
        (
            # found where the elements are, and not before
            lambda: Isotropic(
                E, 0.0, thickness=lambda x: np.where(np.abs(x[0] - 0.03) < 0.02, 0.0, 1.0)
            ),
            r"thickness is 0 at \(0.01409, ",
        ),
        (
            lambda: Laminate((Ply(CARBON, lambda x: 0 * x[0] - 1e-3), Ply(CARBON, 2e-3))),
            r"laminate: plies\[0\].thickness is -0.001 at .* at least 0 everywhere",
        ),
        (
            lambda: Laminate((Ply(CARBON, lambda x: 0 * x[0]),)),
            r"laminate: thickness is 0 at .* greater than 0 everywhere",
        ),
        (
            lambda: Isotropic(E, 0.0, thickness=lambda x: x),
            r"thickness gives an array of shape \(3, 7\)",
        ),
        (
            lambda: Orthotropic(
                1e9, 1e8, nu12=0.2, G12=1e8, G13=1e8, G23=1e8, thickness=0.01, angle=lambda x: x[7]
            ),
            "orthotropic section: angle fails",
        ),
    ],
)
def test_what_is_refused(section, message) -> None:
    with pytest.raises(SceneError, match=message):
        Model(strip(section()), MPI.COMM_WORLD)


def test_numbers_are_those_of_a_position() -> None:
    section = Isotropic(E, 0.0, thickness=taper)
    with pytest.raises(SceneError, match="thickness is a function of the position, so the section"):
        section.A  # noqa: B018
    np.testing.assert_allclose(section.at((L, 0, 0)).D, Isotropic(E, 0.0, thickness=THIN).D)
    assert section.at(np.zeros((3, 4, 2))).A.shape == (4, 2, 3, 3)
