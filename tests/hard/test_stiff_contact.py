"""Stiff contact in steps that are many times longer than an impact."""

import numpy as np
import pytest

from shellmb.scene import (
    Ball,
    Contact,
    Faces,
    InitialVelocity,
    Plane,
    Rectangle,
    RigidBody,
    Rod,
    Scene,
    Shell,
    Solver,
)
from tests.hard.conftest import SOFT

SLOW = [("ep4", 0.0), ("ed", 1.0), ("ed3", 1.0)]
SCHEMES = [("ep", 0.0), *(pytest.param(*s, marks=pytest.mark.slow) for s in SLOW)]
# of the plate of density 1 and thickness 0.2 on a stiffness per area: pi sqrt(0.2/k) is 1.4e-3 s
STIFFNESS = 1e6


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_soft_plate_on_stiff_ground_in_steps_of_100_impacts(
    scheme, alpha, plate, watch, worst
) -> None:
    """It falls with a spin, and a rod is in its way; a step of 0.15 s moves it by a tenth of it."""
    watched = watch(
        plate(
            scheme,
            alpha,
            initial=InitialVelocity(linear=(0.3, 0.1, -0.5), spin=(0.2, -0.4, 0.3)),
            contacts=(
                Contact("ground", Plane((0, 0, -0.2), (0.1, 0, 1)), STIFFNESS),
                Contact("rod", Rod((1.4, 0, 0.2), (0, 1, 0), 0.2), STIFFNESS, smoothing=1e-3),
            ),
            solver=Solver(tolerance=1e-11),
            dt=0.15,
            t_end=4.5,
        )
    )
    watched.check(worst)
    total = watched.total
    if alpha:
        worst("energy left in ED with alpha > 0, of 1", total[-1] / total[0], 0.9)
    else:
        worst("change of energy in EP and EP4, of 1", np.ptp(total) / total[0], 1e-9)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_a_ball_in_a_shell_that_both_move(scheme, alpha, watch, worst) -> None:
    """Steps of 100 impacts: a stiff ball rattles in a hollow one, which turns and flies."""
    m, k = 1.0, 1e8
    hollow = RigidBody("hollow", 2.0, (0.1, 0.2, 0.15), position=(0.1, 0, 0))
    ball = RigidBody("ball", m, (0.01,) * 3, position=(0, 0.1, -0.2))
    watched = watch(
        Scene(
            "rattle",
            rigid_bodies=(hollow, ball),
            contacts=Contact(
                "wall",
                Ball((0, 0, 0), 0.5, inside=True),
                k,
                body="ball",
                radius=0.1,
                obstacle_body="hollow",
            ),
            initial=(
                InitialVelocity((0.3, 0.2, -0.1), (0.5, -0.4, 0.3), body="hollow"),
                InitialVelocity((-1.0, 0.5, 2.0), (1.0, 2.0, -1.0), body="ball"),
            ),
            scheme=scheme,
            alpha=alpha,
            solver=Solver(tolerance=1e-11),
            dt=100 * np.pi * np.sqrt(2 / 3 * m / k),
            t_end=200 * 100 * np.pi * np.sqrt(2 / 3 * m / k),
        )
    )
    watched.check(worst)
    total = watched.total
    if alpha:
        worst("energy left in ED with alpha > 0, of 1", total[-1] / total[0], 1.0)
    else:
        worst("change of energy in EP and EP4, of 1", np.ptp(total) / total[0], 1e-9)


def stacked(scheme: str, alpha: float, **law: float) -> Scene:
    """Three soft plates above each other that fly together, the one between them at rest.

    Args:
        scheme: The scheme.
        alpha: Its dissipation.
        law: Friction and damping of the contacts.
    """
    mass, thick, step = 0.2, 0.2, 0.15
    # impacts of two plates take a hundredth of a step
    k = mass / 2 * (100 * np.pi / step) ** 2
    plates = {
        name: Shell(name, Rectangle(1.0, 0.5, origin=origin), SOFT, mesh=(2, 1))
        for name, origin in (
            ("low", (0.1, 0.05, -0.12)),
            ("middle", (0, 0, 0)),
            ("up", (-0.07, -0.1, 0.13)),
        )
    }
    touching = [
        Contact(f"{name} touches", Faces("middle", thick), k, name, smoothing=1e-3, **law)
        for name in ("low", "up")
    ]
    return Scene(
        "stacked",
        list(plates.values()),
        contacts=touching,
        initial=(
            InitialVelocity((0.05, 0, 0.1), (0.05, -0.1, 0.1), body="low"),
            InitialVelocity((0, 0.05, -0.1), (-0.1, 0.05, -0.1), body="up"),
        ),
        scheme=scheme,
        alpha=alpha,
        solver=Solver(tolerance=1e-11),
        dt=step,
        t_end=20 * step,
    )


@pytest.mark.slow
@pytest.mark.parametrize("law", [{}, {"friction": 0.3, "slip_speed": 1e-2}], ids=["smooth", "rubs"])
@pytest.mark.parametrize(("scheme", "alpha"), [("ep", 0.0), *((p[0], p[1]) for p in SLOW)])
def test_shells_on_shells_in_steps_of_100_impacts(scheme, alpha, law, watch, worst) -> None:
    """They meet in steps that move them by what lies between their surfaces, and rebound."""
    watched = watch(stacked(scheme, alpha, **law))
    watched.check(worst)
    total = watched.total
    if alpha or law:
        worst("energy left with friction or alpha > 0, of 1", total[-1] / total[0], 0.97)
    else:
        worst("change of energy in EP and EP4, of 1", np.ptp(total) / total[0], 1e-9)
