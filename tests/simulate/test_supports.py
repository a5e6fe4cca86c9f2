"""Supports: soft and hard, planes in any direction, driven edges, point forces."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from shellmb.preprocessing.constraint_analysis.redundancy import singular
from shellmb.scene import (
    Clamped,
    Driven,
    EdgeForce,
    Fixed,
    HardSupport,
    Isotropic,
    PointForce,
    Rectangle,
    Scene,
    Shell,
    SoftSupport,
    SurfaceForce,
    SymmetryPlane,
)
from tests.scenes import plate_scene

PLATE = Isotropic(E=1e3, nu=0.3, thickness=0.05)
EDGES = ("left", "right", "bottom", "top")


def turned(Q: np.ndarray, mesh: tuple[int, int] = (2, 2)) -> Shell:
    """The unit square turned about the origin."""
    surface = Rectangle(1.0, 1.0, axis1=tuple(Q[:, 0]), axis2=tuple(Q[:, 1]))
    return Shell("plate", surface, PLATE, mesh=mesh, direction=tuple(Q[:, 0]))


def oblique() -> np.ndarray:
    Q, R = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q if np.linalg.det(Q) > 0 else -Q


def vector(v: np.ndarray) -> tuple[float, float, float]:
    return (float(v[0]), float(v[1]), float(v[2]))


HELD: dict[str, Callable[[np.ndarray], Any]] = {
    # a quarter of a plate between two symmetry planes and two simply supported edges
    "soft": lambda Q: (
        SymmetryPlane("left", vector(Q[:, 0])),
        SymmetryPlane("bottom", vector(Q[:, 1])),
        SoftSupport(("right", "top"), vector(Q[:, 2])),
    ),
    "hard": lambda Q: (
        SymmetryPlane("left", vector(Q[:, 0])),
        SymmetryPlane("bottom", vector(Q[:, 1])),
        HardSupport(("right", "top"), vector(Q[:, 2])),
    ),
}


@pytest.mark.parametrize("held", HELD)
def test_a_turned_plate_has_the_turned_solution(held: str, run, at) -> None:
    """Fixed components where a direction is an axis, multipliers elsewhere: the same result."""
    centre = []
    for Q in (np.eye(3), oblique()):
        scene = Scene(
            "quarter",
            turned(Q),
            supports=HELD[held](Q),
            loads=SurfaceForce(vector(0.2 * Q[:, 2])),
            dt=0.5,
            t_end=1.0,
        )
        simulation = run(scene)
        centre.append(Q.T @ at(simulation, "plate", (0.0, 0.0, 0.0)))
        edge = Q.T @ at(simulation, "plate", vector(Q @ np.array([1.0, 0.5, 0.0])))
        assert edge[2] == pytest.approx(0, abs=1e-12)
    assert centre[0][2] > 0.02
    np.testing.assert_allclose(centre[1], centre[0], atol=1e-9)


def test_a_hard_support_is_stiffer_than_a_soft_one(run, at) -> None:
    deflection = {}
    for kind, support in (("soft", SoftSupport), ("hard", HardSupport)):
        supports = (
            support(EDGES),
            Fixed("left-bottom", displacement=(0.0, 0.0, None)),
            Fixed("right-bottom", displacement=(None, 0.0, None)),
        )
        scene = Scene(
            "plate",
            turned(np.eye(3)),
            supports=supports,
            loads=SurfaceForce((0, 0, 1e-6)),
            scheme="linear-statics",
        )
        deflection[kind] = at(run(scene), "plate", (0.5, 0.5, 0.0))[2]
    assert 1.0 < deflection["soft"] / deflection["hard"] < 1.2
    # thin plate (S. Timoshenko): 0.00406 q L^4 / D; the shear adds some per cent
    thin = 0.00406 * 1e-6 / (1e3 * 0.05**3 / 12 / (1 - 0.3**2))
    assert deflection["hard"] == pytest.approx(thin, rel=0.05)


def test_a_driven_edge_goes_where_it_is_told(run, at) -> None:
    """A plate carried once round by its edge, nothing else acting: it arrives as it left."""
    drive = Driven(
        "left",
        about=(0.2, 0.0, 0.1),
        axis=(1.0, 2.0, -1.0),
        rotation=lambda t: 2.0 * t,
        translation=lambda t: (0.1 * t, 0.0, -0.3 * t),
    )
    simulation = run(Scene("driven", turned(np.eye(3)), supports=drive, dt=0.25, t_end=1.0))
    axis = np.array([1.0, 2.0, -1.0]) / np.sqrt(6)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    Q = np.eye(3) + np.sin(2.0) * cross + (1 - np.cos(2.0)) * cross @ cross
    origin = np.array([0.2, 0.0, 0.1])
    for point in ((0.0, 0.5, 0.0), (1.0, 1.0, 0.0), (0.5, 0.0, 0.0)):
        X = np.array(point)
        expected = Q @ (X - origin) + origin + [0.1, 0.0, -0.3] - X
        np.testing.assert_allclose(at(simulation, "plate", point), expected, atol=1e-9)


@pytest.mark.parametrize("scheme", ["static", "ep"])
def test_no_function_of_time_is_asked_behind_the_end(run, scheme) -> None:
    """Kind: constraints are looked through by differences in time, which must lie in the run."""
    end = 0.5

    def way(t: float) -> float:
        if not 0.0 <= t <= end:
            raise ValueError(f"nothing is known at t = {t}")
        return 0.1 * t

    drive = Driven("left", axis=(0, 1, 0), rotation=way)
    simulation = run(plate_scene(scheme, supports=drive, dt=0.25, t_end=end))
    # as where a step fails
    states = {name: now.q.x.array for name, now in simulation.problem.levels.items()}
    assert not singular(simulation.model, states)


def test_a_prescribed_component(run, at) -> None:
    supports = (
        Clamped("left"),
        Fixed("right", displacement=(None, None, lambda t: 0.3 * t)),
    )
    simulation = run(Scene("pulled", turned(np.eye(3)), supports=supports, dt=0.5, t_end=1.0))
    assert at(simulation, "plate", (1.0, 0.5, 0.0))[2] == pytest.approx(0.3, abs=1e-14)


def test_point_forces_act_like_their_sum(run, at) -> None:
    """Two forces at one node, by name and by coordinates, and their sum."""
    tips = []
    corner = (1.0, 1.0, 0.0)
    for forces in (
        (PointForce("right-top", (0, 0.01, 0.02)), PointForce(corner, (0.01, 0, 0.03))),
        (PointForce(corner, (0.01, 0.01, 0.05)),),
    ):
        scene = Scene(
            "corner", turned(np.eye(3)), supports=Clamped("left"), loads=forces, dt=0.5, t_end=1.0
        )
        tips.append(at(run(scene), "plate", corner))
    assert tips[0][2] > 0.1
    np.testing.assert_allclose(tips[0], tips[1], rtol=1e-11)


def test_edges_given_together_are_all_held_and_loaded(run, at) -> None:
    scene = Scene(
        "bridge",
        turned(np.eye(3)),
        supports=Clamped(("left", "right")),
        loads=EdgeForce(("bottom", "top"), (0, 0, 0.1)),
        dt=1.0,
        t_end=1.0,
    )
    simulation = run(scene)
    bottom, top = (at(simulation, "plate", (0.5, y, 0.0)) for y in (0.0, 1.0))
    assert bottom[2] > 1e-3
    np.testing.assert_allclose(top * [1, -1, 1], bottom, atol=1e-12)
