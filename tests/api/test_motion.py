"""Bodies of the user's own, moved by the schemes as a library."""

from collections.abc import Callable
from functools import cache
from typing import Any

from mpi4py import MPI

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh

import shellmb as sm
from shellmb.demos.own_body import SCHEMES, block, fall, swing

# round-off; the worst that was seen is 1e-13
CLOSED, HELD = 1e-12, 1e-12


def account(motion: Any) -> float:
    """Violation of the energy law, over the energy that was exchanged."""
    e = motion.energies
    return float(abs(e["energy_balance"]) / max(e["kinetic_energy"], abs(e["work_terms"])))


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_a_chain_keeps_its_account_and_its_rod(scheme: str, alpha: float) -> None:
    motion = fall(scheme, alpha)
    # steps are counted: their sum is 1.0000000000000007
    assert motion.time == 1.0
    assert account(motion) < CLOSED
    assert motion.violation < HELD
    dissipation = motion.energies["dissipation"]
    # not round-off: ten steps of a swing
    assert dissipation > 1e-4 if alpha else dissipation == 0.0
    # it swung: the first mass of some 0.5 m
    assert np.abs(motion.u("chain").x.array).max() > 0.4


@cache
def fine() -> np.ndarray:
    """Positions after 0.4 s; the error of ep4 falls by 16 from step to half the step."""
    return np.asarray(fall("ep4", 0.0, 0.4 / 600, 600).u("chain").x.array)


@pytest.mark.parametrize(
    ("scheme", "alpha", "order"),
    # schemes that keep accelerations begin with those of the equations of motion
    [("ep", 0.0, 2), ("ed", 0.5, 2), ("generalized-alpha", 1 / 9, 2)],
)
def test_orders_of_schemes_linear_in_time(scheme: str, alpha: float, order: int) -> None:
    _has_order(scheme, alpha, order)


@pytest.mark.parametrize(("scheme", "alpha", "order"), [("ep4", 0.0, 4), ("ed3", 0.5, 3)])
def test_orders_of_schemes_quadratic_in_time(scheme: str, alpha: float, order: int) -> None:
    _has_order(scheme, alpha, order)


def _has_order(scheme: str, alpha: float, order: int) -> None:
    counts = [40, 80]
    errors = [
        np.abs(fall(scheme, alpha, 0.4 / n, n).u("chain").x.array - fine()).max() for n in counts
    ]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize(
    ("scheme", "alpha"),
    [pytest.param(*k, marks=[] if k[0] == "ed3" else pytest.mark.slow) for k in SCHEMES],
)
def test_any_energy_closes_the_account(scheme: str, alpha: float) -> None:
    motion = swing(scheme, alpha, steps=20)
    assert account(motion) < CLOSED
    # strains of some per cent: the energy is not quadratic
    assert np.abs(motion.u("block").x.array).max() > 0.02


def test_a_stiffness_is_the_energy_that_it_belongs_to() -> None:
    """Of the same material, by kernels of their own."""
    ends = []
    for energy in (np.array([[2.0]]), lambda e: e[0] ** 2):
        body = sm.OwnBody("mass", _points(3), strain=_stretch, energy=energy, mass=ufl.dot)
        motion = sm.Motion(body, scheme="ed3", alpha=0.5, dt=0.1)
        motion.take("mass", v=lambda x: np.outer([0.3, 1.0, 0.2], np.ones(x.shape[1])))
        motion.step(10)
        ends.append(motion.u("mass").x.array.copy())
    # what is left of Newton's iterations
    assert np.abs(ends[1] - ends[0]).max() < 1e-9


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_a_strain_that_is_not_zero_at_rest_is_a_prestrain(scheme: str, alpha: float) -> None:
    """Of any stiffness: strains of the user are 1 + u + c u^2, not 0 where the field is.

    By a stiffness it moves as by the same energy as a function, and where c is 0 as the cosine
    that it must be.
    """
    ends = {}
    for c in (0.0, 0.3):
        for name, energy in (
            ("stiffness", np.array([[100.0]])),
            ("energy", lambda e: 50 * e[0] ** 2),
        ):
            body = sm.OwnBody(
                "mass",
                _points(1),
                strain=lambda u, c=c: ufl.as_vector([1 + u + c * u**2]),  # type: ignore[misc]
                energy=energy,
                mass=ufl.dot,
            )
            motion = sm.Motion(body, scheme=scheme, alpha=alpha, dt=0.01)
            motion.take("mass", u=lambda x: 0 * x[0])
            motion.step(20)
            (u,) = motion.u("mass").x.array
            ends[c, name] = float(u)
            e, stored = 1 + u + c * u**2, motion.energies
            assert stored["strain_energy"] == pytest.approx(50 * e**2, rel=1e-12)
            assert account(motion) < CLOSED
            assert stored["total_energy"] + stored["dissipation"] == pytest.approx(50, rel=1e-11)
        # what is left of Newton's iterations
        assert ends[c, "stiffness"] == pytest.approx(ends[c, "energy"], abs=1e-9)
    # steps of a tenth of a radian; ed damps by its order
    near = {"ep": 2e-3, "ed": 0.1, "ep4": 1e-5, "ed3": 1e-3}[scheme]
    assert ends[0.0, "stiffness"] == pytest.approx(np.cos(2.0) - 1, rel=near)


