"""A strip that two planes fold onto itself, against an elastica with contact.

The strip is a U whose legs come nearer towards their ends, which curl away. One plane is at rest,
the other is driven towards it. They press the belly on both sides, so that the legs close and touch
each other where they curl.

The reference is the planar elastica of one half without extension, from the place `s_t` where the
legs touch to the fold. A plane pushes at `s_c`. Both places are where the tangent is parallel to
the planes, so

    theta' = kappa(s) - N x/EI + F (x - x_c)/EI behind s_c,   theta(s_t) = theta(s_c) = 0,

and SciPy finds `s_t`, `s_c`, `N` and `F` with which the fold is normal to the planes and the
distances are given.
"""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Contact,
    Driver,
    Faces,
    Fixed,
    Isotropic,
    Parametric,
    Plane,
    Prismatic,
    RigidBody,
    Scene,
    Shell,
)

RADIUS, CURL, LEG, CLOSING = 0.02, 0.04, 0.06, 0.25
WIDTH, THICK, YOUNG = 0.02, 1e-3, 1e9
# lengths at which the curl and the straight part end, and of one half
CURLED = 2 * CLOSING * CURL
STRAIGHT = CURLED + LEG
HALF = STRAIGHT + RADIUS * (np.pi / 2 + CLOSING)
# planes reach into the strip at the start, so that something holds it
DEEP = 1e-6
# forces of the elastica where the planes are 6 mm nearer: of a plane, and between the legs, N
LARGEST = np.array([1.8, 0.14])


def half(s: Any) -> tuple[Any, Any]:
    """One leg from its end to the fold: along the planes, and away from the plane of symmetry."""
    turned = CLOSING - np.minimum(s, CURLED) / CURL
    straight = np.clip(s - CURLED, 0.0, LEG)
    bent = np.maximum(s - STRAIGHT, 0.0) / RADIUS - CLOSING
    x = CURL * (np.sin(CLOSING) - np.sin(turned)) + straight * np.cos(CLOSING)
    z = CURL * (np.cos(turned) - np.cos(CLOSING)) - straight * np.sin(CLOSING)
    return (
        x + RADIUS * (np.sin(bent) + np.sin(CLOSING)),
        z + RADIUS * (np.cos(CLOSING) - np.cos(bent)),
    )


def pressed(elements: int, below: int, way: float, dt: float) -> Scene:
    """The strip between planes.

    Args:
        elements: Elements along it.
        below: How many of them are below the fold. Nodes are not opposite to nodes if it is not
            half of them.
        way: How far the upper plane comes down, m.
        dt: Part of the way in a step.
    """
    share = below / elements
    uneven = (0.5 - share) / (share * (1 - share))
    fold = half(HALF)

    def place(xi: Any, eta: Any) -> Any:
        s = 2 * HALF * (xi + uneven * xi * (1 - xi))
        x, z = half(np.where(s > HALF, 2 * HALF - s, s))
        up = np.where(s > HALF, 1.0, -1.0)
        return np.array([RADIUS + x - fold[0], WIDTH * eta, up * (fold[1] - z)])

    law = {"stiffness": 5e8, "body": "strip", "radius": THICK / 2}
    planes = law | {"smoothing": 1e-5, "preloaded": True}
    height = RADIUS + THICK / 2 - DEEP
    return Scene(
        "pressed",
        Shell(
            "strip",
            Parametric(place),
            # without Poisson's ratio the strip is a beam
            Isotropic(YOUNG, 0.0, thickness=THICK, density=1000.0),
            mesh=(elements, 1),
        ),
        rigid_bodies=RigidBody("press", 1.0, (1.0,) * 3, position=(0, 0, height)),
        joints=Prismatic("guide", GROUND, "press", at=(0, 0, height), axis=(0, 0, 1)),
        drivers=Driver("drive", "guide", translation=lambda t: -way * t),
        supports=[
            Fixed((RADIUS, 0.0, 0.0), (0, 0, None), director=(None, 0, 0)),
            Fixed((RADIUS, WIDTH, 0.0), (0, None, None)),
        ],
        contacts=[
            Contact("touch", Faces("strip", THICK), smoothing=2e-5, **law),
            Contact("lower", Plane((0, 0, -height)), **planes),
            Contact("upper", Plane((0, 0, height), (0, 0, -1)), obstacle_body="press", **planes),
        ],
        scheme="static",
        dt=dt,
        t_end=1.0,
    )


