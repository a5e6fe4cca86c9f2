"""Each law is written once: a factor in it changes motion, energy and report alike.

Factors are Constants where they may be, so that all of them share kernels. That the account stays
closed says that forces and energy have the same factor; that motion and report change says that
nobody reads another formula.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pytest
import ufl
from dolfinx import fem
from ufl.core.expr import Expr
from ufl.domain import extract_unique_domain

from shellmb.forms import beam, contact, frame, shell
from shellmb.forms.constraints import joints
from shellmb.forms.steps import potentials
from shellmb.model.body import constraint_error
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    GROUND,
    Beam,
    Clamped,
    Contact,
    Distance,
    EdgeForce,
    InitialVelocity,
    Isotropic,
    Line,
    Plane,
    PointForce,
    Rectangle,
    RectangularSection,
    RigidBody,
    Scene,
    Shell,
    Spring,
)
from shellmb.simulate.simulation import Simulation

# ten times the largest error that any of these runs had, 1e-13
CLOSED = 1e-12
# what a factor of 1.3 changes is far above round-off, of unknowns of order one
CHANGED = 1e-9
SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0)


def soft_plate(scheme: str, mesh: tuple[int, int] = (1, 1)) -> Scene:
    """A clamped plate whose edge is pulled, bent and twisted; all its strains matter."""
    plate = Shell("body", Rectangle(1.0, 0.5), SOFT, mesh=mesh)
    force = EdgeForce("top", (0.03, 0.02, 0.05))
    return Scene("soft", plate, supports=Clamped("left"), loads=force, **in_steps(scheme))


def soft_beam(scheme: str) -> Scene:
    """A clamped beam whose end is pulled, bent about both axes and, by that, twisted."""
    section = RectangularSection(E=1.0, nu=0.3, width=0.3, height=0.2, density=1.0)
    rod = Beam("body", Line((0, 0, 0), (1, 0, 0)), section, elements=2)
    force = PointForce("end", (2e-3, 1e-3, 2e-3))
    return Scene("soft", beams=rod, supports=Clamped("start"), loads=force, **in_steps(scheme))


def in_steps(scheme: str) -> dict[str, Any]:
    return {"scheme": scheme, "dt": 0.2, "t_end": 0.8, "alpha": 0.0}


class Found(NamedTuple):
    """What a run ended with.

    Args:
        motion: State.
        energy: Kinetic and strain energy.
        report: Resultants at the end, or momenta.
        error: Of the energy account.
    """

    motion: np.ndarray
    energy: np.ndarray
    report: np.ndarray
    error: float


def found(scene: Scene, report: Callable[[Any, fem.Function, fem.Function], Expr]) -> Found:
    """Run a scene; `report` is a density of its only body at a state with its velocity."""
    simulation, account = Simulation(scene), EnergyAccount()
    simulation.run([account])
    (body,) = (b for b in simulation.model.bodies if b.name == "body")
    levels = simulation.problem.levels["body"]
    dofs = np.concatenate([body.mixed.dofs[p] for p in ("u", "w")])
    read = fem.form(report(body, levels.q, levels.rates["v"]))
    energy = [account.values[name] for name in ("kinetic_energy", "strain_energy")]
    return Found(
        levels.q.x.array[dofs],
        np.array(energy),
        np.array(fem.assemble_scalar(read)),
        account.relative_error,
    )


def resultants(body: Any, q: fem.Function, v: fem.Function) -> Expr:
    """Squares of strains and resultants."""
    e, N = body.strain.value(q), body.resultants(q)
    return (ufl.dot(e, e) + ufl.dot(N, N)) * body.rules.full


def momenta(body: Any, q: fem.Function, v: fem.Function) -> Expr:
    """Angular momentum about an axis."""
    return body.angular_momentum(q, v, ufl.as_vector([0.1, 0.7, 0.3]))


class Factors:
    """Constants on the components that functions return.

    Args:
        patch: What puts them there.
        functions: Modules, names and numbers of components.
    """

    def __init__(self, patch: pytest.MonkeyPatch, *functions: tuple[Any, str, int]) -> None:
        self.values = {(name, k): 1.0 for _, name, n in functions for k in range(n)}
        self._constants: dict[tuple[int, str, int], fem.Constant] = {}
        for module, name, count in functions:
            written = getattr(module, name)
            patch.setattr(module, name, partial(self._weighed, name, count, written))

    def _weighed(self, name: str, count: int, written: Callable[..., Any], *args: Any) -> Any:
        value = written(*args)
        if isinstance(value, tuple | list):
            return type(value)(self._times(name, k, part) for k, part in enumerate(value))
        if not value.ufl_shape:
            return self._times(name, 0, value)
        return ufl.as_vector([self._times(name, k, value[k]) for k in range(count)])

    def _times(self, name: str, k: int, part: Any) -> Any:
        if isinstance(part, tuple):
            return tuple(self._times(name, k, each) for each in part)
        domain = extract_unique_domain(part)
        if domain is None:
            return part  # zeros, or what is said without a mesh
        key = (id(domain), name, k)
        if key not in self._constants:
            self._constants[key] = fem.Constant(domain, self.values[name, k])
        return self._constants[key] * part


STRAINS = {
    "shell": (soft_plate, [(shell, "membrane_strain", 3), (shell, "bending_strain", 3)]),
    "beam": (soft_beam, [(beam, "axial_strain", 1), (beam, "shear_strains", 2)]),
}
STRAINS["shell"][1].append((shell, "shear_strain", 2))
STRAINS["beam"][1].append((beam, "curvatures", 3))


@pytest.mark.parametrize(
    ("kind", "scheme"),
    [
        ("shell", "ep"),
        ("shell", "ep4"),
        ("beam", "ep"),
        pytest.param("beam", "ep4", marks=pytest.mark.slow),
    ],
)
def test_strains(kind: str, scheme: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make, functions = STRAINS[kind]
    agree_in(Factors(monkeypatch, *functions), make(scheme), resultants)


def agree_in(factors: Factors, scene: Scene, report: Callable[..., Expr]) -> None:
    """Each factor changes motion, energies and report, and the account stays closed."""
    before = found(scene, report)
    assert before.error < CLOSED
    for key in factors.values:
        factors.values[key] = 1.3
        after = found(scene, report)
        factors.values[key] = 1.0
        assert after.error < CLOSED, key
        for what in ("motion", "energy", "report"):
            old, new = getattr(before, what), getattr(after, what)
            assert np.max(np.abs(new - old)) > CHANGED * np.max(np.abs(old)), (key, what)


@pytest.mark.parametrize(
    ("make", "module"), [(soft_plate, shell), (soft_beam, frame)], ids=["shell", "frame"]
)
def test_inertia(make: Any, module: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    agree_in(Factors(monkeypatch, (module, "momenta", 2)), make("ed"), momenta)


def longer(written: Callable[[Expr, Expr], Expr]) -> Callable[[Expr, Expr], Expr]:
    """Constraints of directors whose part that is quadratic in the changes has a factor."""

    def changed(w: Expr, D: Expr) -> Expr:
        return written(w, D) + (written(w, D) + written(-w, D)) / 20

    return changed


@pytest.mark.parametrize(
    ("make", "scheme", "module", "name"),
    [
        (soft_plate, "ed", shell, "director_constraint"),
        (soft_beam, "ep4", frame, "orthonormality"),
    ],
    ids=["shell", "frame"],
)
def test_directors(
    make: Any, scheme: str, module: Any, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nodes are not eliminated as unit directors then, and not reported as such."""
    before = found(make(scheme), resultants)
    monkeypatch.setattr(module, name, longer(getattr(module, name)))
    account = EnergyAccount()
    simulation = Simulation(make(scheme))
    simulation.run([account])
    (body,) = (b for b in simulation.model.bodies if b.name == "body")
    q = simulation.problem.levels["body"].q
    assert account.relative_error < CLOSED
    assert constraint_error(body, q) < 1e-11
    new = np.concatenate([q.x.array[body.mixed.dofs[p]] for p in ("u", "w")])
    assert np.max(np.abs(new - before.motion)) > CHANGED * np.max(np.abs(before.motion))


