"""Cantilever plate with a stiffener along its middle: a glued beam against a strip of thick shell.

The stiffener is a bar of width `b` and height `H`, symmetric about the plate. Once it is a beam,
glued to the plate's middle line by shell revolute joints (eq. 35), once a strip of shell of the
thickness `H` between two halves of the plate. The beam has what the bar has more than the plate it
runs through, so that both are the same structure as `b` becomes small; `b H^3`, the bending
stiffness, is kept. Deflections under a uniform load and frequencies of both approach one another.
"""

# KIND: statics and paths
# CI: shellmb run stiffened_plate --check
# CI: mpiexec -n 2 shellmb run stiffened_plate --no-pictures --quiet

import math
from typing import Any, Literal

from shellmb.running.execute import execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    AlongLine,
    Beam,
    Clamped,
    GeneralSection,
    Glue,
    Isotropic,
    Join,
    Probe,
    Rectangle,
    Scene,
    Shell,
    SurfaceForce,
)

LENGTH, WIDTH, THICKNESS = 1.0, 1.0, 0.005  # [m]
E, NU, RHO, SHEAR = 70e9, 0.3, 2700.0, 5 / 6
STIFFNESS = 0.08 * 0.02**3  # b H^3 of the bar [m^4]
FORCE = 10.0  # [N/m^2]

WIDTHS = (0.08, 0.04, 0.02)  # [m]
MODES = 4


def bar(b: float) -> GeneralSection:
    """Surplus of the bar over the plate it runs through, by the shell theory of the strip.

    Args:
        b: Its width [m].
    """
    H, t, G = height(b), THICKNESS, E / (2 * (1 + NU))
    area, bending = b * (H - t), b * (H**3 - t**3) / 12
    lateral = b**3 * (H - t) / 12
    torsion = _torsion(b, H) - b * t**3 / 3
    return GeneralSection(
        stiffness=(
            E * area,
            SHEAR * G * area,
            SHEAR * G * area,
            G * torsion,
            E * bending,
            E * lateral,
        ),
        mass_per_length=RHO * area,
        second_moments=(RHO * lateral, 0.0, RHO * bending),
        size=H,
    )


def height(b: float) -> float:
    """Height of the bar of the given width [m]."""
    return float((STIFFNESS / b) ** (1 / 3))


def _torsion(b: float, H: float) -> float:
    """Torsion constant of a free strip by first-order shear theory [m^4].

    The twisting curvature relaxes towards the edges within `H / sqrt(12 k)`; `b H^3 / 3` for a
    wide strip, `k b^3 H / 3` for a narrow one.
    """
    decay = math.sqrt(12 * SHEAR) / H
    return H**3 / 3 * (b - 2 * math.tanh(decay * b / 2) / decay)


def scene(
    stiffener: Literal["beam", "strip"] = "beam",
    width: float = 0.04,
    glue: Literal["revolute", "director"] = "revolute",
    elements: int = 8,
) -> Scene:
    """The plate.

    Args:
        stiffener: Whether it is a beam or a strip of shell.
        width: Width of the stiffener [m].
        glue: How the beam is connected.
        elements: Elements along either side of the plate, an even number.
    """
    thin = Isotropic(E=E, nu=NU, thickness=THICKNESS, density=RHO, shear_correction=SHEAR)
    thick = Isotropic(E=E, nu=NU, thickness=height(width), density=RHO, shear_correction=SHEAR)
    middle, half = WIDTH / 2, (WIDTH - width) / 2
    parts: dict[str, Any]
    if stiffener == "beam":
        plate = Shell("plate", Rectangle(LENGTH, WIDTH), thin, mesh=(elements, elements))
        line = AlongLine("plate", (0.0, middle, 0.0), (LENGTH, middle, 0.0))
        parts = {
            "shells": plate,
            "beams": Beam("stiffener", line, bar(width)),
            "glues": Glue("stiffener", "plate", glue),
        }
        names = ["plate"]
        corner, tip = "plate", "plate"
    else:

        def strip(name: str, y: float, w: float, section: Isotropic, count: int) -> Shell:
            surface = Rectangle(LENGTH, w, origin=(0.0, y, 0.0))
            return Shell(name, surface, section, mesh=(elements, count))

        parts = {
            "shells": (
                strip("near", 0.0, half, thin, elements // 2),
                strip("stiffener", half, width, thick, 1),
                strip("far", half + width, half, thin, elements // 2),
            ),
            "joins": (
                Join("near", "stiffener", "top", "bottom"),
                Join("stiffener", "far", "top", "bottom"),
            ),
        }
        names = ["near", "stiffener", "far"]
        corner, tip = "near", "stiffener"
    return Scene(
        "stiffened_plate",
        **parts,
        supports=tuple(Clamped("left", body=name) for name in names),
        loads=tuple(SurfaceForce((0.0, 0.0, FORCE), body=name) for name in names),
        probes=(
            Probe("tip", (LENGTH, middle, 0.0), component=2, body=tip),
            Probe("corner", (LENGTH, 0.0, 0.0), component=2, body=corner),
        ),
        scheme="linear-statics",
        units="m, kg, s",
    )


def measured(comm: Any, **choices: Any) -> dict[str, float]:
    """Deflections and frequencies of the scene with the given choices.

    Args:
        comm: Communicator.
        choices: Parameters of `scene`.
    """
    described = scene(**choices)
    history = execute(described, comm=comm).history
    frequencies = natural_modes(described, comm, MODES).frequencies
    found = {name: float(history[name].iloc[-1]) for name in ("tip", "corner")}
    return found | {f"f{k + 1}": float(f) for k, f in enumerate(frequencies)}


def results(run: Any) -> dict[str, float]:
    """Deflections, and by how much beam and strip differ for each width and on a coarser mesh."""
    comm = run.simulation.model.comm
    found = {name: float(run.column(name)[-1]) for name in ("tip", "corner")}
    for b, elements in ((WIDTHS[-1], 8), *((b, 16) for b in WIDTHS)):
        beam, strip = (
            measured(comm, stiffener=kind, width=b, elements=elements) for kind in ("beam", "strip")
        )
        for name, value in beam.items():
            found[f"{name}_{1e3 * b:g}mm_{elements}"] = value / strip[name] - 1
    other = measured(comm, width=WIDTHS[-1], elements=16, glue="director")
    found["glue_difference"] = max(abs(other[name] / beam[name] - 1) for name in beam)
    return found


def check(results: dict[str, float]) -> None:
    """Beam and strip approach one another with the width, then with the mesh."""
    for name in ("corner", *(f"f{k + 1}" for k in range(MODES))):
        errors = [abs(results[f"{name}_{1e3 * b:g}mm_16"]) for b in WIDTHS]
        # of first order in the width
        assert errors[1] < 0.7 * errors[0], f"{name}: {errors}"
        assert errors[2] < 0.7 * errors[1], f"{name}: {errors}"
        assert errors[2] < 0.025, f"{name}: {errors}"
    # the tip is on the stiffener itself, whose width hardly matters: the rest is that of the meshes
    coarse, fine = (abs(results[f"tip_20mm_{n}"]) for n in (8, 16))
    assert coarse < 0.005, f"tip: {coarse}"
    assert fine < 0.6 * coarse, f"tip: {coarse}, {fine}"
    # the two kinds of glue are one; eigenvalues are found to about this
    assert results["glue_difference"] < 1e-8
