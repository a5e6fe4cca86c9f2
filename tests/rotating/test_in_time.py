"""Modes about steady rotations against small motions in time, which know nothing of them."""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import least_squares

import shellmb as sm
from shellmb.demos.campbell import scene as blade
from shellmb.running.rotating.campbell import campbell
from shellmb.scene import (
    Gravity,
    InitialVelocity,
    Probe,
    RigidBody,
    Scene,
    Spherical,
)


def fitted(t: npt.NDArray, u: npt.NDArray, guess: list[float]) -> tuple[npt.NDArray, float]:
    """Frequencies of the sum of `exp(i w t)` nearest to a signal, and what is left of it."""

    def rest(w: npt.NDArray) -> npt.NDArray:
        base = np.exp(1j * np.outer(t, w))
        left = u - base @ np.linalg.lstsq(base, u, rcond=None)[0]
        return np.concatenate([left.real, left.imag])

    found = least_squares(rest, guess, x_scale=np.abs(guess), xtol=1e-14, ftol=1e-14)
    return found.x, float(np.linalg.norm(found.fun) / np.linalg.norm(u))


@pytest.mark.slow
def test_top_in_time() -> None:
    """Nutation and precession of a top that is pushed, with EP4, seen from the frame."""
    mass, height, rate = 2.0, 0.3, 40.0
    top = RigidBody(
        "top", mass, (0.1, 0.1, 0.15), com=(0, 0, height), points={"head": (0, 0, 2 * height)}
    )
    scene = Scene(
        "top",
        rigid_bodies=top,
        joints=Spherical("tip", "ground", "top", at=(0, 0, 0)),
        loads=Gravity((0, 0, -9.81)),
        initial=InitialVelocity(spin=(0.1, 0, rate)),
        probes=tuple(Probe(f"head_{k}", "head", component=c) for c, k in enumerate("xy")),
        scheme="ep4",
        dt=5e-3,
        t_end=1.5,
    )
    history = sm.run(scene, pictures=False).history
    t = history.index.to_numpy() if "t" not in history else history["t"].to_numpy()
    x, y = (history[f"head_{k}"].to_numpy() for k in "xy")
    (modes,) = campbell(scene, [rate], count=3, loaded=True, axis=(0, 0, 1)).modes
    # both are backward in the frame
    inspace = rate - modes.omega[1:]
    measured, left = fitted(t, x + 1j * y, [0.97 * w for w in inspace])
    # EP4 is off by (w dt)^4/720 = 1e-6 of what turns fastest, the spin; the motion by tilt^2
    assert left < 1e-4
    np.testing.assert_allclose(measured, inspace, rtol=1e-4)


@pytest.mark.slow
def test_blade_in_time() -> None:
    """The first flapping frequencies of the demo's blade at 10 rad/s, in EP4."""
    rate = 10.0
    made = blade(rate, elements=4)
    spin = InitialVelocity(spin=(0, 0, rate))
    struck = InitialVelocity(linear=(0, 0, 0.01), body="blade")
    tip = Probe("tip", (8.5, 0, 0), body="blade")
    moving = replace(
        made, initial=(spin, struck), probes=(tip,), scheme="ep4", dt=8e-3, t_end=3.2, assemble=True
    )
    history = sm.run(moving, pictures=False).history
    t = history.index.to_numpy() if "t" not in history else history["t"].to_numpy()
    z = history["tip"].to_numpy()
    (modes,) = campbell(made, [rate], count=10).modes
    flaps = [
        float(w)
        for w, (real, _) in zip(modes.omega, modes.shapes, strict=True)
        if abs(real["blade"][:, 2]).max() > 0.9
    ][:4]
    guess = [s * 0.98 * w for w in flaps for s in (-1, 1)]
    measured, left = fitted(t, z.astype(complex), guess)
    # flapping beyond the fourth mode, which leaks into what is fitted: 3 %, over 3.2 s
    assert left < 0.05
    own = [math.sqrt(abs(measured[2 * k] * measured[2 * k + 1])) for k in range(4)]
    np.testing.assert_allclose(own[0], flaps[0], rtol=1e-4)
    np.testing.assert_allclose(own[1:3], flaps[1:3], rtol=5e-4)
