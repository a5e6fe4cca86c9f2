"""The cantilever plate of the demo `sudden_load` in shellmb, for comparisons with other codes."""

from __future__ import annotations

from dataclasses import dataclass

from shellmb.demos import sudden_load
from shellmb.demos.sudden_load import LENGTH, WIDTH
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.dynamics.our_motion import OurMotion

# as other codes are told it
E, NU, THICKNESS, DENSITY = SECTION = (210e9, 0.25, 2e-3, 7870.0)


def place(r: complex, s: complex) -> tuple[complex, complex, complex]:
    """Position on the plate, both arguments from 0 to 1, m."""
    return LENGTH * r, WIDTH * s, 0.0


@dataclass(frozen=True)
class Pushed:
    """Load of the plate.

    Args:
        force: Force on the free edge, N.
        t_end: End, s.
    """

    force: float = 2.0
    t_end: float = 0.5


@dataclass(frozen=True)
class OurPlate(Pushed, OurMotion):
    """Settings of the solution; `tolerance` as of the plate in other codes (`plates.py`)."""

    tolerance: float = 1e-2

    def run(self) -> TipHistory:
        """Solve; set-up and compilation are not timed."""
        scene = sudden_load.scene(force=self.force, t_end=self.t_end)
        return self.solve(scene, (LENGTH, WIDTH / 2, 0.0), 2)
