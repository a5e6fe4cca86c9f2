"""Rigid bodies whose points touch shells that deform.

The kind: forces at a place beside the node that carries it. Momenta and energy stay, whatever the
step; what rests presses with its weight where it stands; a rigid shell is one that hardly deforms.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from shellmb.errors import SceneError
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    Contact,
    Faces,
    Gravity,
    InitialVelocity,
    Isotropic,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    Solver,
)
from tests.contact.test_faces import GAP, SPEED, THICK, momenta, plates

SLOW = pytest.mark.slow
PLACE = np.array([0.09, 0.08, 0.05])
# from there
FEET = {"front": (-0.04, -0.04, -0.05), "left": (0.04, -0.03, -0.05), "right": (0.01, 0.06, -0.05)}


def table(scheme: str, **more: Any) -> Scene:
    """A body on three feet that falls on a free plate and turns."""
    place = tuple(PLACE + np.array([0, 0, THICK / 2 + GAP]))
    body = RigidBody("table", 0.3, (4e-4, 5e-4, 7e-4), position=place, points=FEET)
    given = plates(scheme=scheme, alpha=0.5 if scheme.startswith("ed") else None)
    touch = Contact(
        "touch", Faces("low", THICK), 1e5, body="table", at=tuple(FEET), smoothing=2e-5, **more
    )
    return replace(
        given,
        shells=given.shells[:1],
        rigid_bodies=body,
        contacts=touch,
        initial=InitialVelocity((0.2, 0.1, -SPEED), (0.5, -0.3, 2.0), body="table"),
        t_end=2e-3,
    )


RUBS = {"friction": 0.3, "slip_speed": 0.1, "relative_damping": 0.2}


@pytest.mark.parametrize(
    ("scheme", "law"),
    [
        ("ep", RUBS),
        *(pytest.param(s, {}, marks=SLOW) for s in ("ep", "ep4", "ed", "ed3")),
        pytest.param("ep", RUBS | {"radius": 1e-5}, marks=SLOW),
    ],
)
def test_a_body_on_feet_keeps_momenta_and_energy(scheme: str, law: dict[str, Any]) -> None:
    run = execute(table(scheme, **law))
    history, energy = run.history, run.history.total_energy
    assert history["touch.normal"].max() > 5.0
    # as of shells: what Newton's method leaves
    assert np.max(np.abs(history["energy_balance"])) < 1e-10 * energy[0]
    assert (history["touch.loss"].iloc[-1] > 1e-4 * energy[0]) == bool(law)
    linear, angular = momenta(run)
    size = 0.3 * SPEED
    assert_allclose(linear, np.tile(linear[0], (len(linear), 1)), atol=1e-11 * size)
    # in the other schemes it is of their order, as in `test_faces.py`
    bound = {"ep": 1e-11, "ep4": 1e-6}.get(scheme, 1e-4)
    assert_allclose(angular, np.tile(angular[0], (len(angular), 1)), atol=bound * size * 0.2)


@pytest.mark.slow
def test_a_rigid_shell_is_one_that_hardly_deforms() -> None:
    """With a thousand times the stiffness forces differ by what is left of the bending."""
    found = []
    for stiff, model in ((1e3, "exact"), (1.0, "rigid")):
        scene = plates(spin=(0.5, -0.3, 0.5), meshes=(2, 2), stiff=stiff)
        low, up = scene.shells
        soft = replace(low, section=Isotropic(70e9, 0.3, thickness=THICK, density=2700.0))
        scene = replace(scene, shells=(soft, replace(up, model=model)), t_end=1.2e-3)
        found.append(execute(scene).history)
    force = found[0]["touch.normal"].max()
    assert force > 10
    # directors of nodes have inertia in one and none in the other
    assert_allclose(found[1]["touch.normal"], found[0]["touch.normal"], atol=0.02 * force)


@pytest.mark.slow
def test_what_stands_on_a_plate_presses_with_its_weight() -> None:
    """The moments of the feet balance that of the weight: by statics alone."""
    section = Isotropic(70e9, 0.3, thickness=THICK, density=2700.0)
    mass = 2.0
    scene = Scene(
        "stands",
        Shell("low", Rectangle(0.2, 0.2), section, mesh=(4, 4)),
        rigid_bodies=RigidBody(
            "table",
            mass,
            (0.01,) * 3,
            position=tuple(PLACE + np.array([0, 0, THICK / 2])),
            points=FEET,
        ),
        supports=Clamped("left"),
        contacts=[
            Contact(name, Faces("low", THICK), 1e5, body="table", at=name, smoothing=1e-5, **RUBS)
            for name in FEET
        ],
        loads=Gravity(),
        scheme="ed",
        alpha=1.0,
        dt=5e-3,
        t_end=0.5,
        solver=Solver(tolerance=1e-11),
    )
    history = execute(scene).history.tail(20).mean()
    forces = np.array([history[f"{name}.Fz"] for name in FEET])
    places = np.array(list(FEET.values()))[:, :2]
    # the plate still swings by some of its sag
    assert forces.sum() == pytest.approx(mass * 9.81, rel=0.02)
    assert_allclose(forces @ places / forces.sum(), (0.0, 0.0), atol=2e-3)


def test_bodies_in_modes_are_refused() -> None:
    scene = plates()
    low, up = scene.shells
    with pytest.raises(
        SceneError, match="the model of 'low' is 'rigid'; with the faces of a shell"
    ):
        replace(scene, shells=(replace(low, model="rigid"), up))
    with pytest.raises(SceneError, match="the model of 'up' is 'floating-frame'; with the faces"):
        replace(scene, shells=(low, replace(up, model="floating-frame")))
