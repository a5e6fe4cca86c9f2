"""A lock that begins after the end of a run that is cut short is not there."""

import pytest

from shellmb.scene import GROUND, Gravity, Lock, Revolute, RigidBody, Scene
from shellmb.simulate.simulation import Simulation


def pendulum(*locks: Lock) -> Scene:
    return Scene(
        "pendulum",
        rigid_bodies=RigidBody("rod", 1.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0)),
        joints=Revolute("hinge", GROUND, "rod", at=(0, 0, 0), axis=(0, 1, 0)),
        locks=locks,
        loads=Gravity(),
        scheme="ep",
        dt=0.1,
        t_end=2.0,
    )


@pytest.mark.parametrize(("t_end", "there"), [(2.0, True), (1.0, False), (0.5, False)])
def test_it_costs_nothing(t_end: float, there: bool) -> None:
    late = pendulum(Lock("hinge", (1.0, 9.0))).with_options(t_end=t_end)

    def unknowns(scene: Scene) -> int:
        return int(Simulation(scene).problem.system.numbering.owned)

    assert (unknowns(late) > unknowns(pendulum())) is there
