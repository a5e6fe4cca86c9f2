"""Gears, belts, differentials and sums of coordinates: exact motions, torques, work and momenta.

The kind: linear relations of the coordinates of joints, with any factors, of rotations and
translations, over time, in all schemes. Motions with constant torques about parallel axes are
known in closed form; EP4 has them to the fourth order.
"""

from typing import Any

import numpy as np
import pytest

import shellmb as sm

Z, SCHEMES = (0.0, 0.0, 1.0), ("ep", "ed", "ep4", "ed3")
# moments of inertia about the axes, and mass of the rack
INERTIA = {"a": 0.2, "b": 0.5, "c": 0.3}
MASS = 2.0


def train(couplings: Any, torque: float = 0.4, **more: Any) -> sm.Scene:
    """Three wheels on the ground about parallel axes, a rack, and a motor on the first wheel."""
    wheels = [
        sm.RigidBody(name, 1.0, (INERTIA[name],) * 3, position=(0.5 * k, 0.1, 0.0))
        for k, name in enumerate(INERTIA)
    ]
    rack = sm.RigidBody("rack", MASS, (0.1, 0.1, 0.1), position=(0.0, 1.0, 0.0))
    joints = [sm.Revolute(f"on_{w.name}", sm.GROUND, w.name, axis=Z, at=w.position) for w in wheels]
    joints += [sm.Prismatic("slide", sm.GROUND, "rack", at=(0.0, 1.0, 0.0), axis=(1, 0, 0))]
    motor = sm.Motor("motor", "on_a", lambda angle, rate, t: torque + 0 * angle)
    options: Any = {"scheme": "ep", "dt": 0.05, "t_end": 0.5} | more
    return sm.Scene(
        "train",
        rigid_bodies=[*wheels, rack],
        joints=joints,
        couplings=couplings,
        force_elements=[motor, *options.pop("force_elements", ())],
        **options,
    )


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_train_of_gears_moves_as_one_inertia(scheme: str) -> None:
    """Outer gears, a crossed belt, and a pinion with its rack; torques are those of each wheel."""
    ratio, radii, radius = -0.4, (0.3, 0.2), 0.15
    couplings = [
        sm.Gear("gear", "on_a", "on_b", ratio=ratio),
        sm.Belt("belt", "on_b", "on_c", radii=radii, crossed=True),
        sm.Gear("pinion", "on_c", "slide", ratio=radius),
    ]
    of_c = -ratio * radii[0] / radii[1]
    of_rack = of_c * radius
    whole = INERTIA["a"] + INERTIA["b"] * ratio**2 + INERTIA["c"] * of_c**2 + MASS * of_rack**2
    run = sm.run(train(couplings, scheme=scheme), pictures=False)
    end, rate = run.history.iloc[-1], 0.4 / whole
    rotation = end["on_a.rotation"]
    # an angle of 0.2 rad, of which EP turns by 2 atan(h/2) in a step
    near = {"ep": 1e-3, "ed": 1e-3, "ep4": 1e-6, "ed3": 1e-4}[scheme]
    assert rotation == pytest.approx(rate * 0.5**2 / 2, rel=near)
    # exactly in proportion
    angles = end[["on_b.rotation", "on_c.rotation", "slide.translation"]].to_numpy()
    assert angles == pytest.approx(rotation * np.array([ratio, of_c, of_rack]), rel=1e-12)
    torques = end[["pinion.slide.force", "pinion.on_c.torque", "gear.on_a.torque"]].to_numpy()
    expected = [MASS * of_rack * rate, -radius * MASS * of_rack * rate, INERTIA["a"] * rate - 0.4]
    assert torques == pytest.approx(expected, rel=10 * near)
    assert run.summary["energy_balance_error"] < 1e-11
    assert run.warnings == ()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_sum_over_time_moves_what_it_couples(scheme: str) -> None:
    """2 a + b = t^3: both wheels as the equations with one multiplier say; its work is booked."""

    def given(t: float) -> float:
        return t**3

    coupling = sm.Coupling("sum", {"on_a": 2.0, "on_b": 1.0}, given)
    runs = [sm.run(train(coupling, scheme=scheme, dt=dt), pictures=False) for dt in (0.1, 0.05)]
    # I_a a'' = 0.4 + 2 m, I_b b'' = m, 2 a'' + b'' = 6 t
    share = 4 / INERTIA["a"] + 1 / INERTIA["b"]
    b = (0.5**3 - 0.8 / INERTIA["a"] * 0.5**2 / 2) / share / INERTIA["b"]
    errors = []
    for run in runs:
        history = run.history
        errors.append(abs(history["on_b.rotation"].iloc[-1] - b))
        total = 2 * history["on_a.rotation"] + history["on_b.rotation"] - history["t"] ** 3
        assert abs(total).max() < 1e-12
        assert run.summary["energy_balance_error"] < 1e-11
        assert abs(history["work_supports"].iloc[-1]) > 1e-3
    assert errors[1] < {"ep": 2e-4, "ed": 2e-4, "ep4": 1e-6, "ed3": 1e-5}[scheme]
    assert errors[1] < errors[0] or errors[1] < 1e-9


