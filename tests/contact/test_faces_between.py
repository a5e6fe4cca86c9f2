"""Shells and beams that come too near to each other between the nodes that touch: the run says so.

The kind: edges across edges, within the thickness or through each other, and what comes between
nodes. Bodies move freely at one metre per second, as no node is near enough to touch.
"""

from typing import Any, NamedTuple

import numpy as np
import pytest

from shellmb.model.shell_contact.uncovered_contact import closest
from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    Contact,
    Faces,
    InitialVelocity,
    Isotropic,
    Line,
    Parametric,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
)

SLOW = pytest.mark.slow
THICK = 5e-3
SECTION = Isotropic(70e9, 0.3, thickness=THICK, density=2700.0)
BAR = RectangularSection(70e9, 0.3, width=THICK, height=THICK, density=2700.0)


def shell(name: str, surface: Any, mesh: int = 1) -> Shell:
    return Shell(name, surface, SECTION, mesh=(mesh, mesh))


def oblique(a: Any, b: Any) -> Any:
    """A strip across the other one, whose sides come down inclined."""
    return 0.02 * a - 0.01, 0.4 * b - 0.28, 0.004 + 0.1 * (0.4 * b - 0.28)


def corner(a: Any, b: Any) -> Any:
    """A small plate with a corner down."""
    return 0.03 + 0.02 * a + 0.002 * b, 0.03 + 0.02 * b, 0.004 + 0.05 * a + 0.05 * b


LOW = shell("low", Rectangle(0.4, 0.02, origin=(-0.2, -0.01, 0)))
ACROSS = shell("up", Rectangle(0.02, 0.4, origin=(-0.01, -0.28, 4e-3)))


class Case(NamedTuple):
    """Bodies, and what is said.

    Args:
        shells: Shells, of which "low" has the faces.
        beams: Beams.
        speed: Of body "up", m/s.
        end: Time, s.
        says: What they do.
        depth: Depth, m.
        place: Place, m.
        radius: Of the points, m.
    """

    shells: list[Shell]
    beams: list[Beam]
    speed: float
    end: float
    says: str
    depth: float
    place: tuple[float | None, float | None, float]
    radius: float = 0.0


# edges at z = 2 mm are half a millimetre nearer than the 2.5 mm at which they would touch
FLAT = Case([LOW, ACROSS], [], -1.0, 2e-3, "come too near", 5e-4, (None, None, 2e-3))
CASES = {
    "flat edges": FLAT,
    # 5 mm is where a beam of this radius would touch; its middle is at 3 mm
    "beam across an edge": FLAT._replace(
        shells=[LOW],
        beams=[Beam("up", Line((0, -0.28, 5e-3), (0, 0.12, 5e-3)), BAR, elements=1)],
        depth=2e-3,
        place=(0.0, None, 3e-3),
        radius=THICK / 2,
    ),
    # the side passes the middle of the other strip, 10 mm from its edges; its next node is 8 mm
    # below it, where the side is 80 mm further on
    "inclined edges": Case(
        [LOW, shell("up", Parametric(oblique))],
        [],
        -1.0,
        4e-3,
        "intersect",
        THICK / 2 + 8e-3,
        (None, 0.0, 0.0),
    ),
    # the corner is at 4 mm, where the larger plate comes to 6 mm
    "corner between nodes": Case(
        [shell("up", Rectangle(0.2, 0.2)), shell("low", Parametric(corner), 2)],
        [],
        1.0,
        6e-3,
        "intersect",
        THICK / 2 + 2e-3,
        (None, None, 6e-3),
    ),
}


@pytest.mark.parametrize(
    "name",
    [
        "flat edges",
        "corner between nodes",
        *(pytest.param(n, marks=SLOW) for n in ("inclined edges", "beam across an edge")),
    ],
)
def test_bodies_that_meet_between_nodes_are_named(name: str) -> None:
    """With depth and place; neither depends on whether points are on shells or beams."""
    case = CASES[name]
    touch = Contact(
        "touch", Faces("low", THICK), 1e8, body="up", radius=case.radius, smoothing=2e-5
    )
    scene = Scene(
        "between",
        case.shells,
        beams=case.beams,
        contacts=touch,
        initial=InitialVelocity((0, 0, case.speed), body="up"),
        scheme="ep",
        dt=1e-3,
        t_end=case.end,
    )
    run = execute(scene)
    assert run.history["touch.penetration"].max() == 0
    (found,) = [w for w in run.warnings if w.watch == "faces of shells"]
    assert f"'up' and 'low' {case.says}" in found.says
    # of mid-surfaces that are flat, to the round-off of their motion
    assert found.value == pytest.approx(case.depth, rel=1e-6)
    said = found.says.split(" at (")[1].split(") at t")[0]
    place = [float(c) for c in said.split(",")]
    for here, wanted in zip(place, case.place, strict=True):
        assert wanted is None or here == pytest.approx(wanted, abs=1e-6)
    assert f"nearer to each other than {case.radius + THICK / 2:.3g} m" in found.says


def test_closest_places_of_lines() -> None:
    """No place of a fine division is nearer, also where lines are parallel."""
    rng = np.random.default_rng(4)
    one, other = rng.normal(size=(2, 300, 2, 3))
    other[:50] = one[:50] + rng.normal(size=(50, 1, 3))
    share, away = closest(one, other)
    s = np.linspace(0, 1, 101)
    a, b = (x[:, :1] + s[:, None] * (x[:, 1:] - x[:, :1]) for x in (one, other))
    every = np.linalg.norm(a[:, :, None] - b[:, None], axis=3).min(axis=(1, 2))
    found = np.linalg.norm(away, axis=1)
    # a hundredth of lines of length two, half of which is missed at most
    assert np.all(found <= every + 1e-12) and np.all(every <= found + 0.05)
    assert np.all((share >= 0) & (share <= 1))
