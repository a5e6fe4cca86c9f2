"""Modes about states, under loads and in rotation, against closed forms and published values."""

import math
from collections.abc import Iterator, Sequence

from mpi4py import MPI

import numpy as np

from shellmb.api.responding.linearise import about_state
from shellmb.arrays import Floats
from shellmb.demos.references.rotating import flapping, lagging, sleeping_top, spinning_membrane
from shellmb.demos.verification.cases import Check, case
from shellmb.options.linear import LinearOptions
from shellmb.running.resume import StateOfRun
from shellmb.running.rotating.campbell import campbell
from shellmb.running.rotating.modes import RotatingModes, modes_of
from shellmb.running.rotating.state import MovingState
from shellmb.scene import (
    GROUND,
    Beam,
    CircularSection,
    Clamped,
    Disc,
    Driver,
    EdgeForce,
    Fixed,
    Gravity,
    InitialVelocity,
    Isotropic,
    JointSpring,
    Line,
    Prismatic,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Spherical,
    Spring,
    Support,
    SurfaceForce,
    Weld,
)
from shellmb.scene.loads.loads import Load
from shellmb.simulate.simulation import Simulation

UP = (0.0, 0.0, 1.0)

E, DENSITY, LENGTH, WIDTH, THICKNESS = 70e9, 2700.0, 1.0, 0.1, 0.005
# of the strip: its lowest frequency without a load over pi^2, and the strain of Euler's load
UNIT = math.sqrt(E * THICKNESS**2 / 12 / DENSITY) / LENGTH**2
EULER = math.pi**2 * THICKNESS**2 / 12 / LENGTH**2
# a load across it that bends it by three times its thickness
PUSH = 20 * E * THICKNESS**4 / LENGTH**4


def about(scene: Scene, count: int, at: float | None = None) -> RotatingModes:
    """Modes about the end of a static scene, or about the state of another one at a time."""
    if at is None:
        simulation = Simulation(scene)
        simulation.run()
        return modes_of(MovingState(scene, *simulation.saved(), MPI.COMM_WORLD), count)
    reached = StateOfRun(scene, None, at).reach(MPI.COMM_WORLD)
    return modes_of(MovingState(scene, *reached, MPI.COMM_WORLD), count)


def _strip(loads: Sequence[Load], *supports: Support) -> Scene:
    """A strip that is hinged at its ends, in statics."""
    section = Isotropic(E, 0.0, thickness=THICKNESS, density=DENSITY)
    shell = Shell("strip", Rectangle(LENGTH, WIDTH), section, mesh=(6, 1))
    return Scene(
        "strip", (shell,), supports=supports, loads=tuple(loads), scheme="static", dt=0.1, t_end=1.0
    )


@case("modes/column")
def column() -> Iterator[Check]:
    """First two frequencies of a hinged strip under tension and close to its buckling load.

    `omega_n^2 = (n pi/L)^4 E I/m (1 - P/(n^2 P_E))`.
    """
    source = "hinged beam under an axial force (Bokaian, J. Sound Vib. 126 (1988) 49-65)"
    slides = Fixed("right", displacement=(None, 0.0, 0.0))
    for share in (-10.0, 0.5, 0.9):
        force = EdgeForce("right", (-share * EULER * E * THICKNESS, 0.0, 0.0))
        found = about(_strip([force], Fixed("left", displacement=(0.0, 0.0, 0.0)), slides), 2)
        for n in (1, 2):
            exact = (n * math.pi) ** 2 * math.sqrt(1 - share / n**2)
            value = float(found.omega[n - 1] / UNIT)
            yield Check(f"P/P_E={share:g}, quad 6x1, mode {n}", value, exact, source, 0.005)


@case("modes/buckled")
def buckled() -> Iterator[Check]:
    """Frequencies about a strip that has buckled between ends that were moved together.

    With the shortening `lambda` in that of Euler's load `omega_1^2 = 2 (lambda - 1) pi^4 E I/(m
    L^4)`, and `omega_n^2 = n^2 (n^2 - 1) pi^4 E I/(m L^4)` whatever the shortening.
    """
    source = "buckled hinged beam (Nayfeh and Emam, Nonlinear Dyn. 54 (2008) 395-408)"
    for shortening in (2.0, 4.0):
        moved = Fixed("right", displacement=(-shortening * EULER * LENGTH, 0.0, 0.0))
        # says to which side, and is gone at the end
        push = SurfaceForce((0.0, 0.0, PUSH), time=lambda t: 1 - t)
        held = Fixed("left", displacement=(0.0, 0.0, 0.0))
        found = about(_strip([push], held, moved), 2)
        first = math.pi**2 * math.sqrt(2 * (shortening - 1))
        exact = sorted((first, math.pi**2 * math.sqrt(12.0)))
        for n in (1, 2):
            value = float(found.omega[n - 1] / UNIT)
            name = f"shortening {shortening:g}, quad 6x1, mode {n}"
            yield Check(name, value, exact[n - 1], source, 0.005)


