"""Schemes of a user's own whose forces act within the step: those of the textbooks.

The kind: one unknown state, forces at any state between both ends, rates of any name. Orders at
half the step, the exact amplification on an oscillator, and each other's motions decide.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.schemes.base import Stage, at_state
from shellmb.schemes.registry import completed


@dataclass(frozen=True)
class ChungHulbert:
    """Generalised-alpha of 1993: accelerations at 1 - m of the step, forces at 1 - f of it.

    With m = 0 that of Hilber, Hughes and Taylor, with m = f = 1/2 the mid-point rule.
    """

    m: float
    f: float
    name: str = "alpha"
    title: str = "forces within the step"
    order: int = 2
    dynamic: bool = True
    stages: tuple[str, ...] = ("f",)
    # by no name that anything knows
    rates: tuple[str, ...] = ("v", "vdot")
    conserves: frozenset[str] = frozenset()

    def end(self, q: Any, rates: Mapping[str, Any], qf: Any, dt: Any) -> tuple[Any, Any]:
        gamma = 0.5 - self.m + self.f
        beta = (gamma + 0.5) ** 2 / 4
        v, a = rates["v"], rates["vdot"]
        af = ((qf - q - dt * v) / dt**2 - (0.5 - beta) * a) / beta
        return v + dt * ((1 - gamma) * a + gamma * af), af

    def expand(self, levels: Any, dt: Any) -> dict[str, Stage]:
        qf, v, a = levels.unknown["f"], levels.rates["v"], levels.rates["vdot"]
        vf, af = self.end(levels.q, levels.rates, qf, dt)
        rate = (1 - self.m) * af + self.m * a
        velocity = (1 - self.f) * vf + self.f * v
        return {"f": Stage(at_state(qf), rate=rate, velocity=velocity, share=1 - self.f)}

    def advance(self, q: Any, rates: Any, unknown: Any, dt: float, tangent: Any) -> dict[str, Any]:
        return dict(zip(self.rates, self.end(q, rates, unknown["f"], dt), strict=True))


@dataclass(frozen=True)
class MidPoint:
    """Implicit mid-point rule: one rate, forces half-way."""

    name: str = "mid-point"
    title: str = "implicit mid-point rule"
    order: int = 2
    dynamic: bool = True
    stages: tuple[str, ...] = ("f",)
    rates: tuple[str, ...] = ("v",)
    conserves: frozenset[str] = frozenset()

    def expand(self, levels: Any, dt: Any) -> dict[str, Stage]:
        chord = (levels.unknown["f"] - levels.q) / dt
        rate = 2 * (chord - levels.rates["v"]) / dt
        return {"f": Stage(at_state(levels.unknown["f"]), rate=rate, velocity=chord, share=0.5)}

    def advance(self, q: Any, rates: Any, unknown: Any, dt: float, tangent: Any) -> dict[str, Any]:
        return {"v": 2 * (unknown["f"] - q) / dt - rates["v"]}


RHO = 0.8
OPTIMAL = ChungHulbert((2 * RHO - 1) / (RHO + 1), RHO / (RHO + 1))
SCHEMES: dict[str, Any] = {
    "chung-hulbert": OPTIMAL,
    "hht": ChungHulbert(0.0, 0.1),
    "mid-point": MidPoint(),
}


def swing(scheme: Any, dt: float) -> np.ndarray:
    """A double pendulum with a spring in its joint: places at four times."""
    bodies = [
        sm.RigidBody(n, 1.0, (0.01, 0.02, 0.03), position=(x, 0, 0))
        for n, x in zip("ab", (0.5, 1.5), strict=True)
    ]
    joints = [
        sm.Revolute("h", sm.GROUND, "a", at=(0, 0, 0), axis=(0, 1, 0)),
        sm.Revolute("k", "a", "b", at=(1, 0, 0), axis=(0, 1, 0)),
    ]
    made = sm.Scene(
        "swing",
        rigid_bodies=bodies,
        joints=joints,
        force_elements=sm.JointSpring("s", "k", stiffness=5.0),
        loads=sm.Gravity((0, 0, -9.81), time=lambda t: 1 + t),
        probes=[sm.Probe(f"x{k}", "center", component=k, body="b") for k in (0, 2)],
        scheme=scheme,
        dt=dt,
        t_end=0.32,
    )
    run = sm.run(made, pictures=False)
    return run.history[["x0", "x2"]].to_numpy()[:: round(0.08 / dt)]


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    return swing("ep4", 0.01)


@pytest.fixture(scope="module")
def of_ep(exact: np.ndarray) -> float:
    """How far EP is off, at most."""
    return np.abs(swing("ep", 0.01) - exact).max()


@pytest.mark.parametrize("name", SCHEMES)
def test_orders_in_a_mechanism(name: str, exact: np.ndarray, of_ep: float) -> None:
    """Loads over time and forces at the same state: of second order from the first step on."""
    errors = [np.abs(swing(SCHEMES[name], dt) - exact).max() for dt in (0.02, 0.01)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.15)
    # EP is as good
    assert errors[1] < 4 * of_ep


def test_a_half_and_a_half_are_the_mid_point() -> None:
    assert swing(ChungHulbert(0.5, 0.5), 0.02) == pytest.approx(swing(MidPoint(), 0.02), abs=1e-10)


def test_dataclasses_may_have_slots() -> None:
    """Kind: an object whose members are in no dictionary."""
    slotted = dataclass(frozen=True, slots=True)(type("Slotted", (MidPoint,), {}))()
    swung = [sm.run(replace(hung(s), t_end=0.02)).history for s in (slotted, MidPoint())]
    np.testing.assert_array_equal(*(h["total_energy"] for h in swung))


def test_members_in_slots_and_elsewhere_are_kept() -> None:
    """Kind: classes whose slot is one name, or has no value yet."""
    one = type("One", (MidPoint,), {"__slots__": "gain"})
    made = type("More", (one,), {"__slots__": ("later",)})()
    object.__setattr__(made, "gain", 0.5)
    assert completed(made).gain == 0.5  # type: ignore[attr-defined]


def strip(scheme: Any, dt: float, force: float = 1e-5) -> sm.Run:
    """A strip that a load bends from the first instant on, with small displacements."""
    rubber = sm.Isotropic(E=1e7, nu=0.3, thickness=5e-3, density=1000)
    made = sm.Scene(
        "strip",
        sm.Shell("strip", sm.Rectangle(0.3, 0.05), rubber, mesh=(2, 1)),
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", (0, 0, force)),
        probes=sm.Probe("tip", "right-top", component=2),
        scheme=scheme,
        dt=dt,
        t_end=10 * dt,
    )
    return sm.run(made, pictures=False)


def test_shells_move_as_by_the_mid_point_of_linear_dynamics() -> None:
    """Small displacements are linear: the mid-point rule and EP are one there, to the loads."""
    found, linear = (strip(s, 4e-3).history["tip"] for s in (MidPoint(), "linear-dynamics"))
    assert found.to_numpy() == pytest.approx(
        linear.to_numpy(), abs=1e-6 * np.abs(linear.to_numpy()).max()
    )


def test_what_no_share_is_is_refused() -> None:
    @dataclass(frozen=True)
    class Early(MidPoint):
        def expand(self, levels: Any, dt: Any) -> dict[str, Stage]:
            (stage,) = super().expand(levels, dt).values()
            return {"f": Stage(stage.span, stage.rate, stage.velocity, share=0.2)}

    with pytest.raises(sm.SceneError, match=r"share of a stage is 0\.2; it must be between 0\.5"):
        strip(Early(), 1e-2)


@dataclass(frozen=True)
class Bathe:
    """The trapezoidal rule to the middle of a step, and BDF2 from there to its end."""

    name: str = "bathe"
    title: str = "composite scheme"
    order: int = 2
    dynamic: bool = True
    stages: tuple[str, ...] = ("m", "f")
    rates: tuple[str, ...] = ("v", "a")
    conserves: frozenset[str] = frozenset()

    def ends(self, q: Any, rates: Any, qm: Any, qf: Any, dt: Any) -> tuple[Any, ...]:
        vm = 4 * (qm - q) / dt - rates["v"]
        vf = (q - 4 * qm + 3 * qf) / dt
        middle = vm, 4 * (vm - rates["v"]) / dt - rates["a"]
        return *middle, vf, (rates["v"] - 4 * vm + 3 * vf) / dt

    def expand(self, levels: Any, dt: Any) -> dict[str, Stage]:
        qm, qf = levels.unknown["m"], levels.unknown["f"]
        vm, am, vf, af = self.ends(levels.q, levels.rates, qm, qf, dt)
        return {
            "m": Stage(at_state(qm), rate=am, velocity=vm),
            "f": Stage(at_state(qf), rate=af, velocity=vf),
        }

    def advance(self, q: Any, rates: Any, unknown: Any, dt: float, tangent: Any) -> dict[str, Any]:
        *_, vf, af = self.ends(q, rates, unknown["m"], unknown["f"], dt)
        return {"v": vf, "a": af}


class Composite(Bathe):
    """With what a state in between needs."""

    def moved(self, q: Any, scaled: Any, unknown: Any) -> dict[str, Any]:
        return {name: unknown[name] - q for name in self.stages}

    def prescribed(self, stage: str, motion: Any, t: float, dt: float, rates: Any) -> Any:
        return motion(t + dt / 2 if stage == "m" else t + dt)

    def load_weight(self, stage: str, tau: float) -> float:
        return 1.0


def test_states_in_between_need_more_than_the_defaults() -> None:
    with pytest.raises(sm.SceneError, match=r"'m', 'f'; it must also define 'moved', 'prescribed'"):
        swing(Bathe(), 0.02)


def own(**members: Any) -> Any:
    """The mid-point rule with other members; without those that are None."""
    names = ("name", "title", "order", "dynamic", "stages", "rates", "conserves")
    whole = {n: getattr(MidPoint, n) for n in (*names, "expand", "advance")} | members
    return type("Own", (), {n: v for n, v in whole.items() if v is not None})()


def stage(**other: Any) -> Any:
    """A function `expand` whose stage has something else."""

    def expand(self: Any, levels: Any, dt: Any) -> dict[str, Stage]:
        return {"f": replace(MidPoint.expand(self, levels, dt)["f"], **other)}

    return expand


MUST = ("title", "order", "dynamic", "stages", "rates", "conserves", "expand", "advance")
WRONG: list[tuple[dict[str, Any], str]] = [
    *(({name: None}, f"{name} is missing") for name in MUST),
    ({"forms": lambda self, *given: {}}, "'forms', which nothing reads"),
    ({"name": "ep4"}, "a bundled scheme has this name"),
    ({"stages": "f"}, "stages is 'f'"),
    ({"stages": ("m",)}, "one of them must be 'f'"),
    ({"rates": ()}, "one of them must be 'v'"),
    ({"rates": ("v", "q")}, "and none 'q'"),
    ({"conserves": "angular momentum"}, "conserves is 'angular momentum'"),
    ({"conserves": {"energi"}}, "conserves"),
    ({"accelerations": ("w",)}, "names of rates"),
    (
        {"expand": lambda self, *given: None},
        "expand returns None; it must return a dict",
    ),
    ({"expand": lambda self, *given: {"f": 1.0}}, "for each of 'f'"),
    ({"expand": stage(velocity=None)}, "with rate and velocity"),
    (
        {"advance": lambda self, *given: {}},
        "advance returns {}; it must return",
    ),
    ({"advance": lambda self, *given: {"v": 0.0}}, "of the shape of q"),
]


@pytest.mark.parametrize(("members", "said"), WRONG, ids=[said for _, said in WRONG])
def test_what_a_scheme_has_to_say_is_asked_for(members: dict[str, Any], said: str) -> None:
    """Kind: members that are missing, no such things, or read by nobody; what is returned."""
    with pytest.raises(sm.SceneError, match=said):
        sm.run(replace(hung(own()), scheme=own(**members), t_end=0.02), pictures=False)


@pytest.mark.parametrize("member", ["expand", "advance", "dissipation"])
@pytest.mark.parametrize("error", [KeyError("gain"), ValueError("no such rate"), SystemExit(3)])
def test_what_its_functions_raise_is_told_with_their_names(
    member: str, error: BaseException
) -> None:
    """Kind: an error within a user's function of a scheme, of whatever type."""

    def fails(self: Any, *given: Any) -> Any:
        raise error

    scheme = own(**{member: fails})
    place, who = r"test_own_schemes.py, line \d+", f"scheme '{scheme.name}'"
    said = rf"{place}: {who}: {member} fails \(.*{error.args[0]}"
    with pytest.raises(sm.SceneError, match=said):
        sm.run(replace(hung(own()), scheme=scheme, t_end=0.02), pictures=False)


