"""Relaxation of springs: closed forms, orders, exact balance in a mechanism that turns far.

Kind: memory of one coordinate, a distance or that of a joint, beside the state, in every scheme.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

import shellmb as sm
from shellmb.errors import ConvergenceError, SceneError
from shellmb.running.execute import execute
from shellmb.running.resume import resume
from shellmb.simulate.simulation import BaseObserver, Simulation

SCHEMES = ("ep", "ed", "ep4", "ed3")
K, SERIES = 100.0, ((0.3, 0.05), (0.2, 0.5))


def alpha(scheme: str) -> dict[str, float]:
    return {"alpha": 0.5} if scheme in ("ed", "ed3") else {}


def mechanism(scheme: str, h: float, end: float = 1.0, **series: Any) -> sm.Scene:
    """A double pendulum that turns far, with springs on a joint and between points."""
    prony = sm.Prony(SERIES, **series)
    return sm.Scene(
        "mechanism",
        rigid_bodies=[
            sm.RigidBody("arm", 2.0, (0.02, 0.3, 0.3), com=(0.5, 0, 0)),
            sm.RigidBody("bob", 1.0, (0.01, 0.1, 0.1), position=(1, 0, 0), com=(0.4, 0.1, 0)),
        ],
        joints=[
            sm.Revolute("hinge", sm.GROUND, "arm", at=(0, 0, 0), axis=(0, 1, 0)),
            sm.Revolute("elbow", "arm", "bob", at=(1, 0, 0), axis=(0, 1, 0)),
        ],
        force_elements=[
            sm.JointSpring("coil", "elbow", stiffness=3.0, rest=0.3, relaxation=prony),
            sm.JointSpring("plain", "elbow", stiffness=1.0),
            sm.Spring(
                "cord",
                sm.GROUND,
                "bob",
                at=(0.5, 0, 1),
                second_at=(1.8, 0, 0),
                stiffness=20.0,
                length=1.0,
                relaxation=prony,
            ),
        ],
        loads=sm.Gravity((0, 0, -9.81)),
        scheme=scheme,
        dt=h,
        t_end=end,
        solver=sm.Solver(tolerance=1e-13),
        **alpha(scheme),
    )


def test_the_balance_closes_while_it_turns_far() -> None:
    """What goes in is stored or dissipated; the dashpots only take."""
    for scheme in SCHEMES:
        run = sm.run(mechanism(scheme, 0.02, 0.6, relaxed=scheme != "ed"))
        assert run.summary["energy_balance_error"] < 1e-13, scheme
        for name in ("coil", "cord"):
            assert np.all(np.diff(run.history[f"{name}.relaxation.loss"]) > 0)
        assert np.ptp(run.history["elbow.rotation"]) > 1.0


def pendulum(scheme: str, h: float, end: float = 0.5) -> sm.Scene:
    """A single arm of it, which turns about +y, with a coil and a cord."""
    whole = mechanism(scheme, h, end)
    coil, _, cord = whole.force_elements
    cord = replace(cord, second="arm", second_at=(1, 0, 0))
    coil = replace(coil, joint="hinge")
    bodies, joints = whole.rigid_bodies[:1], whole.joints[:1]
    return replace(whole, rigid_bodies=bodies, joints=joints, force_elements=(coil, cord))


def pendulum_by_scipy(end: float) -> tuple[float, float]:
    """Its angle, and what its four dashpots have dissipated."""
    share = 1 - sum(g for g, _ in SERIES)

    def strains(angle: float) -> np.ndarray:
        length = np.hypot(np.cos(angle) - 0.5, -np.sin(angle) - 1)
        return np.array([angle - 0.3, length - 1.0])

    g, tau, k = *np.array(SERIES).T, np.array([3.0, 20.0])
    V = strains(0.0)[:, None] * np.ones(2)

    def rates(t: float, y: np.ndarray) -> list[float]:
        angle, V, h = y[0], y[2:6].reshape(2, 2), 1e-5
        e = strains(angle)
        forces = k * (share * e + (e[:, None] - V) @ g)
        slope = (strains(angle + h) - strains(angle - h)) / (2 * h)
        rate = (e[:, None] - V) / tau
        spent = float((k[:, None] * g * tau * rate**2).sum())
        moment = 2.0 * 9.81 * 0.5 * np.cos(angle) - forces @ slope
        return [y[1], moment / (0.3 + 2.0 * 0.25), *rate.ravel(), spent]

    found = solve_ivp(rates, (0, end), [0, 0, *V.ravel(), 0], "DOP853", rtol=1e-12, atol=1e-13)
    return float(found.y[0, -1]), float(found.y[-1, -1])


def test_orders_by_another_code() -> None:
    """Angle and loss of a pendulum: orders 2, 2, 4, 3 by regression, errors to those of SciPy."""
    exact, steps = np.array(pendulum_by_scipy(0.5)), np.array([10, 20, 40])
    for scheme, order in zip(SCHEMES, (2, 2, 4, 3), strict=True):
        ends = [sm.run(pendulum(scheme, 0.5 / n)).history.iloc[-1] for n in steps]
        loss = ["coil.relaxation.loss", "cord.relaxation.loss"]
        found = np.array([[end["hinge.rotation"], end[loss].sum()] for end in ends])
        errors = np.abs(found - exact)
        slopes = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
        assert slopes == pytest.approx(order, abs=0.35), scheme
        assert errors[-1].max() < {2: 2e-3, 3: 2e-5, 4: 2e-6}[order], scheme


def slide(scheme: str, held: bool, h: float = 0.01, **more: Any) -> sm.Scene:
    """A block on a slide, on which a spring with a joint's coordinate acts."""
    series = more.pop("series", sm.Prony(SERIES))
    rest = more.pop("rest", 0.0)
    spring = sm.JointSpring("spring", "slide", K, rest=rest, relaxation=series)
    given: dict[str, Any] = {"drivers": sm.Driver("drive", "slide", translation=lambda t: 0.0 * t)}
    return sm.Scene(
        "slide",
        rigid_bodies=sm.RigidBody("block", 1e-6, (1e-6, 1e-6, 1e-6)),
        joints=sm.Prismatic("slide", sm.GROUND, "block", at=(0, 0, 0), axis=(0, 0, 1)),
        scheme=scheme,
        dt=h,
        **{"t_end": 1.0, "force_elements": spring} | (given if held else {}) | alpha(scheme) | more,
    )


