"""A wing of two folded panels is opened by springs in hinges of their edges, which latch.

Each hinge is one `EdgeHinge` between an edge of a panel and the body or panel before it; spring,
damper and latch act on its angle. The wing is folded like a Z on the side of a fixed body. The root
latches at 90 degrees and the hinge between the panels at 180, each at its own angle, without a
clock. Until the first of them latches, rigid panels are a double pendulum with two unknowns, which
is integrated here. When both are latched, a rigid wing has no energy but that of the springs, and
the latches have taken all the rest. A flexible wing swings on.
"""

# KIND: mechanisms
# CI: shellmb run panel_hinge --check
# CI: shellmb run panel_hinge --check --set model=rigid --no-pictures --out runs/ci-hinge-rigid

import math
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from shellmb.scene import (
    GROUND,
    EdgeHinge,
    Event,
    Isotropic,
    JointDamper,
    JointSpring,
    Lock,
    Output,
    Probe,
    Rectangle,
    Scene,
    Sensor,
    Shell,
)

LENGTH, WIDTH = 1.0, 0.5  # of a panel [m]
SKIN = Isotropic(E=70e9, nu=0.3, thickness=4e-3, density=2700.0)
# stiffness [N m/rad], rest and latch [rad], damping [N m s/rad]
HINGES = {
    "root": (1.5, math.radians(120), math.radians(90), 0.05),
    "middle": (3.0, -math.radians(200), -math.radians(180), 0.05),
}


def scene(
    model: Literal["exact", "floating-frame", "rigid"] = "exact",
    dt: float = 0.01,
    t_end: float = 4.0,
):
    """The wing.

    Args:
        model: How the panels deform.
        dt: Time step [s].
        t_end: End of the run [s].
    """
    # the inner panel up along the side of the body, the outer one down again, on top of it
    corner = (0.0, -WIDTH / 2, 0.0)
    top = (0.0, -WIDTH / 2, LENGTH)
    inner = Rectangle(LENGTH, WIDTH, corner, axis1=(0, 0, 1), axis2=(0, 1, 0))
    outer = Rectangle(LENGTH, WIDTH, top, axis1=(0, 0, -1), axis2=(0, 1, 0))
    elements: list[JointSpring | JointDamper] = []
    events, locks = [], []
    for name, (stiffness, rest, latch, damping) in HINGES.items():
        elements.append(JointSpring(f"{name} spring", name, stiffness, rest=rest))
        elements.append(JointDamper(f"{name} damper", name, damping))
        angle = Sensor(f"{name}.rotation")
        events.append(Event(f"{name} latched", angle >= latch if latch > 0 else angle <= latch))
        locks.append(Lock(name, when=f"{name} latched"))
    return Scene(
        "panel_hinge",
        [
            Shell(n, s, SKIN, mesh=(2, 1), model=model)
            for n, s in (("inner", inner), ("outer", outer))
        ],
        joints=[
            EdgeHinge("root", GROUND, "inner", second_at="left", rigid_angle=True),
            EdgeHinge("middle", "inner", "outer", at="right", second_at="left", rigid_angle=True),
        ],
        force_elements=elements,
        locks=locks,
        events=events,
        probes=Probe("tip", (0.0, 0.0, 0.0), "position", 0, body="outer"),
        scheme="ed3",
        alpha=1.0,
        dt=dt,
        t_end=t_end,
        output=Output(frames=61),
        units="m, kg, s",
    )


def rigid_latch():
    """Find when the first hinge of rigid panels latches [s], and which one."""
    mass = SKIN.density * SKIN.thickness * LENGTH * WIDTH
    inertia = mass * (LENGTH**2 / 3 + SKIN.thickness**2 / 12)
    (k1, r1, l1, c1), (k2, r2, l2, c2) = HINGES.values()

    def rates(_, state):
        """Of the root's angle and of the angle of the outer panel, which points the other way."""
        first, last, w1, w2 = state
        # the outer panel is turned by `last`, from a start at pi against the inner one
        c, s = (-mass * LENGTH**2 / 2 * f(last - first) for f in (math.cos, math.sin))
        middle = last - first
        t1, t2 = -k1 * (first - r1) - c1 * w1, -k2 * (middle - r2) - c2 * (w2 - w1)
        matrix = [[inertia + mass * LENGTH**2, c], [c, inertia]]
        w = np.linalg.solve(matrix, [t1 - t2 + s * w2**2, t2 - s * w1**2])
        return [w1, w2, *w]

    def root(_, state):
        return state[0] - l1

    def middle(_, state):
        return state[1] - state[0] - l2

    found = solve_ivp(rates, (0.0, 10.0), [0.0] * 4, events=(root, middle), rtol=1e-11, atol=1e-12)
    times = {
        name: float(min(t, default=math.inf))
        for name, t in zip(HINGES, found.t_events, strict=True)
    }
    first = min(times, key=times.__getitem__)
    return times[first], first


def results(run):
    """Measure when the hinges latch, at which angles, and what the latches took."""
    history, events = run.history, run.summary["events"]
    time, which = rigid_latch()
    times = {name: events[f"{name} latched"]["times"] for name in HINGES}
    latches = [latch for _, _, latch, _ in HINGES.values()]
    last = [float(history[f"{name}.rotation"].iloc[-1]) for name in HINGES]
    stored = [k * r**2 / 2 for k, r, _, _ in HINGES.values()]
    left = [k * (r - a) ** 2 / 2 for (k, r, _, _), a in zip(HINGES.values(), last, strict=True)]
    return {
        "first_latch": min(t[0] for t in times.values() if t),
        "rigid_first_latch": time,
        "first_is_the_same": float(times[which] == min(t for t in times.values() if t)),
        "latched": float(sum(map(len, times.values()))),
        "angle_error": float(np.abs(np.subtract(last, latches)).max()),
        "released": sum(stored) - sum(left),
        "taken": float(history["dissipation"].iloc[-1]) - float(history["work_terms"].iloc[-1]),
        "tip": float(history["tip"].iloc[-1]),
        "energy_balance_error": run.summary["energy_balance_error"],
        "rigid": float(run.scene.shell("inner").rigid),
    }


def check(results):
    """Rigid panels latch when the double pendulum does; a flexible wing is later or earlier by less
    than a tenth."""
    assert results["energy_balance_error"] < 1e-9
    assert results["latched"] == 2
    assert results["first_is_the_same"]
    assert results["angle_error"] < 1e-6
    late = abs(results["first_latch"] / results["rigid_first_latch"] - 1)
    if results["rigid"]:
        assert late < 1e-5
        assert abs(results["taken"] / results["released"] - 1) < 1e-5
        assert abs(results["tip"] - 2 * LENGTH) < 1e-5
    else:
        assert late < 0.1
        assert abs(results["tip"] - 2 * LENGTH) < 0.2
