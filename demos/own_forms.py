"""Own weak forms: a strain energy, a strain measure, a force, a time scheme in one script.

Choose with `--set experiment=energy|strain|force|scheme`. Nothing in the package is changed for
any of them, and every command and observer works: the energy account shows the work of the added
force, and that the textbook time scheme below keeps no energy law.

energy
    A rubber strip (incompressible neo-Hookean, integrated through the thickness) is stretched to
    twice its length. Exact: force per width `mu h (l - 1/l^2)`, stretch `l`.
strain
    Only the membrane strain is replaced, by the linear one. A strip pulled by `0.3 E h` then
    stretches by exactly 30 %; with the Green-Lagrange strain of the paper it would be 22.1 %.
force
    Air drag `-c v` is added to the weak form. A flying plate slows down by exactly
    `(1 - c dt/2m)/(1 + c dt/2m)` in every EP step, and the account books the lost energy as work
    of the added term.
scheme
    Newmark's average acceleration as a scheme of its own: unconditionally stable in linear
    problems, but without an
    energy law in nonlinear ones. A cantilever plate under a smooth load shows both.
"""

# KIND: forms of your own
# CI: shellmb run own_forms --set experiment=energy --check --no-pictures --out runs/ci-own-energy
# CI: shellmb run own_forms --set experiment=strain --check --no-pictures --out runs/ci-own-strain
# CI: shellmb run own_forms --set experiment=force --check --no-pictures --out runs/ci-own-force
# CI: shellmb run own_forms --set experiment=scheme --check --no-pictures --out runs/ci-own-scheme

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shellmb.scene import (
    Clamped,
    EdgeForce,
    Fixed,
    Hyperelastic,
    InitialVelocity,
    Isotropic,
    Probe,
    Rectangle,
    Scene,
    Shell,
    SymmetryPlane,
)

LENGTH, WIDTH = 1.0, 0.25
MU, RUBBER_THICKNESS, STRETCH = 0.4e6, 1e-3, 2.0
PULL = 0.3
DRAG, SPEED = 5.0, 2.0
STEEL = {"E": 210e9, "nu": 0.0, "thickness": 2e-3, "density": 7870.0}


# --- a strain energy -------------------------------------------------------------------------
def rubber_energy(strains: Any, p: Mapping[str, Any]) -> Any:
    """Incompressible neo-Hookean energy per area, two Gauss points through the thickness."""
    total = 0
    for z in (-0.5 / 3**0.5, 0.5 / 3**0.5):
        e = strains.eps + z * p["h"] * strains.kap
        c11, c22, c12 = 1 + 2 * e[0], 1 + 2 * e[1], e[2]
        # det C = 1 + a + b, and tr C - 3 without differences of ones, which drown small strains
        a, b = 2 * (e[0] + e[1]), 4 * e[0] * e[1] - c12**2
        det = 1 + a + b
        g1, g2 = strains.gam[0], strains.gam[1]
        shear = (c22 * g1**2 - 2 * c12 * g1 * g2 + c11 * g2**2) / det
        total += p["mu"] / 2 * ((a * (a + b) - b) / det + 5 / 6 * shear)
    return p["h"] / 2 * total


# --- a strain measure ------------------------------------------------------------------------
def linear_membrane_strains(u: Any, w: Any, surf: Any) -> Any:
    """The strains of the paper, with the linear membrane strain in place of Green-Lagrange's."""
    import ufl

    from shellmb.forms.shell import along, shell_strains

    u1, u2 = along(u, surf.e1), along(u, surf.e2)
    eps = ufl.as_vector(
        [
            ufl.dot(surf.e1, u1),
            ufl.dot(surf.e2, u2),
            ufl.dot(surf.e1, u2) + ufl.dot(surf.e2, u1),
        ]
    )
    return shell_strains(u, w, surf)._replace(eps=eps)


# --- a force in the weak form ----------------------------------------------------------------
def air_drag(point: Any) -> Any:
    """Virtual work per area of a drag `-c v`."""
    import ufl

    return -DRAG * ufl.dot(point.v, point.du)


# --- a time scheme ---------------------------------------------------------------------------
@dataclass(frozen=True)
class Newmark:
    """Newmark's average acceleration (beta = 1/4, gamma = 1/2), forces at the end of the step."""

    name: str = "newmark"
    title: str = "Newmark, average acceleration"
    order: int = 2
    dynamic: bool = True
    stages: tuple[str, ...] = ("f",)
    rates: tuple[str, ...] = ("v", "a")
    conserves: frozenset[str] = frozenset()
    linear: bool = False
    jumps: bool = False

    @property
    def rotations(self) -> Any:
        """Rotations of positions that are linear in a step."""
        from shellmb.schemes.base import LINEAR_PATH

        return LINEAR_PATH

    def expand(self, levels: Any, dt: Any) -> dict[str, Any]:
        """Acceleration at the end from the displacement at the end."""
        from shellmb.schemes.base import Stage, at_state

        q, v, a = levels.q, levels.rates["v"], levels.rates["a"]
        qf = levels.unknown["f"]
        acceleration = 4 * (qf - q - dt * v) / dt**2 - a
        return {"f": Stage(at_state(qf), rate=acceleration, velocity=(qf - q) / dt)}

    def load_weight(self, stage: str, tau: float) -> float:
        """Extrapolates the Gauss points to the end of the step (exact for linear loads)."""
        return 1.0 + 6.0 * (tau - 0.5)

    def prescribed(self, stage: str, motion: Any, t: float, dt: float, rates: Any) -> Any:
        """The motion at the end of the step."""
        return motion(t + dt)

    def advance(self, q: Any, rates: Any, unknown: Any, dt: float, tangent: Any) -> dict[str, Any]:
        """Velocity and acceleration at the end."""
        a = 4 * (unknown["f"] - q - dt * rates["v"]) / dt**2 - rates["a"]
        return {"v": rates["v"] + dt / 2 * (rates["a"] + a), "a": a}

    def moved(self, q: Any, push: Any, unknown: Mapping[str, Any]) -> dict[str, Any]:
        """Step, on which forces work in the energy account."""
        return {"f": unknown["f"] - q}

    def dissipation(self) -> tuple[float, str | None]:
        """No law of dissipation."""
        return 0.0, None


