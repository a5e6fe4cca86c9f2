"""Forces at the end of a step against exact ones, and their orders, in every dynamic scheme."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from shellmb.demos import slider_crank
from shellmb.demos.verification.chains import chain
from shellmb.demos.verification.problems.mechanisms import ANGLES, LINKS, double_pendulum
from shellmb.errors import SceneError
from shellmb.options.run import Options
from shellmb.running.execute import RunResult, execute
from shellmb.scene import Clamped, Gravity, Output, Scene
from shellmb.schemes.base import end_acceleration

ENDS = Output(frames=2, end_forces=True)
# two are enough where each halves the step cleanly, and setting up a run is what costs
COUNTS = (20, 40)


def run(scene: Scene, scheme: tuple[str, float]) -> RunResult:
    return execute(replace(scene, scheme=scheme[0], alpha=scheme[1], output=ENDS))


def order(errors: list[float]) -> float:
    """By regression."""
    return float(-np.polyfit(np.log(COUNTS), np.log(errors), 1)[0])


def test_forces_of_a_pendulum_have_the_order_of_the_scheme(scheme, make) -> None:
    """A rigid double pendulum in a large fall: what its bearing carries at each end of a step."""
    if scheme[0] == "ed-printed":
        pytest.skip("a rival of first order at most: tests/schemes/test_rivals.py")
    errors, scale = [], 0.0
    for steps in COUNTS:
        found = run(double_pendulum("ep", 0.0, steps, t_end=0.5), scheme)
        motion = chain(LINKS, ANGLES, (0.0, 0.0), found.column("t"))
        exact = motion.hinge_forces()[1:, 0]
        force = np.stack([found.column(f"top.F{k}_end")[1:] for k in (1, 2)], axis=1)
        scale = np.abs(exact).max()
        errors.append(float(np.abs(force - exact).max() / scale))
    # in large rotations ED is of second order
    wanted = 2 if scheme[0] == "ed" else make(*scheme).order
    # the error of a rival, ten times as large, is not yet its leading term
    rival = scheme[0] == "generalized-alpha"
    assert order(errors) == pytest.approx(wanted, abs=0.3 if rival else 0.1)
    assert errors[-1] < (10 if rival else 1) * {2: 3e-3, 3: 1e-4, 4: 1e-6}[wanted]


ARM = slider_crank.scene().rigid_bodies[0]
# the inertia of the crank in the scene, a rod with a radius, about its bearing
IDEAL = replace(
    slider_crank.IDEAL,
    crank_inertia=ARM.inertia[2][2] + ARM.mass * float(np.dot(ARM.position, ARM.position)),
)


@pytest.mark.parametrize("scheme", [("ep", 0.0), ("ed", 1.0), ("ep4", 0.0)], ids=lambda s: s[0])
def test_torque_of_the_slider_crank_at_the_end_of_a_step(scheme) -> None:
    """Its motion is given, and so is its torque: without error, and without alternation."""
    found = run(slider_crank.scene(dt=2e-3, t_end=0.02), scheme)
    exact = IDEAL.motion(*slider_crank.crank(found.column("t")))
    torque, largest = found.column("drive.torque_end")[1:], np.abs(exact.torque).max()
    # second differences of the angle are known to some 1e-9 of the accelerations
    assert np.abs(torque - exact.torque[1:]).max() < 1e-7 * largest
    pin = np.hypot(*(found.column(f"pin.F{k}_end")[1:] for k in (1, 2)))
    size = np.linalg.norm(exact.pin_force, axis=1)
    assert np.abs(pin - size[1:]).max() < 1e-7 * size.max()


def alternating(error: np.ndarray) -> float:
    """The part of an error that changes its sign from step to step: third differences see it."""
    return float(np.abs(np.diff(error, 3)).max() / 8)


@pytest.mark.parametrize(
    "scheme",
    [("ep", 0.0), pytest.param(("ed", 1.0), marks=pytest.mark.slow)],
    ids=lambda s: s[0],
)
def test_means_of_consistent_velocities_do_not_alternate(scheme) -> None:
    """Torque of the slider-crank over a step: of second order; what EP solves for is of first."""
    counts, own, errors, wobbles = (10, 20, 40), [], [], []
    for count in counts:
        found = run(slider_crank.scene(dt=0.04 / count, t_end=0.04), scheme)
        t = found.column("t")
        nodes, weights = np.polynomial.legendre.leggauss(4)
        middle, half = (t[1:] + t[:-1]) / 2, (t[1:] - t[:-1]) / 2
        exact = sum(
            w / 2 * IDEAL.motion(*slider_crank.crank(middle + half * x)).torque
            for x, w in zip(nodes, weights, strict=True)
        )
        largest = np.abs(exact).max()
        error = (found.column("drive.torque_mean")[1:] - exact) / largest
        errors.append(float(np.abs(error).max()))
        wobbles.append(alternating(error))
        own.append((found.column("drive.torque")[1:] - exact) / largest)

    def order(values: list[float]) -> float:
        return float(-np.polyfit(np.log(counts), np.log(values), 1)[0])

    # 4 ms, a rate of 0.4 of the crank's: not all of the error is its leading term
    assert order(errors) == pytest.approx(2, abs=0.15)
    assert errors[-1] < 2e-4
    # smooth: of higher order than the error
    assert order(wobbles) > 2.5
    if scheme[0] == "ep":
        # means as they are: half of each is the alternation
        assert order([float(np.abs(e).max()) for e in own]) == pytest.approx(1, abs=0.1)
        assert alternating(own[-1]) > 0.5 * np.abs(own[-1]).max() > 1e-3


def test_they_are_asked_for() -> None:
    scene = slider_crank.scene(dt=2e-3, t_end=4e-3)
    without = execute(scene)
    assert not [name for name in without.rows[0] if name.endswith("_end")]
    asked = execute(Options(end_forces=True).apply(scene))
    more = {f"{joint.name}.{k}_end" for joint in scene.joints for k in ("F1", "F2", "F3")}
    more |= {f"{joint.name}.{k}_end" for joint in scene.joints for k in ("M1", "M2", "M3")}
    more |= {"drive.torque_end"}
    more |= {name.replace("_end", "_mean") for name in more}
    assert asked.rows[0].keys() - without.rows[0].keys() == more
    # looking changes nothing
    assert all(asked.rows[-1][name] == without.rows[-1][name] for name in ("drive.torque", "t"))
    assert np.isnan(asked.rows[0]["drive.torque_end"])


def test_statics_has_no_others() -> None:
    scene: Any = slider_crank.scene().with_options(scheme="static", dt=0.5, t_end=1.0)
    rows = execute(replace(scene, t_end=0.5, output=ENDS)).rows
    assert "drive.torque" in rows[-1] and "drive.torque_end" not in rows[-1]


def test_acceleration_of_a_motion() -> None:
    """Of fourth order in the step, from inside of it; exact for polynomials of degree 5."""
    found = end_acceleration(lambda t: np.array([t**5, np.sin(3 * t)]), 0.4, 0.1)
    # round-off over the square of a twentieth of the step
    assert found[0] == pytest.approx(20 * 0.5**3, rel=1e-9)
    assert found[1] == pytest.approx(-9 * np.sin(1.5), rel=1e-6)


@pytest.mark.parametrize("scheme", [("ed", 1.0), ("ep4", 0.0)], ids=lambda s: s[0])
def test_means_of_supports_balance_the_momentum(scheme, plate) -> None:
    """Change of the momentum of a cantilever over each step, by its weight and what holds it."""
    held = {"supports": Clamped("left"), "loads": Gravity((0.01, 0.0, 0.02))}
    found = execute(plate(*scheme, dt=0.1, t_end=0.5, output=ENDS, **held))
    weight = 0.1 * np.array([0.01, 0.0, 0.02])
    force = np.stack([found.column(f"plate.left.F{c}")[1:] for c in "xyz"], axis=1)
    momentum = np.stack([found.column(f"momentum_{c}") for c in "xyz"], axis=1)
    change = np.diff(momentum, axis=0) / 0.1
    assert np.abs(change - weight - force).max() < 1e-11 * np.abs(force).max()
    assert np.abs(found.column("plate.left.Fz_end")[-1]) > 0


def test_held_strains_are_refused(plate) -> None:
    scene = plate("ep")
    held = replace(scene.shells[0], transverse_shear=False)
    with pytest.raises(SceneError, match="'plate': it holds strains at zero"):
        replace(scene, shells=held, output=ENDS)
