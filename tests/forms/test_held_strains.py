"""Forms in which shear or stretching is held at zero: tangents, potentials, energy law, motions."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.meshes.mesh import build_surface
from shellmb.model.body import strain_energy
from shellmb.model.frames.beam import build_beam
from shellmb.model.shells.shell import ShellModel
from shellmb.scene import (
    Beam,
    Cylinder,
    Isotropic,
    ParametricCurve,
    RectangularSection,
    Shell,
)
from shellmb.schemes.base import at_state, interval
from shellmb.schemes.residuals.residual import interval_forces, jump_energy
from tests.forms.conftest import compiled, tie_of_strains

# central differences of step H: error H^2 of the third derivative, plus eps/H of round-off
H, FD = 1e-6, 1e-7
BETA = 0.6
# the slack multiplies strains by 1e5 and their round-off with them
SLACK_ROUND_OFF = 1e-7


class Held:
    """A body with three states, and scalar forms of them, compiled once."""

    def __init__(self, body: Any) -> None:
        self.body = body
        self.a, self.b, self.v, self.dq = (fem.Function(body.mixed.space) for _ in range(4))
        self.beta = fem.Constant(body.mixed.space.mesh, BETA)
        self._forms: dict[str, fem.Form] = {}

    def value(self, name: str, make: Callable[[], ufl.Form]) -> float:
        if name not in self._forms:
            self._forms[name] = compiled(make())
        return float(fem.assemble_scalar(self._forms[name]))

    def work(self, kind: str) -> float:
        if kind == "state":
            return self.value(kind, lambda: interval_forces(self.body, at_state(self.b), self.v))
        span = interval(self.a, self.b, self.beta)
        return self.value(kind, lambda: interval_forces(self.body, span, self.v))

    def tangent(self, kind: str) -> float:
        span = at_state(self.b) if kind == "state" else interval(self.a, self.b, self.beta)
        return self.value(
            f"tangent {kind}",
            lambda: ufl.derivative(interval_forces(self.body, span, self.v), self.b, self.dq),
        )

    def part(self, q: fem.Function, name: str) -> np.ndarray:
        return q.x.array[self.body.mixed.dofs[name]]

    def randomise(self, q: fem.Function, rng: np.random.Generator, size: float) -> None:
        """A small motion of nodes with directors of the right lengths and angles; no resultants."""
        mixed = self.body.mixed
        q.x.array[:] = 0.0
        q.x.array[mixed.dofs["u"]] = 0.1 * size * rng.normal(size=len(mixed.dofs["u"]))
        D = self.body.manifold.directors
        d = (D + size * rng.normal(size=D.shape)).reshape(len(D), -1, 3)
        if d.shape[1] == 3:
            left, _, right = np.linalg.svd(d)
            d = left @ right
        else:
            d = d / np.linalg.norm(d, axis=2, keepdims=True)
        q.x.array[mixed.dofs["w"]] = (d.reshape(D.shape) - D).ravel()

    def satisfy(self, span: Any, q: fem.Function) -> None:
        """Resultants of a state that satisfy compatibility, which is linear in them."""
        rows = np.concatenate([self.body.mixed.dofs[part] for part in self.body.mixed.stresses])
        test = ufl.TestFunction(self.body.mixed.space)
        kind = "state" if span.a is span.b else "interval"
        key = f"residual {kind} {q.name}"
        if key not in self._forms:
            self._forms[key] = compiled(interval_forces(self.body, span, test))
        form = self._forms[key]
        q.x.array[rows] = 0.0
        rest = fem.assemble_vector(form).array[rows]
        matrix = np.zeros((len(rows), len(rows)))
        for k, dof in enumerate(rows):
            q.x.array[dof] = 1.0
            matrix[:, k] = fem.assemble_vector(form).array[rows] - rest
            q.x.array[dof] = 0.0
        q.x.array[rows] = np.linalg.solve(matrix, -rest)


def shell(**options: bool) -> ShellModel:
    section = Isotropic(E=2.6, nu=0.3, thickness=0.1, density=1.5)
    surface = Cylinder(radius=1.0, length=0.8, angles=(10, 60))
    made = Shell("panel", surface, section, mesh=(1, 2), direction=(0.3, 1.0, 0.2))
    made = replace(made, **options)  # type: ignore[arg-type]
    return ShellModel(made, build_surface(made, MPI.COMM_WORLD), [], True)


def beam(**options: bool) -> Any:
    # eccentric, so that forces and moments are coupled
    section = RectangularSection(2.6, 0.3, width=0.3, height=0.2, density=1.5, offset=(0.09, 0.05))
    helix = ParametricCurve(lambda xi: np.stack([np.cos(2 * xi), np.sin(2 * xi), 0.7 * xi]))
    made = Beam("b", helix, section, 2, 2, (0.1, 0.2, 1.0))
    made = replace(made, **options)  # type: ignore[arg-type]
    return build_beam(made, MPI.COMM_WORLD, [], True)


KINDS = {
    "shell without shear": lambda: shell(transverse_shear=False),
    "shell without stretching": lambda: shell(stretching=False),
    "beam without shear": lambda: beam(transverse_shear=False),
    "beam without either": lambda: beam(transverse_shear=False, stretching=False),
}
_MADE: dict[str, Held] = {}


# what it consists of is in the others, and its forms take long to compile
SLOW = {"beam without shear"}


@pytest.fixture(
    params=[pytest.param(k, marks=[pytest.mark.slow] if k in SLOW else []) for k in KINDS]
)
def held(request: pytest.FixtureRequest) -> Held:
    if request.param not in _MADE:
        _MADE[request.param] = Held(KINDS[request.param]())
    return _MADE[request.param]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(1910)


@pytest.mark.parametrize("kind", ["state", "interval"])
def test_tangent_is_the_derivative_of_the_residual(held, kind, rng) -> None:
    for q in (held.a, held.b):
        held.randomise(q, rng, 0.05)
        q.x.array[held.body.mixed.dofs["N"]] = rng.normal(size=len(held.body.mixed.dofs["N"]))
    for q in (held.v, held.dq):
        q.x.array[:] = rng.normal(size=len(q.x.array))
    tangent, centre, ends = held.tangent(kind), held.b.x.array.copy(), []
    for sign in (1, -1):
        held.b.x.array[:] = centre + sign * H * held.dq.x.array
        ends.append(held.work(kind))
    scale = max(1.0, abs(tangent), *map(abs, ends))
    assert abs((ends[0] - ends[1]) / (2 * H) - tangent) < FD * scale


def energy_of(held: Held, q: fem.Function) -> float:
    return held.value(f"energy {q.name}", lambda: strain_energy(held.body, q))


def test_work_of_a_state_is_the_derivative_of_the_energy(held, rng) -> None:
    """With compatible resultants; the multipliers of directors are zero here."""
    held.b.name = "b"
    held.randomise(held.b, rng, 0.05)
    held.satisfy(at_state(held.b), held.b)
    held.v.x.array[:] = rng.normal(size=len(held.v.x.array))
    for name in (*held.body.mixed.stresses, "lam"):
        held.v.x.array[held.body.mixed.dofs[name]] = 0.0

    def potential() -> ufl.Form:
        W = strain_energy(held.body, held.b)
        return W + tie_of_strains(held.body, held.b) if "S" in held.body.mixed.parts else W

    slope = held.value("slope", lambda: ufl.derivative(potential(), held.b, held.v))
    assert held.work("state") == pytest.approx(slope, rel=SLACK_ROUND_OFF)


@pytest.mark.parametrize("beta", [0.0, BETA])
def test_work_over_an_interval_is_the_change_of_energy(held, beta, rng) -> None:
    """Less what the jump dissipates, eqs. (33), (34); any states, held strains violated or not."""
    held.a.name, held.b.name = "a", "b"
    held.beta.value = beta
    held.randomise(held.a, rng, 0.05)
    held.randomise(held.b, rng, 0.08)
    held.satisfy(at_state(held.a), held.a)
    # forces of free strains at the end are those of the end, of held ones those of the interval
    held.satisfy(interval(held.a, held.b, held.beta), held.b)
    held.v.x.array[:] = held.b.x.array - held.a.x.array
    for name in (*held.body.mixed.stresses, "lam"):
        held.v.x.array[held.body.mixed.dofs[name]] = 0.0
    done = held.work("interval")
    change = energy_of(held, held.b) - energy_of(held, held.a)
    lost = held.value("jump", lambda: jump_energy(held.body, held.a, held.b))
    assert lost > 0
    assert done == pytest.approx(change + beta * lost, rel=SLACK_ROUND_OFF)


def test_a_rigid_motion_changes_no_energy(held, rng) -> None:
    held.b.name = "b"
    held.randomise(held.b, rng, 0.05)
    before = energy_of(held, held.b)
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    Q = Q if np.linalg.det(Q) > 0 else -Q
    mixed, X = held.body.mixed, held.body.mixed.nodes("u")
    x = X + held.part(held.b, "u").reshape(-1, 3)
    D = held.body.manifold.directors
    d = (D + held.part(held.b, "w").reshape(D.shape)).reshape(len(D), -1, 3)
    held.b.x.array[mixed.dofs["u"]] = (x @ Q.T + [0.3, -0.2, 0.9] - X).ravel()
    held.b.x.array[mixed.dofs["w"]] = ((d @ Q.T).reshape(D.shape) - D).ravel()
    assert energy_of(held, held.b) == pytest.approx(before, rel=SLACK_ROUND_OFF)
