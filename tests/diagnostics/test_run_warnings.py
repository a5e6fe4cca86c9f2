"""What runs say against themselves, and that healthy ones say nothing."""

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from shellmb.api.runs import load
from shellmb.cli.report import print_run
from shellmb.diagnostics.balances import EnergyLaw
from shellmb.diagnostics.base import RunWarning
from shellmb.diagnostics.registry import WATCHES
from shellmb.errors import ShellmbWarning
from shellmb.observers.summary import Sources
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Clamped,
    Driver,
    EdgeForce,
    Gravity,
    InitialVelocity,
    Isotropic,
    JointDamper,
    JointSpring,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    SoftSupport,
)
from shellmb.scene.checks.ignored_settings import doubts
from shellmb.schemes.ep import EnergyPreserving
from shellmb.schemes.rivals import GeneralizedAlpha
from shellmb.show.account import account
from shellmb.simulate.simulation import Simulation

SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0)
PLATE = Shell("plate", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1))
NUMBERS = ("energy_balance_error", "linear_momentum_drift", "angular_momentum_drift")
SCHEMES = [("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]


def four_bar(scheme: str, alpha: float, **more) -> Scene:
    """Two cranks of 1 m that hang from ground, and a coupler of 2 m."""
    joints = [("A", "ground", "left", 0, 0), ("B", "left", "coupler", 0, -1)]
    joints += [("C", "coupler", "right", 2, -1), ("D", "right", "ground", 2, 0)]
    return Scene(
        "four-bar",
        rigid_bodies=tuple(
            RigidBody(name, mass=1.0, inertia=(0.1, 0.1, 0.1), position=position)
            for name, position in (
                ("left", (0, 0, -0.5)),
                ("coupler", (1, 0, -1)),
                ("right", (2, 0, -0.5)),
            )
        ),
        joints=tuple(
            Revolute(name, first, second, at=(x, 0, z), axis=(0, 1, 0))
            for name, first, second, x, z in joints
        ),
        loads=Gravity((0, 0, -9.81)),
        redundant="drop",
        scheme=scheme,
        alpha=alpha,
        **{"dt": 1e-2, "t_end": 0.2} | more,
    )


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
@pytest.mark.parametrize("what", ["free plate", "clamped plate", "four-bar"])
def test_rest_has_no_errors(what, scheme, alpha) -> None:
    """Round-off is measured by what forces in balance would exchange, not by itself."""
    held = {"supports": Clamped("left")} if what == "clamped plate" else {}
    scene = Scene("rest", PLATE, scheme=scheme, alpha=alpha, dt=0.1, t_end=1.0, **held)
    result = execute(four_bar(scheme, alpha) if what == "four-bar" else scene)
    assert result.warnings == ()
    for name in NUMBERS:
        assert result.summary[name] < 1e-12
    assert result.summary["dissipated_share"] == 0.0 or scheme == "ed"
    assert result.summary["dissipated_share"] < 1e-12


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_joints_to_ground_explain_the_momenta_of_a_mechanism(scheme, alpha) -> None:
    driver = Driver("motor", "A", rotation=lambda t: 0.5 * t**2)
    result = execute(four_bar(scheme, alpha, drivers=driver))
    assert result.warnings == ()
    assert result.summary["linear_momentum_drift"] < 1e-10
    # rigid bodies in ED: the error of the scheme, with 0.002 rad in a step
    assert result.summary["angular_momentum_drift"] < (1e-10 if scheme == "ep" else 1e-4)
    # what drivers do between bodies and ground changes the sums: there is something to explain
    momentum = result.history[["momentum_x", "momentum_z"]].to_numpy()
    assert np.ptp(momentum[:, 0]) > 0.1


def test_oblique_planes_explain_the_momenta() -> None:
    """They hold by multipliers, not by fixed unknowns."""
    result = execute(
        Scene(
            "oblique",
            PLATE,
            supports=SoftSupport("left", axis=(1, 0, 2)),
            loads=EdgeForce("right", (1e-3, 0, 1e-3)),
            scheme="ep",
            dt=0.5,
            t_end=10.0,
        )
    )
    assert result.summary["linear_momentum_drift"] < 1e-9
    assert result.summary["angular_momentum_drift"] < 1e-9
    momentum = result.history[["momentum_x", "momentum_z"]].to_numpy()[-1]
    impulse = np.array([1e-3, 1e-3]) * 0.5 * 10.0
    assert np.linalg.norm(momentum - impulse) > 0.1 * np.linalg.norm(impulse)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES[:2])
def test_steps_that_turn_too_far_are_named(scheme, alpha) -> None:
    rotor = RigidBody("rotor", mass=1.0, inertia=(0.3, 0.4, 0.5))
    slow = RigidBody("slow", mass=1.0, inertia=(0.3, 0.4, 0.5), position=(1, 0, 0))
    spins = (
        InitialVelocity(spin=(0, 0, 10.0), body="rotor"),
        InitialVelocity(spin=(0, 0, 1.0), about=(1, 0, 0), body="slow"),
    )
    scene = Scene(
        "rotors",
        rigid_bodies=(rotor, slow),
        initial=spins,
        scheme=scheme,
        alpha=alpha,
        dt=0.1,
        t_end=0.5,
    )
    result = execute(scene)
    (caution,) = [c for c in result.warnings if c.watch == "turning"]
    assert caution.body == "rotor"
    # EP turns by 2 atan(w dt/2)
    assert caution.value == pytest.approx(2 * np.arctan(0.5), rel=1e-9 if scheme == "ep" else 0.2)
    assert "rigid body 'rotor' turns by 0.9" in caution.says or scheme == "ed"
    assert "use a step of at most 0.0" in caution.says
    resolved = execute(replace(scene, dt=0.02))
    assert resolved.warnings == ()
    # those that are quadratic in time follow half of a radian, and not two
    further = replace(scene, scheme="ep4", alpha=0.0)
    assert execute(replace(further, dt=0.05)).warnings == ()
    (caution,) = [c for c in execute(replace(further, dt=0.2)).warnings if c.watch == "turning"]
    assert caution.body == "rotor"


def test_energy_from_nowhere_is_named_with_its_step() -> None:
    """No scene of ours does it: the watch by itself, with an account that jumps at t = 2."""
    account = SimpleNamespace(relative_error=0.0, exchanged=3e-9)
    steps = (0.0, 0.0), (1.0, 1e-12), (2.0, 0.3), (3.0, 0.3)
    history = SimpleNamespace(rows=[{"t": t, "energy_balance": off} for t, off in steps])
    watch = EnergyLaw(cast(Sources, SimpleNamespace(energy=account, history=history)))
    simulation = SimpleNamespace(scheme=EnergyPreserving(), scene=still())
    assert list(watch.cautions(cast(Simulation, simulation))) == []
    account.relative_error = 2e-8
    (caution,) = watch.cautions(cast(Simulation, simulation))
    assert "error of 2.0e-08" in caution.says and "in the step to t = 2 s" in caution.says
    # how little it is of, and nothing that the scene has not
    assert "exchanged, 3e-09 J" in caution.says and "look at" not in caution.says
    dragged = replace(PLATE, terms=(lambda *given: None,))
    simulation.scene = replace(still(), rigid_bodies=(), shells=dragged)
    (caution,) = watch.cautions(cast(Simulation, simulation))
    assert caution.says.endswith("and look at terms of shell 'plate'")
    # a scheme that claims no law is held to what shows in results
    simulation.scheme = GeneralizedAlpha()
    assert list(watch.cautions(cast(Simulation, simulation))) == []
    account.relative_error = 2e-2
    (caution,) = watch.cautions(cast(Simulation, simulation))
    assert "has no energy law (for comparison" in caution.says
    assert "has an error of 2.0e-02 of" in caution.says


def test_much_dissipation_is_named_with_its_body() -> None:
    """A tip hit so hard that frequencies follow which steps of a second do not resolve."""
    scene = Scene(
        "hit",
        PLATE,
        supports=Clamped("left"),
        initial=InitialVelocity(linear=(0, 0, 0.1)),
        scheme="ed",
        dt=1.0,
        t_end=20.0,
    )
    result = execute(scene)
    (caution,) = [c for c in result.warnings if c.watch == "dissipation"]
    assert caution.body == "plate" and "in shell 'plate'" in caution.says
    assert caution.value == result.summary["dissipated_share"] > 0.05
    account = result.energy.values
    there = account["total_energy"] + account["dissipation"]
    assert caution.value == pytest.approx(account["dissipation"] / there)


def test_what_springs_give_was_there_before() -> None:
    """A hinge that a spring opens, its potential zero at the start: ED loses little of its work."""
    scene = Scene(
        "hinge",
        rigid_bodies=RigidBody("door", 1.0, (0.1, 0.1, 0.1), position=(0.5, 0, 0)),
        joints=Revolute("hinge", GROUND, "door", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=(
            JointSpring("spring", "hinge", potential=lambda theta: theta**2 / 8 - theta),
            JointDamper("damper", "hinge", damping=2.0),
        ),
        scheme="ed",
        dt=0.1,
        t_end=2.0,
    )
    result = execute(scene)
    assert result.energy.values["total_energy"] < -0.5
    assert 0 < result.summary["dissipated_share"] < 0.05
    assert not [c for c in result.warnings if c.watch == "dissipation"]


def test_warnings_are_printed(capsys) -> None:
    rotor = RigidBody("rotor", mass=1.0, inertia=(0.3, 0.4, 0.5))
    initial = InitialVelocity(spin=(0, 0, 10.0))
    scene = Scene("rotor", rigid_bodies=rotor, initial=initial, scheme="ep", dt=0.1, t_end=0.2)
    result = execute(scene)
    print_run(result.summary)
    printed = capsys.readouterr().out
    assert f"warning: {result.warnings[0].says}" in printed


def test_watches_have_names_of_their_own() -> None:
    assert len({watch.name for watch in WATCHES}) == len(WATCHES)
    caution = RunWarning("watch", None, 1.0, 0.5, "words")
    assert caution.to_dict()["says"] == "words"


SLAB = "the thickness is 7800 m and it is 1.414 m long"
PULLED = "it does not pull at 'plate', which has no mass"


def slab(**options):
    """A plate whose thickness is its density, and one of no mass in a gravity for all."""
    weightless = Shell(
        "plate", Rectangle(1.0, 1.0), Isotropic(E=1e9, nu=0.3, thickness=0.1), mesh=(1, 1)
    )
    heavy = Isotropic(E=1e9, nu=0.3, thickness=7800.0, density=1.0)
    slab = Shell("slab", Rectangle(1.0, 1.0, (0, 0, 9)), heavy, mesh=(1, 1))
    supports = [Clamped("left", body="plate"), Clamped("left", body="slab")]
    return Scene("slab", [weightless, slab], supports=supports, loads=Gravity(), **options)


def test_doubts_about_a_scene_are_in_the_record_of_its_run(tmp_path, capsys) -> None:
    """Kind: what only stderr was told of when the scene was built."""
    with pytest.warns(ShellmbWarning) as told:
        scene = slab()
        result = execute(scene, tmp_path / "run", pictures=False)
    said = [caution.says for caution in result.warnings]
    assert any(SLAB in each for each in said)
    assert any(PULLED in each for each in said)
    assert {SLAB in str(w.message) for w in told} == {True, False}, "they are warnings as ever"
    kept = json.loads((tmp_path / "run" / "summary.json").read_text())["warnings"]
    assert [each["says"] for each in kept] == said
    assert doubts(scene) == (
        f"gravity: {PULLED}; give its section a density, or name the body that the load is for",
    )
    report = load(tmp_path / "run").report()
    assert SLAB in report.read_text()
    # what a command has shown already it does not print again
    print_run(result.summary)
    assert SLAB not in capsys.readouterr().out


def test_results_that_are_no_numbers_keep_their_row(capsys) -> None:
    result = execute(still(), results=lambda run: {"found": 1.0, "lost": float("nan")})
    print_run(result.summary)
    printed = dict(line.split()[:2] for line in capsys.readouterr().out.splitlines()[-2:])
    assert printed == {"found": "1", "lost": "nan"}
    assert account({**result.summary, "results": {"lost": None}})["lost"] == "nan"


def still() -> Scene:
    body = RigidBody("rotor", mass=1.0, inertia=(0.3, 0.4, 0.5))
    return Scene("rotor", rigid_bodies=body, scheme="ep", dt=0.1, t_end=0.1)
