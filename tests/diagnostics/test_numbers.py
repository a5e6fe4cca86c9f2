"""What warnings say: each number by an independent one, and each bound where it is said to be.

The kind: a sentence that comes too late or too early, or names a number that is not so.
"""

import math
import re
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from shellmb.diagnostics.balances import Dissipation, Drift, EnergyLaw
from shellmb.diagnostics.base import RunWarning
from shellmb.diagnostics.unknown_forces import Alternating, Undetermined
from shellmb.running.execute import execute
from shellmb.scene import (
    Ball,
    Clamped,
    Contact,
    EdgeForce,
    EdgeMoment,
    Gravity,
    Hinged,
    InitialVelocity,
    Isotropic,
    Plane,
    PointForce,
    Rectangle,
    RigidBody,
    Rolling,
    Scene,
    Shell,
    SoftSupport,
    SurfaceForce,
)
from shellmb.schemes.ed import EnergyDecaying
from shellmb.schemes.ep import EnergyPreserving
from shellmb.schemes.registry import SCHEMES
from shellmb.schemes.rivals import GeneralizedAlpha

ROTOR = RigidBody("rotor", 1.0, (0.3, 0.4, 0.5))
STILL = Scene("rotor", rigid_bodies=ROTOR, scheme="ep", dt=0.1, t_end=0.1)
UP, WEIGHT = (0.0, 0.0, 1.0), 9.81


def of(watch: str, scene: Scene) -> list[RunWarning]:
    """What a watch says of a run."""
    return [c for c in execute(scene).warnings if c.watch == watch]


def judged(kind: Any, scheme: Any = None, **sources: Any) -> list[RunWarning]:
    """What a watch says of numbers that are given."""
    control = SimpleNamespace(output=SimpleNamespace(end_forces=False))
    simulation: Any = SimpleNamespace(
        scheme=scheme or EnergyPreserving(),
        scene=STILL if kind is not Alternating else control,
        model=SimpleNamespace(mechanism=SimpleNamespace(joints={}), length=1.0),
        t=1.0,
    )
    sources = {"rotations": SimpleNamespace(turns={})} | sources
    watch = kind(cast(Any, SimpleNamespace(**sources)))
    if "found" in sources:
        roundoff = SimpleNamespace(found=sources["found"])
        simulation.problem = SimpleNamespace(iteration=SimpleNamespace(roundoff=roundoff))
        watch.accepted(simulation)
    return list(watch.cautions(simulation))


def energy(**numbers: float) -> Any:
    given = {"relative_error": 0.0, "dissipated_share": 0.0, "exchanged": 1.0} | numbers
    return SimpleNamespace(values={}, dissipated={"rotor": 3.0, "other": 1.0}, **given)


def off(by: float) -> dict[str, Any]:
    rows = [{"t": 0.0, "energy_balance": 0.0}, {"t": 1.0, "energy_balance": by}]
    return {"energy": energy(relative_error=by), "history": SimpleNamespace(rows=rows)}


def drifts(by: float, kind: str) -> dict[str, Any]:
    turns = {"rotor": SimpleNamespace(largest=0.25), "other": SimpleNamespace(largest=0.5)}
    momentum = SimpleNamespace(relative_drift=lambda k: by if k == kind else 0.0)
    return {"momentum": momentum, "rotations": SimpleNamespace(turns=turns)}


def alternating(share: float) -> Any:
    rows = [{"motor.torque": 2.0 * (1 + share * (-1) ** k)} for k in range(60)]
    return SimpleNamespace(rows=rows)


