"""Without transverse shear: thick sections with the values of thin plates and slender beams."""

import math
from dataclasses import replace

import numpy as np
import pytest

from shellmb.demos.verification import tables
from shellmb.demos.verification.setups import CENTRE, plate_section, square
from shellmb.demos.verification.solve import displacement, solved
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Beam,
    Clamped,
    EdgeMoment,
    Isotropic,
    Line,
    PointForce,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import Simulation

# Timoshenko & Woinowsky-Krieger: uniform load, w D / (q a^4); docs/reference/literature.md
THIN = {"hard": 4.062353e-3, "clamped": 1.265319087e-3}


@pytest.mark.parametrize("edges", THIN)
def test_thick_plates_bend_as_thin_ones(edges) -> None:
    """a/h = 10, where shear makes 5 to 19 %; 8x8 elements are within 0.2 %, 12x12 within 0.05 %."""
    scene = square(edges, plate_section(0.1))
    thin = replace(scene, shells=replace(scene.shells[0], mesh=(12, 12), transverse_shear=False))
    assert displacement(solved(scene), CENTRE)[2] > 1.04 * THIN[edges]
    for solve in ("reduced", "full"):
        run = solved(replace(thin, solver=replace(thin.solver, solve=solve)))
        assert displacement(run, CENTRE)[2] == pytest.approx(THIN[edges], rel=1e-3)


def test_frequencies_of_a_free_plate_are_those_of_a_thin_one() -> None:
    """a/h = 20 without rotary inertia: six rigid modes, then the thin plate's.

    Differences on 6x6 elements are up to 0.6 % (measured): those of the mesh.
    """
    h = 0.05
    section = plate_section(h, density=1.0)
    shell = Shell("plate", Rectangle(1.0, 1.0), section, mesh=(6, 6))
    shell = replace(shell, rotary_inertia=False, transverse_shear=False)
    modes = natural_modes(Scene("free", shell, scheme="ep", dt=1.0, t_end=1.0), count=11)
    assert modes.rigid == 6
    scaled = modes.omega[6:11] * math.sqrt(h / float(section.D[0, 0]))
    assert scaled == pytest.approx(tables.thin_plate_frequencies("free")[:5], rel=0.01)


def test_an_inextensible_strip_rolls_up_without_growing() -> None:
    """Half a circle under an end moment in one load step; its length is kept to the slack.

    The slack gives way by 1e-5 of what the section would shear; h/L = 0.02 would stretch by more.
    """
    length, h = 1.0, 0.02
    steel = Isotropic(E=1e9, nu=0.0, thickness=h)
    strip = Shell("strip", Rectangle(length, 0.1), steel, mesh=(8, 1), stretching=False)
    moment = math.pi * 1e9 * h**3 / 12 / length
    load = EdgeMoment("right", (0.0, -moment, 0.0))
    scene = Scene("roll", strip, supports=Clamped("left"), loads=load, dt=1.0)
    tip = displacement(solved(scene), (length, 0.0, 0.0))
    radius = length / math.pi
    # elements of 22.5 degrees: the mesh's part is 0.1 % (measured)
    assert tip[[0, 2]] == pytest.approx([-length, 2 * radius], rel=3e-3)


@pytest.mark.parametrize("stretching", [True, False])
def test_slender_beams(stretching) -> None:
    """Bernoulli's deflection and the line's stretching, each by itself; the slack is 1e-5."""
    E, width, height, length = 1e9, 0.1, 0.2, 1.0
    section = RectangularSection(E=E, nu=0.3, width=width, height=height)
    beam = Beam("b", Line((0, 0, 0), (length, 0, 0)), section, elements=2, up=(0, 0, 1))
    beam = replace(beam, transverse_shear=False, stretching=stretching)
    load = PointForce("end", (1.0, 0.0, 1.0))
    run = Simulation(Scene("beam", beams=beam, supports=Clamped("start"), loads=load,
                           scheme="linear-statics"))  # fmt: skip
    run.run()
    model = run.model.beams["b"]
    u = run.problem.state("b").x.array[model.mixed.dofs["u"]].reshape(-1, 3)
    tip = u[int(np.argmax(model.mixed.nodes("u")[:, 0]))]
    assert tip[2] == pytest.approx(length**3 / (3 * E * width * height**3 / 12), rel=1e-5)
    stretch = length / (E * width * height)
    assert tip[0] == pytest.approx(stretch if stretching else 0.0, rel=1e-9, abs=1e-4 * stretch)
