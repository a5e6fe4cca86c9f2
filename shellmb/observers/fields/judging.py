"""Utilisations of the plies of a shell by a criterion of failure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.scene import Reserve, Shell
from shellmb.scene.shells.strength import CRITERIA

# reserve factor in fields of what is hardly loaded, or not at all
MOST = 1000.0


@dataclass(frozen=True)
class Judged:
    """Utilisations of plies by one criterion.

    Args:
        reserve: The description.
        shell: Its shell.
        strengths: Strengths by the index of the ply.
    """

    reserve: Reserve
    shell: Shell
    strengths: dict[int, Any]

    @property
    def across(self) -> bool:
        """Decide whether stresses 13 and 23 are needed."""
        return CRITERIA[self.reserve.criterion].across

    def utilisations(self, stress: Floats, strain: Floats) -> Floats:
        """Utilisations by ply, side and mode, shape (n, plies, 3, modes).

        Args:
            stress: Stresses of all plies at their sides, shape (n, plies, 3, 5).
            strain: Strains likewise.
        """
        criterion = CRITERIA[self.reserve.criterion]
        found = np.zeros((*stress.shape[:3], len(criterion.modes)))
        for k, strength in self.strengths.items():
            found[:, k] = criterion.utilisations(stress[:, k], strain[:, k], strength)
        return found

    def fields(self, stress: Floats, strain: Floats) -> dict[str, Floats]:
        """Utilisation, reserve factor (at most `MOST`) and critical ply, each of shape (n,).

        Args:
            stress: As of `utilisations`.
            strain: As of `utilisations`.
        """
        by_ply = self.utilisations(stress, strain).max(axis=(2, 3))
        largest = by_ply.max(axis=1)
        return {
            "utilisation": largest,
            "reserve": 1 / np.maximum(largest, 1 / MOST),
            "critical_ply": np.asarray(1.0 + by_ply.argmax(axis=1), dtype=float),
        }


def judged(reserve: Reserve, shell: Shell) -> Judged:
    """Utilisations of a shell by a reserve factor."""
    layers = shell.section.generic.layers  # type: ignore[attr-defined]
    chosen = reserve.plies or range(1, len(layers) + 1)
    return Judged(reserve, shell, {k - 1: layers[k - 1].strength for k in chosen})
