"""Obstacles that come between nodes, which alone touch: the run says so, and only then.

The kind: contact of points is silent about what is between them.
"""

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import (
    Ball,
    Box,
    Contact,
    InitialVelocity,
    Isotropic,
    Obstacle,
    Plane,
    Rectangle,
    RigidBody,
    Rod,
    Scene,
    Shell,
)

SLOW = pytest.mark.slow


def falling(obstacle: Obstacle, moving: bool = False, mesh: Any = (1, 1), **more: Any) -> Any:
    """A rigid plate with nodes every 0.1 m falls by 15 mm to the height 0."""
    plate = Shell(
        "plate",
        Rectangle(0.2 * mesh[0], 0.2 * mesh[1], origin=(0, 0, 0.015)),
        Isotropic(70e9, 0.3, thickness=2e-3, density=2700.0),
        mesh=mesh,
        model="rigid",
        **more,
    )
    carrier = RigidBody("carrier", 1e3, (1.0, 1.0, 1.0))
    contact = Contact("post", obstacle, 1e3, "plate", obstacle_body="carrier" if moving else None)
    scene = Scene(
        "falling",
        shells=plate,
        rigid_bodies=carrier,
        contacts=contact,
        initial=InitialVelocity((0, 0, -1.0), body="plate"),
        scheme="ep",
        dt=5e-3,
        t_end=0.015,
    )
    return execute(scene)


@pytest.mark.parametrize(
    ("obstacle", "moving", "missed"),
    [
        # by 5 mm between four nodes, by its height between them; under a node
        (Ball((0.05, 0.05, -0.015), 0.02), False, 5 / 20),
        (Ball((0.1, 0.1, -0.015), 0.02), False, 0),
        pytest.param(Rod((0, 0.15, -0.015), (1, 0, 0), 0.02), False, 5 / 20, marks=SLOW),
        pytest.param(Rod((0.15, 0, -0.015), (0, 1, 0), 0.02), True, 5 / 20, marks=SLOW),
        pytest.param(Box((0.05, 0.15, -0.005), (0.02, 0.02, 0.02)), True, 5 / 10, marks=SLOW),
        # a large one, of which nodes miss little
        pytest.param(Ball((0.05, 0.05, -0.495), 0.5), False, 0, marks=SLOW),
        pytest.param(Plane((0, 0, 0.005)), False, 0, marks=SLOW),
    ],
)
def test_what_comes_between_nodes_is_said(obstacle: Obstacle, moving: bool, missed: float) -> None:
    found = [w for w in falling(obstacle, moving).warnings if w.watch == "between nodes"]
    assert len(found) == (missed > 0)
    if missed:
        # energy is kept, so that nothing else tells; 5 mm deep at the end
        assert found[0].value == pytest.approx(missed, rel=1e-6)
        assert "contact 'post': between its nodes 'plate' is deeper in the" in found[0].says


CORNERS = {f"{k}": tuple(0.1 * c for c in s) for k, s in enumerate(product((-1, 1), repeat=3))}
POST = Box((0.05, 0.02, -0.02), (0.04, 0.04, 0.04))
FOOT = {"a": (-0.1, 0, -0.1), "b": (0.1, 0.1, -0.1), "c": (0.1, -0.1, -0.1)}
TURNED = (math.pi, 0.0, 0.0)


@pytest.mark.parametrize(
    ("body", "obstacle", "radius", "missed"),
    [
        # the cube is 15 mm over the post, and 15 mm deep in it at the end
        ({"points": CORNERS}, POST, 0.0, 15 / 20),
        ({"points": CORNERS, "rotation": TURNED}, POST, 0.0, 15 / 20),
        # its shape is drawn, and only its middle touches
        ({"shape": (0.2, 0.2, 0.2)}, POST, 0.0, 15 / 20),
        ({"points": FOOT}, Ball((0.03, 0.01, -0.02), 0.02), 0.0, 15 / 20),
        ({"points": {k: FOOT[k] for k in "bc"}}, Ball((0.1, 0, -0.02), 0.02), 0.0, 15 / 20),
        # under a point, beside it, under a ball, and a large one
        ({"points": CORNERS}, Box((0.1, 0.1, -0.02), (0.04, 0.04, 0.04)), 0.0, 0),
        ({"points": CORNERS}, Box((0.5, 0, -0.02), (0.04, 0.04, 0.04)), 0.0, 0),
        ({}, POST, 0.1, 0),
        ({"points": CORNERS}, Box((0, 0, -0.1), (1, 1, 0.2)), 0.0, 0),
    ],
)
@pytest.mark.parametrize("moving", [False, True])
def test_what_comes_between_points_is_said(
    body: Any, obstacle: Obstacle, radius: float, missed: float, moving: bool
) -> None:
    """The kind: a shape of which points touch, and an obstacle smaller than their distance."""
    block = RigidBody("block", 1.0, (1e-2,) * 3, position=(0, 0, 0.115), **body)
    points = tuple(body.get("points", ())) or None
    carrier = RigidBody("carrier", 1e3, (1.0, 1.0, 1.0))
    scene = Scene(
        "falling",
        rigid_bodies=[block, carrier],
        contacts=Contact(
            "post",
            obstacle,
            1e3,
            "block",
            at=points,
            radius=radius,
            obstacle_body="carrier" if moving else None,
        ),
        initial=InitialVelocity((0, 0, -1.0), body="block"),
        scheme="ep",
        dt=5e-3,
        t_end=0.03,
    )
    found = [w for w in execute(scene).warnings if w.watch == "between nodes"]
    assert len(found) == (missed > 0)
    if missed:
        # of a ball by lines that are a quarter of its radius apart
        near = 1e-6 if isinstance(obstacle, Box) else 0.02
        assert found[0].value == pytest.approx(missed, rel=near)
        assert "contact 'post': between its points 'block' is deeper in the" in found[0].says


@pytest.mark.parametrize(("cell", "count"), [("quad", 20), ("tri", None)])
def test_neighbours(cell: str, count: int | None) -> None:
    """Sides and diagonals of the squares that nodes of an element make."""
    from mpi4py import MPI

    from shellmb.model.model import Model

    plate = Shell(
        "plate",
        Rectangle(1.0, 1.0),
        Isotropic(1.0, 0.3, thickness=0.1, density=1.0),
        mesh=(1, 1),
        cell=cell,
    )
    scene = Scene(
        "s", plate, contacts=Contact("c", Plane((0, 0, -1)), 1.0), scheme="ep", dt=1, t_end=1
    )
    points = Model(scene, MPI.COMM_WORLD).potentials[0].points
    x, pairs = np.array([end.point for end in points.ends]), points.segments()
    if count is not None:
        assert len(pairs) == count
    assert set(pairs.ravel()) == set(range(len(x)))
    length = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    assert length.max() < 0.75
