"""Runs with factors of large systems end where those of small ones do."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import pytest

from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    Clamped,
    EdgeForce,
    FollowerEdgeForce,
    Gravity,
    Isotropic,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    ShellRevolute,
)
from shellmb.scene.loads.loads import Load
from shellmb.simulate.simulation import Simulation
from shellmb.system.condensation.reduction import Reduction
from shellmb.system.direct import solver as direct
from shellmb.system.direct.mumps import SCALING, mumps_options
from shellmb.system.direct.solver import Factors
from tests.scenes import cantilever

RUBBER = Isotropic(E=2e6, nu=0.3, thickness=0.02, density=500.0)


plate = partial(cantilever, (1.0, 2.0, 8.0), section=RUBBER, mesh=(3, 2))


def hinged(**scheme: Any) -> Scene:
    """A plate with a rod on a hinge: multipliers stay in the reduced system."""
    shell = Shell("plate", Rectangle(1.0, 0.5), RUBBER, mesh=(2, 1))
    return Scene(
        "hinged",
        shell,
        rigid_bodies=RigidBody("rod", 0.5, (1e-3, 2e-2, 2e-2), position=(1.3, 0.25, 0)),
        joints=ShellRevolute("hinge", "rod", "plate", at=(1.0, 0.25, 0)),
        supports=Clamped("left", body="plate"),
        loads=Gravity(),
        **scheme,
    )


class End:
    """The end of a run: all unknowns, the error of the energy account, the solver."""

    def __init__(self, scene: Scene) -> None:
        energy = EnergyAccount()
        self.simulation = Simulation(scene)
        self.simulation.run([energy])
        iteration = self.simulation.problem.iteration
        assert isinstance(iteration.linear, Reduction)
        self.solver, self._convergence = iteration.linear.solver, iteration.convergence
        self.unknowns = self.simulation.problem.system.x.array_r.copy()
        self.energy_error = energy.relative_error or 0.0

    def difference(self, other: End) -> float:
        """Of the unknowns, relative to the scales of the parts."""
        change = (other.unknowns - self.unknowns)[None]
        return float(self._convergence.sizes(self.unknowns, change)[0].max())


@pytest.mark.parametrize("make", [plate, hinged])
@pytest.mark.parametrize(
    ("scheme", "newton"),
    [("ep", "full"), ("ep", "auto"), ("ed", "auto"), ("ep4", "auto"), ("ed3", "auto")],
)
def test_motions_are_the_same(
    monkeypatch: pytest.MonkeyPatch, make: Any, scheme: str, newton: str
) -> None:
    scene = make(scheme=scheme, dt=2e-3, t_end=0.02)
    scene = replace(scene, solver=replace(scene.solver, newton=newton))
    small = End(scene)
    assert small.solver.factors in (Factors.PLAIN, Factors.BANDED)
    monkeypatch.setattr(direct, "SMALL_SYSTEM", 0)
    large = End(scene)
    assert large.solver.factors in (Factors.SYMMETRIC, Factors.DOUBLE)
    # round-off of ten steps, of forces times the condition number
    assert small.difference(large) < 1e-10
    assert large.energy_error < 1e-12


def test_several_ranks_scale_by_iterations() -> None:
    """As MUMPS does of distributed matrices only; any other way is none."""
    assert mumps_options(10_000, reduced=True)[SCALING] == 4
    assert mumps_options(10_000, reduced=True, ranks=2)[SCALING] in (7, 8)


@pytest.mark.parametrize(
    ("force", "factors"),
    [
        (EdgeForce("right", (1e-3, 2e-3, 8e-3)), Factors.SYMMETRIC),
        (FollowerEdgeForce("right", (1e-3, 2e-3, 8e-3)), Factors.DOUBLE),
    ],
    ids=["dead", "follower"],
)
def test_statics_under_dead_loads_need_one_triangle(
    monkeypatch: pytest.MonkeyPatch, force: Load, factors: Factors
) -> None:
    """Soft modes are what a load that follows the plate acts upon: half the matrix would not do."""
    scene = plate(scheme="static", dt=0.5, t_end=1.0)
    # elements as long as 80 thicknesses: round-off of membrane forces grows with the fourth power
    # of that beside what bends, and from 150 on hides whether the matrix is symmetric
    thin = replace(scene.shells[0], section=replace(RUBBER, thickness=2e-3), mesh=(6, 4))
    scene = replace(scene, shells=(thin,), loads=(force,))
    small = End(scene)
    monkeypatch.setattr(direct, "SMALL_SYSTEM", 0)
    large = End(scene)
    assert large.solver.factors is factors
    assert small.difference(large) < 1e-8
