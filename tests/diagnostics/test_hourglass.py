"""Modes that elements hardly resist are named, and no others.

The kind: frequencies and load factors below the first true ones of motions that the strains of
elements do not see. The true ones are known: they do not go with the thickness.
"""

import numpy as np
import pytest

import shellmb as sm
from shellmb.rotating.campbell import campbell
from shellmb.verify.problems.linear_shells import compressed_cylinder

# first true frequency along a free square, Hz (Rayleigh-Ritz; `tests/model/test_triangles.py`)
TRUE = 1971.0


@pytest.mark.parametrize(("n", "thickness"), [(2, 1e-2), (3, 1e-3), (2, 0.2)])
def test_frequencies_below_the_first_true_one_are_named(n: int, thickness: float) -> None:
    section = sm.Isotropic(E=70e9, nu=0.3, thickness=thickness, density=2700.0)
    edges = ("left", "right", "top", "bottom")
    held = sm.Fixed(edges, displacement=(None, 0, None), director=(0, 0, 0))
    surface = sm.Rectangle(1, 1, axis1=(0, 0, 1), axis2=(1, 0, 0))
    plate = sm.Shell("foil", surface, section, mesh=(n, n))
    scene = sm.Scene("free", plate, supports=held, scheme="ep4", dt=1e-4, t_end=1e-3)
    found = sm.modes(scene, count=11 if n == 2 else 26)
    squares = np.asarray(found.fields["foil"]["displacement"]) ** 2
    along = squares[..., [0, 2]].sum((1, 2)) > 0.5 * squares.sum((1, 2))
    frequencies = np.array(found.frequencies)
    # two per cent: the first true one on 2x2 elements is one per cent high
    false = np.flatnonzero(along & (frequencies < 0.98 * TRUE) & (frequencies > 1.0)) + 1
    assert len(false) == (0 if thickness > 0.1 else 3)
    named = [f"modes {', '.join(map(str, false))} and their frequencies are false"]
    assert [w.split(":")[0] for w in found.warnings] == named[: len(false)]


@pytest.mark.parametrize(
    ("cell", "mesh", "false"), [("tri", (4, 16), True), ("tri", (3, 9), False)]
)
def test_triangles_that_buckle_by_themselves_are_named(
    cell: str, mesh: tuple[int, int], false: bool
) -> None:
    """The classical load of a cylinder is that of its section, whatever the elements."""
    found = sm.modes(compressed_cylinder(cell, mesh), buckling=True, count=2)  # type: ignore[arg-type]
    said = [w.split(":")[0] for w in found.warnings]
    assert said == (["mode 1 and its load factor are false"] if false else [])
    # three elements a half-wave: the load is within four per cent
    assert found.load_factors[int(false)] == pytest.approx(1.0, rel=0.04)
    assert not false or found.load_factors[0] < 0.95


def test_modes_of_a_foil_that_spins_are_named_as_well() -> None:
    """Centrifugal forces resist what its elements do not: true ones begin at twenty kilohertz."""
    section = sm.Isotropic(E=70e9, nu=0.3, thickness=1e-5, density=2700.0)
    surface = sm.Rectangle(0.1, 0.1, origin=(-0.05, -0.05, 0.0))
    flat = sm.Fixed(("left", "right", "top", "bottom"), (None, None, 0), director=(0, 0, 0))
    foil = sm.Shell("foil", surface, section, mesh=(2, 2))
    scene = sm.Scene("spun", foil, supports=flat, scheme="ep4", dt=1e-4, t_end=1e-3)
    for found in campbell(scene, [0.0, 300.0], count=12, axis=(0, 0, 1)).modes:
        frequencies = np.abs(found.values.imag) / (2 * np.pi)
        below = np.flatnonzero((frequencies > 500) & (frequencies < 0.98 * 10 * TRUE)) + 1
        named = f"modes {', '.join(map(str, below))} and their eigenvalues are false"
        assert len(below) == 3 and [w.split(":")[0] for w in found.doubtful] == [named]
