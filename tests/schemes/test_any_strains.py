"""Strain measures of a user that are of any form: orders, energy law, momenta."""

from functools import partial
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.errors import SceneError
from shellmb.forms.shell import ShellStrains, shell_strains
from shellmb.model.shells.elastic import ElasticShell
from shellmb.native.kernels import compile_all, compiled
from shellmb.observers.account.momentum import Momentum
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Hyperelastic,
    InitialVelocity,
    Isotropic,
    Solver,
)
from shellmb.schemes.residuals.residual import bow_energy
from shellmb.simulate.simulation import Simulation
from tests.scenes import plate_scene

from .test_quadratic import KINDS, slope
from .test_sections_in_motion import ROUND_OFF, STIFFENING

SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.1, density=1.0)


def stretches(u: Any, w: Any, surf: Any) -> Any:
    """Changes of length in place of Green-Lagrange's strains, along both directions."""
    e = shell_strains(u, w, surf)
    eps = [ufl.sqrt(1 + 2 * e.eps[k]) - 1 for k in range(2)]
    return ShellStrains(ufl.as_vector([*eps, e.eps[2]]), e.kap, e.gam)


def engineering(u: Any, w: Any, surf: Any) -> Any:
    """The same, and curvatures and angles of unit lengths."""
    e = shell_strains(u, w, surf)
    a, b = (ufl.sqrt(1 + 2 * e.eps[k]) for k in range(2))
    return ShellStrains(
        ufl.as_vector([a - 1, b - 1, e.eps[2] / (a * b)]),
        ufl.as_vector([e.kap[0] / a**2, e.kap[1] / b**2, e.kap[2] / (a * b)]),
        ufl.as_vector([e.gam[0] / a, e.gam[1] / b]),
    )


def fixed_to_the_frame(u: Any, w: Any, surf: Any) -> Any:
    """A strain that sees rotations, of third degree: no momentum is kept then, energy is."""
    e = shell_strains(u, w, surf)
    first = ufl.dot(surf.e1, ufl.dot(ufl.grad(u), surf.e1))
    return ShellStrains(e.eps + ufl.as_vector([first**3, 0, 0]), e.kap, e.gam)


plate = partial(plate_scene, section=SOFT, dt=0.2, t_end=1.0)


# what takes a minute to compile is slow
FREE = [
    pytest.param(strains, scheme, alpha, marks=[pytest.mark.slow] if slow else [])
    for strains, scheme, alpha, slow in (
        (stretches, "ep4", 0.0, True),
        (stretches, "ed3", 0.5, True),
        (stretches, "ep", 0.0, False),
        (stretches, "ed", 0.5, True),
        (engineering, "ep4", 0.0, True),
        (engineering, "ed3", 1.0, True),
        (engineering, "ed", 0.0, True),
        (fixed_to_the_frame, "ep4", 0.0, True),
        (fixed_to_the_frame, "ep", 0.0, True),
    )
]


@pytest.mark.parametrize(("strains", "scheme", "alpha"), FREE)
def test_energy_law_and_momenta(strains, scheme, alpha, account, make) -> None:
    """Free flight, fast enough to stretch and bend by some per cent."""
    motion = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(0.4, 0.6, -0.3))
    momentum = Momentum(account)
    simulation = Simulation(plate(scheme, alpha, strains=strains, initial=motion))
    simulation.run([account, momentum])
    assert account.values["strain_energy"] > 1e-3 * account.largest
    assert account.relative_error < ROUND_OFF
    kept = make(scheme, alpha).conserves & momentum.drift.keys()
    if strains is fixed_to_the_frame:
        kept -= {"angular momentum"}
    assert "momentum" in kept
    for kind in kept:
        assert momentum.drift[kind] < ROUND_OFF, kind
    if "energy" not in make(scheme, alpha).conserves:
        assert account.values["dissipation"] > 1e-8 * account.largest


def swaying(strains: Any, scheme: str, alpha: float, steps: int, **more: Any) -> np.ndarray:
    """A cantilever that is pulled, bent and let go again, to strains of a tenth: its end."""
    push = EdgeForce("right", (0.01, 0.002, 0.003), time=lambda t: float(np.sin(1.5 * t) ** 4))
    held = {"supports": Clamped("left"), "loads": push, "solver": Solver(newton="full")}
    simulation = Simulation(
        plate(scheme, alpha, strains=strains, dt=1.6 / steps, t_end=1.6, **held, **more)
    )
    simulation.run()
    # as with the strains of the paper: derivatives of hyperelastic sections leave out a correction
    assert simulation.iterations <= (9 if "section" in more else 3.5) * simulation.step
    body = simulation.model.shells["plate"]
    q = simulation.problem.levels["plate"].q.x.array
    return np.concatenate([q[body.mixed.dofs[p]] for p in ("u", "w")])