def test_momenta_of_a_free_body_are_kept() -> None:
    """Two masses on a spring tumble: EP keeps both momenta, whatever the energy."""

    def strain(u: Any) -> Any:
        r = ufl.as_vector([1 + u[3] - u[0], u[4] - u[1], u[5] - u[2]])
        return ufl.as_vector([(ufl.dot(r, r) - 1) / 2])

    def energy(e: Any) -> Any:
        return 3 * e[0] ** 2 + 20 * e[0] ** 4

    def along(u: Any) -> Any:
        return ufl.as_vector([0, 1, 0, 0, 1, 0])

    def about(u: Any) -> Any:
        # about z, of places (0, 0, 0) and (1, 0, 0)
        return ufl.as_vector([-u[1], u[0], 0, -u[4], 1 + u[3], 0])

    body = sm.OwnBody("pair", _points(6), strain=strain, energy=energy, mass=ufl.dot)
    motion = sm.Motion(body, scheme="ep", dt=0.05)
    motion.take("pair", v=lambda x: np.outer([0.5, -1, 0.2, 0.1, 2, 0.3], np.ones(x.shape[1])))
    motion.start()
    before = [motion.momentum("pair", m) for m in (along, about)]
    assert before == pytest.approx([1.0, 2.0], rel=1e-14)
    motion.step(20)
    after = [motion.momentum("pair", m) for m in (along, about)]
    # what is left of Newton's iterations, over 20 steps
    assert after == pytest.approx(before, rel=1e-9)
    assert account(motion) < CLOSED


def test_what_is_wrong_is_said() -> None:
    cubic: Callable[[Any], Any] = lambda u: ufl.as_vector([u[0] ** 3])  # noqa: E731
    with pytest.raises(sm.SceneError, match="'mass': strain is not quadratic"):
        sm.OwnBody("mass", _points(3), strain=cubic, energy=np.eye(1), mass=ufl.dot)
    held = sm.Hold(lambda u: u[0] ** 3, basix.ufl.element("DG", "interval", 0), ufl.dx)
    with pytest.raises(sm.SceneError, match="'mass': constraint 0 is not quadratic"):
        sm.OwnBody("mass", _points(3), mass=ufl.dot, constraints=[held])
    with pytest.raises(sm.SceneError, match="scheme is 'static'"):
        sm.Motion(sm.OwnBody("mass", _points(3), mass=ufl.dot), scheme="static", dt=0.1)
    with pytest.raises(sm.SceneError, match="a name of its own"):
        sm.Motion(block(), block(), dt=0.1)


def _points(size: int) -> fem.FunctionSpace:
    """Constants on the only cell of a mesh."""
    cell = mesh.create_interval(MPI.COMM_SELF, 1, (0.0, 1.0))
    return fem.functionspace(cell, ("DG", 0, (size,)))


def _stretch(u: Any) -> Any:
    """Of a spring of length one from the origin along x."""
    r = ufl.as_vector([1 + u[0], u[1], u[2]])
    return ufl.as_vector([(ufl.dot(r, r) - 1) / 2])