def test_a_held_spring_relaxes() -> None:
    """Strained at once by 0.1 m: the force is K G(t) 0.1; columns are means over the steps."""
    series = sm.Prony(SERIES, relaxed=False)
    for scheme, error in zip(SCHEMES, (1e-2, 1e-3, 1e-5, 1e-4), strict=True):
        found = sm.run(slide(scheme, True, series=series, rest=-0.1)).history
        t = found["t"].to_numpy()
        assert found["spring.force"].iloc[0] == pytest.approx(0.1 * K)
        mean = sum(g * tau * -np.diff(np.exp(-t / tau)) / 0.01 for g, tau in SERIES)
        wanted = 0.1 * K * (0.5 + mean)
        np.testing.assert_allclose(found["spring.force"][1:], wanted, rtol=error)
        np.testing.assert_allclose(found["drive.force"][1:], wanted, rtol=error)
        lost = 0.1**2 * K / 2 * sum(g * (1 - np.exp(-2 * t[-1] / tau)) for g, tau in SERIES)
        assert found["spring.relaxation.loss"].iloc[-1] == pytest.approx(lost, rel=error)
    force = {
        relaxed: sm.run(
            slide("static", True, 1.0, series=replace(series, relaxed=relaxed), rest=-0.1)
        )
        .history["spring.force"]
        .iloc[-1]
        for relaxed in (True, False)
    }
    assert force == pytest.approx({True: 0.05 * K, False: 0.1 * K})


