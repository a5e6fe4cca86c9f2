"""Runs of small scenes with contact, and what all of them must keep."""

from typing import Any

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import Contact, InitialVelocity, Plane, RigidBody, Scene

# mass, stiffness and speed of the ball: the contact takes pi sqrt(m/k) = 31.4 ms
MASS, STIFFNESS, SPEED, RADIUS = 2.0, 2e4, 3.0, 0.1


@pytest.fixture
def run() -> Any:
    """Runs a scene: its history and summary; the energy law holds, and no scheme gains."""

    def made(scene: Scene) -> Any:
        result = execute(scene)
        history, summary = result.history, result.summary
        assert summary["failed"] is None
        if scene.static:
            return result
        # Newton stops at 1e-9 of the unknowns: what is left of energies is added up over the steps
        assert summary["energy_balance_error"] < 1e-10
        own = history.total_energy - history.get("work_loads", 0.0) - history.work_terms
        # round-off of the energies: 6e-12 was seen
        assert np.max(np.diff(own)) < 1e-10 * np.max(np.abs(own))
        return result

    return made


@pytest.fixture
def ball() -> Any:
    """A ball that touches the plane z = 0 after 0.02 s, in a scene without weight."""

    def made(scheme: str, alpha: float, dt: float, **more: Any) -> Scene:
        scene = {k: more.pop(k) for k in ("t_end", "initial", "loads", "supports") if k in more}
        position = more.pop("position", (0.0, 0.0, RADIUS + 0.02 * SPEED))
        body = RigidBody("ball", MASS, (0.4 * MASS * RADIUS**2,) * 3, position)
        scene = {"initial": InitialVelocity(linear=(0, 0, -SPEED)), "t_end": 0.08} | scene
        contact = {"obstacle": Plane(), "stiffness": STIFFNESS, "radius": RADIUS} | more
        return Scene(
            "ball",
            rigid_bodies=body,
            contacts=Contact("floor", **contact),
            scheme=scheme,
            alpha=alpha,
            dt=dt,
            **scene,
        )

    return made
