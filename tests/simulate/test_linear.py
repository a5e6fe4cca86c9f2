"""Linear scenes: one factorisation for all load steps."""

import numpy as np
import pytest

from shellmb.demos.verification.solve import displacement
from shellmb.scene import (
    Beam,
    Clamped,
    Isotropic,
    Line,
    PointForce,
    RectangularSection,
    Scene,
    Solver,
    Weld,
)
from shellmb.simulate.simulation import Simulation
from shellmb.system.newton.refactorisation import Once
from tests.scenes import cantilever

TIP = (1.0, 0.25, 0.0)
STEEL = Isotropic(E=210e9, nu=0.3, thickness=1e-3)


@pytest.mark.parametrize("solve", ["reduced", "full"])
@pytest.mark.parametrize("backend", ["newton", "snes"])
@pytest.mark.parametrize("newton", ["auto", "full"])
def test_load_steps_share_the_factorisation_of_the_start(solve, backend, newton) -> None:
    """The last step is shorter, which changes nothing; a deflection of twenty lengths neither."""
    solver = Solver(solve=solve, backend=backend, newton=newton)
    runs = [
        Simulation(cantilever((0, 0, 1e3), "linear-statics", section=STEEL, dt=dt, solver=solver))
        for dt in (None, 0.3)
    ]
    for run in runs:
        run.run()
    assert [run.step for run in runs] == [1, 4]
    assert [run.problem.iteration.factorisations for run in runs] == [1, 1]
    once, often = (displacement(run, TIP)[2] for run in runs)
    # round-off of membrane forces, (length / thickness)^2 times as firm as bending, on bending
    assert often == pytest.approx(once, rel=10 * np.finfo(float).eps * (1.0 / 1e-3) ** 2)
    assert once > 10


def test_a_joint_that_begins_to_act_costs_another_factorisation() -> None:
    """Two beams, tied at their tips in the second half: the stiffness doubles there."""
    section = RectangularSection(E=1e9, nu=0.3, width=0.1, height=0.1)
    beams = [
        Beam(name, Line((0, y, 0), (1, y, 0)), section, elements=1, up=(0, 0, 1))
        for name, y in (("a", 0.0), ("b", 0.0))
    ]
    tie = Weld("tie", "a", "b", at=(1, 0, 0), active=(0.5, 1.0))
    scene = Scene(
        "tied",
        beams=beams,
        supports=[Clamped("start", body=name) for name in ("a", "b")],
        joints=tie,
        loads=PointForce("end", (0, 0, 1.0), body="a", time=lambda t: 1.0 if t > 0.5 else 0.0),
        scheme="linear-statics",
        dt=0.25,
    )
    run = Simulation(scene)
    run.run()
    assert run.step == 4
    assert run.problem.iteration.factorisations == 2


def test_what_is_not_linear_does_not_pass() -> None:
    """A second update that is not small says so; another system asks for a factorisation."""
    once = Once()
    once.begin("a")
    assert once.wanted()
    once.factorised(8.0)
    assert not once.wanted()
    assert not once.converged(1.0, 1.0, 1.0, 1e-9)
    assert not once.converged(0.5, 0.5, 0.5, 1e-9)
    assert once.converged(1e-10, 0.0, 1e-10, 1e-9)
    once.begin("a")
    assert not once.wanted()
    once.begin("b")
    assert once.wanted()
    once.factorised(8.0)
    once.forget()
    once.begin("b")
    assert once.wanted()
