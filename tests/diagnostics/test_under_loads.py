"""Kind: flat shells that stretch as they bend far, beside better elements under all of their loads.

Small loads do not tell: they bend the plate, and points that hold it carry nothing along it. True
are differences of statics from 32x32 elements (degree 2), in per cent of the largest displacement.
"""

from typing import Any

import pytest

import shellmb as sm

CORNERS = "left-bottom", "right-bottom", "left-top", "right-top"
MIDDLE = sm.PointForce((0.5, 0.5, 0.0), (0.0, 0.0, 60.0))


def plate(held: Any, load: Any, n: int, cell: Any, **more: Any) -> sm.Scene:
    """A plate of 1 m and 2 mm of aluminium that bends by several times its thickness."""
    section = sm.Isotropic(70e9, 0.3, thickness=2e-3, density=2700.0)
    shell = sm.Shell("plate", sm.Rectangle(1.0, 1.0), section, (n, n), cell=cell)
    given = {"scheme": "static", "dt": 0.2, "t_end": 1.0, **more}
    return sm.Scene("plate", shell, supports=held, loads=load, **given)


PINNED = tuple(sm.Fixed(corner, (0.0, 0.0, 0.0)) for corner in CORNERS)
SIMPLY = (
    sm.Fixed("left-bottom", (0.0, 0.0, 0.0)),
    sm.Fixed("right-bottom", (None, 0.0, 0.0)),
    *(sm.Fixed(corner, (None, None, 0.0)) for corner in CORNERS[2:]),
)


def off(scene: sm.Scene) -> list[float]:
    """Per cent that the run warns of."""
    found = [w for w in sm.run(scene, pictures=False).warnings if "is off by about" in w]
    assert all("shell 'plate'" in w for w in found)
    return [float(w.split("off by about ")[1].split(" %")[0]) for w in found]


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_pins_that_hold_a_plate_along_itself_are_told_of(cell: Any) -> None:
    """The middle moves by 9.2 (quadrilaterals), 8.6 % too little: 5 % at least are said."""
    (said,) = off(plate(PINNED, MIDDLE, 4, cell))
    assert 5 <= said <= 10


def test_pins_under_pressure_are_told_of() -> None:
    """4x4 elements move by 3.2 % too little, 8x8 by 0.8 %, which is nothing to tell."""
    assert off(plate(SIMPLY, sm.Pressure(-300.0), 4, "quad")) == [3.0]
    assert not off(plate(SIMPLY, sm.Pressure(-300.0), 8, "quad"))


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_what_is_right_is_not_told_of(cell: Any) -> None:
    """A force at a corner of a plate that an edge holds: 0.2 % at most, by 0.4 of its length."""
    load = sm.PointForce("right-top", (0.0, 0.0, 10.0))
    assert not off(plate(sm.Clamped("left"), load, 8, cell, dt=0.1))


def moving(held: Any, load: Any, n: int) -> sm.Scene:
    """The same under a sudden load, up to its farthest deflection by the force."""
    return plate(held, load, n, "quad", scheme="ep", dt=1e-3, t_end=0.06)


def test_pins_that_hold_a_plate_in_motion_are_told_of() -> None:
    """The middle moves 8.0 % too little at its farthest with 4x4 elements."""
    (said,) = off(moving(PINNED, MIDDLE, 4))
    assert 5 <= said <= 10


def test_a_plate_in_motion_that_points_let_slide_is_not_told_of() -> None:
    """0.4 % at its farthest: nothing holds it along itself but for its rigid motions."""
    assert not off(moving(SIMPLY, sm.Pressure(-300.0), 4))
