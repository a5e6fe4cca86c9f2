"""Derivatives that bodies write by hand are the same where only their record is read."""

from dataclasses import replace

import numpy as np
import pytest
from dolfinx import fem

from shellmb.native import kernels
from shellmb.native.derivatives import Written
from shellmb.scene import Beam, Clamped, GeneralSection, Line, Rectangle, Scene, Shell
from shellmb.schemes.residuals.rows import NAMES
from shellmb.simulate.problem import Problem
from shellmb.simulate.simulation import Simulation
from tests.scenes import SOFT

from .test_sections_in_motion import STIFFENING

BEAM = GeneralSection(
    (1.0, 0.4, 0.4, 2e-3, 4e-3, 4e-3), mass_per_length=1.0, second_moments=(4e-3, 0.0, 4e-3)
)


@pytest.fixture
def problem(scheme: tuple[str, float]) -> Problem:
    """A shell and a beam; in some schemes a shell with damping, and one that is hyperelastic."""
    shells = [Shell("plate", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1))]
    supports = [Clamped("left", body="plate"), Clamped("start", body="beam")]
    if scheme[0] in ("ep", "ed3"):
        section = replace(SOFT, stiffness_damping=0.1)
        shells.append(Shell("damped", Rectangle(1.0, 0.5, (0, 2, 0)), section, mesh=(2, 1)))
        supports.append(Clamped("left", body="damped"))
    if scheme == ("ed3", 1.0):
        plate = Rectangle(1.0, 0.5, (0, 6, 0))
        shells.append(Shell("stiffening", plate, STIFFENING, mesh=(2, 1)))
        supports.append(Clamped("left", body="stiffening"))
    beam = Beam("beam", Line((0, 4, 0), (1, 4, 0)), BEAM, elements=2)
    scene = Scene(
        "s",
        shells,
        beams=beam,
        supports=supports,
        scheme=scheme[0],
        alpha=scheme[1],
        dt=0.1,
        t_end=0.1,
    )
    return Simulation(scene).problem


def test_found_are_what_is_written(problem: Problem) -> None:
    rng, count = np.random.default_rng(0), 0
    for field in problem.fields:
        written = [
            d
            for t in field.terms
            for ds in t.derivatives.values()
            for d in ds
            if type(d) is Written
        ]
        for derivative in written:
            for function in derivative.form().coefficients():
                if function.x.array.any() or function.name in NAMES:
                    function.x.array[:] += 0.1 * rng.standard_normal(len(function.x.array))
            (found,) = kernels.compile_with_derivatives([derivative])
            assert found is not None
            exact = fem.assemble_matrix(kernels.compiled(derivative.form())).to_dense()
            largest = np.abs(exact).max()
            assert largest > 0
            assert np.abs(fem.assemble_matrix(found).to_dense() - exact).max() < 1e-14 * largest
        count += len(written)
    assert count >= 2
