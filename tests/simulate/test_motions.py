"""Rigid motions in words."""

from typing import Any

import numpy as np
import pytest

from shellmb.preprocessing.constraint_analysis.mobility import Frame, describe


@pytest.mark.parametrize(
    ("motions", "said"),
    [
        (np.eye(6), "move freely"),
        (np.eye(6)[:, :0], ""),
        (np.eye(6)[:, :3], "translate along x, y and z"),
        ([[0], [0], [1], [0], [0], [0]], "translate along z"),
        ([[0], [3], [4], [0], [0], [0]], "translate along (0, 0.6, 0.8)"),
        ([[0], [1], [0], [1e-16], [0], [-2e-19]], "translate along y"),
        # the middle moves along y where the body turns about z through a point at its left
        ([[0], [0.5], [0], [0], [0], [1]], "turn about z through (0, 0, 0)"),
    ],
)
def test_motions_in_words(motions: Any, said: str) -> None:
    frame = Frame(np.array([1.0, 0.0, 0.0]), 2.0)
    assert describe(frame, np.asarray(motions, dtype=float)) == said
