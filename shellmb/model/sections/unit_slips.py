"""Slips of units: stiffness, mass and loads that no body of one consistent system has together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from mpi4py import MPI

from shellmb.errors import warn
from shellmb.scene import EdgeForce, Gravity, PointForce, Pressure, Scene, SurfaceForce
from shellmb.scene.lookup import said
from shellmb.scene.units import parse_units

if TYPE_CHECKING:
    from shellmb.model.frames.beam import BeamModel
    from shellmb.model.shells.shell import ShellModel

# in m, kg and s
LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
# gravity of the earth by the units of length and time that it tells
EARTH = {9.81: ("m", "s"), 981.0: ("cm", "s"), 9810.0: ("mm", "s"), 9.81e-3: ("mm", "ms")}
# speeds of waves in solids, from soft gels to diamond and to bodies that are made nearly
# rigid, m/s; where only gravity tells the units, bodies may be softer
SLOWEST, SOFTEST, FASTEST = 1.0, 0.1, 1e6
# metals by Young's modulus in GPa and density in kg/m^3
METALS = (
    (185.0, 240.0, 7500.0, 8200.0),
    (62.0, 82.0, 2550.0, 2900.0),
    (95.0, 130.0, 4300.0, 4700.0),
)
# Pa, kPa, MPa, GPa and dyn/cm^2 in a GPa, and which densities belong to them, per kg/m^3
MODULI = {1e9: (1.0,), 1e6: (1e-3, 1e-9), 1e3: (1e-12, 1e-6), 1.0: (1e-9,), 1e10: (1e-3,)}
DENSITIES = (1.0, 1e-3, 1e-6, 1e-9, 1e-12)
# E over density of moduli in GPa with kg/m^3 at most, and of moduli in Pa with g/cm^3
GIGA, GRAMS = 0.1, (1e9, 1.5e11)
# strains of loads beyond which nothing is left of a body's shape, and of weight
FLOWS, FALLS = 10.0, 100.0


class _Size(NamedTuple):
    """Material and size of a body.

    Args:
        body: Its description.
        E: Young's modulus, or stiffness over thickness.
        density: Mass per volume.
        thickness: Thickness.
        length: Length.
    """

    body: Any
    E: float
    density: float
    thickness: float
    length: float


def doubt_units(
    comm: MPI.Comm,
    scene: Scene,
    shells: Mapping[str, ShellModel],
    beams: Mapping[str, BeamModel],
) -> None:
    """Warn of moduli, densities and loads that do not fit one another.

    The units are those that the scene names, or those that gravity tells. Without both only pairs
    that are known in no consistent system are doubted: a scene may be without units.

    Args:
        comm: Communicator.
        scene: The scene.
        shells: Shells by name.
        beams: Beams by name.
    """
    if comm.rank != 0:
        return
    for size in _sizes(shells, beams):
        sentence = _by_waves(scene, size) or _by_loads(scene, size)
        if sentence:
            warn(f"{said(size.body)}: {sentence}, so check the units")


def _sizes(shells: Mapping[str, ShellModel], beams: Mapping[str, BeamModel]) -> Iterator[_Size]:
    for shell in shells.values():
        sizes, section = shell.section.sizes, shell.shell.section
        E = getattr(section, "E", None) or sizes.stiffness / sizes.thickness
        density = sizes.mass / sizes.thickness
        yield _Size(shell.shell, E, density, sizes.thickness, shell.surface_mesh.length)
    for beam in beams.values():
        own: Any = beam.beam.section
        if hasattr(own, "E"):
            yield _Size(beam.beam, own.E, own.density, own.size, float(beam.domain.length))


def _by_waves(scene: Scene, size: _Size) -> str:
    """Doubt a modulus with a density; empty: none."""
    E, density = size.E, size.density
    # what is at rest has the same equilibrium with any density
    if scene.static or not density > 0:
        return ""
    pair, scale = f"E = {E:.4g} and density = {density:.4g}", _scale(scene)
    if scale is not None:
        length, time = scale
        speed = math.sqrt(E / density) * LENGTHS[length] / TIMES[time]
        named = scene.units is not None
        # what has nearly no mass may be meant, where no units are named
        if speed < (SLOWEST if named else SOFTEST) or (named and speed > FASTEST):
            return (
                f"by {pair} waves run at {speed:.3g} m/s, where {length} and {time} are the units "
                "of length and time as the scene or gravity says; in solids they run at 1 to "
                "20000 m/s"
            )
        if named:
            return ""
    for low, high, light, heavy in METALS:
        for modulus, right in MODULI.items():
            for unit in DENSITIES:
                metal = low * modulus <= E <= high * modulus and light <= density / unit <= heavy
                if metal and unit not in right:
                    return (
                        f"{pair} are those of a metal ({E / modulus:.4g} GPa and "
                        f"{density / unit:.4g} kg/m^3) in units that do not belong together, as "
                        "GPa or MPa with kg/m^3, or Pa with g/cm^3"
                    )
    giga = 500 <= density <= 25e3 and E / density < GIGA and E >= 1e-3
    grams = 0.5 <= density <= 25 and E >= 1e9 and GRAMS[0] <= E / density <= GRAMS[1]
    if giga or grams:
        units = "GPa with kg/m^3" if giga else "Pa with g/cm^3"
        return f"by {pair} waves run at {math.sqrt(E / density):.3g}, as with {units}"
    return ""


def _scale(scene: Scene) -> tuple[str, str] | None:
    """Units of length and time that a scene tells by their names or by gravity."""
    names = parse_units(scene.units).names
    if names and names[0] in LENGTHS and names[2] in TIMES:
        return names[0], names[2]
    for load in scene.loads:
        if isinstance(load, Gravity):
            g = math.hypot(*load.acceleration)
            for earth, units in EARTH.items():
                if abs(g / earth - 1) < 0.01:
                    return units
    return None


def _by_loads(scene: Scene, size: _Size) -> str:
    """Doubt loads that would stretch a body by a multiple of itself; empty: none."""
    body, E, density, h, length = size
    width = h if body.label == "beam" else length
    for load in scene.loads:
        # where all is linear, loads have any size
        if scene.linear or body not in scene.bodies_of(load):
            continue
        if isinstance(load, Gravity):
            stress = density * math.hypot(*load.acceleration) * length
        elif isinstance(load, PointForce):
            stress = math.hypot(*load.force) / (h * width)
        elif isinstance(load, EdgeForce) and not callable(load.force):
            stress = math.hypot(*load.force) / h
        elif isinstance(load, SurfaceForce) and not callable(load.force):
            stress = math.hypot(*load.force) * length / h
        elif isinstance(load, Pressure) and not callable(load.p):
            stress = abs(load.p) * length / h
        else:
            continue
        if stress > (FALLS if isinstance(load, Gravity) else FLOWS) * E:
            return (
                f"{said(load)} causes stresses of about {stress:.3g}, {stress / E:.3g} times E = "
                f"{E:.4g}"
            )
    return ""