OTHERS = (MidPoint(), ChungHulbert(0.0, 0.1), Composite(), "generalized-alpha")


@pytest.mark.parametrize("scheme", OTHERS, ids=lambda s: getattr(s, "name", s))
def test_dampers_see_the_velocity_of_what_they_are_at(scheme: Any) -> None:
    """A spinning wheel on a damper, and a driven motor: closed forms, of second order.

    The kind: forces that depend on velocities, of bodies that have none of their own.
    """
    inertia, c, spin, times = 0.2, 0.8, 3.0, np.linspace(0.1, 0.4, 4)

    def angle(dt: float) -> np.ndarray:
        wheel = sm.Scene(
            "wheel",
            rigid_bodies=sm.RigidBody("wheel", 1.0, (0.1, inertia, 0.1)),
            joints=sm.Revolute("axle", sm.GROUND, "wheel", at=(0, 0, 0), axis=(0, 1, 0)),
            force_elements=[
                sm.JointDamper("damper", "axle", damping=c / 2),
                sm.Motor("brake", "axle", lambda x, rate, t: 1.5 * t - c / 2 * rate),
            ],
            initial=sm.InitialVelocity(spin=(0, spin, 0)),
            scheme=scheme,
            dt=dt,
            t_end=0.4,
        )
        history = sm.run(wheel, progress=False).history
        return np.interp(times, history["t"], history["axle.rotation"])

    # inertia x'' + c x' = 1.5 t
    decay, slope = np.exp(-c * times / inertia), 1.5 / c
    late = -slope * inertia / c
    right = (spin - late) * inertia / c * (1 - decay) + late * times + slope * times**2 / 2
    errors = [np.abs(angle(dt) - right).max() for dt in (0.02, 0.01)]
    assert errors[1] < 2e-3 and errors[0] / errors[1] > 3.5


