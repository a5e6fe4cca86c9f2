"""Natural modes: rigid motions, the effect of a load on the frequencies, errors."""

import math

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    EdgeForce,
    Fixed,
    HardSupport,
    Isotropic,
    Rectangle,
    Scene,
    Shell,
    SymmetryPlane,
)

E, NU, H, RHO, L = 70e9, 0.0, 2e-3, 2700.0, 1.0
BENDING = E * H**3 / 12
SECTION = Isotropic(E=E, nu=NU, thickness=H, density=RHO)


def strip(force: float) -> Scene:
    """A strip between two supports, pulled at one of them; `nu = 0` makes it a beam."""
    return Scene(
        "strip",
        Shell("strip", Rectangle(L, 0.25), SECTION, mesh=(12, 1)),
        supports=(
            HardSupport(("left", "right")),
            Fixed("left", displacement=(0, None, None)),
            SymmetryPlane(("bottom", "top"), (0, 1, 0)),
        ),
        loads=EdgeForce("right", (force, 0, 0)),
        scheme="static",
    )


@pytest.mark.parametrize("fraction", [0.0, 3.0, -0.5])
def test_axial_force_shifts_the_frequencies(fraction: float) -> None:
    """`omega^2 = (pi/L)^4 D/m + (pi/L)^2 N/m`, exact for a beam on two supports."""
    k = math.pi / L
    force = fraction * BENDING * k**2  # in units of the Euler load
    modes = natural_modes(strip(force), count=1, loaded=True)
    exact = (k**4 * BENDING + k**2 * force) / (RHO * H)
    # 12 Q2 elements to half a wave: 1.2e-4 of the bending term, rotary inertia 1e-5
    assert modes.omega2[0] == pytest.approx(exact, rel=5e-4)


def test_beyond_the_euler_load_a_mode_is_unstable() -> None:
    """The straight strip stays an equilibrium beyond the Euler load, with a negative eigenvalue."""
    force = -1.5 * BENDING * (math.pi / L) ** 2
    modes = natural_modes(strip(force), count=1, loaded=True)
    assert modes.omega2[0] < 0
    assert modes.frequencies[0] < 0


def test_free_plate_has_six_rigid_modes() -> None:
    """Six rigid motions and no spurious one, also in the plane, next to the thin plate's modes."""
    plate = Shell("plate", Rectangle(L, L), Isotropic(E=E, nu=0.3, thickness=H, density=RHO))
    modes = natural_modes(Scene("free", plate, scheme="ep", dt=1.0, t_end=1.0), count=11)
    assert modes.rigid == 6
    unit = math.sqrt(E * H**2 / 12 / (1 - 0.3**2) / RHO) / L**2
    ritz = np.array([13.4682, 19.5961, 24.2702, 34.8009, 34.8009])
    np.testing.assert_allclose(modes.omega[6:] / unit, ritz, rtol=0.01)


def test_point_support_does_not_wake_hourglass_modes() -> None:
    """Held in its plane at two corners only, a thin plate has no low in-plane mode."""
    plate = Shell("plate", Rectangle(L, L), Isotropic(E=E, nu=0.3, thickness=1e-3, density=RHO))
    scene = Scene(
        "corners",
        plate,
        supports=(
            HardSupport(("left", "right", "bottom", "top")),
            Fixed("left-bottom", displacement=(0, 0, None)),
            Fixed("right-bottom", displacement=(None, 0, None)),
        ),
        scheme="ep",
        dt=1.0,
        t_end=1.0,
    )
    modes = natural_modes(scene, count=5)
    unit = math.sqrt(E * 1e-6 / 12 / (1 - 0.3**2) / RHO) / L**2
    exact = math.pi**2 * np.array([2, 5, 5, 8, 10])
    np.testing.assert_allclose(modes.omega / unit, exact, rtol=0.01)
    for shape in modes.shapes:
        assert np.max(np.abs(shape["plate"][:, :2])) < 1e-3


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_what_is_stiffer_by_ten_orders_than_bending_is_found_whole(cell: str) -> None:
    """Kind: frequencies far above those of bending, by which they were searched; double ones.

    A free square sheet that moves in its plane: none of its frequencies depends on its thickness.
    """

    def sheet(thickness: float, count: int) -> np.ndarray:
        section = Isotropic(1.0, 0.3, thickness=thickness, density=1.0)
        areas = {"all": lambda x: x[0] > -1}
        shell = Shell("sheet", Rectangle(1.0, 1.0), section, mesh=(4, 4), cell=cell, areas=areas)
        held = Fixed("all", (None, None, 0.0))
        scene = Scene("sheet", shell, supports=held, scheme="ep", dt=1.0, t_end=1.0)
        return natural_modes(scene, count=count).omega

    thick, thin = sheet(1e-2, 9), sheet(1e-5, 9)
    assert thick[4] == pytest.approx(thick[5], rel=1e-10)
    # directors of thicker ones swing at other frequencies, far above these
    assert thin[3:] == pytest.approx(thick[3:], rel=1e-8)
    assert sheet(1e-5, 5)[3:] == pytest.approx(thick[3:5], rel=1e-8)
    assert sheet(1e-7, 5)[3:] == pytest.approx(thick[3:5], rel=1e-8)


def test_count_must_be_positive() -> None:
    """Asking for no mode is an error."""
    with pytest.raises(SceneError, match="count is 0"):
        natural_modes(strip(0.0), count=0)


@pytest.mark.mpi
def test_two_ranks_give_the_same_frequencies(mpirun) -> None:  # type: ignore[no-untyped-def]
    """Frequencies do not depend on the number of ranks."""
    one, two = (np.array([float(v) for v in mpirun(n, "-c", SCRIPT).split()]) for n in (1, 2))
    np.testing.assert_allclose(two, one, rtol=1e-9)


SCRIPT = """
from mpi4py import MPI
from shellmb.scene import *
from shellmb.running.natural_modes.vibration import natural_modes
section = Isotropic(E=70e9, nu=0.0, thickness=2e-3, density=2700.0)
strip = Shell("s", Rectangle(1.0, 0.25), section, mesh=(8, 1))
supports = (
    HardSupport(("left", "right")),
    Fixed("left", displacement=(0, None, None)),
    SymmetryPlane(("bottom", "top"), (0, 1, 0)),
)
modes = natural_modes(Scene("s", strip, supports=supports, scheme="static"), count=3)
if MPI.COMM_WORLD.rank == 0:
    print(*modes.omega2)
"""