def test_storage_and_loss_by_a_harmonic_motion() -> None:
    """Force in and out of phase with sin(w t), after the start has died away."""
    w, n, g, tau = 8.0, 60, np.array([0.4]), np.array([0.1])
    h = 2 * np.pi / w / n
    drive = sm.Driver("drive", "slide", translation=lambda t: 0.1 * np.sin(w * t))
    more = {"drivers": drive, "t_end": 4 * n * h, "series": sm.Prony([(0.4, 0.1)])}
    history = sm.run(slide("ep4", True, h, **more)).history
    found = history.iloc[-n:]
    middle, a = found["t"].to_numpy() - h / 2, w * tau
    waves = np.column_stack([np.sin(w * middle), np.cos(w * middle)]) * np.sinc(w * h / 2 / np.pi)
    found_moduli = np.linalg.lstsq(waves, found["spring.force"] / 0.1, rcond=None)[0]
    moduli = K * np.array([1 - g.sum() + g @ (a**2 / (1 + a**2)), g @ (a / (1 + a**2))])
    np.testing.assert_allclose(found_moduli, moduli, rtol=1e-5)
    cycle = np.ptp(history["spring.relaxation.loss"][-n - 1 :])
    assert cycle == pytest.approx(np.pi * moduli[1] * 0.1**2, rel=1e-5)


def test_a_spring_creeps() -> None:
    """A force at once on a block without mass to speak of; at h/2 as at h."""
    g, tau = 0.4, 0.5
    for h in (0.02, 0.01):
        load = sm.PointForce("center", (0, 0, 10.0), body="block")
        more = {"loads": load, "alpha": 1.0, "series": sm.Prony([(g, tau)]), "t_end": 2.0}
        found = sm.run(slide("ed3", False, h, **more)).history
        wanted = 10 / (K * (1 - g)) * (1 - g * np.exp(-(1 - g) * found["t"] / tau))
        np.testing.assert_allclose(found["slide.translation"][10:], wanted[10:], rtol=1e-5)


class Stops(BaseObserver):
    """Ends a run in the middle."""

    def accepted(self, simulation: Simulation) -> None:
        if simulation.step == 5:
            raise ConvergenceError("in the middle")


def test_a_run_resumes_bit_for_bit(tmp_path: Path) -> None:
    scene = replace(mechanism("ed", 0.02, 0.2), solver=sm.Solver(newton="full"))
    whole = execute(scene, tmp_path / "whole", pictures=False).history
    with pytest.raises(ConvergenceError):
        execute(scene, tmp_path / "half", [Stops()], pictures=False)
    found = resume(tmp_path / "half", scene=scene, pictures=False).history
    for name in set(whole) - {"wall_s"}:
        np.testing.assert_array_equal(found[name], whole[name], err_msg=name)


def test_derivatives_are_those_of_runs() -> None:
    def scene(share: float = 0.3, time: float = 0.05, stiffness: float = 20.0) -> sm.Scene:
        whole = pendulum("ep4", 0.02, 0.2)
        coil, cord = whole.force_elements
        series = sm.Prony(((share, time), (0.2, 0.5)))
        cord = replace(cord, relaxation=series, stiffness=stiffness)
        return replace(whole, force_elements=(coil, cord))

    found = sm.sensitivities(scene, parameters=("share", "time", "stiffness")).history
    for name, value in (("share", 0.3), ("time", 0.05), ("stiffness", 20.0)):
        for column in ("hinge.rotation", "cord.force"):
            h = 1e-4 * value
            above, below = (sm.run(scene(**{name: value + d})).history[column] for d in (h, -h))
            wanted = (above.iloc[-1] - below.iloc[-1]) / (2 * h)
            assert found[name, column].iloc[-1] == pytest.approx(wanted, rel=1e-5), (name, column)


