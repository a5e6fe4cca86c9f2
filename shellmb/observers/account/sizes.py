"""Sizes of a flexible body that say how stiff it is, for what is judged relative to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shellmb.model.frames.beam import BeamModel
from shellmb.model.shells.shell import ShellModel


@dataclass(frozen=True)
class Stiffness:
    """Stiffness of a shell in its surface, or of a beam along its line.

    Args:
        wave_speed: Speed of longitudinal waves, m/s; infinite where nothing stretches, 0 without
            mass.
        unit_energy: Strain energy at a uniform strain of one, J, to an order of magnitude.
    """

    wave_speed: float
    unit_energy: float


def stiffness_of(body: ShellModel | BeamModel) -> Stiffness:
    """Stiffness of a body with mass, in its stiffest direction."""
    if isinstance(body, ShellModel):
        sizes, area = body.section.sizes, body.domain.length**2
        return _stiffness(sizes.stiffness, sizes.mass, body.shell.stretching, area)
    axial = float(body.beam.section.stiffness[0, 0])
    return _stiffness(axial, body.beam.section.mass[0], body.beam.stretching, body.domain.length)


def _stiffness(stiffness: float, mass: float, stretching: bool, extent: float) -> Stiffness:
    if not mass > 0:
        return Stiffness(0.0, stiffness * extent)
    speed = float(np.sqrt(stiffness / mass)) if stretching else np.inf
    return Stiffness(speed, stiffness * extent)
