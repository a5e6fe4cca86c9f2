"""Shells and beams declared rigid: the inertia of the flexible ones, and their motion if stiff."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.model.model import Model
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.momentum import Momentum
from shellmb.scene import (
    AlongLine,
    Arc,
    Beam,
    Clamped,
    Cylinder,
    FollowerForce,
    Glue,
    Gravity,
    InitialVelocity,
    Isotropic,
    Join,
    Line,
    LineForce,
    PointForce,
    Pressure,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    ShellRevolute,
    Spherical,
)
from shellmb.simulate.simulation import Simulation
from tests import scenes

E, RHO = 2e11, 7800.0
A, B, T = 1.0, 0.4, 2e-2
PLATE = Isotropic(E=E, nu=0.3, thickness=T, density=RHO)
BAR = RectangularSection(E=E, nu=0.3, width=0.04, height=0.08, density=RHO)
# away from the origin and off the middle surface or line
PLACED = {"origin": (3.0, 1.0, 2.0), "axis1": (0, 1, 1), "axis2": (1, 0, 0)}
ECCENTRIC = replace(PLATE, offset=0.004)
SPIN = InitialVelocity(linear=(1.0, 2.0, 3.0), spin=(3.0, 1.0, 10.0), about=(0.1, 0.2, 0.3))
MOTION = {"scheme": "ep", "dt": 1e-3, "t_end": 0.05}


def plate(section: Isotropic = PLATE, **more: Any) -> Shell:
    return scenes.plate(section, (A, B), "body", **{"model": "rigid", **more})


def beam(curve: Any, **more: Any) -> Beam:
    return Beam("body", curve, **{"section": BAR, "elements": 4, "model": "rigid", **more})


def scene_of(body: Shell | Beam, **more: Any) -> Scene:
    kind = "shells" if isinstance(body, Shell) else "beams"
    return Scene("s", **{kind: body, "initial": SPIN, **MOTION, **more})


def flexible(scene: Scene) -> Scene:
    """The same scene with flexible bodies."""
    return replace(
        scene,
        shells=tuple(replace(b, model="exact") for b in scene.shells),
        beams=tuple(replace(b, model="exact") for b in scene.beams),
    )


def observed(scene: Scene) -> tuple[Simulation, EnergyAccount, Momentum]:
    simulation, energy = Simulation(scene), EnergyAccount()
    momentum = Momentum(energy)
    energy.start(simulation)
    momentum.start(simulation)
    return simulation, energy, momentum


@pytest.mark.parametrize(
    "body",
    [
        plate(ECCENTRIC, surface=Rectangle(A, B, **PLACED)),
        plate(ECCENTRIC, cell="tri"),
        plate(rotary_inertia=False),
        Shell("body", Cylinder(0.5, 1.0, angles=(0, 90)), ECCENTRIC, mesh=(3, 2), model="rigid"),
        Shell("body", Cylinder(0.5, 1.0), PLATE, mesh=(4, 1), degree=3, model="rigid"),
        beam(Line((3, 1, 2), (4, 1.5, 2))),
        beam(Arc((0, 0, 0), (1, 0.5, 0.3), (2, 0, 0)), section=replace(BAR, offset=(0.01, 0.02))),
        beam(Arc((0, 0, 0), (1, 0.5, 0.3), (2, 0, 0)), degree=3, rotary_inertia=False),
    ],
    ids=lambda body: f"{body.label} {type(getattr(body, 'surface', None) or body.curve).__name__}",
)
def test_energy_and_momenta_of_a_rigid_motion_are_those_of_the_mesh(body: Shell | Beam) -> None:
    scene = scene_of(body)
    rigid, energy, momentum = observed(scene)
    soft, soft_energy, soft_momentum = observed(flexible(scene))
    # the same sums in another order
    assert energy.values["kinetic_energy"] == pytest.approx(
        soft_energy.values["kinetic_energy"], rel=1e-12
    )
    size = max(abs(v) for v in soft_momentum.measure().values())
    for name, value in soft_momentum.measure().items():
        assert momentum.measure()[name] == pytest.approx(value, rel=1e-12, abs=1e-12 * size)
    assert rigid.problem.system.size == 18
    assert soft.problem.system.size > 5 * rigid.problem.system.size


def test_a_flat_plate_is_a_cuboid() -> None:
    (found,) = Model(scene_of(plate()), MPI.COMM_WORLD).scene.rigid_bodies
    m = RHO * A * B * T
    assert found.mass == pytest.approx(m, rel=1e-12)
    np.testing.assert_allclose(found.center, (A / 2, B / 2, 0), atol=1e-14)
    moments = m / 12 * np.array([B**2 + T**2, A**2 + T**2, A**2 + B**2])
    np.testing.assert_allclose(found.inertia_tensor, np.diag(moments), atol=1e-13 * m)
    np.testing.assert_allclose(found.place("right-top"), (A, B, 0), atol=1e-14)


def corner_path(scene: Scene, point: tuple[float, float, float]) -> np.ndarray:
    """Displacement of a point of the body over the steps."""
    simulation = Simulation(scene)
    path = []

    class Watch(EnergyAccount):
        def accepted(self, simulation: Simulation) -> None:
            super().accepted(simulation)
            body, nodes, X, D = simulation.model.nodes_of("body")
            q = simulation.problem.state(body.name).x.array
            u = q[body.mixed.dofs["u"]].reshape(-1, 3)[nodes]
            k = int(np.argmin(np.linalg.norm(X - point, axis=1)))
            if "body" in simulation.model.meshed:
                path.append(u[k].copy())
            else:
                w = q[body.mixed.dofs["w"]].reshape(-1, 3, 3)[nodes[k]]
                path.append(u[k] + (D[k] @ (np.asarray(point) - X[k])) @ w)

    account = Watch()
    simulation.run([account])
    assert account.relative_error is not None
    # stiff plates among them, of whose strains round-off is seen: up to 1e-11
    assert account.relative_error < 1e-10
    return np.array(path)


def test_a_stiff_plate_tumbles_as_a_rigid_one() -> None:
    """It deforms by something like (rho v^2 / E) (L/h)^2, times what vibrates."""
    scene = scene_of(plate(replace(PLATE, E=2e14)))
    rigid = corner_path(scene, (A, B, 0.0))
    stiff = corner_path(flexible(scene), (A, B, 0.0))
    assert np.max(np.abs(rigid)) > 0.3
    np.testing.assert_allclose(rigid, stiff, atol=1e-4)


@pytest.mark.parametrize("scheme", ["ep", "ed"])
def test_joints_and_loads_of_a_rigid_plate(scheme: Any) -> None:
    """A physical pendulum: a plate hung at a named corner, pushed at another, with weight."""
    hung = {
        "joints": Spherical("hook", "body", at="left-bottom"),
        "loads": (Gravity(), PointForce("right-top", (0.0, 30.0, 100.0))),
        "initial": (),
        "scheme": scheme,
    }
    scene = scene_of(plate(replace(PLATE, E=2e14)), **hung)
    rigid = corner_path(scene, (A, B, 0.0))
    stiff = corner_path(flexible(scene), (A, B, 0.0))
    assert np.max(np.abs(rigid)) > 5e-3
    np.testing.assert_allclose(rigid, stiff, atol=2e-3 * np.max(np.abs(rigid)))


def test_a_shell_revolute_joint_turns_about_the_director() -> None:
    post = RigidBody("post", 1.0, (1.0, 1.0, 1.0))
    joint = ShellRevolute("pin", "post", "body", at=(A, B, 0.0), mass=0.5)
    scene = scene_of(plate(), rigid_bodies=post, joints=joint, initial=())
    (found,) = Model(scene, MPI.COMM_WORLD).scene.joints
    assert isinstance(found, Revolute)
    assert found.axis == pytest.approx((0, 0, 1))
    assert (found.name, found.mass, found.at) == ("pin", 0.5, (A, B, 0.0))


def test_a_follower_force_keeps_the_direction_of_its_node() -> None:
    arc = Arc((0, 0, 0), (1, 0.5, 0), (2, 0, 0))
    force = FollowerForce("end", (5.0, 0.0, 0.0), body="body")
    model = Model(scene_of(beam(arc), loads=force), MPI.COMM_WORLD)
    (body,), (load,) = model.scene.rigid_bodies, model.scene.loads
    assert isinstance(load, FollowerForce)
    tangent = arc.tangent(np.array([1.0]))[:, 0]
    # the mesh's parabola has its tangent there to third order in the element's angle
    np.testing.assert_allclose(body.axes @ np.array(load.components), 5 * tangent, atol=1e-2)


def test_what_is_glued_or_joined_to_a_rigid_shell_is_welded() -> None:
    line = AlongLine("body", (0, 0, 0), (A, 0, 0))
    stiffener = Beam("rib", line, BAR)
    wall = replace(plate(), name="wall", surface=Rectangle(A, B, axis2=(0, 0, 1)))
    scene = scene_of(
        plate(),
        shells=(plate(), wall),
        beams=stiffener,
        glues=Glue("rib", "body"),
        joins=Join("body", "wall", "bottom", "bottom"),
    )
    rigid, energy, _ = observed(scene)
    _, soft_energy, _ = observed(flexible(scene))
    assert [b.name for b in rigid.model.scene.rigid_bodies] == ["body", "wall", "rib"]
    assert list(rigid.model.mechanism.joints) == [
        "join of body and wall",
        "glue of rib and body",
    ]
    assert energy.values["kinetic_energy"] == pytest.approx(
        soft_energy.values["kinetic_energy"], rel=1e-12
    )
    # three bodies of 18 unknowns and two welds of 6
    assert rigid.problem.system.size == 3 * 18 + 2 * 6


LINE = Line((0, 0, 0), (1, 0, 0))
RIB = Beam("rib", AlongLine("body", (0, 0, 0), (A, 0, 0)), BAR, model="rigid")


@pytest.mark.parametrize(
    ("scene", "sentence"),
    [
        (scene_of(plate(), supports=Clamped("left")), "clamped edge: shell 'body' is rigid"),
        (scene_of(beam(LINE), supports=Clamped("start")), "clamped edge: beam 'body' is rigid"),
        (scene_of(plate(), loads=Pressure(1.0)), "pressure: shell 'body' is rigid"),
        (scene_of(beam(LINE), loads=LineForce((0, 0, 1))), "line force: beam 'body' is rigid"),
        (scene_of(plate(terms=(lambda point: 0,))), "shell 'body' is rigid and has terms"),
        (scene_of(beam(LINE, rotary_inertia=False)), "no inertia about one of its axes"),
        (
            scene_of(
                plate(),
                shells=(plate(), replace(plate(), name="soft", model="exact")),
                joins=Join("body", "soft", "bottom", "bottom"),
            ),
            "join of 'body' and 'soft': one of them is rigid",
        ),
        (
            scene_of(plate(model="exact"), beams=RIB, glues=Glue("rib", "body")),
            "beam 'rib' is rigid and shell 'body' is not",
        ),
    ],
)
def test_what_only_flexible_bodies_can_bear_is_refused(scene: Scene, sentence: str) -> None:
    with pytest.raises(SceneError, match=sentence):
        Model(scene, MPI.COMM_WORLD)
