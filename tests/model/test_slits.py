"""Surfaces whose opposite edges lie on one another are open there, and a run says so.

The kind: a map that closes in itself, whatever its size, place and direction. A pole, a surface
that is closed, and a slit that is said to be meant are none.
"""

import warnings

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import ShellmbWarning
from shellmb.model.model import Model
from shellmb.scene import Clamped, Cylinder, Isotropic, Parametric, Scene, Shell, Surface


def tube(size=1.0, across=False):
    """A cylinder, along its first or its second parameter."""

    def place(xi, eta):
        along, around = (eta, xi) if across else (xi, eta)
        a = 2 * np.pi * around
        return size * np.stack([3 + along, 0.1 * np.cos(a), 0.1 * np.sin(a)])

    return place


def ring(xi, eta):
    r, a = 1 + eta, 2 * np.pi * xi
    return np.stack([r * np.cos(a), r * np.sin(a), 0 * r])


class Own(Surface):
    """A surface of a user's own."""

    def position(self, xi, eta):
        return ring(xi, eta)


def built(surface, edge):
    section = Isotropic(E=1.0, nu=0.3, thickness=1e-2)
    shell = Shell("shell", surface, section, mesh=(4, 4))
    scene = Scene("s", shell, supports=Clamped(edge), scheme="linear-statics")
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        Model(scene, MPI.COMM_SELF)
    return " ".join(str(w.message) for w in heard if w.category is ShellmbWarning)


@pytest.mark.parametrize(
    ("surface", "edges"),
    [
        (Parametric(tube()), ("bottom", "top")),
        (Parametric(tube(1e3)), ("bottom", "top")),
        (Parametric(tube(1e-3, across=True)), ("left", "right")),
        (Parametric(ring), ("left", "right")),
        (Own(), ("left", "right")),
    ],
)
def test_a_slit_is_said(surface, edges):
    other = "left" if edges[0] == "bottom" else "bottom"
    said = built(surface, other)
    assert f"shell 'shell': its edges '{edges[0]}' and '{edges[1]}' lie on one another" in said


@pytest.mark.parametrize(
    "surface",
    [
        Parametric(ring, slit=True),
        Parametric(lambda xi, eta: np.stack([xi, eta, 0 * xi])),
        Cylinder(0.1, 1.0),
    ],
)
def test_what_is_meant_or_closed_is_not(surface):
    assert built(surface, "bottom") == ""