LINEAR, ANGULAR = "momentum", "angular momentum"
ED, ALPHA = EnergyDecaying(1.0), GeneralizedAlpha(0.5)
# 5 per cent of the energy; 1e-8 where an account must close, and otherwise 1 per cent; 1e-6 of
# momenta that a scheme conserves (ED: not the angular one), and of others 1 per cent; six digits;
# a tenth of what does not alternate
BOUNDS: dict[str, tuple[float, Any]] = {
    "dissipation": (0.05, lambda x: judged(Dissipation, energy=energy(dissipated_share=x))),
    "account": (1e-8, lambda x: judged(EnergyLaw, **off(x))),
    "account, no law": (1e-2, lambda x: judged(EnergyLaw, ALPHA, **off(x))),
    "momentum": (1e-6, lambda x: judged(Drift, **drifts(x, LINEAR))),
    "angular momentum": (1e-6, lambda x: judged(Drift, **drifts(x, ANGULAR))),
    "momentum in ED": (1e-6, lambda x: judged(Drift, ED, **drifts(x, LINEAR))),
    "angular momentum in ED": (1e-2, lambda x: judged(Drift, ED, **drifts(x, ANGULAR))),
    "round-off": (1e-6, lambda x: judged(Undetermined, found=("torque", x))),
    "alternation": (0.1, lambda x: judged(Alternating, history=alternating(x))),
}


@pytest.mark.parametrize("name", BOUNDS)
def test_bounds_are_where_they_are_said_to_be(name: str) -> None:
    bound, said = BOUNDS[name]
    assert said(0.98 * bound) == []
    (caution,) = said(1.02 * bound)
    assert caution.value == pytest.approx(1.02 * bound, rel=1e-9)
    assert caution.bound == bound


def test_sentences_of_numbers_that_are_given() -> None:
    """Shares of bodies, and the body that turns most."""
    (caution,) = judged(Dissipation, energy=energy(dissipated_share=0.4))
    assert "dissipates 40% of the energy" in caution.says
    assert "75% of it in rigid body 'rotor'" in caution.says
    (caution,) = judged(Drift, **drifts(2e-3, ANGULAR))
    assert caution.says.startswith("angular momentum has an unexplained error of 0.2 % (rel")
    assert "turns most, by up to 0.5 rad in a step" in caution.says
    (caution,) = judged(Alternating, history=alternating(0.3))
    assert "by 0.3 times its mean over two" in caution.says


MOVING = ["ep", "ed", "ep4", "ed3"]


@pytest.mark.parametrize("name", MOVING)
def test_from_the_bound_of_turns_on_the_angle_is_five_per_cent_off(name: str) -> None:
    """A free rotor about a principal axis turns by `w t` exactly; measured over one step."""

    def run(angle: float) -> tuple[float, list[RunWarning]]:
        """What is made of an angle, and what is said."""
        scene = Scene(
            "rotor",
            rigid_bodies=ROTOR,
            initial=InitialVelocity(spin=(0, 0, angle)),
            scheme=name,
            dt=1.0,
            t_end=1.0,
        )
        found = execute(scene)
        rigid = found.simulation.model.rigid
        assert rigid is not None
        w = found.simulation.problem.state(rigid.name).x.array[rigid.mixed.dofs["w"]]
        d = w.reshape(-1, 3, 3)[0, 0]
        return math.atan2(d[1], 1 + d[0]), [c for c in found.warnings if c.watch == "turning"]

    bound = SCHEMES[name](1.0).rotations.largest
    inside, outside = 0.93 * bound, 1.15 * bound
    made, said = run(inside)
    assert said == [] and abs(made / inside - 1) < 0.05
    made, (caution,) = run(outside)
    # the largest angle of a director is that of the body
    assert caution.value == pytest.approx(made, rel=1e-9)
    assert f"turns by {made:.2g} rad" in caution.says
    advised = float(re.search(r"a step of at most ([\d.e-]+) s", caution.says)[1])  # type: ignore[index]
    assert advised == pytest.approx(bound / made, rel=0.05)
    # 5 per cent soon behind it
    # and beyond 5 per cent before it is twice that
    assert abs(run(1.9 * bound)[0] / (1.9 * bound) - 1) > 0.05