def test_differentials_and_planets() -> None:
    """Sun, ring and carrier as Willis says; a differential shares its torque."""
    for teeth in ((1.0, 1.0), (20.0, 60.0)):
        planet = sm.Differential("planet", "on_c", "on_a", "on_b", teeth=teeth)
        run = sm.run(train(planet, scheme="ep"), pictures=False)
        a, b, c = (run.history[f"on_{n}.rotation"] for n in INERTIA)
        assert abs(teeth[0] * (a - c) + teeth[1] * (b - c)).max() < 1e-12
        torques = run.history[[f"planet.on_{n}.torque" for n in INERTIA]].iloc[-1].to_numpy()
        assert torques == pytest.approx(
            torques[0] / teeth[0] * np.array([*teeth, -sum(teeth)]), rel=1e-12
        )


def test_springs_act_through_gears_in_statics() -> None:
    """A torque on the first wheel, a spring on the second one: a = torque/(ratio^2 stiffness)."""
    spring = sm.JointSpring("spring", "on_b", stiffness=3.0)
    rest = [sm.JointSpring(f"rest_{n}", n, stiffness=1.0) for n in ("on_c", "slide")]
    gear = sm.Gear("gear", "on_a", "on_b", ratio=-0.5)
    scene = train(gear, force_elements=[spring, *rest], scheme="static", dt=None, t_end=None)
    end = sm.run(scene, pictures=False).history.iloc[-1]
    assert end["on_a.rotation"] == pytest.approx(0.4 / (0.25 * 3.0), rel=1e-9)
    assert end["gear.on_a.torque"] == pytest.approx(-0.4, rel=1e-9)


@pytest.mark.parametrize(
    ("coupling", "sentence"),
    [
        (sm.Gear("g", "on_a", "nowhere", ratio=1.0), "coupling 'g': there is no joint 'nowhere'"),
        (sm.Gear("g", "on_a", ("on_b", "translation"), ratio=1.0), "has no translation"),
        (sm.Gear("g", "on_a", "on_a", ratio=2.0), "it must have two or more, each once"),
        (sm.Coupling("g", {"on_a": 1.0}), "it must have two or more, each once"),
        # one coordinate by two names, which would stand still
        (
            sm.Gear("g", "on_a", ("on_a", "rotation"), ratio=2.0),
            "it must have two or more, each once",
        ),
        (sm.Differential("g", "on_a", "on_a", "on_b"), "it must have two or more, each once"),
        (sm.Differential("g", "on_a", "on_b", "on_b"), "it must have two or more, each once"),
        # a belt or a planet on a slide is none
        *(
            (coupled, "the coordinate of joint 'slide' is a translation; it must be a rotation")
            for coupled in (
                sm.Belt("g", "on_a", "slide", radii=(0.1, 0.2)),
                sm.Belt("g", ("slide", "translation"), "on_b", radii=(0.1, 0.2), crossed=True),
                sm.Differential("g", "slide", "on_a", "on_b"),
                sm.Differential("g", "on_a", "on_b", "slide"),
            )
        ),
        (sm.Coupling("g", {"on_a": 1.0, "on_b": 1.0}, lambda t: 1 + t), "must begin as 0"),
        (sm.Coupling("g", {"on_a": 1.0, "on_b": 1.0}, sm.Command("c")), "no value over time"),
        (
            [sm.Gear("g", "on_a", "on_b", ratio=1.0), sm.Gear("h", "on_b", "on_a", ratio=1.0)],
            "1 of the constraints are redundant",
        ),
        (
            [sm.Gear("g", "on_a", "on_b", ratio=1.0), sm.Gear("h", "on_b", "on_a", ratio=2.0)],
            None,
        ),
    ],
)
def test_what_does_not_fit_is_refused(coupling: Any, sentence: str | None) -> None:
    if sentence is None:
        # both wheels stand still
        run = sm.run(train(coupling), pictures=False)
        assert abs(run.history["on_a.rotation"]).max() < 1e-12
        return
    with pytest.raises(sm.SceneError, match=sentence):
        sm.run(train(coupling), pictures=False)


@pytest.mark.parametrize("zero", [0.0, -0.0, 0])
def test_factors_of_zero_are_refused(zero: float) -> None:
    """What has no share in a relation is refused by the parameter that says so."""
    with pytest.raises(sm.SceneError, match=r"gear 'g': ratio is -?0.0; it must not be 0; .* Lock"):
        sm.Gear("g", "on_a", "on_b", ratio=zero)
    with pytest.raises(sm.SceneError, match="coupling 'g': the factor of 'on_b' is 0; it must not"):
        sm.Coupling("g", {"on_a": 1.0, "on_b": zero})
