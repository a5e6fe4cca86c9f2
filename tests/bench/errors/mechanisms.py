"""Cases of mechanisms: rigid, flexible, controlled, with stops and spin."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import shellmb as sm
from shellmb.scene import Revolute, RigidBody, Scene
from tests.bench.errors.bodies import demo
from tests.bench.errors.case import Case


def chain(scheme: str, links: int = 2, **options: Any) -> Scene:
    """Chain of rigid links that falls from the horizontal."""
    inertia = (1e-3, 4e-3, 4e-3)
    bodies = tuple(
        RigidBody(f"link{k}", mass=1.0, inertia=inertia, com=(0.1 + 0.2 * k, 0, 0))
        for k in range(links)
    )
    joints = tuple(
        Revolute(
            f"hinge{k}",
            sm.GROUND if k == 0 else f"link{k - 1}",
            f"link{k}",
            at=(0.2 * k, 0.0, 0.0),
            axis=(0.0, 1.0, 0.0),
        )
        for k in range(links)
    )
    tips: Any = tuple(
        sm.Probe(f"tip_{a}", (0.2 * links, 0, 0), component=k, body=f"link{links - 1}")
        for k, a in ((0, "x"), (2, "z"))
    )
    return Scene(
        "chain",
        rigid_bodies=bodies,
        joints=joints,
        loads=(sm.Gravity((0, 0, -9.81)),),
        probes=tips,
        scheme=scheme,
        **({"t_end": 0.6} | options),
    )


def sprung() -> Scene:
    """The chain with a spring and a damper in its hinges."""
    elements = (
        sm.JointSpring("spring", "hinge1", stiffness=20.0),
        sm.JointDamper("damper", "hinge0", damping=0.2),
    )
    return replace(
        chain("ed3", dt=0.02, alpha=0.5, t_end=1.0),
        force_elements=elements,
    )


def lowest(run: Any) -> dict[str, float]:
    """Measure the lowest height of a probe at the ends of steps."""
    return {"lowest": float(run.history["tip_z"].min())}


ENDS = ("tip_x:l2", "tip_z:end")

MECHANISMS = (
    Case("two rigid links, EP4", "mechanism", lambda: chain("ep4", dt=0.02), ENDS),
    Case("two rigid links, EP", "mechanism", lambda: chain("ep", dt=5e-3), ENDS),
    Case("two rigid links, ED3", "mechanism", lambda: chain("ed3", dt=0.02, alpha=0.5), ENDS),
    Case("two links with a spring", "mechanism", sprung, ENDS),
    Case(
        "pendulum, sampled",
        "mechanism",
        lambda: replace(chain("ep", links=1, dt=2e-2, t_end=1.0), results=lowest),
        ("lowest",),
        {"lowest": -0.2},
    ),
    Case("heavy top", "mechanism", lambda: demo("heavy_top", dt=2e-3), ("x:l2", "z:end")),
    Case("slider-crank, rigid", "mechanism", lambda: demo("slider_crank"), ("middle_x:l2",)),
    Case(
        "slider-crank, flexible",
        "mechanism",
        lambda: demo("slider_crank", flexible=True, t_end=0.1),
        ("middle_y:l2",),
    ),
    Case(
        "slider-crank, reduced",
        "mechanism",
        lambda: demo("slider_crank", flexible=True, modes=4, t_end=0.1),
        ("middle_y:l2",),
    ),
    Case("panel into a stop", "mechanism", lambda: demo("latch_stop"), ("tip_z:l2", "peak_torque")),
    Case("arm under control", "mechanism", lambda: demo("pid_arm"), ("tip_x:l2", "tip_z:end")),
    Case("robot arm", "mechanism", lambda: demo("robot_arm", t_end=2.0), ("tip_z:l2",)),
    Case(
        "rolling cart",
        "mechanism",
        lambda: demo("rolling_cart", t_end=0.2),
        ("load_z:l2", "load_x:end"),
    ),
    Case(
        "beam after its buckling",
        "mechanism",
        lambda: demo("crank_buckling", elements=4, dt=2e-3),
        ("swing", "y:l2", "y:end", "z:min"),
    ),
    Case("satellite", "mechanism", lambda: demo("satellite"), ("turn:l2", "recoil:end")),
)
