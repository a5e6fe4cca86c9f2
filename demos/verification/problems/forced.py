"""Forced vibration: NAFEMS, Selected Benchmarks for Forced Vibration (R0016, 1989)."""

import math
from collections.abc import Iterator

import numpy as np
import scipy.signal
from scipy.signal import StateSpace

from shellmb.api.responding.linearise import about_state
from shellmb.api.responding.response import damped, response_at
from shellmb.api.responding.system import LinearSystem
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.setups import ALL
from shellmb.options.linear import LinearOptions
from shellmb.scene import (
    Beam,
    Fixed,
    HardSupport,
    Isotropic,
    Line,
    LineForce,
    PointForce,
    Pressure,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
)

SOURCE = "NAFEMS R0016"
RATIO, MODES = 0.02, 16
MILLI, MEGA, H = 1e3, 1e-6, 0.05


def plate() -> Scene:
    """Tests 13: a thin square plate, simply supported, under a uniform pressure."""
    section = Isotropic(200e9, 0.3, thickness=H, density=8000.0)
    shell = Shell("plate", Rectangle(10.0, 10.0), section, mesh=(12, 12))
    centre = (5.0, 5.0, 0.0)
    return Scene(
        "plate",
        shell,
        supports=(HardSupport(ALL), Fixed(ALL, displacement=(0.0, 0.0, None))),
        loads=Pressure(100.0),
        probes=(Probe("u", centre), Probe("M", centre, "bending", 0)),
        scheme="ep",
        dt=1.0,
        t_end=1.0,
    )


def beam() -> Scene:
    """Tests 5: a deep simply supported beam under a uniform force."""
    section = RectangularSection(200e9, 0.3, width=2.0, height=2.0, density=8000.0)
    middle = (5.0, 0.0, 0.0)
    return Scene(
        "beam",
        beams=Beam("beam", Line((0, 0, 0), (10.0, 0, 0)), section, elements=10),
        supports=(
            Fixed("start", displacement=(0.0, 0.0, 0.0)),
            Fixed("end", displacement=(None, 0.0, 0.0)),
        ),
        loads=LineForce((0, 1e6, 0)),
        probes=(Probe("u", middle, component=1), Probe("M", middle, "moment", 2)),
        scheme="ep",
        dt=1.0,
        t_end=1.0,
    )


def _damped(system: LinearSystem, modes: int) -> LinearSystem:
    """Modes with their damping ratio, driven by the load."""
    return damped(system.select("load1").modal(modes), RATIO)


def _peaks(system: LinearSystem, near: float) -> tuple[float, list[float]]:
    """Frequency of the largest displacement, and amplitudes of both outputs there."""
    f = near * np.linspace(0.97, 1.03, 1201)
    sizes = np.abs(response_at(system, f)[:, 0])
    k = int(np.argmax(sizes[0]))
    return float(f[k]), sizes[:, k].tolist()


def _periodic(system: LinearSystem, f: float) -> list[float]:
    """Largest outputs under the load times `sin wt - sin 3 wt`."""
    first, third = np.moveaxis(response_at(system, np.array([f, 3 * f]))[:, 0], 1, 0)
    turn = np.exp(2j * np.pi * np.linspace(0, 1, 4001))
    outputs = (np.outer(first, turn) - np.outer(third, turn**3)).imag
    return np.abs(outputs).max(axis=1).tolist()


def _step(system: LinearSystem, end: float) -> tuple[float, list[float], list[float]]:
    """Time of the largest displacement after a load begins, both outputs then, and at rest."""
    space = StateSpace(*system.state_space())
    t, outputs = scipy.signal.step(space, T=np.linspace(0.0, end, 4001))
    still = -space.C @ np.linalg.solve(space.A, space.B) + space.D
    k = int(np.argmax(np.abs(outputs[:, 0])))
    return float(t[k]), np.abs(outputs[k]).tolist(), np.abs(still[:, 0]).tolist()


