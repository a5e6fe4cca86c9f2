"""Identify stiffness and friction of a hinge from the noisy record of a swing (`sm.fit`).

A flap hangs on a hinge with a spring and with dry friction, is let go to the side, and swings out.
What is measured is the way of its edge. The record is made by a run with known values, so that the
fit can be judged. Derivatives through friction are exact as long as the flap does not stick.
"""

# KIND: mechanisms
# CI: shellmb run identify_joint --check --no-pictures
# CI --all: python -m shellmb.demos.identify_joint

import math

import numpy as np
import ufl

import shellmb as sm

# what the record is made with, and where a fit begins
TRUTH = {"stiffness": 3.0, "friction": 0.15}
GUESS = {"stiffness": 4.0, "friction": 0.3}
# standard deviation of the noise [m]: two tenths of a millimetre
NOISE = 2e-4
LENGTH, MASS = 0.4, 0.5
# rate at which friction is three quarters of what it becomes [rad/s]
CREEP = 0.05


def scene(stiffness: float = TRUTH["stiffness"], friction: float = TRUTH["friction"]):
    """The flap, let go at 45 degrees.

    Args:
        stiffness: Stiffness of the spring [N m/rad].
        friction: Torque of the friction [N m].
    """
    start = math.radians(45)
    to_edge = LENGTH * np.array([math.sin(start), 0.0, -math.cos(start)])
    flap = sm.RigidBody(
        "flap",
        MASS,
        # a plate of 0.2 m along the hinge
        (MASS * LENGTH**2 / 12, MASS * LENGTH**2 / 12, MASS * 0.2**2 / 12),
        position=tuple(to_edge / 2),
        points={"edge": tuple(to_edge / 2)},
    )
    return sm.Scene(
        "identify_joint",
        rigid_bodies=flap,
        joints=sm.Revolute("hinge", sm.GROUND, "flap", at=(0, 0, 0), axis=(0, 1, 0)),
        force_elements=(
            # positions count from the start
            sm.JointSpring("spring", "hinge", stiffness=stiffness, rest=start),
            sm.JointDamper("friction", "hinge", law=lambda rate: friction * ufl.tanh(rate / CREEP)),
        ),
        loads=sm.Gravity((0, 0, -9.81)),
        probes=(
            sm.Probe("edge_x", "edge", body="flap", component=0),
            sm.Probe("edge_z", "edge", body="flap", component=2),
        ),
        scheme="ep4",
        dt=1e-2,
        t_end=1.2,
        units="m, kg, s",
    )


def record(seed: int):
    """A record of the edge with noise.

    Args:
        seed: Which noise.
    """
    history = sm.run(scene(), pictures=False).history[["t", "edge_x", "edge_z"]].iloc[1:]
    noise = NOISE * np.random.default_rng(seed).standard_normal((len(history), 2))
    return history.assign(edge_x=history.edge_x + noise[:, 0], edge_z=history.edge_z + noise[:, 1])


def identify(seed: int) -> sm.Fit:
    """Fit both parameters to a record."""
    return sm.fit(scene, record(seed), tuple(GUESS), noise=NOISE, values=GUESS)


def results(run):
    """The first swing to the other side."""
    return {"swing": float(-run.column("edge_x").min())}


def check(results):
    """Between once and twice the way to the middle, as friction takes a part."""
    middle = LENGTH * math.sin(math.radians(45))
    assert middle < results["swing"] < 2 * middle


def main() -> None:
    """Identify, and judge what was found."""
    fitted = identify(seed=1)
    print(fitted)
    assert fitted.converged and not fitted.warnings
    assert fitted.runs <= 12
    for name, true in TRUTH.items():
        off = (fitted.values[name] - true) / fitted.deviations[name]
        assert abs(off) < 3.0, f"{name} is off by {off:.2g} deviations"


if __name__ == "__main__":
    main()
