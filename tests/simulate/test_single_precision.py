"""Runs with factors of single precision end where those of double precision do."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
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
from shellmb.system.direct.solver import DirectSolver, Factors
from tests.bench.record import Configuration
from tests.bench.scenes import plate as bench_plate
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
    double = End(scene)
    assert not double.solver.single
    monkeypatch.setattr(direct, "SMALL_SYSTEM", 0)
    single = End(scene)
    assert single.solver.single
    # round-off of ten steps, of forces times the condition number
    assert double.difference(single) < 1e-10
    assert single.energy_error < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("newton", ["full", "auto"])
def test_large_plates(monkeypatch: pytest.MonkeyPatch, newton: str) -> None:
    """Ten steps of 32x32 elements with ED, 30380 reduced unknowns."""
    scene = bench_plate("dynamic", "ed", (32, 32), Configuration("reduced", newton))
    scene = replace(scene, t_end=10 * (scene.dt or 0.0))
    single = End(scene)
    assert single.solver.single
    # 1e-3 as measured
    assert single.solver.contraction is not None and single.solver.contraction < 0.01
    use = DirectSolver._use
    monkeypatch.setattr(DirectSolver, "_use", lambda self, _: use(self, Factors.DOUBLE))
    double = End(scene)
    assert not double.solver.single
    # round-off of ten steps, of forces times the condition number
    assert double.difference(single) < 1e-10
    displacements = [e.simulation.problem.levels["plate"].q.x.array for e in (single, double)]
    assert abs(displacements[0] - displacements[1]).max() < 1e-13


PROGRAM = """
from mpi4py import MPI
from tests.bench.record import AUTO
from tests.bench.scenes import plate
from shellmb.scene.loads.loads import Load
from shellmb.simulate.simulation import Simulation

simulation = Simulation(plate("dynamic", "ep", (64, 64), AUTO))
for _ in range(3):
    simulation.advance()
solver = simulation.problem.iteration.linear.solver
assert solver.single, solver.contraction
# 8e-4 as measured; 0.09 without scaling, and factors of double precision from then on
assert solver.contraction < 0.01, solver.contraction
"""


@pytest.mark.slow
@pytest.mark.mpi
def test_large_plates_on_two_ranks(mpirun: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """MUMPS scales what several ranks have in other ways than what one has."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    mpirun(2, "-c", PROGRAM)


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
def test_statics_fall_back_to_double_precision(
    monkeypatch: pytest.MonkeyPatch, force: Load, factors: Factors
) -> None:
    """Thin and without inertia: soft modes are lost in single precision.

    They are what a load that follows the plate acts upon: half the matrix would not do.
    """
    scene = plate(scheme="static", dt=0.5, t_end=1.0)
    # elements as long as 80 thicknesses: round-off of membrane forces grows with the fourth power
    # of that beside what bends, and from 150 on hides whether the matrix is symmetric
    thin = replace(scene.shells[0], section=replace(RUBBER, thickness=2e-3), mesh=(6, 4))
    scene = replace(scene, shells=(thin,), loads=(force,))
    double = End(scene)
    monkeypatch.setattr(direct, "SMALL_SYSTEM", 0)
    single = End(scene)
    assert single.solver.factors is factors
    assert double.difference(single) < 1e-8