@pytest.fixture(scope="module")
def fine() -> np.ndarray:
    """With less than half of the smaller steps: its error is a thirtieth of theirs and less."""
    return swaying(stretches, "ep4", 0.0, 144)


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "alpha", "order"), KINDS)
def test_order_in_large_motion(scheme: str, alpha: float, order: int, fine) -> None:
    """Stretches of a tenth differ from Green-Lagrange's strains by a twentieth of these."""
    counts = [36, 54]
    errors = [np.linalg.norm(swaying(stretches, scheme, alpha, n) - fine) for n in counts]
    assert np.abs(fine).max() > 0.25
    assert slope(counts, errors) == pytest.approx(order, abs=0.2)
    assert errors[-1] < (1e-6 if order == 4 else 1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("what", ["rows", "blocks"])
def test_strains_of_the_paper_are_a_special_case(what: str, monkeypatch) -> None:
    """At random states: both rows and the energy that is lost, and all blocks of the Jacobian."""
    found = []
    for quadratic in (True, False):
        monkeypatch.setattr(ElasticShell, "quadratic", quadratic)
        scene = plate("ed3", 0.5, supports=Clamped("left"))
        problem, rng = Simulation(scene).problem, np.random.default_rng(7)
        levels, (body,) = problem.levels["plate"], problem.model.bodies
        for function in (levels.q, *levels.scaled.values(), *levels.unknown.values()):
            function.x.array[:] = 0.1 * rng.normal(size=len(function.x.array))
        problem.system.follow()
        (term,) = problem.forms["plate"]["f"].terms
        if what == "rows":
            rows = fem.assemble_vector(compiled(term.residual)).array
            lost = compiled(bow_energy(body, problem.steps["plate"].step, levels.q))
            found.append([rows, np.array([fem.assemble_scalar(lost)])])
            continue
        dense = [
            [fem.assemble_matrix(kernel).to_dense() for kernel in compile_all(some)]
            for some in term.derivatives.values()
        ]
        found.append([sum(matrices) for matrices in dense])
    for plain, general in zip(*found, strict=True):
        assert np.abs(plain).max() > 0
        np.testing.assert_allclose(general, plain, atol=1e-12 * np.abs(plain).max())


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "alpha"), [("ep4", 0.0), ("ed3", 0.5)])
def test_hyperelastic_sections_have_the_energy_law(scheme: str, alpha: float, account) -> None:
    """Free flight with strains of any form and an energy that is not quadratic in them."""
    assert isinstance(STIFFENING, Hyperelastic)
    motion = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(0.4, 0.6, -0.3))
    simulation = Simulation(
        plate(scheme, alpha, strains=stretches, section=STIFFENING, initial=motion)
    )
    simulation.run([account])
    assert account.values["strain_energy"] > 1e-3 * account.largest
    assert account.relative_error < ROUND_OFF
    if alpha:
        assert account.values["dissipation"] > 1e-8 * account.largest


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "alpha", "order"), KINDS)
def test_order_of_hyperelastic_sections(scheme: str, alpha: float, order: int) -> None:
    """The density and the strains are of any form; errors are some of those of linear sections."""
    of, counts = {"section": STIFFENING}, [36, 54]
    best = swaying(stretches, "ep4", 0.0, 144, **of)
    errors = [np.linalg.norm(swaying(stretches, scheme, alpha, n, **of) - best) for n in counts]
    assert slope(counts, errors) == pytest.approx(order, abs=0.3)


def strained_at_rest(u: Any, w: Any, surf: Any) -> Any:
    """A membrane strain of a tenth of a per cent more."""
    e = shell_strains(u, w, surf)
    return ShellStrains(e.eps + ufl.as_vector([1e-3, 0, 0]), e.kap, e.gam)


def curved_at_rest(u: Any, w: Any, surf: Any) -> Any:
    """A curvature that varies, of a measure that is not quadratic."""
    x, e = ufl.SpatialCoordinate(ufl.domain.extract_unique_domain(u)), stretches(u, w, surf)
    return ShellStrains(e.eps, e.kap + ufl.as_vector([0, ufl.sin(x[0]), 0]), e.gam)


def zero_by_round_off(u: Any, w: Any, surf: Any) -> Any:
    """Zero at rest, but not by its symbols."""
    e, size = shell_strains(u, w, surf), ufl.dot(surf.e1, surf.e1)
    return ShellStrains(e.eps + ufl.as_vector([size - 1, 0, 0]), e.kap, e.gam)


@pytest.mark.parametrize("section", [SOFT, STIFFENING])
def test_strains_that_are_not_zero_at_rest_are_refused(section: Any) -> None:
    """Resultants begin as zero: a prestrain of a shell is natural, or in its energy."""
    for strains in (strained_at_rest, curved_at_rest):
        with pytest.raises(SceneError, match=f"'plate': strains {strains.__name__} gives a strain"):
            Simulation(plate("ep", strains=strains, section=section))
    Simulation(plate("ep", strains=zero_by_round_off, section=section))
