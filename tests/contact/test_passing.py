"""Moments at which points pass through triangles that turn while they move.

The kind: a moment that is found by a straight line between the volumes at both states. Two legs of
a strip passed through each other so, in a step in which they turned by 40 degrees.
"""

import numpy as np
import pytest

from shellmb.model.shell_contact.facets import crossings


def volume(y: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Six times the volume of a point and a triangle."""
    return np.vecdot(np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]), y - v[:, 0])


@pytest.mark.parametrize("far", [0.0, 2.0])
def test_all_crossings_are_found(far: float) -> None:
    """As many as changes of sign at 1001 moments, up to three of a pair; far ones are few."""
    rng = np.random.default_rng(3)
    y, v = rng.normal(size=(2, 4000, 3)), rng.normal(size=(2, 4000, 3, 3))
    y += far * np.sign(y)
    pairs, when = crossings(tuple(y), tuple(v))
    moments = np.linspace(0.0, 1.0, 1001)
    every = np.array([volume(y[0] + t * (y[1] - y[0]), v[0] + t * (v[1] - v[0])) for t in moments])
    changes = (every[1:] * every[:-1] < 0).sum(axis=0)
    found = np.bincount(pairs, minlength=4000)
    # two that are nearer than a thousandth are not seen at these moments
    assert np.mean(found != changes) < 2e-3 and np.all(found >= changes)
    assert found.max() == 3
    t = when[:, None]
    at, on = y[0][pairs] + t * (y[1] - y[0])[pairs], v[0][pairs]
    on = on + t[:, None] * (v[1] - v[0])[pairs]
    # volumes are of the order of hundred; 1e-14 was seen
    assert np.max(np.abs(volume(at, on))) < 1e-12


def test_what_stays_on_its_side_does_not_cross() -> None:
    """Nor what moves in the plane of a triangle at rest."""
    v = np.eye(3)[None]
    away = np.array([[1.0, 1.0, 1.0]])
    plane = np.array([[0.5, 0.5, 0.0]]), np.array([[0.2, 0.3, 0.5]])
    for y in ((away, 2 * away), (0.1 * away, 0.2 * away), plane):
        assert not len(crossings(y, (v, v))[0])
    pairs, when = crossings((0 * away, away), (v, v))
    assert pairs.tolist() == [0] and when == pytest.approx(1 / 3)
