"""Free bodies that turn steadily: no rigid motion grows, whatever round-off makes of it.

A translation in the plane is a double eigenvalue `i Omega` with one vector. The kind: rings and
plates, one body or several, in the plane or along any axis, in any unit.
"""

import pytest

from shellmb.moving.campbell import campbell
from shellmb.scene import Cylinder, Isotropic, Rectangle, Scene, Shell


def plate(name: str, at: float, length: float = 1.0) -> Shell:
    """A plate in the plane z = 0."""
    section = Isotropic(E=70e9 / length, nu=0.3, thickness=2e-3 * length, density=2700 / length**3)
    place = (at * length, -0.25 * length, 0)
    return Shell(name, Rectangle(length, 0.5 * length, place), section, mesh=(4, 2))


def ring() -> Shell:
    """A steel ring about the axis."""
    steel = Isotropic(E=210e9, nu=0.0, thickness=5e-3, density=7850.0)
    return Shell("ring", Cylinder(0.5, 0.02), steel, mesh=(16, 1))


CASES = {
    "ring": ([ring()], 40.0),
    "plate": ([plate("plate", -0.5)], 20.0),
    "millimetres": ([plate("plate", -0.5, 1000.0)], 20.0),
    "two": ([plate("one", -0.5), ring()], 20.0),
}


@pytest.mark.parametrize(("bodies", "rate"), CASES.values(), ids=CASES)
def test_no_mode_of_a_free_body_grows(bodies: list[Shell], rate: float) -> None:
    """And its translation has the rate of the frame to the last digits."""
    scene = Scene("spins", bodies, scheme="ep", dt=1e-3, t_end=1e-2)
    found = campbell(scene, [rate], count=10, axis=(0, 0, 1), about=(0, 0, 0))
    assert not found.unstable, found.verdict
    (modes,) = found.modes
    assert abs(modes.values.imag - rate).min() < 1e-9 * rate
