"""Sections of any strain energy density in the schemes that are quadratic in time."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.forms.materials import mooney_rivlin, neo_hookean, ogden
from shellmb.forms.shell import ShellStrains
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Hyperelastic,
    InitialVelocity,
    LinearSection,
    Solver,
)
from shellmb.scene.shells.lamination import Layer
from shellmb.simulate.simulation import Simulation
from tests.scenes import cantilever, plate_scene

from .test_quadratic import KINDS, slope
from .test_sections_in_motion import STIFFENING, H


def swaying(section: Any, scheme: str, alpha: float, steps: int) -> Simulation:
    """A cantilever that is pulled, bent and let go again, to strains of a tenth."""
    push = EdgeForce("right", (0.01, 0.002, 0.003), time=lambda t: float(np.sin(1.5 * t) ** 4))
    held = {"supports": Clamped("left"), "loads": push, "solver": Solver(newton="full")}
    simulation = Simulation(
        plate_scene(scheme, alpha, section=section, dt=1.6 / steps, t_end=1.6, **held)
    )
    simulation.run()
    return simulation


def motion(simulation: Simulation) -> np.ndarray:
    """Displacements, directors and assumed strains at the end."""
    body = simulation.model.shells["plate"]
    q = simulation.problem.levels["plate"].q.x.array
    return np.concatenate([q[body.mixed.dofs[p]] for p in ("u", "w", "S") if p in body.mixed.dofs])


@pytest.fixture(scope="module")
def fine() -> np.ndarray:
    """With a quarter of the larger steps: its error is a hundredth of theirs and less."""
    return motion(swaying(STIFFENING, "ep4", 0.0, 144))


@pytest.mark.parametrize(
    ("scheme", "alpha", "order"), [KINDS[0], pytest.param(*KINDS[1], marks=pytest.mark.slow)]
)
def test_order_where_the_section_stiffens(scheme: str, alpha: float, order: int, fine) -> None:
    """At strains of a tenth the terms of sixth degree are half of the others."""
    errors, counts = [], [36, 54]
    for steps in counts:
        simulation = swaying(STIFFENING, scheme, alpha, steps)
        errors.append(float(np.linalg.norm(motion(simulation) - fine)))
        # the tangent leaves out what is of third order in the strains of a step: linear sections
        # take three to four full iterations here, too
        assert simulation.iterations <= 4.5 * simulation.step
    assert np.abs(fine).max() > 0.25
    # of frequencies up to 2 rad in a step
    assert slope(counts, errors) == pytest.approx(order, abs=0.3)
    assert errors[-1] < (1e-4 if order == 4 else 5e-4)


class Plain(LinearSection):
    """What `STIFFENING` is without its terms of sixth degree."""

    shear_correction, offset = 1.0, 0.0

    def layers_by(self, value: Any) -> tuple[Layer, ...]:
        return (Layer(np.eye(3), np.eye(2) / 3, 1.0, H),)


@pytest.mark.parametrize(
    ("scheme", "alpha"), [("ep4", 0.0), pytest.param("ed3", 0.5, marks=pytest.mark.slow)]
)
def test_a_quadratic_density_is_the_linear_section(scheme: str, alpha: float) -> None:
    """The closed form of the path against Gauss' points in time, and resultants with them."""
    zeros = {"k": 0.0, "b": 0.0}
    section = replace(STIFFENING, parameters=dict(STIFFENING.parameters) | zeros)
    plain = swaying(Plain(), scheme, alpha, 8)
    written = swaying(section, scheme, alpha, 8)
    dofs = [s.model.shells["plate"].mixed.dofs for s in (plain, written)]
    states = [s.problem.levels["plate"].q.x.array for s in (plain, written)]
    for part in ("u", "w"):
        found = [q[d[part]] for q, d in zip(states, dofs, strict=True)]
        np.testing.assert_allclose(*found, atol=1e-9)
    # means over the last step
    for found in zip(*map(forces, (plain, written)), strict=True):
        np.testing.assert_allclose(*found, atol=1e-7 * np.abs(found[0]).max())


