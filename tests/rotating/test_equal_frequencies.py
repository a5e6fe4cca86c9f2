"""Branches of a Campbell diagram where several modes have one frequency: none is torn."""

import math

from mpi4py import MPI  # noqa: F401

import numpy as np

import shellmb as sm
from shellmb.running.rotating.campbell import SAME, _mixed

STEEL = sm.CircularSection(210e9, 0.3, radius=0.01, density=7850.0)


def rotor(blades: int) -> sm.Scene:
    """Equal blades on an axle that nothing couples: each frequency is there once for each."""
    made = []
    for k in range(blades):
        c, s = math.cos(2 * math.pi * k / blades), math.sin(2 * math.pi * k / blades)
        line = sm.Line((0.1 * c, 0.1 * s, 0.0), (1.1 * c, 1.1 * s, 0.0))
        made.append(sm.Beam(f"blade {k}", line, STEEL, elements=2))
    held = [sm.Clamped("start", body=beam.name) for beam in made]
    return sm.Scene("rotor", beams=made, supports=held)


def test_equal_blades_have_whole_branches(tmp_path) -> None:
    rates, blades = [0.0, 20.0, 40.0, 60.0], 5
    found = sm.modes(
        rotor(blades), tmp_path, 2 * blades, rates=rates, axis=(0, 0, 1), pictures=False
    )
    assert found.warnings == ()
    first = found.frequencies[:, : 2 * blades]
    assert not np.isnan(first).any()
    # Southwell: the square of each frequency grows with that of the rate, the same for equal blades
    squares = first**2 - first[0] ** 2
    slopes = squares[1:] / np.square(rates[1:])[:, None]
    assert np.ptp(slopes, axis=0).max() < 0.02 * slopes.max()


def test_any_mixture_of_equal_modes_is_the_same_group() -> None:
    """Five modes of one frequency, mixed at will, and one of another."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(5, 5)))[0]
    alike = np.zeros((6, 6))
    alike[:5, :5], alike[5, 5] = turn**2, 1.0
    equal, apart = np.array([1.0] * 5 + [2.0]), np.linspace(1.0, 2.0, 6)
    assert alike[0].max() < 1 and alike[:5, :5].min() < SAME
    whole = np.zeros((6, 6))
    whole[:5, :5], whole[5, 5] = 1.0, 1.0
    assert np.allclose(_mixed(alike, equal, equal), whole)
    # a group that splits has each of its parts as a whole; what is no group is left as it is
    assert np.allclose(_mixed(alike, equal, apart)[:5, :5], 1.0)
    assert np.allclose(_mixed(alike, apart, apart), alike)
