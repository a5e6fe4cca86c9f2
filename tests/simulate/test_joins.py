"""Joined shells: smooth joins leave no trace, kinks transmit moments, three share an edge."""

import numpy as np
import pytest

from shellmb.model.body import constraint_error
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Isotropic,
    Join,
    Rectangle,
    Scene,
    Shell,
    Solver,
    Table,
)

E, T, WIDTH = 2.0e5, 0.1, 0.2
BEAM = Isotropic(E=E, nu=0.0, thickness=T, density=1.0)


def test_two_plates_joined_flat_are_one(run, at) -> None:
    # a factorisation in each iteration: else round-off may decide on the last one
    full = Solver(newton="full")
    load = {"dt": 0.5, "t_end": 1.0, "supports": Clamped("left"), "solver": full}
    force = (0.5, 1.0, 20.0)
    whole = Shell("whole", Rectangle(2.0, WIDTH), BEAM, mesh=(4, 1))
    one = run(Scene("one", whole, loads=EdgeForce("right", force), **load))
    halves = (
        Shell("a", Rectangle(1.0, WIDTH), BEAM, mesh=(2, 1)),
        Shell("b", Rectangle(1.0, WIDTH, origin=(1.0, 0.0, 0.0)), BEAM, mesh=(2, 1)),
    )
    load["supports"] = Clamped("left", body="a")
    loads = EdgeForce("right", force, body="b")
    two = run(Scene("two", halves, loads=loads, joins=Join("a", "b", "right", "left"), **load))
    assert two.problem.system.size == one.problem.system.size
    assert two.iterations == one.iterations
    for x in (0.5, 1.0, 1.75, 2.0):
        expected = at(one, "whole", (x, 0.1, 0.0))
        found = at(two, "a" if x < 1 else "b", (x, 0.1, 0.0))
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-11)
    assert at(one, "whole", (2.0, 0.1, 0.0))[2] > 0.1


def frame(second: Rectangle, force: tuple[float, float, float], **times: float) -> Scene:
    """A horizontal plate clamped at its left, and another one on its right edge."""
    shells = (
        Shell("post", Rectangle(1.0, WIDTH), BEAM, mesh=(3, 1)),
        Shell("arm", second, BEAM, mesh=(3, 1)),
    )
    return Scene(
        "frame",
        shells,
        supports=Clamped("left", body="post"),
        loads=EdgeForce("right", force, body="arm"),
        joins=Join("post", "arm", "right", "left"),
        **times,
    )


def upright(length: float) -> Rectangle:
    """A plate that stands on the edge x = 1."""
    return Rectangle(length, WIDTH, origin=(1.0, 0, 0), axis1=(0, 0, 1), axis2=(0, 1, 0))


def test_a_kink_transmits_the_moment(run, at) -> None:
    """Cantilever L-frame with a horizontal tip force, small displacements, beam theory."""
    force, length = 1e-4, 0.8
    simulation = run(frame(upright(length), (force / WIDTH, 0, 0), dt=1.0, t_end=1.0))
    u = at(simulation, "arm", (1.0, 0.1, length))
    bending = E * T**3 / 12 * WIDTH
    shear = 5 / 6 * E / 2 * T * WIDTH
    # the moment F a turns the post's end by F a L / EI and lifts it by half of that
    tip = force * (
        length**3 / 3 / bending + length / shear + length**2 / bending + 1 / (E * T * WIDTH)
    )
    assert u[0] == pytest.approx(tip, rel=0.01)
    # the moment about +y presses the post's end down
    assert abs(u[2]) == pytest.approx(force * length / 2 / bending, rel=0.01)


def test_the_angle_of_a_kink_is_kept_in_large_motion(run, at) -> None:
    simulation = run(frame(upright(0.8), (40.0, 0, 10.0), dt=0.25, t_end=1.0))
    assert np.linalg.norm(at(simulation, "arm", (1.0, 0.1, 0.8))) > 0.3
    for body in simulation.model.bodies:
        # the part of an error of order Newton's tolerance squared that round-off leaves
        assert constraint_error(body, simulation.problem.levels[body.name].q) < 1e-11


def test_a_kink_conserves_energy(run) -> None:
    account = EnergyAccount()
    scene = frame(upright(0.8), (4.0, 3.0, 10.0), dt=0.01, t_end=0.1)
    scene = Scene(**{**vars(scene), "scheme": "ep"})
    run(scene, account)
    assert account.relative_error < 1e-11
    assert account.values["work_loads"] > 0


def test_three_shells_share_one_edge(run, at) -> None:
    """A T-frame: two arms on one edge, loaded alternately, respond alike and share the edge."""

    def arm(name: str, direction: float) -> Shell:
        # axis2 is turned with axis1, so that the normals differ by a right angle from the post's
        surface = Rectangle(
            0.5, WIDTH, origin=(1.0, 0, 0), axis1=(0, 0, direction), axis2=(0, 1, 0)
        )
        return Shell(name, surface, BEAM, mesh=(2, 1))

    post = Shell("post", Rectangle(1.0, WIDTH), BEAM, mesh=(2, 1))
    tips = {}
    for loaded, sign in (("up", 1.0), ("down", -1.0)):
        scene = Scene(
            "tee",
            (post, arm("up", 1.0), arm("down", -1.0)),
            supports=Clamped("left", body="post"),
            loads=EdgeForce("right", (1e-3, 0, 0), body=loaded),
            joins=(
                Join("post", "up", "right", "left"),
                Join("post", "down", "right", "left"),
            ),
            dt=1.0,
            t_end=1.0,
        )
        simulation = run(scene)
        tips[loaded] = at(simulation, loaded, (1.0, 0.1, 0.5 * sign))
        ends = [at(simulation, name, (1.0, 0.1, 0.0)) for name in ("post", "up", "down")]
        np.testing.assert_allclose(ends[1:], [ends[0], ends[0]], atol=1e-14)
        # the other arm is turned with the edge, without load of its own
        other = "down" if loaded == "up" else "up"
        far = at(simulation, other, (1.0, 0.1, -0.5 * sign))
        turned = 2 * ends[0][2] / 1.0
        assert far[0] - ends[0][0] == pytest.approx(-0.5 * abs(turned), rel=0.02)
    # a mirror image
    np.testing.assert_allclose(tips["up"] * [1, 1, -1], tips["down"], rtol=1e-6, atol=1e-12)


def test_load_histories_of_joined_shells(run, at) -> None:
    """A load whose time function ends at zero leaves nothing behind in statics."""
    scene = frame(upright(0.8), (10.0, 0, 0), dt=0.5, t_end=1.0)
    (load,) = scene.loads
    loads = EdgeForce(load.at, load.force, body="arm", time=Table((0.0, 0.5, 1.0), (0, 1, 0)))
    simulation = run(Scene(**{**vars(scene), "loads": loads}))
    assert np.linalg.norm(at(simulation, "arm", (1.0, 0.1, 0.8))) < 1e-9
