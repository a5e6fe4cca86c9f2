"""The cantilever plate of the demo `sudden_load` as other codes are told it."""

from __future__ import annotations

from shellmb.demos.sudden_load import LENGTH, WIDTH

E, NU, THICKNESS, DENSITY = SECTION = (210e9, 0.25, 2e-3, 7870.0)


def place(r: complex, s: complex) -> tuple[complex, complex, complex]:
    """Position on it, both arguments from 0 to 1, m."""
    return LENGTH * r, WIDTH * s, 0.0
