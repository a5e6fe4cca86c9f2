"""Sentences on modes: of bodies that are too stiff or too soft, by model, state, and modes."""

from __future__ import annotations

from shellmb.diagnostics.elements.bulges import bulging_modes
from shellmb.diagnostics.elements.edges import twisted_modes
from shellmb.diagnostics.elements.locking import locked_modes
from shellmb.diagnostics.elements.wrinkled import wrinkled_modes
from shellmb.diagnostics.stiffened_modes import stiffened_modes

BUCKLING = twisted_modes, bulging_modes, wrinkled_modes
VIBRATION = stiffened_modes, locked_modes, *BUCKLING