def test_a_stiff_body_loses_the_spin_that_is_said() -> None:
    """A free plate under ED, beside what is left of its angular momentum."""
    stiff = Isotropic(E=1e4, nu=0.3, thickness=0.2, density=1.0)
    plate = Shell("plate", Rectangle(1.0, 0.5), stiff, mesh=(2, 1))
    spin = InitialVelocity(spin=(0, 0, 0.25), about=(0.5, 0.25, 0))
    run = execute(Scene("spin", plate, initial=spin, scheme="ed", alpha=1.0, dt=1.0, t_end=10.0))
    (caution,) = [c for c in run.warnings if c.watch == "stiff spin"]
    about = run.column("angular_momentum_z") - 0.5 * run.column("momentum_y")
    about += 0.25 * run.column("momentum_x")
    # an estimate of what it would lose that does not stretch
    assert caution.value == pytest.approx(1 - about[-1] / about[0], rel=0.3)
    turned = float(re.search(r"turns by ([\d.]+) rad in all", caution.says)[1])  # type: ignore[index]
    assert turned == pytest.approx(2.5, rel=0.25)


@pytest.mark.parametrize(("aside", "depth"), [(0.2, 0.6), (0.3, 0.4)])
def test_how_deep_a_point_comes_within_a_step(aside: float, depth: float) -> None:
    """It flies past the centre of a soft ball, at both ends of a step outside of it."""
    scene = Scene(
        "shot",
        rigid_bodies=RigidBody("shot", 1.0, (0.1, 0.1, 0.1), position=(-1.0, aside, 0)),
        contacts=Contact("ball", Ball((0, 0, 0), 0.5), 1e-9),
        initial=InitialVelocity(linear=(1.0, 0, 0)),
        scheme="ep",
        dt=2.0,
        t_end=2.0,
    )
    said = [c for c in of("contact", scene) if "of the radius" in c.says]
    assert len(said) == (depth > 0.5)
    for caution in said:
        assert caution.value == pytest.approx(depth, rel=1e-6)
        assert f"as deep as {depth:.0%} of the radius of the ball" in caution.says


@pytest.mark.parametrize("pull", [0.4, 0.0])
def test_by_how_much_a_rolling_joint_pulls(pull: float) -> None:
    """A ball that rests, and is lifted by more than its weight from half of the time on."""
    lift = PointForce(
        (0, 0, 0.1), (0, 0, WEIGHT * (1 + pull)), time=lambda t: 1.0 if t > 0.5 else 0.0
    )
    scene = Scene(
        "lifted",
        rigid_bodies=RigidBody("ball", 1.0, (4e-3,) * 3, position=(0, 0, 0.1)),
        joints=Rolling("touch", "ground", "ball", at=(0, 0, 0), normal=UP, radius=0.1),
        loads=[Gravity((0, 0, -WEIGHT)), lift],
        scheme="ep",
        dt=0.1,
        t_end=1.0,
    )
    said = of("lifting", scene)
    assert len(said) == (pull > 0)
    for caution in said:
        assert caution.value == pytest.approx(pull, rel=1e-6)
        assert f"by up to {pull * WEIGHT:.3g} N" in caution.says


L, B, H = 1.0, 0.25, 0.01
SECTION = Isotropic(E=12e6, nu=0.0, thickness=H, density=1000.0)
# bending stiffness per width
D = 12e6 * H**3 / 12


def strip(model: str = "exact", mesh: tuple[int, int] = (6, 1)) -> Shell:
    return Shell("strip", Rectangle(L, B), SECTION, mesh=mesh, model=model)


@pytest.mark.parametrize("angle", [0.097, 0.103])
def test_rotations_of_small_displacements(angle: float) -> None:
    """A cantilever under a moment turns by `M L/D` at its end, where 0.1 rad are small."""
    load = EdgeMoment("right", (0, -angle * D / L, 0))
    said = of(
        "small displacements",
        Scene("bent", strip(), supports=Clamped("left"), loads=load, scheme="linear-statics"),
    )
    assert len(said) == (angle > 0.1)
    for caution in said:
        assert caution.value == pytest.approx(angle, rel=1e-3)
        assert f"turns by {angle:.2g} rad" in caution.says


