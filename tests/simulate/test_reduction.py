"""Reduced and unreduced linear systems, rare and frequent factorisations: the same results."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.model.body import constraint_error
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    GROUND,
    AlongLine,
    Beam,
    CircularSection,
    Clamped,
    Cylindrical,
    Distance,
    Driver,
    Fixed,
    Glue,
    Gravity,
    InPlane,
    Isotropic,
    JointSpring,
    Line,
    Planar,
    PointForce,
    Prismatic,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Screw,
    Shell,
    ShellRevolute,
    Spherical,
    SymmetryPlane,
    Universal,
    Weld,
)
from shellmb.simulate.simulation import Simulation
from tests.scenes import cantilever

RUBBER = Isotropic(E=2e6, nu=0.3, thickness=0.02, density=500.0)
AXIS, ACROSS = (0.2, 1.0, 0.3), (1.0, -0.2, 0.0)
SCHEMES: list[dict[str, Any]] = [
    {"scheme": "ep"},
    {"scheme": "ed", "alpha": 0.0},
    {"scheme": "ed", "alpha": 1.0},
]
IDS = ["ep", "ed-0", "ed-1"]
STEPS = 3


# a cantilever plate that a force at an edge bends and twists
plate = partial(cantilever, (1.0, 2.0, 8.0), section=RUBBER, dt=0.02, t_end=1.0)


def symmetric(**more: Any) -> Scene:
    """Half of a cantilever plate: directors that are held in a plane."""
    given = plate(**more)
    return replace(given, supports=(*given.supports, SymmetryPlane("bottom", (0, 1, 0))))


def rods(kinds: dict[str, tuple[type[Any], dict[str, Any]]]) -> Callable[..., Scene]:
    """Of each kind of joint a rod on a spherical joint, and one that hangs from it by that kind."""

    def made(**scheme: Any) -> Scene:
        bodies: list[RigidBody] = []
        joints: list[Any] = []
        for k, (name, (kind, more)) in enumerate(kinds.items()):
            a, b, y = f"a {name}", f"b {name}", 2.0 * k
            bodies += [
                RigidBody(a, 1.0, (0.01, 0.1, 0.1), position=(0.3, y, 0)),
                RigidBody(b, 1.0, (0.1, 0.02, 0.1), position=(0.6, y - 0.3, 0.1)),
            ]
            second = {"second_at": (0.6, y - 0.1, 0.0)} if kind is Distance else {}
            joints += [
                Spherical(f"first {name}", GROUND, a, at=(0, y, 0)),
                kind(f"second {name}", a, b, at=(0.6, y, 0), **more, **second),
            ]
        parts = {"rigid_bodies": bodies, "joints": joints, "loads": Gravity((0, 1, -9.81))}
        return Scene("rods", **parts, dt=0.02, t_end=1.0, **scheme)

    return made


def driven(**scheme: Any) -> Scene:
    """A driven crank with a flexible coupler, a spring, and a plate at its end."""
    section = CircularSection(E=2e6, nu=0.3, radius=0.05, density=500.0)
    beam = Beam("coupler", Line((0.2, 0, 0), (1.0, 0, 0)), section, elements=2)
    shell = Shell("plate", Rectangle(0.6, 0.4, origin=(1.0, 0, 0)), RUBBER, mesh=(1, 1))
    return Scene(
        "driven",
        shell,
        beams=beam,
        rigid_bodies=RigidBody("crank", 0.2, (1e-4, 1e-3, 1e-3), position=(0.1, 0, 0)),
        joints=[
            Revolute("bearing", GROUND, "crank", at=(0, 0, 0), axis=(0, 1, 0)),
            Revolute("pin", "crank", "coupler", at=(0.2, 0, 0), axis=(0, 1, 0)),
            ShellRevolute("hinge", "coupler", "plate", at=(1.0, 0, 0)),
        ],
        drivers=Driver("drive", "bearing", rotation=lambda t: 3.0 * t),
        force_elements=JointSpring("spring", "pin", stiffness=0.5),
        loads=Gravity(),
        dt=0.02,
        t_end=1.0,
        **scheme,
    )


def stiffened(kind: str) -> Callable[..., Scene]:
    """A plate with a beam along its middle."""

    def made(**scheme: Any) -> Scene:
        shell = Shell("plate", Rectangle(1.0, 0.4), RUBBER, mesh=(2, 2))
        bar = RectangularSection(E=2e6, nu=0.3, width=0.02, height=0.04, density=500.0)
        beam = Beam("beam", AlongLine("plate", (0, 0.2, 0), (1, 0.2, 0)), bar)
        return Scene(
            "stiffened",
            shell,
            beams=beam,
            glues=Glue("beam", "plate", kind),
            supports=Clamped("left", body="plate"),
            loads=(PointForce("right-bottom", (0.3, 0.2, 1.0), body="plate"), Gravity()),
            dt=0.02,
            t_end=1.0,
            **scheme,
        )

    return made


def held_component(**scheme: Any) -> Scene:
    """A plate one component of whose directors is held along an edge."""
    given = plate(**scheme)
    edge = Fixed("right", director=(None, 0.0, None))
    return replace(given, supports=(*given.supports, edge))


KINDS: dict[str, tuple[type[Any], dict[str, Any]]] = {
    "spherical": (Spherical, {}),
    "revolute": (Revolute, {"axis": AXIS}),
    "universal": (Universal, {"axis": AXIS, "second_axis": ACROSS}),
    "cylindrical": (Cylindrical, {"axis": ACROSS}),
    "prismatic": (Prismatic, {"axis": AXIS}),
    "planar": (Planar, {"normal": (0.0, 0.3, 1.0)}),
    "screw": (Screw, {"axis": AXIS, "pitch": 0.4}),
    "weld": (Weld, {}),
    "distance": (Distance, {}),
    "in-plane": (InPlane, {"normal": AXIS}),
}
MOVING: dict[str, Callable[..., Scene]] = {
    "plate": plate,
    "triangles": lambda **s: plate(cell="tri", **s),
    "offset": lambda **s: plate(section=replace(RUBBER, offset=0.005), **s),
    "symmetry plane": symmetric,
    "held component": held_component,
    "mechanism": driven,
    "glue by directors": stiffened("director"),
    "glue by joints": stiffened("revolute"),
    "every joint": rods(KINDS),
    **{name: rods({name: kind}) for name, kind in KINDS.items()},
}


class Iterates:
    """The states of a simulation after every Newton iteration of some steps."""

    def __init__(self, scene: Scene, solve: str, newton: str, steps: int = STEPS) -> None:
        solver = replace(scene.solver, solve=solve, newton=newton)
        self.simulation = Simulation(replace(scene, solver=solver))
        self.iteration = self.simulation.problem.newton.iteration
        self.states: list[np.ndarray] = []
        converged = self.iteration.converged

        def record(x: Any, dx: Any) -> bool:
            self.states.append(np.array(x.array))
            return converged(x, dx)

        self.iteration.converged = record  # type: ignore[method-assign]
        for _ in range(steps):
            self.simulation.advance()

    def difference(self, other: "Iterates", number: int) -> float:
        """Between two states, relative to the scales of the parts."""
        a, b = self.states[number], other.states[number]
        return float(self.iteration.convergence.sizes(a, (a - b)[None]).max())


def same_iterates(scene: Scene, steps: int = STEPS) -> Iterates:
    full = Iterates(scene, "full", "full", steps)
    reduced = Iterates(scene, "reduced", "full", steps)
    assert reduced.iteration.linear.size < full.iteration.linear.size
    assert len(full.states) == len(reduced.states)
    # round-off times the condition number of the unreduced matrix, and far from the solution times
    # what an iteration makes of it; at the solution round-off alone
    worst = max(full.difference(reduced, k) for k in range(len(full.states)))
    assert worst < 1e-6
    assert full.difference(reduced, -1) < 1e-10
    return full


# one scheme of each runs in CI; kinds of joints by themselves are slow, and all together quick
BY = {**dict.fromkeys(KINDS, None), "every joint": "ep", "mechanism": "ep", "glue by joints": "ep"}
CASES = [
    pytest.param(
        name,
        scheme,
        id=f"{name}-{which}",
        marks=[] if BY.get(name, "ed-1") == which else pytest.mark.slow,
    )
    for name in MOVING
    for which, scheme in zip(IDS, SCHEMES, strict=True)
]


@pytest.mark.parametrize(("name", "scheme"), CASES)
def test_reduced_iterates_are_those_of_the_unreduced_system(
    name: str, scheme: dict[str, Any]
) -> None:
    scene = MOVING[name](**scheme)
    full = same_iterates(scene)
    for newton in ("auto", "modified"):
        rare = Iterates(scene, "reduced", newton)
        assert rare.iteration.factorisations < full.iteration.factorisations
        # what round-off leaves of the multipliers: the iteration leaves 1e-6 of its tolerance
        assert full.difference(rare, -1) < 1e-9


# kernels of one joint between rigid bodies are small
SMALL = min(KINDS)


@pytest.mark.parametrize("scheme", [{"scheme": "ep4"}, {"scheme": "ed3", "alpha": 0.5}])
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n == SMALL else pytest.mark.slow) for n in MOVING]
)
def test_schemes_quadratic_in_time_have_the_same_solution(
    name: str, scheme: dict[str, Any]
) -> None:
    scene = MOVING[name](**scheme)
    full, reduced = (Iterates(scene, solve, "full") for solve in ("full", "reduced"))
    assert reduced.iteration.linear.size < full.iteration.linear.size
    # what both leave of the last iteration
    assert full.difference(reduced, -1) < 1e-9


@pytest.mark.parametrize("scheme", ["static", "linear-statics"])
def test_statics(scheme: str) -> None:
    for scene in (plate(scheme=scheme), symmetric(scheme=scheme), plate(scheme=scheme, degree=3)):
        same_iterates(replace(scene, dt=1.0, t_end=1.0), 1)


def test_auto_keeps_the_energy_law_and_factorises_rarely() -> None:
    scene = replace(plate(scheme="ep"), dt=5e-3, t_end=0.5)
    energy = EnergyAccount()
    simulation = Simulation(scene)
    simulation.run([energy])
    assert energy.relative_error is not None
    # round-off of 100 steps, as with a factorisation in each iteration
    assert energy.relative_error < 1e-12
    iteration = simulation.problem.newton.iteration
    assert iteration.factorisations < 0.5 * simulation.step


def test_lengths_and_angles_are_exact_after_any_iteration() -> None:
    scene = driven(scheme="ep")
    simulation = Simulation(replace(scene, solver=replace(scene.solver, newton="full")))
    for _ in range(3):
        simulation.advance()
        for body in simulation.model.bodies:
            if body.manifold.directors is not None:
                state = simulation.problem.levels[body.name].q
                # a few units of round-off: no tolerance of an iteration enters
                assert constraint_error(body, state) < 3e-15


def test_a_scene_gives_the_same_numbers_whenever_it_is_built() -> None:
    """The pattern of the matrix is found at states drawn in the order of the forms."""
    a, b = (Iterates(driven(scheme="ep"), "reduced", "auto") for _ in range(2))
    assert len(a.states) == len(b.states)
    assert np.array_equal(a.states[-1], b.states[-1])
