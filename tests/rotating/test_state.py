"""Modes about the last state of a run: what turns steadily, what is loaded, what is at rest."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
from typer.testing import CliRunner

import shellmb as sm
from shellmb.cli.main import app
from shellmb.demos.campbell import scene as bladed
from shellmb.errors import SceneError
from shellmb.running.rotating.axis import find_axis
from shellmb.running.rotating.campbell import campbell
from shellmb.running.rotating.linearised import SteadyRotation
from shellmb.running.rotating.modes import RotatingModes, modes_of
from shellmb.running.rotating.state import MovingState, check_state
from shellmb.scene import (
    Beam,
    Clamped,
    Gravity,
    InitialVelocity,
    Isotropic,
    JointDamper,
    JointSpring,
    Line,
    Prismatic,
    Rectangle,
    RectangularSection,
    RigidBody,
    Scene,
    Shell,
    Spherical,
)
from shellmb.simulate.simulation import Simulation

UP = (0.0, 0.0, 1.0)


def modes_at(turning: Any, rate: float, count: int) -> RotatingModes:
    turning.go(rate)
    return modes_of(turning, count)


def top(spin: float, scheme: str = "ep4", **more: Any) -> Scene:
    """A heavy top that stands on its tip."""
    return Scene(
        "top",
        rigid_bodies=RigidBody("top", 2.0, (0.1, 0.1, 0.15), com=(0, 0, 0.3)),
        joints=Spherical("tip", "ground", "top", at=(0, 0, 0)),
        loads=Gravity((0, 0, -9.81)),
        initial=InitialVelocity(spin=(0, 0, spin)),
        scheme=scheme,
        dt=0.002,
        t_end=0.02,
        **more,
    )


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["ep4", "ed"])
def test_sleeping_top(scheme: str, tmp_path: Path) -> None:
    """After some steps the same as about the relative equilibrium, weight and all."""
    run = sm.run(top(40.0, scheme), tmp_path / "run")
    made = sm.modes(run, tmp_path / "modes", count=3)
    # ED turns a little slower: by a third of the square of half the angle of a step
    assert made.rate == pytest.approx(40.0, rel=1e-6 if scheme == "ep4" else 1e-2)
    (exact,) = campbell(top(40.0), [made.rate], count=3, loaded=True, axis=UP).modes
    assert made.rigid == exact.rigid == 1
    np.testing.assert_allclose(made.frequencies[1:], exact.frequencies[1:], rtol=1e-6)
    assert made.drift < 1e-6
    assert made.stable
    assert not made.warnings
    read = sm.load(tmp_path / "modes")
    assert isinstance(read, sm.StateModes)
    assert read.verdict == made.verdict
    assert "turns by 40" in repr(read) or scheme == "ed"
    # in a frame that stands the top is what moves: nothing is steady but its weight
    stands = sm.modes(run, count=3, rates=[0.0])
    assert stands.rate == 0.0
    assert stands.summary["relative_energy_share"] == pytest.approx(1.0)
    with pytest.raises(SceneError, match=r"is .* fixed in space"):
        sm.modes(run, rates=[3.0], axis=(1, 0, 0), about=(0, 0, 0))


@pytest.mark.slow
@pytest.mark.parametrize("steps", [0, 10])
def test_blade(steps: int) -> None:
    """A blade that stands in its hub under the pull of its rotation, of `SteadyRotation`."""
    scene = bladed(rate=10.0, elements=2)
    turning = SteadyRotation(scene, find_axis(scene), MPI.COMM_WORLD, False)
    exact = modes_at(turning, 10.0, 4)
    simulation = Simulation(scene.with_options(scheme="ep4", dt=0.005, t_end=0.05))
    for name, levels in simulation.problem.levels.items():
        levels.q.x.array[:] = turning.levels[name].q.x.array
    spin = np.array([0.0, 0.0, 10.0])
    for target in (*scene.beams, *scene.rigid_bodies):
        body, nodes, X, D = simulation.model.nodes_of(target.name)
        levels = simulation.problem.levels[body.name]
        v, q = levels.rates["v"].x.array, levels.q.x.array
        u = body.mixed.dofs["u"].reshape(-1, 3)[nodes]
        w = body.mixed.dofs["w"].reshape(-1, 9)[nodes]
        v[u] = np.cross(spin, X + q[u])
        v[w] = np.cross(spin, D + q[w].reshape(D.shape)).reshape(w.shape)
    if steps:
        simulation._start.accelerations(0.0)
        simulation.run()
    state = MovingState(scene, simulation.arrays(), simulation.state(), MPI.COMM_WORLD)
    # steps of 0.05 rad have errors of the fourth power
    close = 1e-6 if steps else 1e-9
    assert state.rate == pytest.approx(10.0, rel=close)
    assert state.unsteady.drift(10.0) < close
    found = modes_of(state, 4)
    np.testing.assert_allclose(found.values, exact.values, rtol=close, atol=1e-8)
    # without the tension, which comes from the accelerations, the lowest would be at 2/s
    assert found.omega[0] > 10.0


STRIP = {"E": 70e9, "nu": 0.0, "density": 2700.0, "width": 0.1, "height": 0.01}


def strip(load: float, **damping: float) -> Scene:
    """A clamped strip under its weight along itself, which stiffens it."""
    return Scene(
        "strip",
        beams=Beam(
            "beam", Line((0, 0, 0), (1, 0, 0)), RectangularSection(**STRIP, **damping), elements=2
        ),
        supports=Clamped("start"),
        loads=Gravity((load, 0, -load / 10)) if load else (),
        scheme="static",
        dt=0.5,
        t_end=1.0,
    )


@pytest.mark.slow
def test_loaded(tmp_path: Path) -> None:
    """The end of a static run: what `loaded=True` gives, with the damping of sections."""
    scene = strip(2e3, stiffness_damping=2e-4)
    run = sm.run(scene, tmp_path / "run")
    made = sm.modes(scene, state=run, count=3)
    plain = sm.modes(scene, count=3, loaded=True)
    assert made.rate == 0.0
    assert made.summary["frame_stands_because"] == "nothing turns"
    assert made.drift < 1e-9
    for column in ("omega_rad_per_s", "growth_per_s"):
        np.testing.assert_allclose(made.summary[column], plain.summary[column], rtol=1e-6)
    sizes = np.hypot(made.summary["omega_rad_per_s"], made.summary["growth_per_s"])
    # damping shifts sizes by its square: what pulls is not damped
    without = sm.modes(strip(2e3), count=3, loaded=True).frequencies
    np.testing.assert_allclose(sizes / (2 * math.pi), without, rtol=1e-3)
    assert 0 < made.damping[0] < 0.9 * 2e-4 * sizes[0] / 2


@pytest.mark.slow
def test_released(tmp_path: Path) -> None:
    """What is at rest again after it was pulled has `tau |s| / 2` of every mode."""
    tau = 2e-3
    scene = strip(0.0, stiffness_damping=tau)
    pulled = Gravity((0, 0, -10.0), time=lambda t: float(t < 0.1))
    # of 6.6 s of the lowest mode, whose ratio is 0.05, the twentieth power of e is left
    run = scene.with_options(scheme="ed", dt=0.02, t_end=8.0)
    run = replace(run, loads=pulled)
    made = sm.modes(sm.run(run, tmp_path / "run"), count=3)
    sizes = np.hypot(made.summary["omega_rad_per_s"], made.summary["growth_per_s"])
    np.testing.assert_allclose(made.damping, tau * sizes / 2, rtol=1e-6)
    assert made.drift < 1e-6
    assert made.stable


def test_what_is_damped_beyond_oscillation() -> None:
    """All modes of a plate but four are real, and half of their eigenvalues crowd at `-1/tau`."""
    tau, surface = 2e-3, Rectangle(1.0, 0.2)
    metal = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0, stiffness_damping=tau)
    plates = [
        Shell("plate", surface, replace(metal, stiffness_damping=d), mesh=(4, 1))
        for d in (0.0, tau)
    ]
    plain, damped = (
        Scene("plate", plate, supports=Clamped("left"), scheme="ep", dt=1e-3, t_end=1.0)
        for plate in plates
    )
    omega = sm.modes(plain, count=4).summary["omega_rad_per_s"]
    turning = SteadyRotation(damped, find_axis(damped, UP), MPI.COMM_WORLD, False)
    first, others = np.split(modes_at(turning, 0.0, 6).values, [4])
    np.testing.assert_allclose(first.real, -tau * np.square(omega) / 2, rtol=1e-5)
    np.testing.assert_allclose(np.abs(first), omega, rtol=1e-5)
    # s = -1/tau (1 + 1/(tau omega)^2 + ...)
    np.testing.assert_allclose(others, -1 / tau, rtol=1e-6)


def slide(pushed: float, viscosity: float) -> Scene:
    """A mass on a spring and a damper."""
    return Scene(
        "slide",
        rigid_bodies=RigidBody("slide", 2.0, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", "ground", "slide", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=(
            JointSpring("spring", "rail", stiffness=200.0),
            JointDamper("damper", "rail", damping=viscosity),
        ),
        initial=InitialVelocity(linear=(pushed, 0, 0)) if pushed else (),
        scheme="ep",
        dt=0.01,
        t_end=0.05,
    )


@pytest.mark.slow
def test_in_motion(tmp_path: Path) -> None:
    """A linear system has the same modes wherever it moves; how far it does is said."""
    moved = sm.run(slide(3.0, 4.0), tmp_path / "run")
    made = sm.modes(moved, count=1)
    (exact,) = [r for r in np.roots([2.0, 4.0, 200.0]) if r.imag > 0]
    assert made.rate == 0.0
    np.testing.assert_allclose(made.summary["growth_per_s"], [exact.real], rtol=1e-9)
    np.testing.assert_allclose(made.summary["omega_rad_per_s"], [exact.imag], rtol=1e-9)
    assert made.damping == pytest.approx([0.1])
    assert "no steady motion" in made.verdict
    assert made.summary["relative_energy_share"] == pytest.approx(1.0)
    with pytest.raises(SceneError, match="prismatic joint 'rail' holds on to ground"):
        sm.modes(moved, rates=[1.0], axis=UP)
    # m v^2/2 with m = 2
    speed = math.sqrt(moved.history["kinetic_energy"].iloc[-1])
    assert made.summary["relative_velocity"] == pytest.approx(speed, rel=1e-6)


def flying(mass: float = 2.0) -> Scene:
    """A free body that spins as it flies."""
    return Scene(
        "free",
        rigid_bodies=RigidBody("body", mass, (0.1, 0.1, 0.18), com=(1, 2, 3)),
        initial=InitialVelocity(linear=(3.0, 0, 0), spin=(0, 0, 10.0), about=(1, 2, 3)),
        scheme="ep",
        dt=0.01,
        t_end=0.05,
    )


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> sm.Run:
    return sm.run(flying(), tmp_path_factory.mktemp("state") / "run")


def test_flying_gyroscope(moved: sm.Run) -> None:
    """As about its spin where it is: its flight is steady, too."""
    made = sm.modes(moved, count=6)
    # the rate is that of the state; EP turns it exactly
    assert made.rate == pytest.approx(10.0, rel=1e-9)
    assert made.rigid == 2
    # wobble, and what is at rest in space
    omega = made.summary["omega_rad_per_s"][2:]
    np.testing.assert_allclose(omega, [8.0, 10.0, 10.0, 10.0], rtol=1e-6)
    assert made.stable
    assert made.drift < 1e-9
    assert not made.warnings


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda run: sm.modes(flying(3.0), state=run), "mass was 2.0, is 3.0"),
        (
            lambda run: sm.modes(flying(), state="nowhere"),
            "modes: there is no state",
        ),
        (lambda run: sm.modes(run, rates=[1.0, 2.0]), "rates are .*a state has one finite rate"),
        (lambda run: sm.modes(run, rates=[math.nan]), "rates are .*a state has one finite rate"),
        (lambda run: sm.modes(run, axis=(0, 0)), "axis is .*three numbers"),
        (lambda run: sm.modes(run, state=run), "the scene is a run, and a state is given"),
        (lambda run: sm.modes(flying(), state=run, loaded=True), "loaded is given"),
    ],
)
def test_bad_input(change: Callable[[Any], Any], said: str, moved: sm.Run) -> None:
    with pytest.raises(SceneError, match=said):
        change(moved)


def test_linear_run() -> None:
    with pytest.raises(SceneError, match="the scheme 'linear-dynamics', whose equations"):
        check_state(slide(3.0, 4.0), "linear-dynamics")


def test_directory_of_no_bundled_scene(moved: sm.Run) -> None:
    """A run of a scene that was made in Python does not tell the command which one."""
    done = CliRunner().invoke(app, ["modes", str(moved.directory)])
    assert done.exit_code == 2
    assert "modes: " in done.output


@pytest.mark.slow
def test_command(tmp_path: Path) -> None:
    """`shellmb modes RUN_DIR` of a bundled scene, and its refusals."""
    run, out = str(tmp_path / "run"), str(tmp_path / "modes")
    first = ["run", "campbell", "--set", "elements=2", "--t-end", "0.01", "--no-pictures", "-q"]
    assert CliRunner().invoke(app, [*first, "--out", run]).exit_code == 0
    done = CliRunner().invoke(app, ["modes", run, "--out", out, "--count", "2", "--no-pictures"])
    assert done.exit_code == 0, done.output
    # it starts from rest, with a hub that turns at once
    assert "no steady motion" in " ".join(done.output.split())
    assert "drift" in done.output
    for wrong, said in (
        (["--mesh", "4x4"], "holds a run, which has its own mesh"),
        (["--check"], "is given with a state or --buckling"),
        (["--rate", "1,2"], "a state has one finite rate"),
    ):
        done = CliRunner().invoke(app, ["modes", run, *wrong, "--out", out + "2"])
        assert done.exit_code == 2
        assert said in " ".join(done.output.split())
