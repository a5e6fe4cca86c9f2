"""Terms of sections: where their rows go, and that they are the paper's forms."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.model.body import added
from shellmb.native.kernels import compiled
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Isotropic,
    Laminate,
    PlyMaterial,
    Rectangle,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.functionals import DolfinxResiduals
from shellmb.system.assembly.loops import LoopResiduals
from shellmb.system.assembly.meshgroups import mesh_groups

SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.1, density=1.0)
PLY = PlyMaterial(E1=10.0, E2=1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.3, density=1.5)


def problem_of(scheme: str, shell: Shell) -> Any:
    alpha = {"alpha": 0.5} if scheme in ("ed", "ed3") else {}
    held = {"supports": Clamped("left"), "loads": EdgeForce("right", (0.0, 0.0, 1e-3))}
    return Simulation(
        Scene("plate", shell, scheme=scheme, dt=0.1, t_end=0.2, **alpha, **held)
    ).problem


@pytest.mark.parametrize("scheme", ["ed", "ed3"])
def test_our_loops_and_dolfinx_put_rows_in_the_same_places(scheme: str) -> None:
    """One row a form, or both in one."""
    problem = problem_of(scheme, Shell("plate", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1)))
    system, rng = problem.system, np.random.default_rng(7)
    for field in system.fields:
        field.function.x.array[:] = 0.1 * rng.normal(size=field.size_all)
    system.follow()
    found = []
    for residuals in (
        LoopResiduals(group.residuals for group in mesh_groups(system)),
        DolfinxResiduals(system.residual_forms, system.fields, system.numbering.offsets),
    ):
        local = np.zeros(len(system.numbering.local_to_global))
        residuals.add(local)
        found.append(local)
    ours, theirs = found
    assert all(np.abs(theirs[system.numbering.slice(k)]).max() > 0 for k in range(2))
    # sums in another order
    np.testing.assert_allclose(ours, theirs, atol=1e-14 * np.abs(theirs).max())


SHELLS = {
    "isotropic": {},
    "coupled": {"section": Laminate.from_stacking(PLY, 0.05, (0, 60), offset=0.02)},
    "kirchhoff": {"transverse_shear": False},
}


@pytest.mark.parametrize(
    ("kind", "scheme"),
    [("isotropic", "static"), ("isotropic", "ed"), ("coupled", "ed"), ("kirchhoff", "ed")],
)
def test_rows_are_the_general_forms(kind: str, scheme: str) -> None:
    """At random states the terms are the averaged stresses on mid-point strains, eqs. (20)-(32)."""
    shell = replace(Shell("plate", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1)), **SHELLS[kind])
    problem, rng = problem_of(scheme, shell), np.random.default_rng(7)
    levels, (body,) = problem.levels["plate"], problem.model.bodies
    for function in (levels.q, *levels.unknown.values()):
        function.x.array[:] = 0.1 * rng.normal(size=len(function.x.array))
    problem.system.follow()
    test = ufl.TestFunction(body.mixed.space)
    for stage in problem.forms["plate"].values():
        (term,), span = stage.terms, stage.stage.span
        found = fem.assemble_vector(compiled(term.residual)).array
        work = added(part.interval(span, test) for part in body.elastic)
        wanted = fem.assemble_vector(compiled(work)).array
        # sums in another order
        np.testing.assert_allclose(found, wanted, atol=1e-13 * np.abs(wanted).max())
