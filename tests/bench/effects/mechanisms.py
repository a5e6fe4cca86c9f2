"""Effects of joints and of what acts on them, on two rods that hang from a hinge."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from shellmb.scene import (
    GROUND,
    PID,
    Command,
    Contact,
    Cylindrical,
    Damper,
    Distance,
    Driver,
    EdgeHinge,
    Event,
    Gravity,
    InPlane,
    Joint,
    JointDamper,
    JointSpring,
    JointStop,
    KnifeEdge,
    Lock,
    Motor,
    Planar,
    Plane,
    Potential,
    Prismatic,
    Revolute,
    RigidBody,
    Rolling,
    Scene,
    Screw,
    Sensor,
    ShellRevolute,
    Spherical,
    Spring,
    Universal,
    Weld,
)
from tests.bench.effects.case import Case, Mesh
from tests.bench.effects.plates import CASES as PLATES
from tests.bench.scenes import DT

AXIS, ACROSS = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
T_END = 0.5
_MIDDLE = (0.5, 0.0, 0.0)


def _rod(name: str, x: float) -> RigidBody:
    """A rod of half a metre along x."""
    return RigidBody(name, 1.0, (1e-3, 0.02, 0.02), (x, 0, 0), com=(0.25, 0, 0))


def _rods(scheme: str, joint: Joint, **more: Any) -> Scene:
    """Two rods: one turns about a point of the ground, a joint ties the other to it."""
    return Scene(
        "bench_rods",
        rigid_bodies=(_rod("a", 0.0), _rod("b", 0.5)),
        joints=(Revolute("pin", GROUND, "a", at=(0, 0, 0), axis=AXIS), joint),
        loads=(Gravity(),),
        scheme=scheme,
        dt=DT,
        t_end=T_END,
        **more,
    )


def _hinge(**more: Any) -> Joint:
    return Revolute("hinge", "a", "b", at=_MIDDLE, axis=AXIS, **more)


def _joint(name: str, joint: Joint) -> Case:
    return Case(
        f"{name}_joint", lambda scheme, mesh: _rods(scheme, joint), joint.name, meshed=False
    )


def _with(effect: str, **more: Any) -> Case:
    """The rods on two hinges with what acts on them."""
    return Case(effect, lambda scheme, mesh: _rods(scheme, _hinge(), **more), meshed=False)


def _of_hinge(effect: str, **more: Any) -> Case:
    """The rods with something of the hinge."""
    return Case(effect, lambda scheme, mesh: _rods(scheme, _hinge(**more)), meshed=False)


def _shell_revolute(scheme: str, mesh: Mesh) -> Scene:
    """A plate in flight that turns about a rod along its director."""
    free: Callable[[str, Mesh], Scene] = next(c.make for c in PLATES if c.effect == "flexibility")
    hub = RigidBody("hub", 1.0, (1e-3, 1e-3, 1e-3))
    tie = ShellRevolute("tie", "hub", "plate", at=(0, 0, 0))
    return replace(free(scheme, mesh), rigid_bodies=(hub,), joints=(tie,), probes=())


def _edge_hinge(scheme: str, mesh: Mesh) -> Scene:
    """A plate in flight that turns about its edge on a hub."""
    tie = EdgeHinge("tie", "hub", "plate", second_at="left")
    return replace(_shell_revolute(scheme, mesh), joints=(tie,))


def _turned(t: float) -> float:
    return 0.1 * math.sin(10.0 * t)


def _pull(coordinate: Any, rate: Any, time: Any) -> Any:
    return -0.1 * coordinate - 0.01 * rate + time


_HELD = PID("pid", Sensor("hinge.rotation"), 0.0, 1.0, kd=0.1)


def _field(at: Any, parameters: Any) -> Any:
    """Springs to where the point began, in all directions."""
    return parameters["k"] / 2 * (at.u[0] ** 2 + at.u[1] ** 2 + at.u[2] ** 2)


# of what pulls the second rod: a point of the ground, and the rod's end
_ABOVE, _END = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)

CASES = (
    _joint("spherical", Spherical("tie", "a", "b", at=_MIDDLE)),
    _joint("revolute", Revolute("tie", "a", "b", at=_MIDDLE, axis=AXIS)),
    _joint("universal", Universal("tie", "a", "b", at=_MIDDLE, axis=AXIS, second_axis=ACROSS)),
    _joint("cylindrical", Cylindrical("tie", "a", "b", at=_MIDDLE, axis=AXIS)),
    _joint("prismatic", Prismatic("tie", "a", "b", at=_MIDDLE, axis=AXIS)),
    _joint("planar", Planar("tie", "a", "b", at=_MIDDLE, normal=AXIS)),
    _joint("screw", Screw("tie", "a", "b", at=_MIDDLE, axis=AXIS, pitch=0.1)),
    _joint("weld", Weld("tie", "a", "b", at=_MIDDLE)),
    _joint("distance", Distance("tie", "a", "b", at=_MIDDLE, second_at=(1.0, 0.0, 0.0))),
    _joint("in_plane", InPlane("tie", "a", "b", at=_MIDDLE, normal=AXIS)),
    Case("shell_revolute_joint", _shell_revolute),
    Case("edge_hinge_joint", _edge_hinge),
    _joint("rolling", Rolling("tie", "a", "b", at=(0, 0, -0.1), normal=ACROSS, radius=0.1)),
    _joint(
        "knife_edge", KnifeEdge("tie", "a", "b", at=_MIDDLE, normal=ACROSS, direction=(1, 0, 0))
    ),
    _of_hinge("joint_mass", mass=0.1),
    _of_hinge("joint_windows", active=((0.0, T_END),)),
    _with("driver", drivers=Driver("drive", "pin", rotation=_turned)),
    _with("lock", locks=Lock("hinge", ((0.0, T_END),))),
    _with("joint_spring", force_elements=JointSpring("spring", "hinge", stiffness=10.0)),
    _with("joint_damper", force_elements=JointDamper("damper", "hinge", damping=0.1)),
    _with("joint_stop", force_elements=JointStop("stop", "hinge", upper=0.2, stiffness=100.0)),
    _with("motor", force_elements=Motor("motor", "hinge", law=_pull)),
    _with("spring", force_elements=Spring("spring", GROUND, "b", _ABOVE, _END, stiffness=10.0)),
    _with("damper", force_elements=Damper("damper", GROUND, "b", _ABOVE, _END, damping=0.1)),
    _with(
        "controller",
        controllers=_HELD,
        force_elements=Motor("servo", "hinge", command=Command("pid")),
    ),
    # one that never comes: what it costs to look
    _with("event", events=Event("far", Sensor("hinge.rotation") >= 9.0)),
    _with("potential", potentials=Potential("field", _field, "b", at=_END, parameters={"k": 10.0})),
    _with("contact", contacts=Contact("floor", Plane((0, 0, -0.2)), 1e3, "b", at=_END)),
    _with("observe_joints"),
)
