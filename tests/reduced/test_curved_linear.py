"""Curved bodies with linear strains are the exact ones where these move little, however they lie.

The kind: terms of a linearised form that vanish on flat bodies, as directors that change along the
surface. What bends and what stretches couple here.
"""

from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Clamped,
    Cylinder,
    EdgeForce,
    EdgeMoment,
    InitialVelocity,
    Isotropic,
    Probe,
    Scene,
    Shell,
    Sphere,
)

SECTION = Isotropic(E=1e7, nu=0.3, thickness=0.02, density=1000.0)
PANELS = {
    "cylinder": Cylinder(radius=0.5, length=0.8, angles=(10.0, 80.0)),
    "sphere": Sphere(radius=0.5, polar=(30.0, 70.0), azimuth=(0.0, 60.0)),
}
MOMENT = (1e-6, 1e-6, 2e-6)
SLOW = pytest.mark.slow
CASES = [
    ("cylinder", "quad"),
    *(pytest.param(*pair, marks=SLOW) for pair in (("cylinder", "tri"), ("sphere", "quad"))),
]


def panel(name: str, cell: Any, model: str) -> Shell:
    return Shell("panel", PANELS[name], SECTION, mesh=(3, 3), cell=cell, model=model)


@pytest.mark.parametrize(("name", "cell"), CASES)
def test_small_deflections_of_a_curved_panel(name: str, cell: str) -> None:
    """Of a millionth of its size: what differs is of the size of its square."""

    def bent(model: str) -> Any:
        scene = Scene(
            "panel",
            panel(name, cell, model),
            supports=Clamped("left"),
            loads=[
                EdgeForce("right", (2e-6, 1e-5, -1e-5)),
                EdgeMoment("right", (1e-6, 1e-6, 2e-6)),
            ],
            probes=[Probe(f"{k}", "right-top", "displacement", k) for k in range(3)],
            scheme="static",
            dt=1.0,
        )
        end = execute(scene).history.iloc[-1]
        return end[["0", "1", "2"]].to_numpy(dtype=float), end["strain_energy"]

    (u, energy), (v, other) = bent("exact"), bent("floating-frame")
    assert 1e-9 < np.abs(u).max() < 1e-5
    np.testing.assert_allclose(v, u, rtol=0, atol=1e-4 * np.abs(u).max())
    assert other == pytest.approx(energy, rel=1e-4)


@pytest.mark.parametrize(("name", "cell"), CASES)
def test_natural_frequencies_of_a_curved_panel(name: str, cell: str) -> None:
    """Free, with six rigid motions: linear strains have no energy in any of them."""
    found = [
        natural_modes(Scene("panel", panel(name, cell, model), scheme="ep", dt=1, t_end=1), count=9)
        for model in ("exact", "floating-frame")
    ]
    assert [modes.rigid for modes in found] == [6, 6]
    np.testing.assert_allclose(found[1].omega[6:], found[0].omega[6:], rtol=1e-6)


@SLOW
@pytest.mark.parametrize(("name", "cell"), [("cylinder", "quad"), ("cylinder", "tri")])
def test_a_curved_panel_tumbles(name: str, cell: str) -> None:
    """So slowly that nothing bends: it stays what it is, through a turn and a half."""
    spin = InitialVelocity(linear=(1e-2, 0, 0), spin=(0.02, 0.03, 0.01))
    scene = Scene(
        "tumbling",
        panel(name, cell, "floating-frame"),
        initial=spin,
        scheme="ep",
        dt=8.0,
        t_end=160.0,
    )
    run = execute(scene)
    assert run.summary["energy_balance_error"] < 1e-10
    assert run.summary["angular_momentum_drift"] < 1e-9
    # centrifugal forces on a body whose frequencies are a thousand times the spin
    assert run.column("strain_energy").max() < 1e-4 * run.column("kinetic_energy").max()
