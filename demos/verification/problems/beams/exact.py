"""Beams: large displacements against exact solutions, buckling, frequencies, published motions."""

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from shellmb.arrays import Floats
from shellmb.demos import right_angle_frame, spin_up_beam
from shellmb.demos.references import tables
from shellmb.demos.references.beams import Ends, lateral_buckling, roll_up, timoshenko_frequencies
from shellmb.demos.verification.cantilever import exact_cantilever, section_stiffness
from shellmb.demos.verification.cases import Check, case
from shellmb.running.execute import RunResult, execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Beam,
    CircularArc,
    Clamped,
    Fixed,
    GeneralSection,
    Line,
    PointForce,
    PointMoment,
    Probe,
    RectangularSection,
    Scene,
    Solver,
)

Degree = Literal[2, 3]

TIP = (
    Probe("tip_x", "end", component=0),
    Probe("tip_y", "end", component=1),
    Probe("tip_z", "end", component=2),
)
# with 33 and 25 nodes
ELEMENTS: dict[Degree, int] = {2: 16, 3: 8}


def tip(result: RunResult) -> Floats:
    """Displacement at the end of the beam after the last step, shape (3,), m."""
    return np.array([result.history[probe.name].iloc[-1] for probe in TIP])


def rolled(thinness: float, degree: Degree, elements: int) -> RunResult:
    """Cantilever of length 1 bent to a full circle by its end moment, in one load step."""
    section = RectangularSection(E=1e7, nu=0.3, width=thinness, height=thinness)
    moment = 2 * math.pi * float(section.stiffness[5, 5])
    beam = Beam("beam", Line((0, 0, 0), (1, 0, 0)), section, elements=elements, degree=degree)
    scene = Scene(
        "roll-up",
        beams=(beam,),
        supports=(Clamped("start"),),
        loads=(PointMoment("end", (0, 0, moment)),),
        probes=TIP,
        scheme="static",
        dt=1.0,
        solver=Solver(max_iterations=60),
    )
    return execute(scene)


@case("beams/roll-up")
def roll_ups() -> Iterator[Check]:
    """A full circle in a single load step, however thin the beam."""
    along, across = roll_up(2 * math.pi, 1.0, 1.0)
    for degree, elements in ELEMENTS.items():
        for thinness in (1e-3, 1e-4):
            result = rolled(thinness, degree, elements)
            error = float(np.linalg.norm(tip(result) - (along, across, 0.0)))
            yield Check(
                f"one load step, t/L={thinness:g}, degree {degree}, {elements} elements",
                error,
                0.0,
                f"distance from the exact arc over L; {result.simulation.iterations} iterations",
                1e-3,
                "at most",
            )


RADIUS, FORCE = 100.0, 600.0
BEND = section_stiffness(1e7, 5e6 * 5 / 6, 5e6 * 5 / 6, 1e7 / 12, 1e7 / 12, 1e7 / 12)
ARC = CircularArc((0, RADIUS, 0), (0, 0, 0), (0, 0, 1), math.pi / 4)


def exact_bend() -> Floats:
    """Exact displacement of the end of the 45 degree bend, shape (3,), m."""
    length = RADIUS * math.pi / 4
    return exact_cantilever(BEND, length, force=(0, 0, FORCE), curvature=(0, 0, 1 / RADIUS)).tip


def bend(degree: Degree, elements: int) -> Floats:
    """Displacement of the end of the 45 degree bend in one load step, shape (3,), m."""
    beam = Beam("beam", ARC, GeneralSection(BEND), elements=elements, degree=degree)
    scene = Scene(
        "bend",
        beams=(beam,),
        supports=(Clamped("start"),),
        loads=(PointForce("end", (0, 0, FORCE)),),
        probes=TIP,
        scheme="static",
        dt=1.0,
    )
    return tip(execute(scene))


@case("beams/45 degree bend")
def bends() -> Iterator[Check]:
    """Bathe and Bolourchi's bend of radius 100 under 600 across its plane, and its rates."""
    exact = exact_bend()
    for degree in ELEMENTS:
        found = {n: bend(degree, n) for n in (2, 4, 8)}
        for axis, value, reference in zip("xyz", found[8], exact, strict=True):
            yield Check(
                f"tip u{axis}, degree {degree}, 8 elements",
                float(value),
                float(reference),
                "exact, by shooting",
                1e-3,
            )
        errors = np.array(
            [np.linalg.norm(u - exact) / np.linalg.norm(exact) for u in found.values()]
        )
        shown = ", ".join(f"{e:.1e}" for e in errors)
        yield Check(
            f"rate at the tip, degree {degree}, 4 and 8 elements",
            float(np.log2(errors[1] / errors[2])),
            2.0 * degree,
            f"theory: 2 k at nodes; errors {shown}",
            0.3,
            "at least",
        )


# so stiff in the plane of the load, in tension and in shear that it does not count there
TORSION, WEAK, STRONG, STIFF = 0.8, 1.0, 1e5, 1e8


