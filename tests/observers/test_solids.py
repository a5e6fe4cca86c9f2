"""Shapes of rigid bodies and obstacles in files and pictures: their size, place and motion."""

import numpy as np
import pytest

import shellmb as sm
from shellmb.observers.files.output_parts import body_solid, obstacle_solid

TURN = (0.3, -0.7, 1.1)
# a cylinder of 32 sides has 0.6 % less of everything
SIDES = 0.02


def moments(solid):
    """Volume, centre and inertia over volume of what a closed surface holds."""
    a, b, c = np.moveaxis(solid.points[solid.triangles], 1, 0)
    volumes = np.einsum("fi,fi->f", a, np.cross(b, c)) / 6
    volume = volumes.sum()
    centre = np.einsum("f,fi->i", volumes, a + b + c) / 4 / volume
    a, b, c = (p - centre for p in (a, b, c))
    s = a + b + c
    second = sum(np.einsum("f,fi,fj->ij", volumes, p, p) for p in (a, b, c, s)) / 20 / volume
    return volume, centre, np.trace(second) * np.eye(3) - second


@pytest.mark.parametrize(
    ("shape", "inertia"),
    [
        ("box", (0.02, 0.03, 0.04)),
        ("box", ((0.03, 0.004, 0.0), (0.004, 0.03, 0.002), (0.0, 0.002, 0.02))),
        ("rod", (0.05, 0.05, 0.002)),
        ("rod", (0.01, 0.019, 0.01)),
    ],
)
def test_a_shape_has_the_inertia_of_its_body(shape, inertia) -> None:
    """The kind: what is drawn is homogeneous and of the body's mass, in any place and attitude."""
    body = sm.RigidBody("b", 2.0, inertia, (1, 2, 3), TURN, com=(0.1, 0.2, -0.3), shape=shape)
    _, centre, J = moments(body_solid(body))
    expected = body.axes @ body.inertia_tensor @ body.axes.T / body.mass
    assert np.allclose(centre, body.center, atol=1e-12)
    assert np.allclose(J, expected, rtol=0, atol=SIDES * np.abs(expected).max())


def test_a_box_of_given_sides_and_a_plate() -> None:
    sides = sm.RigidBody("b", 0.0, (0, 0, 0), shape=(0.4, 0.2, 0.1))
    assert np.allclose(np.ptp(body_solid(sides).points, axis=0), (0.4, 0.2, 0.1))
    # a lamina: m/12 (b^2, a^2, a^2 + b^2)
    plate = sm.RigidBody("p", 12.0, (0.04, 0.16, 0.2), shape="box")
    assert np.allclose(np.ptp(body_solid(plate).points, axis=0), (0.4, 0.2, 0.0), atol=1e-3)


def test_a_surface_from_a_file(tmp_path) -> None:
    import meshio

    file = tmp_path / "tip.stl"
    meshio.write(file, meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])]))
    body = sm.RigidBody("b", 1.0, (1, 1, 1), (0, 0, 1), com=(5, 5, 5), shape=str(file))
    assert np.allclose(np.sort(body_solid(body).points, axis=0)[-1], (1, 1, 2))


@pytest.mark.parametrize(
    ("shape", "says"),
    [
        ("bax", "'box' or 'rod'"),
        ((1.0, 2.0), "'box' or 'rod'|three numbers"),
        ((1.0, -2.0, 1.0), "'box' or 'rod'"),
        ("missing.stl", "no such file"),
    ],
)
def test_a_shape_that_cannot_be(shape, says) -> None:
    with pytest.raises(sm.SceneError, match=says):
        sm.RigidBody("b", 1.0, (1, 1, 1), shape=shape)
    with pytest.raises(sm.SceneError, match="shape is 'rod', which mass and inertia determine"):
        sm.RigidBody("b", 0.0, (0, 0, 0), shape="rod")


def test_obstacles_are_where_they_act() -> None:
    """Their distance from the surface that contact knows is zero at each corner."""
    centre, n = np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 2.0]) / 3
    plane = sm.Contact("c", sm.Plane(point=(0, 0, 1), normal=3 * n), stiffness=1.0)
    found = obstacle_solid(plane, centre, 2.0)
    assert np.allclose((found.points - (0, 0, 1)) @ n, 0, atol=1e-12)
    ball = sm.Contact("c", sm.Ball((1, 0, 0), 0.5), stiffness=1.0)
    found = obstacle_solid(ball, centre, 2.0)
    assert np.allclose(np.linalg.norm(found.points - (1, 0, 0), axis=1), 0.5)
    rod = sm.Contact("c", sm.Rod((1, 0, 0), n, 0.5), stiffness=1.0)
    arms = obstacle_solid(rod, centre, 2.0).points - (1, 0, 0)
    assert np.allclose(np.linalg.norm(arms - np.outer(arms @ n, n), axis=1), 0.5)
    cube = sm.Box((1, 0, 0), (1, 2, 3), axis1=(2, 1, 0), axis2=(-1, 2, 0))
    found = obstacle_solid(sm.Contact("c", cube, stiffness=1.0, obstacle_body="b"), centre, 2.0)
    corners = (found.points - (1, 0, 0)) @ cube.axes.T
    assert np.allclose(np.abs(corners), (0.5, 1.0, 1.5)) and found.body == "b"


def spinning(folder, spin, **output):
    """A block that spins freely above a floor."""
    scene = sm.Scene(
        "block",
        rigid_bodies=(
            sm.RigidBody("block", 1.0, (0.1, 0.1, 0.1), (0, 0, 1), shape="box"),
            sm.RigidBody("moon", 1.0, (0.1, 0.1, 0.1), (0, 0, 9)),
        ),
        initial=sm.InitialVelocity(spin=(0, 0, spin), body="block"),
        contacts=(
            sm.Contact("floor", sm.Plane(), stiffness=1e3, body="block"),
            sm.Contact("lid", sm.Box((0, 0, 2), (1, 1, 1)), 1e3, "moon", obstacle_body="block"),
        ),
        output=sm.Output(**output),
        scheme="ep",
        dt=0.01,
        t_end=1.0,
    )
    return sm.run(scene, folder, pictures=False)


def test_shapes_move_with_their_bodies_and_frames_follow_them(tmp_path) -> None:
    """Between two states nothing turns by more than 20 degrees, unless the scene says how many."""
    spin = 20.0
    run = spinning(tmp_path / "a", spin)
    solids, obstacles = run.fields["solids"], run.fields["obstacles"]
    assert not np.any(obstacles["displacement"][:, :4])
    x = solids["reference"].values + solids["displacement"].values
    lid = (obstacles["reference"].values + obstacles["displacement"].values)[:, 4:]
    t = solids["t"].values
    assert len(t) > 90 and np.diff(t).max() * spin < np.radians(25)
    # the mid-point rule turns by 2 atan(spin dt / 2) a step
    expected = 2 * np.arctan(spin * 0.01 / 2) / 0.01 * t
    for at in (x, lid):
        angle = np.arctan2(at[:, 0, 1] - at[:, :, 1].mean(1), at[:, 0, 0] - at[:, :, 0].mean(1))
        assert np.allclose(np.unwrap(angle) - angle[0], expected, atol=1e-6)
    assert len(spinning(tmp_path / "b", spin, frames=11).fields["solids"]["t"]) == 11
    assert len(spinning(tmp_path / "c", 0.1).fields["solids"]["t"]) == 50