@pytest.mark.parametrize("scheme", ["ep", "ed3"])
def test_joints(scheme: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A length that counts one direction more than others holds a body on an ellipsoid."""

    def pendulum() -> Scene:
        bob = RigidBody("body", 1.0, (0.1, 0.2, 0.3), position=(1.0, 0.0, 0.0))
        rod = Distance("rod", GROUND, "body", at=(0.0, 0.0, 0.0), second_at=(1.0, 0.0, 0.0))
        start = InitialVelocity(linear=(0.0, 0.5, 1.0), spin=(0.3, 0.0, 0.2))
        return Scene("pendulum", rigid_bodies=bob, joints=rod, initial=start, **in_steps(scheme))

    def run() -> tuple[np.ndarray, float]:
        simulation, account = Simulation(pendulum()), EnergyAccount()
        simulation.run([account])
        body = simulation.model.bodies[0]
        q = simulation.problem.levels[body.name].q.x.array
        return q[body.mixed.dofs["u"]].copy(), account.relative_error

    before, _ = run()
    gap = joints._gap

    def weighed(a: joints.Place, b: joints.Place) -> Expr:
        d = gap(a, b)
        return ufl.as_vector([d[0], d[1], 1.2 * d[2]])

    monkeypatch.setattr(joints, "_gap", weighed)
    after, error = run()
    assert error < CLOSED
    assert np.max(np.abs(after - before)) > 1e-3
    # it has gone as far as the length as written allows
    x, y, z = after.reshape(-1, 3)[0] + (1.0, 0.0, 0.0)
    assert x**2 + y**2 + 1.44 * z**2 == pytest.approx(1.0, abs=1e-11)


def bouncing(scheme: str, contact: float = 1.0, spring: float = 1.0) -> Scene:
    """A body that skids into a damped, rough plane on a spring; stiffnesses by factors."""
    body = RigidBody("body", 1.0, (0.1, 0.1, 0.1))
    rough: dict[str, Any] = {"friction": 0.3, "slip_speed": 0.01, "smoothing": 0.02}
    floor = Contact("floor", Plane(), 40.0 * contact, relative_damping=0.5, **rough)
    held: dict[str, Any] = {"at": (0.5, 0.0, 1.0), "second_at": (0.0, 0.0, 0.0), "length": 1.0}
    tied = Spring("tied", GROUND, "body", stiffness=10.0 * spring, **held)
    start = InitialVelocity(linear=(0.4, 0.0, -1.0))
    return Scene(
        "bouncing",
        rigid_bodies=body,
        contacts=floor,
        force_elements=tied,
        initial=start,
        **in_steps(scheme) | {"dt": 0.05, "alpha": 0.5},
    )


@pytest.mark.parametrize("scheme", ["ed", pytest.param("ed3", marks=pytest.mark.slow)])
def test_energies_of_contacts_and_springs(scheme: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forces, their damping and friction, dissipation and report have the factor of the energy."""

    def run(**factors: float) -> np.ndarray:
        simulation, account = Simulation(bouncing(scheme, **factors)), EnergyAccount()
        simulation.run([account])
        assert account.relative_error < CLOSED
        body = simulation.model.bodies[0]
        q = simulation.problem.levels[body.name].q.x.array
        energies = [account.values[k] for k in ("strain_energy", "potential_energy", "dissipation")]
        return np.array([*q[body.mixed.dofs["u"]].ravel(), *energies])

    before = run()
    for name, module, energy in (
        ("contact", contact, "energy"),
        ("spring", potentials, "linear_potential"),
    ):
        stiffer = run(**{name: 1.5})
        written = getattr(module, energy)
        with monkeypatch.context() as patch:
            patch.setattr(module, energy, weighed(written))
            after = run()
        # ten times the worst that was seen, 6e-15 of the contact in ED
        scale = np.max(np.abs(before))
        assert np.max(np.abs(stiffer - before)) > 1e-3 * scale, name
        assert np.max(np.abs(after - stiffer)) < 1e-13 * scale, name


def weighed(written: Callable[..., Any]) -> Callable[..., Any]:
    """An energy, or what makes one, by half more."""

    def energy(*args: Any) -> Any:
        value = written(*args)
        return 1.5 * value if isinstance(value, Expr) else (lambda e: 1.5 * value(e))

    return energy