def rise(t: float) -> float:
    """Smooth rise from 0 to 1 within 0.1 s."""
    return float(np.sin(np.pi / 2 * min(t / 0.1, 1.0)) ** 2)


Experiment = Literal["energy", "strain", "force", "scheme"]


def scene(experiment: Experiment = "energy") -> Scene:
    """One of the experiments.

    Args:
        experiment: energy, strain, force or scheme.
    """
    surface = Rectangle(LENGTH, WIDTH)
    corner = (LENGTH, 0.0, 0.0)
    tip = Probe("tip", corner, component=0)
    straight = (
        SymmetryPlane("left", (1, 0, 0)),
        SymmetryPlane("bottom", (0, 1, 0)),
        Fixed("left", displacement=(None, None, 0.0)),
    )
    steel = Isotropic(**STEEL)
    if experiment == "energy":
        force = MU * RUBBER_THICKNESS * (STRETCH - 1 / STRETCH**2)
        rubber = Hyperelastic(
            rubber_energy,
            {"mu": MU, "h": RUBBER_THICKNESS},
            thickness=RUBBER_THICKNESS,
            density=1000.0,
            stiffness=3 * MU * RUBBER_THICKNESS,
        )
        return Scene(
            "own_forms",
            Shell("strip", surface, rubber, mesh=(4, 1)),
            supports=straight,
            loads=EdgeForce("right", (force, 0, 0)),
            probes=tip,
            scheme="static",
            dt=0.25,
            units="m, kg, s",
        )
    if experiment == "strain":
        force = PULL * steel.E * steel.thickness
        return Scene(
            "own_forms",
            Shell("strip", surface, steel, mesh=(4, 1), strains=linear_membrane_strains),
            supports=straight,
            loads=EdgeForce("right", (force, 0, 0)),
            probes=tip,
            scheme="static",
            dt=0.25,
            units="m, kg, s",
        )
    if experiment == "force":
        return Scene(
            "own_forms",
            Shell("plate", surface, steel, mesh=(4, 1), terms=(air_drag,)),
            initial=InitialVelocity(linear=(0, 0, SPEED)),
            probes=Probe("speed", corner, quantity="velocity", component=2),
            scheme="ep",
            dt=0.05,
            t_end=2.0,
            units="m, kg, s",
        )
    return Scene(
        "own_forms",
        Shell("plate", surface, steel, mesh=(4, 1)),
        supports=Clamped("left"),
        loads=EdgeForce("right", (0, 0, 200.0), time=rise),
        probes=Probe("tip", corner, component=2),
        scheme=Newmark(),
        dt=2e-3,
        t_end=0.4,
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Measure the experiment's value beside the exact one."""
    history = run.history
    if "speed" in history:
        mass = STEEL["density"] * STEEL["thickness"]
        ratio = (1 - DRAG * 0.05 / 2 / mass) / (1 + DRAG * 0.05 / 2 / mass)
        steps = run.simulation.step
        lost = history["total_energy"].iloc[-1] - history["total_energy"].iloc[0]
        booked = history["work_terms"].iloc[-1] - history["work_terms"].iloc[0]
        return {
            "speed": float(history["speed"].iloc[-1]),
            "exact_speed": SPEED * ratio**steps,
            "work_of_drag_over_energy_change": float(booked / lost),
        }
    tip = float(history["tip"].iloc[-1])
    if run.simulation.scheme.name == "newmark":
        energy = run.summary["energy_balance_error"]
        return {"largest_tip": float(history["tip"].max()), "energy_balance_error": float(energy)}
    return {"stretch": 1 + tip / LENGTH}


def check(results: dict[str, float]) -> None:
    """Exact values where there are any."""
    if "exact_speed" in results:
        assert abs(results["speed"] / results["exact_speed"] - 1) < 1e-9
        assert abs(results["work_of_drag_over_energy_change"] - 1) < 1e-9
    elif "energy_balance_error" in results:
        assert results["energy_balance_error"] > 1e-6, "this scheme should have no energy law"
    else:
        exact = (STRETCH, 1 + PULL)
        assert min(abs(results["stretch"] / value - 1) for value in exact) < 1e-6
