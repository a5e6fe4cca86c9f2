"""What is given twice: joins and volumes are refused, loads and contacts that add up doubted."""

from typing import Any

import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.scene import (
    Contact,
    EdgeForce,
    EnclosedVolume,
    Gas,
    Isotropic,
    Join,
    Plane,
    Pressure,
    Rectangle,
    Scene,
    Shell,
)
from shellmb.scene.checks.ignored_settings import doubts

STEEL = Isotropic(210e9, 0.3, 2e-3, 7800.0)
GROUND = Plane(point=(0, 0, -1), normal=(0, 0, 1))


def two(**more: Any) -> Scene:
    """Two plates side by side."""
    shells = [
        Shell(name, Rectangle(0.5, 0.1, (x, 0, 0)), STEEL, mesh=(1, 1))
        for name, x in (("p", 0.0), ("q", 0.5))
    ]
    return Scene("two", shells, scheme="ep", dt=0.1, t_end=1.0, **more)


REFUSED = {
    "two joins join the same edges of 'p' and 'q'": {
        "joins": [Join("p", "q", "right", "left"), Join("q", "p", ("top", "left"), "right")]
    },
    # the same object
    "of 'p' and 'q', 'right' and 'left'": {"joins": [Join("p", "q", "right", "left")] * 2},
    "'a' and enclosed volume 'b': both are enclosed by 'p', 'q'": {
        "volumes": [
            EnclosedVolume("a", ("p", "q")),
            EnclosedVolume("b", ("q", "p"), gas=Gas(1e5)),
        ]
    },
}
DOUBTED = {
    "two equal pressures act on 'p'": {"loads": [Pressure(2.0, "p")] * 2},
    "two equal edge forces act on 'q'": {"loads": [EdgeForce("top", (1, 0, 0), "q")] * 2},
    "two equal contacts act on 'p'": {
        "contacts": [Contact(name, GROUND, stiffness=1e5, body="p") for name in ("a", "b")]
    },
}
# parts of one load, and joins around a slit
MEANT = {
    "loads": [Pressure(2.0, "p"), Pressure(1.0, "p"), Pressure(2.0, "q")],
    "joins": [Join("p", "q", "right", "left"), Join("q", "p", "right", "left")],
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_holds_twice_is_refused(message: str) -> None:
    with pytest.raises(SceneError, match=message):
        two(**REFUSED[message])


@pytest.mark.parametrize("message", DOUBTED)
def test_what_acts_twice_is_warned_of(message: str) -> None:
    with pytest.warns(ShellmbWarning, match=message):
        scene = two(**DOUBTED[message])
    # for the record of the run
    assert any(message in sentence for sentence in doubts(scene))


def test_what_is_meant_is_not() -> None:
    two(**MEANT)
