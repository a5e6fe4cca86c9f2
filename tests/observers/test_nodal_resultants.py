"""How near resultants at nodes are to those of a plate that turns, at its free edges and inside.

The kind: a field that is curved within elements. What one element has is of a degree less than
its displacements; that is continued to its nodes, and is off by the curvature times the square of
its size, at free edges as anywhere else. The documentation says by how much.
"""

import numpy as np
import pytest

import shellmb as sm
from shellmb.scene import Fixed, Isotropic, Output, Rectangle, Scene, Shell, SurfaceForce


def deviation(mesh: tuple[int, int], cell: str, degree: int = 2, unit: float = 1.0) -> np.ndarray:
    """Deviations of N11, N22, N12 at all nodes, and largest N11, N22; `unit` is a metre.

    Without Poisson's ratio `N11 = m Omega^2 (L^2/4 - x^2)/2`, N22 alike across, exactly.
    """
    L, B, pull = unit, unit / 4, 5.4e4 / unit**3
    section = Isotropic(E=70e9 / unit, nu=0.0, thickness=2e-3 * unit, density=2700 / unit**3)
    place = (-L / 2, -B / 2, 0)
    shell = Shell("rotor", Rectangle(L, B, place), section, mesh=mesh, cell=cell, degree=degree)
    # inertia forces balance: what holds the plate carries nothing
    held = [
        Fixed((-L / 2, 0, 0), (0, 0, 0)),
        Fixed((L / 2, 0, 0), (None, 0, 0)),
        Fixed((0, B / 2, 0), (None, None, 0)),
    ]
    forces = SurfaceForce(lambda X: (pull * X[0], pull * X[1], 0 * X[0]))
    output = Output(fields=("N",))
    # it keeps its files
    run = sm.run(
        Scene(
            "rotor",
            shell,
            supports=held,
            loads=forces,
            scheme="linear-statics",
            t_end=1.0,
            output=output,
        )
    )
    found = run.fields["rotor"]
    x, y, _ = found["reference"].values.T
    largest = pull / 8 * np.array([L**2, B**2, B**2])
    exact = pull / 2 * np.stack([L**2 / 4 - x**2, B**2 / 4 - y**2, 0 * x], axis=1)
    return np.asarray((found["N"].values[-1] - exact) / largest)


@pytest.mark.parametrize("unit", [1.0, 1e3])
def test_values_at_nodes_are_off_by_the_curvature_within_an_element(unit: float) -> None:
    """By `-N'' h^2/12` at corners and `N'' h^2/24` between, so `2/(3 n^2)` of the largest."""
    found = deviation((8, 2), "quad", unit=unit)
    for component, n in ((0, 8), (1, 2)):
        corner = 2 / (3 * n**2)
        assert found[:, component].max() == pytest.approx(corner, rel=1e-4)  # not round-off
        assert found[:, component].min() == pytest.approx(-corner / 2, rel=1e-4)  # not round-off
    assert np.abs(found[:, 2]).max() < 1e-4  # not round-off


def test_cubic_elements_have_a_parabola_as_it_is() -> None:
    """What an element has is of degree two there."""
    assert np.abs(deviation((4, 2), "quad", degree=3)).max() < 1e-4  # not round-off


def test_values_at_nodes_of_triangles_converge_with_the_square_of_the_size() -> None:
    """A quarter for half the size; 4.6 %, 19 % and 3.3 % were seen on 8x2."""
    coarse, fine = (np.abs(deviation(m, "tri")).max(axis=0) for m in ((8, 2), (16, 4)))
    assert np.all(coarse < (0.02, 0.25, 0.04))
    # one element at a corner holds the middles of all: N12 converges more slowly there
    assert np.all((coarse / fine > (2.8, 2.8, 2.0)) & (coarse / fine < 5.0))