def buckling_factor(held: bool) -> float:
    """Load factor `P L^2 / sqrt(EI GJ)` at which the lowest frequency of a cantilever is zero.

    Args:
        held: Whether the loaded end is held laterally.
    """
    stiffness = section_stiffness(STIFF, STIFF, STIFF, TORSION, STRONG, WEAK)
    # the mass sets the scale of the frequency and not the load at which it is zero
    section = GeneralSection(stiffness, mass_per_length=1.0, second_moments=(1e-4, 0.0, 1e-4))
    unit = math.sqrt(WEAK * TORSION)
    beam = Beam("beam", Line((0, 0, 0), (1, 0, 0)), section, elements=8)
    side = (Fixed("end", displacement=(None, 0.0, None)),) if held else ()

    def lowest(factor: float) -> float:
        scene = Scene(
            "narrow",
            beams=(beam,),
            supports=(Clamped("start"), *side),
            loads=(PointForce("end", (0, 0, -factor * unit)),),
            scheme="static",
            dt=1.0,
        )
        return float(natural_modes(scene, count=1, loaded=True).omega2[0])

    near = lateral_buckling(held)
    return float(brentq(lowest, 0.95 * near, 1.05 * near, xtol=1e-5))


@case("beams/lateral buckling")
def lateral() -> Iterator[Check]:
    """Narrow cantilever under a force at its end, in the plane of its large stiffness."""
    published = {False: 4.01288, True: 6.98392}
    for held, computed in published.items():
        name = "loaded end fixed laterally" if held else "loaded end free"
        found = buckling_factor(held)
        yield Check(
            f"{name}, 8 elements",
            found,
            lateral_buckling(held),
            "Bessel functions; Timoshenko and Gere art. 6.3",
            1e-3,
        )
        title = f"{name}, against linear elements, 8 elements"
        yield Check(title, found, computed, "Hermite and linear elements, computed", 1e-3)


@case("beams/frequencies")
def frequencies() -> Iterator[Check]:
    """Bending in both planes, torsion and tension; free: exactly six rigid motions."""
    section = RectangularSection(E=2e11, nu=0.3, width=0.05, height=0.1, density=7800.0)
    C, (m, _, (J2, _, J3)) = section.stiffness, section.mass
    beam = Beam("beam", Line((0, 0, 0), (1, 0, 0)), section)
    kinds: tuple[tuple[Ends, float], ...] = (("clamped-free", math.pi / 2), ("free-free", math.pi))
    torsion, tension = math.sqrt(C[3, 3] / (J2 + J3)), math.sqrt(C[0, 0] / m)
    for ends, wave in kinds:
        free = ends == "free-free"
        scene = Scene(
            "beam",
            beams=(beam,),
            supports=() if free else (Clamped("start"),),
            scheme="ep",
            dt=1.0,
            t_end=1.0,
        )
        modes = natural_modes(scene, count=12)
        planes = ((C[5, 5], C[1, 1], J2), (C[4, 4], C[2, 2], J3))
        known = [
            (f"bending {k + 1} along d{axis}", omega)
            for axis, (EI, GA, J) in zip((2, 3), planes, strict=True)
            for k, omega in enumerate(timoshenko_frequencies(ends, 2, EI, 1.0, m, GA, J))
        ]
        known += [("torsion 1", wave * torsion)]
        known += [("tension 1", wave * tension)] if not free else []
        if free:
            yield Check(f"{ends}, rigid modes", modes.rigid, 6.0, "rigid motions of a body", 0.0)
        for name, reference in sorted(known, key=lambda item: item[1]):
            elastic = modes.omega[modes.rigid :]
            nearest = float(elastic[np.argmin(np.abs(elastic - reference))])
            yield Check(
                f"{ends}, {name}, 8 elements",
                nearest,
                float(reference),
                "Timoshenko beam, exact",
                2e-3,
            )


@case("beams/right angle frame")
def right_angle() -> Iterator[Check]:
    """Extremes of a motion of 30 s, relative to the largest excursion of each point."""
    result = execute(right_angle_frame.scene())
    reference = tables.read("right_angle_frame")
    source = "SE(3) beam elements, vspsonn/mb_sef_py, h = 0.01"
    for name in ("elbow_uz", "tip_uz"):
        size = float(np.max(np.abs(reference[name])))
        for kind in ("min", "max"):
            found, wanted = (getattr(table[name], kind)() for table in (result.history, reference))
            title = f"{name} {kind} over the excursion, EP, dt=0.1, 4 elements in each arm"
            yield Check(title, float(found / size), float(wanted / size), source)


@case("beams/spin-up")
def spin_up() -> Iterator[Check]:
    """Deflection in the rotating frame, and the stretch of the rod that turns steadily."""
    result = execute(spin_up_beam.scene())
    measured = spin_up_beam.results(result)
    source = "SE(3) beam elements, vspsonn/mb_sef_py"
    reference = float(tables.read("spin_up_beam")["transverse"].min())
    title = "EP, dt=0.04, 4 elements"
    yield Check(f"largest deflection, {title}", measured["deflection_min"], reference, source)
    yield Check(
        f"history of the deflection over its largest value, {title}",
        measured["deflection_difference"],
        0.0,
        source,
        0.01,
        "at most",
    )
    yield Check(
        f"mean stretch of the turning rod, {title}",
        measured["stretch"],
        float(tables.read("spin_up_beam").query("t_s > 15")["axial"].mean()),
        source,
    )
    yield Check(
        f"mean stretch against the rod without bending, {title}",
        measured["stretch"],
        measured["stretch_exact"],
        "exact; what is left of the vibration shortens the beam by 2 %",
        0.03,
    )