@case("modes/top")
def top() -> Iterator[Check]:
    """A heavy top that sleeps: nutation and precession at steady spins, and about a run's state."""
    mass, height, across, along = 2.0, 0.3, 0.1, 0.15
    weight, tilting = mass * 9.81 * height, across + mass * height**2
    critical = 2 * math.sqrt(tilting * weight) / along
    body = RigidBody("top", mass, (across, across, along), com=(0, 0, height))

    def scene(rate: float) -> Scene:
        return Scene(
            "top",
            rigid_bodies=(body,),
            joints=(Spherical("tip", "ground", "top", at=(0, 0, 0)),),
            loads=(Gravity((0, 0, -9.81)),),
            initial=(InitialVelocity(spin=(0, 0, rate)),),
            scheme="ep4",
            dt=0.01,
            t_end=0.2,
        )

    source = "A z'' - i C Omega z' - m g l z = 0"
    rates = [0.9 * critical, 1.1 * critical, 2 * critical]
    steady = campbell(scene(critical), rates, count=3, loaded=True, axis=UP)
    moving = about(scene(2 * critical), 3, at=0.1)
    for name, rate, modes in (
        *zip(("spin 0.9", "spin 1.1", "spin 2"), rates, steady.modes, strict=True),
        ("state at spin 2", rates[-1], moving),
    ):
        both = sleeping_top(rate, tilting, along, weight)
        exact = sorted((complex(s) for s in both), key=lambda s: abs(s.imag))
        own = modes.values[modes.rigid :]
        title = f"{name} of the critical one"
        close = 1e-9
        if rate < critical:
            growth = float(max(own.real))
            yield Check(f"{title}, growth", growth, max(s.real for s in exact), source, close)
            continue
        for k, kind in enumerate(("slow", "fast")):
            value = float(own[k].imag)
            yield Check(f"{title}, {kind}", value, abs(exact[k].imag), source, close)


@case("modes/arm")
def arm() -> Iterator[Check]:
    """A mass on a spring along an arm that spins up: `omega^2 = k/m - Omega(t)^2`."""
    own, speeding = 30.0, 200.0
    mass, inertia = 2.0, (0.1, 0.1, 0.1)
    bodies = (
        RigidBody("arm", 1.0, inertia),
        RigidBody("mass", mass, inertia, com=(0.5, 0.0, 0.0)),
    )
    joints = (
        Revolute("axle", "ground", "arm", at=(0, 0, 0), axis=UP),
        Prismatic("slide", "arm", "mass", at=(0, 0, 0), axis=(1, 0, 0)),
    )
    scene = Scene(
        "arm",
        rigid_bodies=bodies,
        joints=joints,
        drivers=(Driver("motor", "axle", rotation=lambda t: speeding * t**2 / 2),),
        force_elements=(JointSpring("spring", "slide", stiffness=mass * own**2),),
        scheme="ep4",
        dt=0.01,
        t_end=0.2,
    )
    for at in (0.05, 0.12):
        exact = math.sqrt(own**2 - (speeding * at) ** 2)
        value = float(about(scene, 1, at).omega[0])
        yield Check(f"t={at:g}", value, exact, "k/m - Omega^2", 1e-9)


@case("modes/blade")
def blade() -> Iterator[Check]:
    """Campbell diagram of a cantilever: flapping and lagging over the rate."""
    section = RectangularSection(E=2e11, nu=0.3, width=0.04, height=0.01, density=7800.0)
    beam = Beam("blade", Line((0, 0, 0), (2.0, 0, 0)), section, elements=8)
    scene = Scene(
        "blade", beams=(beam,), supports=(Clamped("start"),), scheme="ep4", dt=0.01, t_end=0.2
    )
    unit = math.sqrt(2e11 * 0.01**2 / 12 / 7800.0) / 2.0**2
    stiffer = 0.04 / 0.01
    etas = (0.0, 2.0, 6.0, 12.0)
    found = campbell(scene, [eta * unit for eta in etas], count=3, axis=UP)
    source = "Ritz, thin beam, equal to Wright et al., J. Appl. Mech. 49 (1982) 197-202"
    for eta, row in zip(etas, found.frequencies, strict=True):
        across, within = flapping(eta, 2), lagging(eta / stiffer, 1)
        exact = (across[0], within[0] * stiffer, across[1])
        for kind, value, reference in zip(("flap 1", "lag 1", "flap 2"), row, exact, strict=False):
            number = float(2 * math.pi * value / unit)
            yield Check(f"eta={eta:g}, {kind}, 8 elements", number, float(reference), source, 2e-3)