def test_friction_sees_the_velocity_of_what_slides() -> None:
    """A ball slides on the ground until it nearly stops, in schemes with other equations."""

    def slide(scheme: str) -> float:
        deep = 0.6 * 9.81 / 2e4
        ground = sm.Contact(
            "ground",
            sm.Plane(normal=(0, 0, 1)),
            stiffness=2e4,
            radius=0.12,
            friction=0.4,
            slip_speed=0.05,
            preloaded=True,
        )
        scene = sm.Scene(
            "slide",
            rigid_bodies=sm.RigidBody(
                "ball", 0.6, (2e-3, 2e-3, 2e-3), position=(0, 0, 0.12 - deep)
            ),
            loads=sm.Gravity(),
            initial=sm.InitialVelocity(linear=(0.5, 0, 0)),
            contacts=ground,
            probes=sm.Probe("x", "center", component=0),
            scheme=scheme,
            dt=1e-3,
            t_end=0.1,
        )
        return float(sm.run(scene, progress=False).history["x"].iloc[-1])

    assert abs(slide("generalized-alpha") / slide("ep4") - 1) < 3e-5


def hung(scheme: Any = "ep", stiffness: float = 2.0, spin: float = 1.0) -> sm.Scene:
    """A pendulum with a spring and a damper, whose rates its joint takes from the body."""
    return sm.Scene(
        "hung",
        rigid_bodies=sm.RigidBody("bob", 1.0, (0.01, 0.02, 0.03), position=(1, 0, 0)),
        joints=sm.Revolute("hinge", sm.GROUND, "bob", at=(0, 0, 0), axis=(0, 1, 0)),
        force_elements=[
            sm.JointSpring("spring", "hinge", stiffness),
            sm.JointDamper("damper", "hinge", 0.5),
        ],
        loads=sm.Gravity((0, 0, -9.81)),
        initial=sm.InitialVelocity(spin=(0, spin, 0)),
        probes=sm.Probe("height", "center"),
        scheme=scheme,
        dt=0.02,
        t_end=0.08,
    )


@pytest.mark.parametrize(
    "scheme", [OPTIMAL, Composite(), "generalized-alpha"], ids=["alpha", "composite", "bundled"]
)
def test_derivatives_go_backwards(scheme: Any) -> None:
    """Kind: rates beside the velocity at the start of a step, and states in between."""
    names, tight = ("stiffness", "spin"), {"newton": "full", "newton_tolerance": 1e-11}
    common: Any = {"values": {"scheme": scheme}, **tight}
    back = sm.adjoint(hung, lambda h: float(np.sum(h["height"] ** 2)), (), names, **common)
    forth = sm.sensitivities(hung, names, columns="probes", fields=False, **common)
    height = forth.run.history["height"].to_numpy()
    for name in names:
        exact = 2 * height @ forth.history[name]["height"].to_numpy()
        # differences of tangents
        assert back.parameters[name] == pytest.approx(exact, rel=1e-6)
