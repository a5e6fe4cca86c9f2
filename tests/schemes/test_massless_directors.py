"""Directors without inertia in the schemes that are quadratic in time, eq. (Q6)."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh

from shellmb.errors import SceneError
from shellmb.forms.constraints.held import Held
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    AlongEdge,
    Beam,
    Clamped,
    Driven,
    EdgeForce,
    EdgeMoment,
    Fixed,
    Glue,
    Hinged,
    InitialVelocity,
    Join,
    Line,
    PointForce,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
    Solver,
)
from shellmb.schemes.quadratic import path_of
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.system.nullspace.directorpath import MasslessPath, PathBases

from .test_quadratic import GENERAL, SOFT, slope

PLATE = Shell("plate", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1), rotary_inertia=False)
BAR = RectangularSection(E=1.0, nu=0.3, width=0.1, height=0.1, density=1.0)
ROD = Beam("rod", Line((0, 0, 0), (1, 0, 0)), BAR, elements=2, rotary_inertia=False)
ARM = replace(PLATE, name="arm", surface=Rectangle(0.8, 0.5, (1, 0, 0), (0, 0, 1), (0, 1, 0)))
SPIN = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(0.4, 0.6, -0.3))
HELD: dict[str, Any] = {"supports": Clamped("left", body="plate")}
PULL = EdgeForce("right", (0.001, 0.0005, 0.001), body="plate")


def turn(t: float) -> float:
    """Angle of a driven edge, rad."""
    return float(0.6 * np.sin(t) ** 2)


# free, held in all or in some components, moved, and loads that jump on the massless part itself
CASES: dict[str, dict[str, Any]] = {
    "free": {"shells": PLATE, "initial": SPIN},
    "moment at once": {"shells": PLATE, **HELD, "loads": EdgeMoment("right", (0, 0.0005, 0))},
    "driven": {"shells": PLATE, "supports": Driven("left", axis=(0, 1, 0), rotation=turn)},
    "component moved": {
        "shells": PLATE,
        "supports": (Hinged("left"), Fixed("left", director=(lambda t: turn(t) / 3, None, None))),
        "loads": PULL,
    },
    "kink": {
        "shells": (PLATE, ARM),
        "joins": Join("plate", "arm", "right", "left"),
        "loads": EdgeForce("right", (0.001, 0.0005, 0), body="arm"),
        **HELD,
    },
    "glue": {
        "shells": replace(PLATE, degree=2),
        "beams": Beam("rib", AlongEdge("plate", "top"), BAR, degree=2, rotary_inertia=False),
        "glues": Glue("rib", "plate"),
        "loads": PULL,
        **HELD,
    },
    "beam": {
        "beams": ROD,
        "supports": Clamped("start"),
        "loads": PointForce((1, 0, 0), (0, 0.0005, 0.0005)),
    },
    "unshearable": {
        "shells": replace(PLATE, transverse_shear=False),
        "loads": PULL,
        **HELD,
    },
}


class Lengths(BaseObserver):
    """Largest violation of the constraints of directors, at all ends and middles of steps."""

    def __init__(self) -> None:
        self.end = self.middle = 0.0

    def solved(self, simulation: Simulation) -> None:
        for nodes in simulation.problem.iteration.nodes.sets.values():
            if nodes.state is None:
                continue
            path: Any = nodes.along(simulation.problem.fields)
            free = nodes.regular
            for name, d in (("end", path.end), ("middle", path.half)):
                v = d[free].reshape(len(d[free]), -1, 3)
                off = v @ v.transpose(0, 2, 1) - np.eye(v.shape[1])
                setattr(self, name, max(getattr(self, name), float(np.abs(off).max())))


# kinks and glue take long to compile; without them there is a beam
LONG = ("kink", "glue")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n in LONG else ()) for n in CASES]
)
def test_energy_law_constraints_and_reduction(name: str) -> None:
    states = []
    for solve in ("full", "reduced"):
        more: dict[str, Any] = {"dt": 0.2, "t_end": 0.6, "scheme": "ed3", "alpha": 0.5}
        solver = Solver(solve=solve, newton="full")
        simulation = Simulation(Scene("s", **CASES[name], solver=solver, **more))
        account, lengths = EnergyAccount(), Lengths()
        simulation.run([account, lengths])
        # Newton leaves the square of its tolerance; what is seen is round-off
        assert account.relative_error < 1e-12
        assert account.values["dissipation"] > 1e-6 * account.values["total_energy"]
        assert lengths.end < 1e-11
        assert lengths.middle < 1e-11
        states.append(
            np.concatenate(
                [
                    simulation.problem.levels[n].q.x.array[body.mixed.dofs[part]]
                    for n, body in simulation.model.meshed.items()
                    for part in ("u", "w")
                ]
            )
        )
    # the same, but for what Newton's method leaves
    np.testing.assert_allclose(states[0], states[1], atol=1e-10)


def swaying(alpha: float, steps: int) -> list[np.ndarray]:
    """Displacements, their velocities and directors of a cantilever after a large swing."""
    push = EdgeForce("right", (0.004, 0.002, 0.003), time=lambda t: float(np.sin(1.5 * t) ** 4))
    more: dict[str, Any] = {"dt": 1.6 / steps, "t_end": 1.6, "scheme": "ed3", "alpha": alpha}
    simulation = Simulation(Scene("s", PLATE, loads=push, **HELD, **more))
    simulation.run()
    levels, dofs = simulation.problem.levels["plate"], simulation.model.shells["plate"].mixed.dofs
    q, v = levels.q.x.array, levels.rates["v"].x.array
    return [q[dofs["u"]], v[dofs["u"]], q[dofs["w"]]]


@pytest.mark.parametrize("alpha", [0.5, 1.0])
def test_order_in_large_motion(alpha: float) -> None:
    """Three where there is mass; directors, which follow from a stress linear in time, over two."""
    counts, fine = [27, 54], swaying(alpha, 216)
    found = [swaying(alpha, n) for n in counts]
    orders = [
        slope(counts, [float(np.linalg.norm(f[k] - fine[k])) for f in found]) for k in range(3)
    ]
    assert np.abs(fine[2]).max() > 0.18
    # of 216 steps the error is a sixty-fourth of that of 54: it adds 0.03 to an order of three
    assert orders[0] == pytest.approx(3, abs=0.15)
    assert orders[1] == pytest.approx(3, abs=0.15)
    assert 2 < orders[2] < 3.2


class Tip(BaseObserver):
    """Change of the director at the loaded edge after each step."""

    def __init__(self) -> None:
        self.found: list[np.ndarray] = []

    def accepted(self, simulation: Simulation) -> None:
        body = simulation.model.shells["plate"]
        edge = np.isclose(body.mixed.nodes("u")[:, 0], 1.0)
        q = simulation.problem.levels["plate"].q.x.array
        self.found.append(q[body.mixed.dofs["w"]].reshape(-1, 3)[edge].mean(axis=0))


def test_an_imbalance_at_the_start_is_forgotten_and_booked() -> None:
    """A moment at once turns the massless edge at once, by (1 - alpha)/(1 + alpha) in each step.

    Displacements barely move in steps this short: the director goes to where springs have it, which
    take half of the work.
    """
    load = EdgeMoment("right", (0, 0.00005, 0))
    ends = {}
    for alpha in (1.0, 0.5):
        tip, account = Tip(), EnergyAccount()
        more: dict[str, Any] = {"dt": 1e-4, "t_end": 1e-3, "scheme": "ed3", "alpha": alpha}
        Simulation(Scene("s", PLATE, loads=load, **HELD, **more)).run([account, tip])
        assert account.relative_error < 1e-12
        share = account.values["dissipation"] / account.values["work_loads"]
        # what the displacements take in a millisecond, and turns of 0.008 rad
        assert share == pytest.approx(0.5, rel=0.01)
        ends[alpha] = np.array(tip.found)[:, 0]
    final = ends[1.0][-1]
    assert abs(final) > 5e-3
    # annihilated in the first step, but for terms of the square of its turn
    np.testing.assert_allclose(ends[1.0], final, rtol=1e-4)
    errors = ends[0.5][:6] - final
    # (Q3) without inertia: q_f - x = (1 - alpha)/(1 + alpha) (q_i - x), of the same sign
    np.testing.assert_allclose(errors[1:4] / errors[:3], 1 / 3, rtol=1e-3)


@pytest.mark.parametrize("alpha", [0.3, 1.0])
@pytest.mark.parametrize("directors", [1, 3])
def test_bases_of_a_node(alpha: float, directors: int) -> None:
    """Tests see no constraint force, increments keep the constraints, the forces do no work."""
    n = 3 * directors
    frames = np.linalg.qr(GENERAL.normal(size=(3, 3, 3)))[0].reshape(3, 9)[:, :n]
    start, end, half = frames
    chord, bow = end - start, ((start + end) / 2 - half) / 1.5
    rate = (12 * bow + 2 * alpha * chord) / (1 + alpha)
    path = MasslessPath(start[None], 0 * start[None], end[None], rate[None], alpha)
    np.testing.assert_allclose(path.half[0], half, atol=1e-14)
    np.testing.assert_allclose(path.allowed()[0], rate, atol=1e-12)
    given = [d.copy() for d in (start, 0 * start, end, rate)]
    zero = np.zeros((1, n))
    bases = PathBases(np.zeros(1, bool), np.arange(n)[None], zero, given, MasslessPath, alpha)
    bases()
    states, rates = bases.halves
    G = path.force_rows()[0]
    for tests in (
        np.concatenate([states.left[0], rates.left_other[0]]),
        np.concatenate([states.left_other[0], rates.left[0]]),
    ):
        np.testing.assert_allclose(G @ tests, 0, atol=1e-12)
    work = G @ np.concatenate([chord, 6 * bow])
    np.testing.assert_allclose(work, 0, atol=1e-12)
    step = 1e-6
    for d_end, d_rate in (
        (states.right[0], rates.right_other[0]),
        (np.zeros_like(states.right[0]), rates.right[0]),
    ):
        for k in range(d_end.shape[1]):
            moved = [
                MasslessPath(
                    *(start[None], 0 * start[None]),
                    *(end[None] + s * d_end[None, :, k], rate[None] + s * d_rate[None, :, k]),
                    alpha,
                )
                for s in (step, -step)
            ]
            for which in ("end", "half"):
                d = [getattr(p, which).reshape(-1, 3) for p in moved]
                change = (d[0] @ d[0].T - d[1] @ d[1].T) / (2 * step)
                # differences of squares of numbers of size one
                np.testing.assert_allclose(change, 0, atol=1e-8)


def test_forces_of_any_quadratic_constraint_do_no_work() -> None:
    """Work of both multipliers, for random states that need not obey the constraint."""
    domain = mesh.create_unit_interval(MPI.COMM_SELF, 1)
    space = fem.functionspace(domain, ("DG", 0, (3,)))
    q_i, q_f, r, zero = (fem.Function(space) for _ in range(4))
    for f in (q_i, q_f, r):
        f.x.array[:] = np.resize(GENERAL.normal(size=3), len(f.x.array))
    alpha = 0.4
    path = path_of(q_i, q_f, zero, r, ufl.as_ufl(alpha))
    Q = ufl.as_matrix(((2.0, 0.3, -0.1), (0.3, -1.0, 0.7), (-0.1, 0.7, 0.5)))

    def g(q: Any) -> Any:
        return ufl.as_vector([ufl.dot(q, Q * q) / 2 + q[0] - 0.3 * q[2] + 0.2])

    first, second = (Held(g).path(path, k, d, True) for k, d in enumerate(path.moved))
    ends = g(path.end)[0] - g(path.start)[0]
    around = 2 * (g(path.start)[0] + g(path.end)[0] - 2 * second.value[0])
    for work, expected in (
        (first.own[0] + second.other[0], ends),
        (first.other[0] + second.own[0], around),
    ):
        found = [fem.assemble_scalar(fem.form(e * ufl.dx)) for e in (work, expected)]
        assert found[0] == pytest.approx(found[1], rel=1e-12)


@pytest.mark.parametrize(("scheme", "alpha"), [("ep4", 0.0), ("ed3", 0.5)])
def test_held_strains_leave_the_account_closed(scheme: str, alpha: float) -> None:
    """Membrane forces of the end of a step are in its energy, also where shear is held."""
    shell = replace(PLATE, transverse_shear=False, rotary_inertia=True)
    more: dict[str, Any] = {"dt": 0.2, "t_end": 0.6, "scheme": scheme, "alpha": alpha}
    account = EnergyAccount()
    Simulation(Scene("s", shell, loads=PULL, **HELD, **more)).run([account])
    # with those of the row P0 it was open by 6e-3
    assert account.relative_error < 1e-12


@pytest.mark.parametrize(("scheme", "alpha"), [("ep4", 0.0), ("ed3", 0.0)])
def test_without_dissipation_they_are_refused(scheme: str, alpha: float) -> None:
    with pytest.raises(SceneError, match="shell 'plate': rotary_inertia is False, or"):
        Scene("s", PLATE, scheme=scheme, alpha=alpha, dt=0.1, t_end=0.2)


def test_shared_directors_have_inertia_in_both_bodies_or_in_none() -> None:
    arm = replace(ARM, rotary_inertia=True)
    with pytest.raises(SceneError, match="'plate' and 'arm' are joined: only 'plate' has no"):
        Scene(
            *("s", (PLATE, arm)),
            joins=Join("plate", "arm", "right", "left"),
            **{"scheme": "ed3", "dt": 0.1, "t_end": 0.2},
        )
