"""Modes about steady rotations where it is hard: ropes, double frequencies, critical speeds."""

import numpy as np
import pytest

from shellmb.demos.references.rotating import flapping, lagging
from shellmb.running.rotating.campbell import campbell
from shellmb.scene import Beam, Clamped, Line, RectangularSection, Scene

E, RHO = 2e11, 7800.0
TIMES = {"scheme": "ep", "dt": 0.01, "t_end": 1.0}


def clamped(
    end: tuple[float, float, float], width: float, height: float, elements: int = 8
) -> Scene:
    """A beam from the origin to a point, clamped to a hub."""
    section = RectangularSection(E=E, nu=0.3, width=width, height=height, density=RHO)
    beam = Beam("beam", Line((0, 0, 0), end), section, elements=elements)
    return Scene("turning", beams=beam, supports=Clamped("start"), **TIMES)


def test_blade_without_bending_stiffness() -> None:
    """A blade of 1e-4 of its length is nearly a rope: its first frequency grows twentyfold.

    A rope has `omega^2 = n (2 n - 1) Omega^2` across the plane, and that less one in it; bending
    near the hub raises the first by 1.6 %, the first in the plane from zero to 0.178. Elements are
    of the size of that layer, `sqrt(E I/T)` or 0.02 of the length: longer ones miss it.
    """
    found = campbell(clamped((1, 0, 0), 1e-4, 1e-4, 32), [0.0, 10.0], count=4, axis=(0, 0, 1))
    eta = 10.0 / np.sqrt(E * 1e-8 / 12 / RHO)
    exact = np.sort([*flapping(eta, 2), *lagging(eta, 2)]) / eta
    own = np.sort(found.modes[1].omega)[:4] / 10.0
    np.testing.assert_allclose(own, exact, rtol=5e-3)
    assert own[1] == pytest.approx(1.0, abs=0.02)
    assert found.modes[0].omega[0] * 17 < own[1] * 10.0
    assert not found.unstable


def test_critical_speed_of_a_shaft() -> None:
    """A shaft with equal stiffnesses: a double frequency w splits into `|w - Omega|`, `w + Omega`.

    It passes its critical speed w without growing, and 1 % from there its mode is found; branches
    are followed through the zero, where the whirl in the frame turns about.
    """
    scene = clamped((0, 0, 1), 0.01, 0.01)
    (w,) = campbell(scene, [0.0], count=1, axis=(0, 0, 1)).modes[0].omega[:1]
    rates = w * np.array([0.0, 0.5, 0.99, 1.01, 1.5])
    found = campbell(scene, rates, count=2, axis=(0, 0, 1))
    for rate, modes in zip(rates, found.modes, strict=True):
        # rotary inertia: (h/L)^2 of the rate
        np.testing.assert_allclose(modes.omega[0], abs(w - rate), atol=1e-3 * w)
        assert np.min(np.abs(modes.omega - w - rate)) < 1e-3 * w
    assert not found.unstable
    forward = 2 * np.pi * found.frequencies
    assert sum(np.allclose(b, abs(w - rates), atol=1e-3 * w) for b in forward.T) == 1
    assert sum(np.allclose(b, w + rates, atol=1e-3 * w) for b in forward.T) == 1
    directions = [modes.directions[0] for modes in found.modes[1:]]
    assert directions == ["forward", "forward", "backward", "backward"]


def test_flat_shaft_between_its_critical_speeds() -> None:
    """With two stiffnesses it diverges between both critical speeds, and only there."""
    scene = clamped((0, 0, 1), 0.012, 0.01)
    first, second = campbell(scene, [0.0], count=2, axis=(0, 0, 1)).modes[0].omega[:2]
    rates = [0.98 * first, 1.02 * first, 0.98 * second, 1.02 * second]
    found = campbell(scene, rates, count=2, axis=(0, 0, 1))
    assert [bool(modes.unstable) for modes in found.modes] == [False, True, True, False]
    assert "divergence" in found.verdict
    for rate, modes in zip(rates, found.modes, strict=True):
        exact = np.roots(
            [
                1,
                0,
                first**2 + second**2 + 2 * rate**2,
                0,
                (first**2 - rate**2) * (second**2 - rate**2),
            ]
        )
        assert min(abs(exact - modes.values[0])) < 2e-3 * first


@pytest.mark.slow
@pytest.mark.mpi
def test_two_ranks(mpirun) -> None:  # type: ignore[no-untyped-def]
    """Eigenvalues do not depend on the number of ranks."""
    one, two = (np.array([float(v) for v in mpirun(n, "-c", SCRIPT).split()]) for n in (1, 2))
    np.testing.assert_allclose(two, one, rtol=1e-7)


SCRIPT = """
from mpi4py import MPI
from shellmb.scene import *
from shellmb.demos.references.rotating import flapping, lagging
from shellmb.running.rotating.campbell import campbell
section = RectangularSection(E=2e11, nu=0.3, width=0.04, height=0.01, density=7800.0)
beam = Beam("beam", Line((0, 0, 0), (1, 0, 0)), section, elements=4)
scene = Scene("s", beams=beam, supports=Clamped("start"), scheme="ep", dt=1.0, t_end=1.0)
found = campbell(scene, [10.0, 50.0], count=3, axis=(0, 0, 1))
if MPI.COMM_WORLD.rank == 0:
    print(*(w for modes in found.modes for w in modes.omega[:3]))
"""