@case("forced/NAFEMS 13")
def plates() -> Iterator[Check]:
    """Tests 13H, 13R, 13P, 13T: harmonic, random, periodic and transient, in mm and N/mm^2.

    The closed forms are those of the first mode: 13P and 13T are compared with one mode. The stress
    of 13H is published as 30.03; the displacement's first mode has 32.03, and 13R its square.
    """
    system, stress = about_state(plate(), LinearOptions()), 6 / H**2 * MEGA
    every, one = _damped(system, MODES), _damped(system, 1)
    f, (u, M) = _peaks(every, 2.377)
    yield Check("13H, frequency [Hz]", f, 2.377, SOURCE)
    yield Check("13H, displacement", u * MILLI, 45.42, SOURCE)
    yield Check("13H, stress", M * stress, math.sqrt(1025.44), f"{SOURCE}, 13R", 0.03)
    yield Check("13R, density of the displacement", (u * MILLI) ** 2, 2063.20, SOURCE)
    yield Check("13R, density of the stress", (M * stress) ** 2, 1025.44, SOURCE, 0.05)
    u, M = _periodic(one, 1.2)
    yield Check("13P, displacement", u * MILLI, 2.863, SOURCE)
    yield Check("13P, stress", M * stress, 2.018, SOURCE, 0.03)
    t, (u, M), (still, _) = _step(one, 0.4)
    yield Check("13T, displacement", u * MILLI, 3.523, SOURCE)
    yield Check("13T, time [s]", t, 0.210, SOURCE)
    yield Check("13T, stress", M * stress, 2.484, SOURCE, 0.03)
    yield Check("13T, static displacement", still * MILLI, 1.817, SOURCE)


@case("forced/NAFEMS 5")
def beams() -> Iterator[Check]:
    """Tests 5H and 5T of a deep beam: harmonic and transient, in mm and N/mm^2."""
    system = _damped(about_state(beam(), LinearOptions()), MODES)
    # W = 2^3/6
    stress = 6 / 8 * MEGA
    f, (u, M) = _peaks(system, 42.65)
    yield Check("5H, frequency [Hz]", f, 42.65, SOURCE)
    yield Check("5H, displacement", u * MILLI, 13.45, SOURCE)
    yield Check("5H, stress", M * stress, 241.9, SOURCE, 0.02)
    t, (u, M), (still, _) = _step(system, 0.03)
    yield Check("5T, displacement", u * MILLI, 1.043, SOURCE)
    yield Check("5T, time [s]", t, 0.0117, SOURCE, 0.02)
    yield Check("5T, stress", M * stress, 18.76, SOURCE, 0.03)
    yield Check("5T, static displacement", still * MILLI, 0.538, SOURCE)


@case("forced/plate mobility")
def mobility() -> Iterator[Check]:
    """Driving-point mobility of a thin simply supported plate, by its modes, in m/(N s)."""
    a, b, x, y = 0.5, 0.7, 0.1, 0.2
    E, nu, h, density = 70e9, 0.3, 2e-3, 2700.0
    section = Isotropic(E, nu, thickness=h, density=density)
    scene = Scene(
        "plate",
        Shell("plate", Rectangle(a, b), section, mesh=(10, 14)),
        supports=(HardSupport(ALL), Fixed(ALL, displacement=(0.0, 0.0, None))),
        loads=PointForce((x, y, 0.0), (0, 0, 1.0)),
        probes=Probe("w", (x, y, 0.0)),
        scheme="ep",
        dt=1.0,
        t_end=1.0,
    )
    n = np.arange(1, 61) * math.pi
    shapes = np.outer(np.sin(n * x / a), np.sin(n * y / b)) ** 2 / (density * h * a * b / 4)
    own = math.sqrt(E * h**2 / 12 / (1 - nu**2) / density) * np.add.outer(
        (n / a) ** 2, (n / b) ** 2
    )
    system = damped(
        about_state(scene, LinearOptions()).select("load1").modal(40, static=True), RATIO
    )
    # the first resonance, between resonances, and above ten of them
    f = np.array([20.0, own[0, 0] / (2 * math.pi), 50.0, 110.0, 250.0])
    found = np.abs(response_at(system, f, 1)[0, 0])
    for k, w in enumerate(2 * math.pi * f):
        exact = abs(w * np.sum(shapes / (own**2 - w**2 + 2j * RATIO * own * w)))
        yield Check(f"{f[k]:.4g} Hz", float(found[k]), float(exact), "Navier's modes", 0.02)