def forces(simulation: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Membrane and shear forces of the last step at a point of each cell."""
    body, f = simulation.model.shells["plate"], simulation.problem.levels["plate"].unknown["f"]
    read = fem.Expression(body.forces(f), np.array([[0.3, 0.6]]))
    domain = f.function_space.mesh
    cells = np.arange(domain.topology.index_map(2).size_local, dtype=np.int32)
    found = read.eval(domain, cells).reshape(-1, 5)
    return found[:, :3], found[:, 3:]


def test_a_steady_spin_is_no_division_by_zero() -> None:
    """Strains that do not change have no chord along which the energy could be made good."""
    spin = InitialVelocity(spin=(0.0, 0.0, 1e-3))
    simulation = Simulation(plate_scene("ep4", section=STIFFENING, dt=0.5, t_end=5.0, initial=spin))
    simulation.run()
    assert simulation.iterations <= 5 * simulation.step


def test_reduced_and_unreduced_systems_have_the_same_solution() -> None:
    """Assumed strains and resultants are eliminated cell by cell, those of both rows together."""
    states = []
    spin = InitialVelocity(spin=(0.4, 0.6, -0.3))
    for solve in ("reduced", "full"):
        solver = Solver(solve=solve, newton="full")
        simulation = Simulation(
            plate_scene(
                "ed3", 0.5, section=STIFFENING, dt=0.2, t_end=0.6, initial=spin, solver=solver
            )
        )
        simulation.run()
        states.append(motion(simulation))
    # both leave what the last iteration still changed, 1e-9, times the factor of its convergence
    np.testing.assert_allclose(states[0], states[1], atol=1e-10)


def test_small_strains_of_rubber_are_no_round_off() -> None:
    """A soft plate that a small load sets in motion.

    With `tr C - 3` as a difference of ones it took 536 steps, and the account closed to 7e-9.
    """
    values = {"mu": 1e6, "thickness": 0.01, "shear_correction": 5 / 6}
    rubber = Hyperelastic(neo_hookean, values, thickness=0.01, density=1100.0, stiffness=3e4)
    simulation = Simulation(cantilever((0, 0, 1.0), "ep4", section=rubber, dt=5e-3, t_end=0.02))
    account = EnergyAccount()
    simulation.run([account])
    assert simulation.step == 4
    # it closes to 2e-14 now
    assert account.relative_error < 1e-11


def test_the_energy_of_rubber_is_that_of_textbooks() -> None:
    """At strains of a tenth: `mu/2 (tr C - 3)` with `det C = 1`, by the stretches of C."""
    values = {"mu": 3.0, "thickness": 0.1, "shear_correction": 1.0}
    e, gam = np.array([0.2, -0.1, 0.15]), np.array([0.1, 0.05])
    vectors = (ufl.as_vector(list(part)) for part in (e, np.zeros(3), gam))
    parameters = {name: ufl.as_ufl(value) for name, value in values.items()}
    found = neo_hookean(ShellStrains(*vectors), parameters)
    C = np.array([[1.4, 0.15, 0.1], [0.15, 0.8, 0.05], [0.1, 0.05, 0.0]])
    C[2, 2] = (1 - np.linalg.det(C)) / np.linalg.det(C[:2, :2])
    assert np.linalg.det(C) == pytest.approx(1.0)
    assert float(found(())) == pytest.approx(0.1 * 3.0 / 2 * (np.trace(C) - 3), rel=1e-12)


LAWS = {
    mooney_rivlin: {"mu1": 7e3, "mu2": 3e3},
    ogden: {"mu1": 1.5e4, "alpha1": 1.3, "mu2": -250.0, "alpha2": -2.0},
}


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_a_plate_of_rubber_keeps_its_energy(scheme: str, law: Any) -> None:
    """It is thrown and spins, to strains of some hundredths."""
    values = LAWS[law] | {"thickness": 0.01, "shear_correction": 5 / 6}
    own = Hyperelastic(law, values, thickness=0.01, density=1100.0, stiffness=3e2)
    spin = InitialVelocity(spin=(3.0, 4.0, 12.0))
    more = {"initial": spin, "solver": Solver(newton="full", tolerance=1e-12)}
    simulation, energy = (
        Simulation(plate_scene(scheme, section=own, dt=5e-3, t_end=5e-2, **more)),
        EnergyAccount(),
    )
    simulation.run([energy])
    assert energy.values["strain_energy"] > 1e-3 * energy.largest
    assert energy.error < 1e-9 * energy.largest
