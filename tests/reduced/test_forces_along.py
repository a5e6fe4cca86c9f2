"""Forces along a body that its modes, or linear strains, know nothing of: said by their size."""

from typing import Any

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import Beam, Clamped, GeneralSection, Line, Modal, PointForce, Probe, Scene

BENDING = 200.0
# hardly a shear or a stretch
SECTION = GeneralSection(
    (4e8, 1e8, 1e8, 100.0, BENDING, BENDING),
    mass_per_length=1.5,
    second_moments=(1e-4, 0.0, 1e-4),
)


def column(model: Any, share: float) -> Scene:
    """A column under a share of its buckling load, `pi^2 D/(4 L^2)`, and a small force across."""
    load = share * np.pi**2 * BENDING / 4
    return Scene(
        "column",
        beams=Beam("rod", Line((0, 0, 0), (1, 0, 0)), SECTION, elements=4, model=model),
        supports=Clamped("start"),
        loads=PointForce("end", (-load, 0.0, 1e-2 * load)),
        probes=Probe("tip", "end", component=2),
        scheme="static",
    )


@pytest.mark.parametrize(
    "model",
    [
        pytest.param(Modal(modes=4), id="modal"),
        pytest.param("floating-frame", marks=pytest.mark.slow),
    ],
)
def test_the_share_is_what_deflections_are_off_by(model: Any) -> None:
    """Most of the softening is known: the frame turns, and so the load acts across it."""
    off, said = [], []
    for share in (0.02, 0.08, 0.4):
        exact, found = (execute(column(m, share)) for m in ("exact", model))
        tips = [run.history["tip"].iloc[-1] for run in (exact, found)]
        off.append(abs(tips[1] / tips[0] - 1))
        said.append([c["value"] for c in found.summary["warnings"] if "along it" in c["says"]])
    assert said[0] == []
    for error, values in zip(off[1:], said[1:], strict=True):
        assert len(values) == 1
        assert error / 3 < values[0] < 3 * error
    assert off[0] < 0.01
