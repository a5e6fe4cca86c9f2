"""Beams that tension holds: ropes, cables, strings, rings and blades of next to no bending."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from shellmb.arrays import Floats
from shellmb.demos.references.rotating import flapping
from shellmb.demos.verification.cases import Check, case
from shellmb.running.execute import execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.running.rotating.campbell import campbell
from shellmb.scene import (
    GROUND,
    Beam,
    CircularArc,
    Clamped,
    Fixed,
    GeneralSection,
    Gravity,
    Hinged,
    InitialVelocity,
    Line,
    LineForce,
    ParametricCurve,
    PointForce,
    Probe,
    Revolute,
    Scene,
    Weld,
)

Degree = Literal[2, 3]
BOTH: tuple[Degree, ...] = (2, 3)

GRAVITY, UP = 9.81, (0.0, 0.0, 1.0)


def thin(EA: float, EI: float, inertia: float = 1e-6, mass: float = 1.0) -> GeneralSection:
    """Section of a rope: stiff in tension and shear, with next to no bending stiffness."""
    return GeneralSection(
        (EA, EA, EA, EI, EI, EI), mass_per_length=mass, second_moments=(inertia, 0.0, inertia)
    )


@case("beams/hanging rope")
def rope() -> Iterator[Check]:
    """Gravity at once and a small push to its side: it swings and stretches, and does not fall."""
    EA, EI = 1e4, 1e-4
    kinds: tuple[tuple[str, Degree], ...] = (("ep", 2), ("ep", 3), ("ep4", 2))
    for scheme, degree in kinds:
        beam = Beam("rope", Line((0, 0, 0), (0, 0, -1)), thin(EA, EI, 1e-8), 12, degree=degree)
        scene = Scene(
            "rope",
            beams=(beam,),
            supports=(Hinged("start"),),
            loads=(Gravity((0, 0, -GRAVITY)), PointForce("end", (0.01, 0, 0))),
            probes=(Probe("z", "end", component=2),),
            scheme=scheme,
            dt=1e-3,
            t_end=0.1,
        )
        lowest = float(execute(scene).history["z"].min())
        # the wave of a load that comes at once reaches the end twice as strong
        yield Check(
            f"lowest end over m g L/EA, {scheme}, degree {degree}, 12 elements",
            -lowest / (GRAVITY / EA),
            1.0,
            "wave in a rod under sudden weight",
            0.02,
        )


def catenary(length: float, EA: float) -> float:
    """Sag of a cable of weight 9.81 N/m between ends 1 m apart on a level, m.

    Args:
        length: Unloaded length, m.
        EA: Axial stiffness, N.
    """
    w, V = GRAVITY, GRAVITY * length / 2

    def miss(H: float) -> float:
        return 2 * (H / w * math.asinh(V / H) + H * length / 2 / EA) - 1

    H = float(brentq(miss, 1e-2, 1e5))
    return H / w * (math.hypot(1, V / H) - 1) + w * length**2 / 8 / EA


def parabola(sag: float, xi: Floats) -> Floats:
    """Points of a cable at rest, shape (3, n), m."""
    return np.array([xi, 0 * xi, -4 * sag * xi * (1 - xi)])


@case("beams/cable")
def cable() -> Iterator[Check]:
    """Statics of a cable in one load step: straight at rest, and slack by a parabola."""
    EA, EI = 1e5, 1e-3
    joints = tuple(
        Revolute(name, GROUND, "cable", at=(x, 0, 0), axis=(0, 1, 0))
        for name, x in (("left", 0), ("right", 1))
    )
    for sag in (0.0, 0.1, 0.4):
        curve = ParametricCurve(partial(parabola, sag))
        xi = np.linspace(0, 1, 20001)
        length = float(np.hypot(np.diff(xi), np.diff(4 * sag * xi * (1 - xi))).sum())
        exact = catenary(length, EA)
        for degree in BOTH:
            scene = Scene(
                "cable",
                beams=(Beam("cable", curve, thin(EA, EI), elements=16, degree=degree),),
                joints=joints,
                redundant="drop",
                loads=(Gravity((0, 0, -GRAVITY)),),
                probes=(Probe("z", (0.5, 0, -sag), component=2),),
                scheme="static",
                dt=1.0,
            )
            found = sag - float(execute(scene).history["z"].iloc[-1])
            yield Check(
                f"sag in the middle, {sag:g} m at rest, degree {degree}, 16 elements",
                found,
                exact,
                "elastic catenary",
                1e-3,
            )


@case("beams/taut string")
def string() -> Iterator[Check]:
    """A guitar string: frequencies of modes, and of its motion, which keeps its tension."""
    m, L, T, EA, EI = 1e-3, 0.65, 100.0, 2.5e4, 2.5e-4
    # stretched by T/EA; a clamped end holds it by the length sqrt(EI/T)
    unit = math.sqrt(T / m / (1 + T / EA)) / (2 * L) * (1 + math.sqrt(EI / T) / L)
    section = thin(EA, EI, 1e-11, m)
    held = (Clamped("start"), Fixed("end", displacement=(None, 0, 0)))
    for degree in BOTH:
        beam = Beam("string", Line((0, 0, 0), (L, 0, 0)), section, elements=10, degree=degree)
        taut = Scene(
            "string",
            beams=(beam,),
            supports=held,
            loads=(PointForce("end", (T, 0, 0)),),
            scheme="static",
            dt=1.0,
        )
        hertz = natural_modes(taut, count=12, loaded=True).omega / (2 * math.pi)
        for k in (1, 2, 3):
            nearest = float(hertz[np.argmin(np.abs(hertz - k * unit))])
            yield Check(
                f"mode {k}, degree {degree}, 10 elements [Hz]", nearest, k * unit, "string", 1e-2
            )
    period = 1 / unit
    beam = Beam("string", Line((0, 0, 0), (L, 0, 0)), section, elements=10)
    for scheme in ("ep", "ep4"):
        scene = Scene(
            "string",
            beams=(beam,),
            supports=held,
            loads=(
                PointForce("end", (T, 0, 0), time=lambda t: min(1.0, t / (2 * period))),
                LineForce((0, 0, 0.5), time=lambda t: float(2 < t / period < 2.25)),
            ),
            probes=(
                Probe("z", (L / 2, 0, 0), component=2),
                Probe("N", "start", quantity="force", component=0),
            ),
            scheme=scheme,
            dt=period / 40,
            t_end=8.5 * period,
        )
        history = execute(scene).history.query(f"t > {2.5 * period}")
        yield Check(
            f"motion, {scheme}, 10 elements [Hz]",
            frequency(history["t"].to_numpy(), history["z"].to_numpy()),
            unit,
            "string",
            1e-2,
        )
        yield Check(
            f"mean tension in motion, {scheme}, 10 elements [N]",
            float(history["N"].mean()),
            T,
            "the force that pulls it",
            1e-2,
        )


def frequency(t: Floats, z: Floats) -> float:
    """Frequency by the passages of zero upwards, Hz."""
    (before,) = np.nonzero((z[:-1] < 0) & (z[1:] >= 0))
    at = t[before] - z[before] * (t[before + 1] - t[before]) / (z[before + 1] - z[before])
    return float((len(at) - 1) / (at[-1] - at[0]))


@case("beams/spun ring")
def ring() -> Iterator[Check]:
    """A thin ring that is let go while it spins: it grows to twice the 1 % of steady rotation."""
    EA, spin = 1e4, 10.0
    # its energy with the angular momentum kept: r^2 (r^2 - 1) = 4 m spin^2/EA
    exact = math.sqrt((1 + math.sqrt(1 + 16 * spin**2 / EA)) / 2) - 1
    push = PointForce("start", (0.01, 0, 0), body="a", time=lambda t: float(t < 0.1) * t)
    for elements in (12, 16, 20, 32):
        halves = tuple(
            Beam(
                name,
                CircularArc((0, 0, 0), (x, 0, 0), UP, math.pi),
                thin(EA, 1e-3),
                elements=elements // 2,
            )
            for name, x in (("a", 1), ("b", -1))
        )
        for scheme in ("ep", "ep4"):
            scene = Scene(
                "ring",
                beams=halves,
                joints=(
                    Weld("one", "a", "b", at="end", second_at="start"),
                    Weld("other", "b", "a", at="end", second_at="start"),
                ),
                initial=(InitialVelocity(spin=(0, 0, spin)),),
                loads=(push,),
                probes=tuple(
                    Probe(f"{body}{k}", "start", body=body, component=k)
                    for body in "ab"
                    for k in (0, 1)
                ),
                scheme=scheme,
                dt=5e-3,
                t_end=0.3,
            )
            h = execute(scene).history
            growth = np.hypot(h["a0"] - h["b0"] + 2, h["a1"] - h["b1"]) / 2 - 1
            yield Check(
                f"largest growth, {scheme}, {elements} elements",
                float(growth.max()),
                exact,
                "energy and angular momentum of the ring",
                0.02,
            )


@case("beams/thin blade")
def thin_blade() -> Iterator[Check]:
    """Flapping of a cantilever that spins so fast that tension is nearly all of its stiffness."""
    EI, eta = 1e-2, 100.0
    for degree in BOTH:
        beam = Beam("blade", Line((0, 0, 0), (1, 0, 0)), thin(1e7, EI, 1e-9), 8, degree=degree)
        scene = Scene(
            "blade", beams=(beam,), supports=(Clamped("start"),), scheme="ep4", dt=1.0, t_end=1.0
        )
        rate = eta * math.sqrt(EI)
        (found,) = campbell(scene, [rate], count=6, axis=UP).frequencies
        for k, exact in enumerate(flapping(eta, 2) / eta):
            ratios = 2 * math.pi * np.asarray(found) / rate
            yield Check(
                f"flap {k + 1} over the rate, degree {degree}, 8 elements",
                float(ratios[np.argmin(np.abs(ratios - exact))]),
                float(exact),
                "Ritz, thin beam",
                1e-2,
            )
