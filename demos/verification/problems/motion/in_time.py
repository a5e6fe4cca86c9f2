"""Thin shells in time: thrown and left alone, or loaded slowly and let go.

`docs/evidence/in_time.md` says which data are from the literature, and which are ours.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shellmb.demos import flying_l_plate, short_cylinder
from shellmb.demos.hemisphere import FORCE, INWARD, NU, OUTWARD, RADIUS, THICKNESS, E
from shellmb.demos.references import flight
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.motion import ENERGY, title
from shellmb.running.execute import RunResult, execute
from shellmb.scene import (
    Cylinder,
    Isotropic,
    PointForce,
    Probe,
    Scene,
    Shell,
    Sphere,
    SymmetryPlane,
    Table,
)

# with the largest dissipation
SCHEMES = {"ep": 0.0, "ed": 1.0, "ep4": 0.0, "ed3": 1.0}
KEEPS = ("ep", "ep4")
# energies after the pulse [J] and displacements at the end [m] of runs with an eighth of the step
TUBE_END = 8.00001
FLAT_ENERGY, FLAT_END = 0.1330705, 0.04028542
FOLD_ENERGY, FOLD_END = 0.0798750, -0.00095945
PANEL_ENERGY, PANEL_END = 14.7930, 0.1034653
# of a step, over the energy: round-off of energies that nothing changes
RISE = 1e-10
# of angular momentum in EP4: its drift, and its distance from a sum of second order
TURNED, MOMENT = 1e-4, 1e-2


@dataclass(frozen=True)
class Flight:
    """A body that is thrown by a pulse and then left alone.

    Args:
        scene: Its scene.
        pulse: Time of the pulse, s.
        impulse: Impulse of all forces, N s.
        column: A displacement in the history.
        energy: Energy after the pulse of a converged run, J.
        end: That displacement at the end of it, m.
        converged: That run in words.
        within: How far each scheme may be from both, in the order of `SCHEMES`; displacements over
            `size`.
        size: A length of the motion, m.
        moment: Angular momentum that the forces have given by a history's end; None: not told.
        other: Distance of a history from that of another code; None: there is none.
    """

    scene: Scene
    pulse: float
    impulse: tuple[float, ...]
    column: str
    energy: float
    end: float
    converged: str
    within: tuple[float, ...]
    size: float
    moment: Callable[[RunResult], np.ndarray] | None = None
    other: Callable[[Any], float] | None = None

    def run(self, scheme: str) -> RunResult:
        """Run with a scheme."""
        scene = replace(self.scene, scheme=scheme, alpha=SCHEMES[scheme])
        return execute(scene, watched=False)

    def checks(self) -> Iterator[Check]:
        """Laws to round-off in all schemes, then distances from the converged run."""
        for (scheme, alpha), within in zip(SCHEMES.items(), self.within, strict=True):
            run = self.run(scheme)
            name = f"{title(scheme, alpha)}, dt={self.scene.dt:g} s"
            yield from self._laws(run, name)
            yield from self._converged(run, name, within)
            if self.other is not None:
                source = "OpenSees, ASDShellQ4 -corotational, 32x2, short_cylinder.csv"
                told = f"{name}, distance from another code until 1.4 s"
                yield Check(told, self.other(run.history), 0.0, source, 0.02, "at most")

    def _laws(self, run: RunResult, name: str) -> Iterator[Check]:
        scheme, found = run.scene.scheme, flight.flight(run.history, self.pulse)
        linear = flight.vectors(run.history, "momentum_")[-1]
        error = flight.distance(linear, self.impulse)
        yield Check(f"{name}, momentum over impulse", error, 0.0, "impulse of the loads", ENERGY)
        balance = run.energy.relative_error
        yield Check(f"{name}, energy balance error", balance, 0.0, "eqs. (20), (33)", ENERGY)
        if scheme not in KEEPS:
            rise = found["energy_rise"]
            yield Check(f"{name}, rise of energy", rise, 0.0, "free flight", RISE, "at most")
            return
        energy, angular = found["energy_variation"], found["angular_drift"]
        yield Check(f"{name}, energy variation", energy, 0.0, "free flight", ENERGY)
        # EP4 keeps angular momentum to its order
        within = ENERGY if scheme == "ep" else TURNED
        yield Check(f"{name}, angular momentum drift", angular, 0.0, "free flight", within)
        if self.moment is not None:
            given = self.moment(run)
            # what EP gives exactly is a rule of second order for the places between ends of steps
            within = ENERGY if scheme == "ep" else MOMENT
            error = flight.distance(flight.vectors(run.history, "angular_momentum_")[-1], given)
            source = "moments of the forces at the places of the history"
            yield Check(f"{name}, angular momentum over moments", error, 0.0, source, within)

    def _converged(self, run: RunResult, name: str, within: float) -> Iterator[Check]:
        energy = flight.flight(run.history, self.pulse)["energy"]
        yield Check(
            f"{name}, energy after the pulse [J]", energy, self.energy, self.converged, within
        )
        apart = abs(float(run.column(self.column)[-1]) - self.end) / self.size
        told = f"{name}, {self.column} at {self.scene.t_end:g} s, distance"
        yield Check(told, apart, 0.0, self.converged, within, "at most")


def tube() -> Scene:
    """The short cylinder, while its forces act and for two seconds after."""
    return short_cylinder.scene((16, 2), dt=0.05, t_end=3.0)


def plate(fold: float) -> Scene:
    """The L-plate, flat or folded, for five times its pulse."""
    return flying_l_plate.scene(2, fold, dt=1e-3, t_end=0.1)


PANEL, LENGTH, HALF, PUSH = 1.0, 1.0, 30.0, 0.01  # radius and length [m], angle, pulse [s]
CORNERS = {
    name: (
        PANEL * math.cos(math.radians(90 + angle)),
        PANEL * math.sin(math.radians(90 + angle)),
        z,
    )
    for name, angle, z in (("right", -HALF, 0.0), ("left", HALF, LENGTH))
}
PUSHES = {"right": (100.0, 200.0, 100.0), "left": (0.0, 300.0, -200.0)}


def panel() -> Scene:
    """A free cylindrical panel of 60 degrees, pushed at two corners across."""
    pulse = Table((0.0, PUSH / 2, PUSH), (0.0, 1.0, 0.0))
    section = Isotropic(70e9, 0.3, thickness=2e-3, density=2700.0)
    surface = Cylinder(PANEL, LENGTH, angles=(90 - HALF, 90 + HALF))
    return Scene(
        "panel",
        Shell("panel", surface, section, mesh=(6, 4)),
        loads=tuple(PointForce(CORNERS[name], force, time=pulse) for name, force in PUSHES.items()),
        probes=tuple(
            Probe(f"{name}_u{axis}", at, component=k)
            for name, at in CORNERS.items()
            for k, axis in enumerate("xyz")
        ),
        scheme="ep",
        dt=5e-4,
        t_end=0.05,
    )


@case("in time/short cylinder", slow=True)
def short_tube() -> Iterator[Check]:
    """A thin tube thrown by four forces, which bends to an oval and turns over."""

    def moment(run: RunResult) -> np.ndarray:
        tube = short_cylinder
        return flight.turned(run.history, tube.PLACES, tube.FORCES, tube.PEAK, tube.PULSE)[-1]

    yield from Flight(
        scene=tube(),
        pulse=short_cylinder.PULSE,
        impulse=tuple(short_cylinder.IMPULSE),
        column="B_uz",
        energy=short_cylinder.CONVERGED,
        end=TUBE_END,
        converged="EP4, dt=0.00625 s, same mesh",
        within=(0.01, 0.02, 1e-3, 1e-3),
        size=short_cylinder.RADIUS,
        moment=moment,
        other=short_cylinder.from_opensees,
    ).checks()


def _flying_plate(fold: float, energy: float, end: float) -> Iterator[Check]:
    return Flight(
        scene=plate(fold),
        pulse=flying_l_plate.PULSE,
        impulse=tuple(flying_l_plate.IMPULSE),
        column="top_uz",
        energy=energy,
        end=end,
        converged="EP4, dt=0.125 ms, same mesh",
        within=(0.01, 0.01, 5e-3, 0.01),
        size=flying_l_plate.SIDE,
    ).checks()


@case("in time/flying L-plate", slow=True)
def flying_plate() -> Iterator[Check]:
    """Three squares in one plane, thrown at the ends of both arms."""
    yield from _flying_plate(0.0, FLAT_ENERGY, FLAT_END)


@case("in time/folded L-plate", slow=True)
def folded_plate() -> Iterator[Check]:
    """The L-plate with an arm at a right angle, whose edges have two directors."""
    yield from _flying_plate(90.0, FOLD_ENERGY, FOLD_END)


@case("in time/cylindrical panel", slow=True)
def free_panel() -> Iterator[Check]:
    """A free panel of 60 degrees pushed at two corners: large overall motion and bending."""
    yield from Flight(
        scene=panel(),
        pulse=PUSH,
        impulse=tuple(PUSH / 2 * np.sum(list(PUSHES.values()), axis=0)),
        column="left_uy",
        energy=PANEL_ENERGY,
        end=PANEL_END,
        converged="EP4, dt=0.0625 ms, same mesh",
        within=(0.05, 0.05, 0.02, 0.02),
        size=0.1,
        moment=lambda run: flight.turned(run.history, CORNERS, PUSHES, 1.0, PUSH)[-1],
    ).checks()


# the hemisphere is loaded in ten of its longest periods, and let go in a quarter of one [s]
SLOW, LET_GO, FREE = 20.0, 0.5, 4.0


def pinched(dt: float = 0.5) -> Scene:
    """A quarter of the hemisphere with a hole; the load of its static problem comes slowly."""

    def load(t: float) -> float:
        if t < SLOW:
            return math.sin(math.pi * t / (2 * SLOW)) ** 2
        return max(0.0, 1 - (t - SLOW) / LET_GO)

    a, b = (RADIUS, 0.0, 0.0), (0.0, RADIUS, 0.0)
    section = Isotropic(E, NU, thickness=THICKNESS, density=1.0)
    surface = Sphere(RADIUS, polar=(18, 90), azimuth=(0, 90))
    return Scene(
        "pinched",
        Shell("hemisphere", surface, section, mesh=(6, 6)),
        supports=(SymmetryPlane("left", (0, 1, 0)), SymmetryPlane("right", (1, 0, 0))),
        loads=(
            PointForce(a, (FORCE / 2, 0, 0), time=load),
            PointForce(b, (0, -FORCE / 2, 0), time=load),
        ),
        probes=(Probe("outward", a, component=0), Probe("inward", b, component=1)),
        scheme="ep",
        dt=dt,
        t_end=SLOW + FREE,
    )


@case("in time/pinched hemisphere", slow=True)
def pinched_hemisphere() -> Iterator[Check]:
    """Sze, Liu and Lo's hemisphere, loaded slowly to its static displacements, then let go."""
    source = "Sze, Liu and Lo (2004), static, full load"
    for scheme, alpha in SCHEMES.items():
        run = execute(replace(pinched(), scheme=scheme, alpha=alpha), watched=False)
        name = f"{title(scheme, alpha)}, dt={run.scene.dt:g} s"
        full = int(np.argmin(np.abs(run.column("t") - SLOW)))
        for column, sign, static in (("outward", 1, OUTWARD), ("inward", -1, INWARD)):
            found = sign * float(run.column(column)[full])
            yield Check(f"{name}, {column} at full load", found, static, source, 0.02)
        along = float(np.max(np.abs(run.column("momentum_z"))))
        told = f"{name}, momentum along the axis over impulse"
        yield Check(told, along / (FORCE * SLOW / 2), 0.0, "nothing acts along the axis", ENERGY)
        balance = run.energy.relative_error
        yield Check(f"{name}, energy balance error", balance, 0.0, "eqs. (20), (33)", ENERGY)
        energy = run.column("total_energy")[run.column("t") > SLOW + LET_GO * (1 + 1e-9)]
        if scheme in KEEPS:
            varied = float(np.ptp(energy) / energy[0])
            yield Check(f"{name}, energy variation", varied, 0.0, "free vibration", ENERGY)
        else:
            rise = float(np.max(np.diff(energy)) / energy[0])
            yield Check(f"{name}, rise of energy", rise, 0.0, "free vibration", RISE, "at most")
