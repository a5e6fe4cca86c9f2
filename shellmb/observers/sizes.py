"""Sizes of a flexible body that say how stiff it is, for what is judged relative to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shellmb.model.beam import BeamModel
from shellmb.model.shell import ShellModel
from shellmb.scene import LinearSection


@dataclass(frozen=True)
class Stiffness:
    """How stiff a shell is in its surface, or a beam along its line.

    Args:
        wave_speed: Speed of longitudinal waves, m/s; infinite where nothing stretches.
        unit_energy: Strain energy at a uniform strain of one, J, to an order of magnitude.
    """

    wave_speed: float
    unit_energy: float


def stiffness_of(body: ShellModel | BeamModel) -> Stiffness:
    """Stiffness of a body with mass, in its stiffest direction."""
    if isinstance(body, ShellModel):
        description, section = body.shell, body.shell.section
        linear = isinstance(section, LinearSection)
        stiffness = np.max(np.diag(section.A)) if linear else section.stiffness
        extent = body.domain.length**2
    else:
        description, section = body.beam, body.beam.section
        stiffness, extent = section.stiffness[0, 0], body.domain.length
    speed = float(np.sqrt(stiffness / section.mass[0])) if description.stretching else np.inf
    return Stiffness(speed, float(stiffness * extent))