def test_a_fit_finds_the_series_of_a_creep_test() -> None:
    """Data are the closed form of a strip whose tip carries a force, with noise."""
    g, tau, long_term = 0.4, 0.8, 1e-3 / (3 * 2e9 * 0.2 * 0.02**3 / 12)

    def strip(share: float = 0.25, time: float = 1.5) -> sm.Scene:
        series = sm.Prony(((share, time),))
        bar = sm.RectangularSection(
            2e9, 0.0, width=0.2, height=0.02, density=1e-4, relaxation=series
        )
        return sm.Scene(
            "strip",
            beams=sm.Beam("strip", sm.Line((0, 0, 0), (1, 0, 0)), bar, 2),
            supports=sm.Clamped("start"),
            loads=sm.PointForce("end", (0, 0, 1e-3), body="strip"),
            probes=sm.Probe("tip", "end", component=2, body="strip"),
            scheme="ed3",
            alpha=1.0,
            dt=0.1,
            t_end=3.0,
        )

    t, noise = np.arange(0.5, 3.01, 0.1), 1e-3 * long_term
    creep = long_term / (1 - g) * (1 - g * np.exp(-(1 - g) * t / tau))
    creep += noise * np.random.default_rng(2).normal(size=len(t))
    data = pd.DataFrame({"t": t, "tip": creep})
    fitted = sm.fit(strip, data, ("share", "time"), noise=noise)
    assert fitted.converged
    for name, value in (("share", g), ("time", tau)):
        assert abs(fitted.values[name] - value) < 4 * fitted.deviations[name]
        assert fitted.deviations[name] < 0.05 * value


def loaded(load: float = 1.0) -> sm.Scene:
    probe = sm.Probe("z", "center", component=2, body="block")
    force = sm.PointForce("center", (0, 0, load), body="block")
    return slide("ep", False, loads=force, probes=probe)


def named(name: str) -> sm.Scene:
    """A spring beside a beam that relaxes, too."""
    section = sm.RectangularSection(
        2e9, 0.3, width=0.2, height=0.02, density=1.0, relaxation=sm.Prony(SERIES)
    )
    beam = sm.Beam("strip", sm.Line((0, 0, 1), (1, 0, 1)), section)
    spring = sm.JointSpring(name, "slide", K, relaxation=sm.Prony(SERIES))
    return slide("ep", False, beams=beam, supports=sm.Clamped("start"), force_elements=spring)


@pytest.mark.parametrize(("scheme", "bound"), [("ep", 2e-4), ("ed3", 2e-6), ("ep4", 5e-8)])
def test_forces_at_the_end_of_a_step(scheme: Any, bound: float) -> None:
    """Held at a length: its force, and that of what holds it, fall as in closed form."""
    g, tau, k, x = 0.4, 0.6, 2000.0, 0.01
    series = sm.Prony([(g, tau)], relaxed=False)
    scene = sm.Scene(
        "held",
        rigid_bodies=sm.RigidBody("grip", 1.0, (1e-3, 1e-3, 1e-3)),
        joints=sm.Prismatic("slide", sm.GROUND, "grip", at=(0, 0, 0), axis=(0, 0, 1)),
        drivers=sm.Driver("hold", "slide", translation=lambda t: 0.0 * t),
        force_elements=sm.JointSpring("rubber", "slide", k, rest=-x, relaxation=series),
        output=sm.Output(end_forces=True),
        scheme=scheme,
        dt=0.05,
        t_end=0.5,
    )
    history = sm.run(scene, pictures=False).history[1:]
    exact = k * x * (1 - g + g * np.exp(-history["t"] / tau))
    for name in ("rubber.force_end", "hold.force_end"):
        np.testing.assert_allclose(abs(history[name]), exact, rtol=bound)


BAD: dict[str, Callable[[], Any]] = {
    "spring 'soft': it has a relaxation and a potential": lambda: sm.JointSpring(
        "soft", "slide", potential=lambda x: x**4, relaxation=sm.Prony(SERIES)
    ),
    "spring 'spring': its Prony series has relaxed=False, and the scene starts in": lambda: slide(
        "ep", False, series=sm.Prony(SERIES, relaxed=False), start="equilibrium"
    ),
    "spring 'spring' relaxes, and there are equations": lambda: sm.linearise(
        slide("ep", False, series=sm.Prony(SERIES, relaxed=False)), at="equilibrium"
    ),
    "'joint spring 'spring'': it has a relaxation; scheme 'generalized-alpha'": lambda: sm.run(
        slide("generalized-alpha", False)
    ),
    "spring 'strip': a body that relaxes has this name": lambda: named("strip"),
}


@pytest.mark.parametrize("message", BAD)
def test_what_cannot_relax_gets_a_sentence(message: str) -> None:
    with pytest.raises(SceneError, match=message):
        BAD[message]()