@case("modes/disc")
def disc() -> Iterator[Check]:
    """A free disc that is nearly a membrane, `(omega/Omega)^2` by diameters and circles."""
    rate = 100.0
    section = Isotropic(70e9, 0.3, thickness=1e-4, density=2700.0)
    shell = Shell("disc", Disc(0.5), section, mesh=(4, 4))
    scene = Scene("disc", (shell,), scheme="ep4", dt=0.01, t_end=0.2)
    (modes,) = campbell(scene, [rate], count=10, axis=UP).modes
    ratios: Floats = (modes.omega[modes.rigid :] / rate) ** 2
    source = "Lamb and Southwell, Proc. R. Soc. A 99 (1921) 272-280"
    for diameters, circles in ((2, 0), (0, 1), (3, 0)):
        exact = spinning_membrane(diameters, circles, 0.3)
        value = float(ratios[np.argmin(np.abs(ratios - exact))])
        # bending stiffness and the mesh add 2e-3 each to the third
        yield Check(f"{diameters} diameters, {circles} circles", value, exact, source, 4e-3)


def _rotor(rate: float) -> Scene:
    """A shaft along x with two discs, in bearings that are softer along z than along y."""
    E, G, density, length, diameter, far = 211e9, 81.2e9, 7810.0, 1.5, 0.05, 1e4

    def wheel(name: str, at: float, outer: float, width: float = 0.07) -> RigidBody:
        mass = density * math.pi * width * (outer**2 - diameter**2) / 4
        around = outer**2 + diameter**2
        across = mass * (around / 16 + width**2 / 12)
        return RigidBody(name, mass, (mass * around / 8, across, across), position=(at, 0, 0))

    wheels = (wheel("left", 0.5, 0.28), wheel("right", 1.0, 0.35))
    # springs this long keep their directions; the last one holds the shaft along its axis
    held = (
        ("start", 0.0, (0.0, -far, 0.0), 1e6),
        ("start", 0.0, (0.0, 0.0, -far), 8e5),
        ("end", length, (0.0, -far, 0.0), 1e6),
        ("end", length, (0.0, 0.0, -far), 8e5),
        ("start", 0.0, (-far, 0.0, 0.0), 1e7),
    )
    springs = tuple(
        Spring(f"bearing {k}", GROUND, "shaft", at=(x + u, v, w), second_at=end, stiffness=stiff)
        for k, (end, x, (u, v, w), stiff) in enumerate(held)
    )
    section = CircularSection(E, E / (2 * G) - 1, radius=diameter / 2, density=density)
    return Scene(
        "rotor",
        beams=Beam("shaft", Line((0, 0, 0), (length, 0, 0)), section, elements=6),
        rigid_bodies=wheels,
        joints=tuple(Weld(w.name + " hub", "shaft", w.name, at=w.position) for w in wheels),
        force_elements=springs,
        initial=InitialVelocity(spin=(rate, 0, 0)),
        scheme="ep4",
        dt=5e-5,
        t_end=1e-3,
    )


@case("modes/rotor")
def rotor() -> Iterator[Check]:
    """A flexible rotor with two discs in bearings that differ, seen in space: rad/s."""
    source = "ROSS, tests of Friswell et al. (2010), Example 5.9.2"
    published = {
        0: (82.65, 86.66, 254.52, 274.31, 679.49, 716.79),
        4000: (82.33, 86.86, 239.64, 287.25, 583.49, 806.89),
    }
    for turns, values in published.items():
        system = about_state(_rotor(turns * math.pi / 30), LinearOptions(at=0.0))
        found = np.abs(system.poles(14).imag)
        for k, exact in enumerate(values, start=1):
            value = float(found[np.argmin(np.abs(found - exact))])
            yield Check(f"{turns} rev/min, whirl {k}", value, exact, source, 1e-3)
