"""Order of accuracy, behaviour at high frequency, and the static limit."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from shellmb.scene import (
    Clamped,
    EdgeForce,
    Solver,
    Table,
)
from shellmb.schemes.base import (
    LINEAR_PATH,
    Levels,
    Motion,
    Rotations,
    Stage,
    Tangent,
    Values,
    at_state,
)
from shellmb.schemes.quadratic import QuadraticInTime
from shellmb.schemes.registry import SCHEMES, make_scheme
from shellmb.simulate.simulation import Simulation

STEPS = (0.2, 0.1, 0.05)
SMALL, LARGE = 1e-4, 0.1
_reference: list[np.ndarray] = []


def slope(steps: tuple[float, ...], errors: list[float]) -> float:
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def test_order(scheme, swaying, final, make) -> None:
    """A small motion under a load that varies in time, from rest, in steps that resolve it."""
    if not _reference:
        # the fourth-order scheme with a small step, once per process
        _reference.append(final(swaying("ed", 0.0, min(STEPS) / 4, size=SMALL)))
    exact = _reference[0]
    errors = [
        float(np.linalg.norm(final(swaying(*scheme, dt, size=SMALL)) - exact)) for dt in STEPS
    ]
    assert slope(STEPS, errors) > make(*scheme).order - 0.2


def test_order_in_large_rotations(scheme, swaying, final, make) -> None:
    """The averages of strains and the director's own inertia leave second order.

    Those that are quadratic in time keep theirs.
    """
    steps = (0.1, 0.05, 0.025)
    ends = [final(swaying(*scheme, dt, size=LARGE)) for dt in (*steps, steps[-1] / 2)]
    # directors turn by about a radian: the motion is not linear
    assert np.max(np.abs(ends[-1])) > 0.8
    changes = [float(np.linalg.norm(b - a)) for a, b in itertools.pairwise(ends)]
    made = make(*scheme)
    order = made.order if isinstance(made, QuadraticInTime) else min(made.order, 2)
    assert slope(steps, changes) > order - 0.2


@pytest.mark.slow
def test_order_of_a_tumbling_plate(scheme, tumbling, final, make) -> None:
    """A free plate that turns about all axes, bends and stretches, from an elastic shock on."""
    steps = (0.1, 0.05, 0.025)
    ends = [final(tumbling(*scheme, dt, t_end=0.6)) for dt in (*steps, steps[-1] / 2)]
    changes = [float(np.linalg.norm(b - a)) for a, b in itertools.pairwise(ends)]
    made = make(*scheme)
    order = made.order if isinstance(made, QuadraticInTime) else min(made.order, 2)
    assert slope(steps, changes) > order - 0.2


def test_spectral_radius_at_infinity(scheme, plate) -> None:
    """A small disturbance in one step far larger than all periods: its amplitude ratio is rho."""
    name, alpha = scheme
    made = make_scheme(*scheme)
    if "acceleration" in made.rates:
        pytest.skip("a state of three variables: see `test_rivals.py`")
    if isinstance(made, QuadraticInTime):
        # velocities times such a step are kilometres: see `test_quadratic.py`
        pytest.skip("asked of the scheme's weights")
    kick = EdgeForce("right", (0, 0, 1e-2), time=Table((0.1, 0.10001), (1.0, 0.0)))
    # displacements of 1e-4 thicknesses must be solved to many digits
    held = {"supports": Clamped("left"), "loads": kick, "solver": Solver(tolerance=1e-11)}
    simulation = Simulation(plate(*scheme, dt=0.1, t_end=1e12, **held))
    body = simulation.model.shells["plate"]
    place = body.mixed.dofs["u"]
    q = simulation.problem.levels["plate"].q.x.array
    simulation.advance()
    before = q[place].copy()
    simulation.size.dt = 1e9
    simulation.advance()
    ratio = (q[place] @ before) / (before @ before)
    # the paper's scheme below eq. (34); the mid-point rule reverses the sign
    expected = (1 - alpha) / (1 + alpha) if name in ("ed", "ed-printed") else -1.0
    assert ratio == pytest.approx(expected, abs=1e-4)


def test_the_dissipative_scheme_finds_the_static_equilibrium(plate, final) -> None:
    """In a step far larger than all periods nothing but the equilibrium of eq. (29) is left."""
    held = {"supports": Clamped("left"), "loads": EdgeForce("right", (0, 0, 2e-4))}
    static = final(plate("static", dt=0.5, t_end=1.0, **held))
    dynamic = final(plate("ed", 1.0, dt=1e7, t_end=5e7, **held))
    assert np.max(np.abs(static)) > 0.05
    np.testing.assert_allclose(dynamic, static, atol=1e-6)


@dataclass(frozen=True)
class BackwardEuler:
    """A scheme as a user would write it: all forces at the end of the step."""

    name: str = "backward Euler"
    title: str = "backward Euler"
    order: int = 1
    dynamic: bool = True
    stages: tuple[str, ...] = ("f",)
    rates: tuple[str, ...] = ("v",)
    conserves: frozenset[str] = frozenset({"momentum"})
    linear: bool = False
    jumps: bool = False
    rotations: Rotations = LINEAR_PATH

    def expand(self, levels: Levels, dt: Any) -> dict[str, Stage]:
        q, v, qf = levels.q, levels.rates["v"], levels.unknown["f"]
        velocity = (qf - q) / dt
        return {"f": Stage(at_state(qf), rate=(velocity - v) / dt, velocity=velocity)}

    def load_weight(self, stage: str, tau: float) -> float:
        return 1.0

    def prescribed(
        self, stage: str, motion: Motion, t: float, dt: float, rates: Mapping[str, Values]
    ) -> Values:
        return motion(t + dt)

    def advance(
        self,
        q: Values,
        rates: Mapping[str, Values],
        unknown: Mapping[str, Values],
        dt: float,
        tangent: Tangent,
    ) -> dict[str, Values]:
        return {"v": (unknown["f"] - q) / dt}

    def dissipation(self) -> tuple[float, str | None]:
        return 0.0, None


def test_a_scheme_of_ones_own(swaying, final) -> None:
    steps = (0.1, 0.05, 0.025, 0.0125)
    ends = [final(swaying(BackwardEuler(), 0.0, dt, size=SMALL)) for dt in steps]
    changes = [float(np.linalg.norm(b - a)) for a, b in itertools.pairwise(ends)]
    assert slope(steps[:-1], changes) == pytest.approx(1, abs=0.2)


def test_the_registry_says_what_its_schemes_are() -> None:
    for name, make in SCHEMES.items():
        scheme = make(0.5)
        assert scheme.name == name
        assert scheme.title
        assert "f" in scheme.stages
        assert scheme.dynamic == bool(scheme.rates) == (scheme.order > 0)
        # weights of a load average are those of an average
        nodes, weights = np.polynomial.legendre.leggauss(3)
        for stage in scheme.stages:
            total = sum(
                w / 2 * scheme.load_weight(stage, (x + 1) / 2)
                for x, w in zip(nodes, weights, strict=True)
            )
            # that with P1 = 2 tau - 1 is none
            assert total == pytest.approx(0 if stage == "v" else 1, abs=1e-14)