def elastica(height: float, distance: float) -> tuple[float, float]:
    """Forces of a plane and between the legs, N.

    Args:
        height: Distance of the belly from the plane of symmetry, m.
        distance: Distance of the touching legs from it, m.
    """
    stiffness = YOUNG * THICK**3 / 12

    def ends(touch: float, force: float, belly: float, legs: float) -> tuple[Any, Any]:
        state, at, begin = np.zeros(3), np.zeros(3), touch
        for end in (*sorted([CURLED, STRAIGHT, belly]), HALF):
            kappa = -1 / CURL if begin < CURLED else 0.0 if begin < STRAIGHT else 1 / RADIUS
            push = force if begin >= belly else 0.0

            def slopes(
                _: float, q: Any, k: float = kappa, push: float = push, x: float = float(at[0])
            ) -> list[float]:
                moment = push * (q[0] - x) - legs * q[0]
                return [np.cos(q[2]), np.sin(q[2]), k + moment / stiffness]

            state = solve_ivp(slopes, (begin, end), state, rtol=1e-8, atol=1e-12).y[:, -1]
            at, begin = state if end == belly else at, end
        return state, at

    def missed(unknown: Any) -> list[float]:
        fold, belly = ends(*(unknown * np.array([HALF, 100.0, HALF, 100.0])))
        far = fold[1] - belly[1] - height, fold[1] - distance
        return [fold[2] - np.pi / 2, belly[2], far[0] / RADIUS, far[1] / RADIUS]

    found = root(missed, [0.075, 0.07, 0.736, 0.0])
    assert found.success
    return 100 * WIDTH * found.x[1], 100 * WIDTH * found.x[3]


@pytest.mark.parametrize(
    ("elements", "below", "way", "dt"),
    [
        (24, 11, 3e-3, 0.5),
        pytest.param(24, 11, 6e-3, 0.25, marks=pytest.mark.slow),
        pytest.param(47, 22, 6e-3, 0.25, marks=pytest.mark.slow),
    ],
)
def test_planes_fold_a_strip_onto_itself(elements: int, below: int, way: float, dt: float) -> None:
    """Forces of both contacts are those of the elastica.

    A plane touches at nodes, whose distance is `ds`. It pushes up to half of that beside the
    belly, whose arm to the fold is about `RADIUS`, and the belly is up to `ds^2/8 RADIUS` nearer to
    the plane than they are. Half of the latter is added. What is left falls with `ds`: 3.5, 1.9
    and 1.1 % of the largest force were seen with 24, 47 and 93 elements.
    """
    run = execute(pressed(elements, below, way, dt))
    assert not run.warnings
    history = run.history
    np.testing.assert_allclose(history["upper.normal"], history["lower.normal"], rtol=1e-6)
    rows = [row for _, row in history.iterrows() if row["touch.normal"] > 0.3 * LARGEST[1]]
    assert rows
    ds = HALF / elements
    for row in rows if elements < 40 else rows[::3]:
        deep = (row["lower.penetration"] + row["upper.penetration"]) / 2
        height = RADIUS - DEEP - way * row.t / 2 + deep + ds**2 / 16 / RADIUS
        expected = elastica(height, (THICK - row["touch.penetration"]) / 2)
        found = row[["upper.normal", "touch.normal"]].to_numpy()
        np.testing.assert_allclose(
            found / LARGEST, np.array(expected) / LARGEST, rtol=0, atol=1.2 / elements
        )
