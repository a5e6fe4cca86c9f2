"""Natural strains that no length can have are refused, large ones are warned of."""

from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

import shellmb as sm
from shellmb.errors import SceneError
from shellmb.model.model import Model

from .test_natural import HELD, H, beam

METAL = sm.Isotropic(200e9, 0.3, H, 7800.0)
# by every way to give them, more than lengths can have: shorter than nothing, or per cent and
# milli strains that were meant as ratios
WRONG = {
    "shell 'plate': its natural strain reaches -2;": sm.NaturalStrain((-2.0, -2.0, 0.0)),
    "reaches 1.2;": sm.NaturalStrain((1.2, 0.0, 0.0)),
    # 11 and 22 vanish: by the principal ones
    "reaches -0.6;": sm.NaturalStrain((0.0, 0.0, 1.2)),
    "reaches 3.516;": sm.thermal_strain(METAL, 1.2e-5, 293e3),
    # of a plate 2 mm thick
    "natural strain at the faces reaches -0.6;": sm.NaturalStrain(curvature=(600.0, 0.0, 0.0)),
    "reaches -0.7;": sm.NaturalStrain(lambda x: np.array([-0.7 * x[0], 0 * x[0], 0 * x[0]])),
    "reaches -0.8;": sm.NaturalStrain((0.01, 0.0, 0.0), time=lambda t: -80.0 * t),
    "time gives 'warm' at t = 0.25": sm.NaturalStrain(
        (1e-3, 0.0, 0.0), time=lambda t: "warm" if t == 0.25 else 1.0
    ),
    "beam 'beam': its natural strain reaches -0.8;": sm.BeamNaturalStrain(-0.8),
}
LARGE = {
    "reaches 0.06, more than 0.05": sm.NaturalStrain((0.06, 0.0, 0.0)),
    "reaches -0.09": sm.NaturalStrain((0.0, -0.09, 0.0)),
    "at the faces reaches -0.07": sm.NaturalStrain((-0.02, 0.0, 0.0), (50.0, 0.0, 0.0)),
    "reaches 0.3": sm.NaturalStrain(lambda x: np.array([0 * x[0], 0.3 * x[0], 0 * x[0]])),
    "reaches 0.2": sm.NaturalStrain((0.01, 0.0, 0.0), time=lambda t: 20 * t),
    "at the faces reaches 0.06": sm.BeamNaturalStrain(0.05, (0.0, 1.0, 0.0)),
}


def of(natural: Any) -> sm.Scene:
    """A plate of steel 2 mm thick, or a beam 20 mm wide."""
    if isinstance(natural, sm.BeamNaturalStrain):
        return beam(natural)
    shell = sm.Shell("plate", sm.Rectangle(1.0, 0.5), METAL, mesh=(2, 2), natural=natural)
    return sm.Scene("plate", shell, supports=HELD)


@pytest.mark.parametrize("message", WRONG)
def test_natural_strains_that_no_length_can_have_are_refused(message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Model(of(WRONG[message]), MPI.COMM_WORLD)


@pytest.mark.parametrize("message", LARGE)
def test_natural_strains_beyond_five_per_cent_warn(message: str) -> None:
    with pytest.warns(sm.ShellmbWarning, match=message):
        model = Model(of(LARGE[message]), MPI.COMM_WORLD)
    # where Newton's method does not converge it says nothing of the mesh
    assert not any("mesh" in p.advice for b in model.meshed.values() for p in b.parts)