HINGES = (Hinged("left"), SoftSupport("right"))


@pytest.mark.parametrize("angle", [0.097, 0.103])
def test_rotations_about_the_frame_of_a_linear_body(angle: float) -> None:
    """Two moments bend a strip on hinges; its frame stays, and its ends turn by `M L/(2 D)`."""
    m = 2 * angle * D / L
    loads = (EdgeMoment("right", (0, -m, 0)), EdgeMoment("left", (0, m, 0)))
    scene = Scene(
        "bow", strip("floating-frame"), supports=HINGES, loads=loads, scheme="static", dt=1.0
    )
    said = [c for c in of("linear bodies", scene) if "relative to its frame" in c.says]
    assert len(said) == (angle > 0.1)
    for caution in said:
        assert caution.value == pytest.approx(angle, rel=1e-2)


@pytest.mark.parametrize("share", [0.3, 0.009])
def test_forces_along_a_linear_body(share: float) -> None:
    """A part of Euler's load beside a small load across: so much softer a column is."""
    euler = math.pi**2 * D / L**2
    loads = (EdgeForce("right", (-share * euler, 0, 0)), SurfaceForce((0, 0, 1.0)))
    scene = Scene(
        "column", strip("floating-frame"), supports=HINGES, loads=loads, scheme="static", dt=1.0
    )
    said = [c for c in of("linear bodies", scene) if "squares of its rotations" in c.says]
    assert len(said) == (share > 0.01)
    for caution in said:
        # bent by a uniform load: a parabola of fourth order is nearly a sine
        assert caution.value == pytest.approx(share, rel=1e-2)


@pytest.mark.parametrize("ratio", [0.12, 0.09])
def test_spins_of_a_linear_body(ratio: float) -> None:
    """In parts of its lowest frequency by itself, 22.37 sqrt(D/(m L^4)) of a free strip."""
    lowest = 22.3733 * math.sqrt(D / (1000.0 * H * L**4))
    scene = Scene(
        "spun",
        strip("floating-frame"),
        initial=InitialVelocity(spin=(0, 0, ratio * lowest), about=(L / 2, B / 2, 0)),
        scheme="ep",
        dt=0.1 / (ratio * lowest),
        t_end=0.3 / (ratio * lowest),
    )
    said = [c for c in of("linear bodies", scene) if "spins at" in c.says]
    assert len(said) == (ratio > 0.1)
    for caution in said:
        # six elements: 2 % of the frequency
        assert caution.value == pytest.approx(ratio**2, rel=0.05)
        assert f"spins at {ratio * lowest:.3g} rad/s" in caution.says
        assert np.isclose(
            float(re.search(r", ([\d.]+) of its lowest", caution.says)[1]), ratio, rtol=0.05
        )  # type: ignore[index]


def test_a_contact_that_comes_in_one_step() -> None:
    """An impact of two steps is at its largest in the middle, where a step ends; four will do."""
    lasts = 0.3
    ball = RigidBody("ball", 1.0, (0.1, 0.1, 0.1), position=(0, 0, 1e-9))
    k = (math.pi / lasts) ** 2

    def said(steps: int) -> list[RunWarning]:
        scene = Scene(
            "bounce",
            rigid_bodies=ball,
            contacts=Contact("floor", Plane(), k),
            initial=InitialVelocity(linear=(0, 0, -1.0)),
            scheme="ep4",
            dt=lasts / steps,
            t_end=2 * lasts,
        )
        return of("contact", scene)

    (caution,) = said(2)
    assert caution.value == pytest.approx(1.0, abs=0.02)
    assert said(4) == [] and said(8) == []
