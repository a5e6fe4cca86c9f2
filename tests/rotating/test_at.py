"""Modes about a state at any time of a run, which the run is taken up to again.

A mass slides along an arm that spins up: `r'' + (k/m - Omega(t)^2) r = k r0/m` whatever `r` is.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import shellmb as sm
from shellmb.cli.main import app
from shellmb.errors import SceneError
from shellmb.scene import Driver, Event, JointSpring, Prismatic, Revolute, RigidBody, Scene, Sensor

OMEGA, SPIN_UP = 30.0, 200.0


def arm(**options: Any) -> Scene:
    """An arm that spins up, with a mass on a spring along it."""
    mass, inertia = 2.0, (0.1, 0.1, 0.1)
    found = Scene(
        "arm",
        rigid_bodies=(
            RigidBody("arm", 1.0, inertia),
            RigidBody("mass", mass, inertia, com=(0.5, 0, 0)),
        ),
        joints=(
            Revolute("axle", "ground", "arm", at=(0, 0, 0), axis=(0, 0, 1)),
            Prismatic("slide", "arm", "mass", at=(0, 0, 0), axis=(1, 0, 0)),
        ),
        drivers=Driver("motor", "axle", rotation=lambda t: SPIN_UP * t**2 / 2),
        force_elements=JointSpring("spring", "slide", stiffness=mass * OMEGA**2),
        scheme="ep4",
        dt=0.01,
        t_end=0.1,
    )
    return found.with_options(**options)


def expected(t: float) -> float:
    return math.sqrt(OMEGA**2 - (SPIN_UP * t) ** 2)


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that has come to half of what the scene asks for."""
    folder = tmp_path_factory.mktemp("arm") / "run"
    sm.run(arm(t_end=0.05), folder)
    return folder


@pytest.mark.parametrize(
    ("at", "begin"),
    [
        pytest.param(0.0, 0.0, marks=pytest.mark.slow),
        (0.033, 0.0),
        pytest.param(0.05, None, marks=pytest.mark.slow),
        (0.08, 0.05),
    ],
)
def test_frequency_follows_the_rate(stopped: Path, at: float, begin: float | None) -> None:
    """At the start, within a step before the last state, there, and beyond."""
    made = sm.modes(arm(), state=stopped, at=at, count=1)
    assert made.summary["run_again_from"] == begin
    assert made.summary["t"] == pytest.approx(at, rel=1e-12)
    assert made.rate == pytest.approx(SPIN_UP * at, rel=1e-9, abs=1e-12)
    assert made.summary["omega_rad_per_s"][0] == pytest.approx(expected(at), rel=1e-9)


@pytest.mark.slow
def test_run_again_is_the_run() -> None:
    """The last state, saved and run again without any run: bit for bit."""
    last, again = sm.modes(sm.run(arm()), count=1), sm.modes(arm(), at=0.1, count=1)
    assert again.summary["run"] is None
    assert again.summary["omega_rad_per_s"] == last.summary["omega_rad_per_s"]


def test_command_takes_the_steps_of_the_run(tmp_path: Path) -> None:
    """Scheme and step are those of the run, though the command has no options for them."""
    file = tmp_path / "arm.py"
    file.write_text("from tests.rotating.test_at import arm\n\n\ndef scene():\n    return arm()\n")
    invoke = CliRunner().invoke
    options = ["--no-pictures", "--quiet", "--out"]
    ran = invoke(app, ["run", str(file), "--scheme", "ed3", *options, str(tmp_path / "run")])
    assert ran.exit_code == 0, ran.output
    command = ["modes", str(file), "--state", str(tmp_path / "run"), "--at", "0.02"]
    made = invoke(app, [*command, "--count", "1", *options, str(tmp_path / "modes")])
    assert made.exit_code == 0, made.output
    found = sm.load(tmp_path / "modes")
    assert isinstance(found, sm.StateModes)
    assert found.summary["omega_rad_per_s"][0] == pytest.approx(expected(0.02), rel=1e-9)
    refused = invoke(app, [*command, "--set", "x=1", *options, str(tmp_path / "other")])
    assert refused.exit_code == 2
    assert "has its own mesh and parameters" in refused.output
    refused = invoke(app, [*command, "--errors", *options, str(tmp_path / "other")])
    assert refused.exit_code == 2
    assert "errors are estimated of natural modes at rest only" in " ".join(refused.output.split())


@pytest.mark.parametrize(
    ("changed", "at", "said"),
    [
        ({}, 0.2, r"at is 0.2; the run goes from 0 to 0.1 s"),
        ({}, -0.1, r"at is -0.1; the run goes from 0"),
        ({}, math.nan, r"at is nan; the run goes from 0"),
        ({"scheme": "ed3"}, 0.02, r"scheme was ep4, is ed3.*whose steps are taken again"),
        ({"dt": 0.005}, 0.02, r"dt was 0.01, is 0.005"),
    ],
)
def test_refused(stopped: Path, changed: dict[str, Any], at: float, said: str) -> None:
    with pytest.raises(SceneError, match=f"modes: .*{said}"):
        sm.modes(arm(**changed), state=stopped, at=at)


def test_an_event_ends_the_run_before() -> None:
    turned = Sensor("axle.rotation")
    ends = replace(arm(), events=Event("enough", when=turned >= 0.1, ends=True))
    with pytest.raises(SceneError, match=r"at is 0\.1; an event ends the run at t = 0\.0316"):
        sm.modes(ends, at=0.1)


def test_static_states_are_whole_at_the_end() -> None:
    still = replace(arm(), drivers=()).with_options(scheme="static")
    with pytest.raises(SceneError, match="the scene is static; its loads are whole at the end"):
        sm.modes(still, at=0.05)
