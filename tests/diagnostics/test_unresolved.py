"""Functions of time and laws of motors that jump within steps are named; none that is smooth."""

import math

import pytest
import ufl

import shellmb as sm

INERTIA = 0.4
# end of the run, and a jump that is no end of a step
END, JUMP = 1.0, 0.333


def turned(scheme, law=None, time=None, **more):
    """A body on a hinge, turned by a motor or a moment: how far at the end, and its warnings."""
    motor = sm.Motor("motor", "hinge", law) if law else ()
    moment = sm.PointMoment("center", (0, 0, 1.0), body="hub", time=time) if time else ()
    scene = sm.Scene(
        "turned",
        rigid_bodies=sm.RigidBody("hub", 12.0, (0.2, 0.2, INERTIA)),
        joints=sm.Revolute("hinge", sm.GROUND, "hub", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=motor,
        loads=moment,
        scheme=scheme,
        dt=0.02,
        t_end=END,
        **more,
    )
    run = sm.run(scene)
    return run.history["hinge.rotation"].iloc[-1], run.warnings


def jumping(angle, rate, t):
    """One before the jump, then minus two."""
    return ufl.conditional(ufl.lt(t, JUMP), 1.0, -2.0)


EXACT = (END**2 / 2 - 3 * (END - JUMP) ** 2 / 2) / INERTIA


@pytest.mark.parametrize("scheme", ["ep", "ep4", "ed3"])
def test_a_law_that_jumps_within_a_step_is_named(scheme) -> None:
    rotation, warnings = turned(scheme, jumping)
    # a fifth of a step at most of a torque of three
    assert 1e-3 < abs(rotation - EXACT) < 0.2 * 0.02 * 3 * (END - JUMP) / INERTIA
    (sentence,) = warnings
    assert "motor 'motor' jumps within steps" in sentence and "t = 0.32 to 0.34" in sentence


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_what_the_sentence_says_to_do_is_exact(scheme) -> None:
    """A constant torque on a body about a fixed axis is exact in every step."""
    control = sm.StepControl(times=(JUMP,))
    rotation, warnings = turned(scheme, jumping, step_control=control)
    # not round-off: a body's middle lags by the square of its turn in a step
    assert abs(rotation - EXACT) < 1e-4 and not warnings


@pytest.mark.parametrize(
    ("time", "share"), [(sm.Step(JUMP), 0.3), (lambda t: math.exp(-(((t - 0.5) / 2e-3) ** 2)), 30)]
)
def test_loads_that_jump_or_are_too_short_are_named(time, share) -> None:
    (sentence,) = turned("ep4", time=time)[1]
    assert "point moment on 'hub' jumps" in sentence and f"off by about {share}" in sentence


@pytest.mark.parametrize("time", [sm.Step(0.2), sm.Ramp(0.1, start=JUMP), sm.Sine(10.0)])
def test_steps_that_end_at_a_jump_corners_and_five_steps_a_period_are_not(time) -> None:
    assert not turned("ep4", time=time)[1]


def test_a_smooth_law_is_not_named_and_one_that_jumps_with_the_angle_is() -> None:
    assert not turned("ep4", lambda angle, rate, t: 20 * (0.5 - angle) - 2 * rate + t)[1]
    assert not turned("ep4", lambda angle, rate, t: 1.0)[1]
    bang = turned("ep4", lambda angle, rate, t: ufl.conditional(ufl.lt(angle, 0.21), 1.0, -1.0))
    assert "motor 'motor' jumps" in bang[1][0]


def arm(function, where, **more):
    """A body on a hinge or a rod that moves as given: warnings of its run."""
    hinge = sm.Revolute("hinge", sm.GROUND, "arm", at=(0, 0, 0), axis=(0, 0, 1))
    given = {
        "driver": lambda: {"joints": hinge, "drivers": sm.Driver("d", "hinge", rotation=function)},
        "coupling": lambda: {
            "joints": (
                hinge,
                sm.Revolute("other", sm.GROUND, "arm2", at=(3, 0, 0), axis=(0, 0, 1)),
            ),
            "couplings": sm.Coupling("c", {"hinge": 1.0, "other": 1.0}, value=function),
        },
        "distance": lambda: {
            "joints": sm.Distance(
                "rod",
                sm.GROUND,
                "arm",
                at=(2, 0, 0),
                second_at="origin",
                length=lambda t: 2.0 + function(t),
            )
        },
    }
    bodies = [
        sm.RigidBody(name, 1.0, (0.1, 0.1, 0.1), com=(0.5, 0, 0), position=(x, 0, 0))
        for name, x in (("arm", 0.0), ("arm2", 3.0))
    ]
    scene = sm.Scene(
        "arm", rigid_bodies=bodies, **given[where](), scheme="ep4", dt=0.02, t_end=0.4, **more
    )
    return [w for w in sm.run(scene, progress=False).warnings if "jumps by" in w]


@pytest.mark.parametrize("jump", [0.2, 0.213, 0.219])
@pytest.mark.parametrize("where", ["driver", "coupling", "distance"])
def test_motions_that_jump_are_named(where, jump) -> None:
    """Kind: given motions, whose jumps no force makes: at ends of steps and within them."""
    (sentence,) = arm(lambda t: 0.1 * t + (0.3 if t >= jump else 0.0), where)
    # at a time that is an end, round-off tells in which of two steps it is
    assert "from t = 0.18 to 0.2," in sentence or "from t = 0.2 to 0.22," in sentence
    # the motion beside it in that step is 0.002
    assert (
        "jumps by 0.302" in sentence
        and {"driver": "'d': rotation", "coupling": "'c'"}.get(where, "'rod'") in sentence
    )


@pytest.mark.parametrize(
    "smooth",
    [
        # eight steps a period
        lambda t: 0.1 * math.sin(2 * math.pi * t / 0.16),
        # a corner within a step, and one at an end of a step
        lambda t: max(0.0, t - 0.213),
        sm.Ramp(0.1, start=0.1),
        # what stands still but for round-off
        lambda t: 0.1 + 1e-17 * math.sin(1e5 * t),
    ],
)
def test_motions_that_do_not_jump_are_not_named(smooth) -> None:
    assert not arm(lambda t: smooth(t) - smooth(0.0), "driver")


def test_edges_that_jump_are_named() -> None:
    steel = sm.Isotropic(E=2e9, nu=0.3, thickness=0.01, density=1000)
    plate = sm.Shell("plate", sm.Rectangle(1.0, 0.2), steel, mesh=(2, 1))
    scene = sm.Scene(
        "plate",
        plate,
        supports=sm.Driven("left", axis=(1, 0, 0), rotation=lambda t: 0.01 if t > 0.01 else 0.0),
        scheme="ep",
        dt=4e-3,
        t_end=0.02,
    )
    (sentence,) = [w for w in sm.run(scene, progress=False).warnings if "jumps by" in w]
    assert "rotation jumps by 0.01 from t = 0.008 to 0.012" in sentence
