"""Damping of bodies in modes has its couplings: the modes of a damped body are not those without.

The kind: a matrix of which only the diagonal counts. With several times of damping it is full.
"""

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.running.rotating.campbell import campbell
from shellmb.scene import Isotropic, Modal, ShellDamping
from tests import scenes

# so thick that its bending modes have a good part of their energy in shear, which alone is damped
THICK = Isotropic(
    E=70e9, nu=0.3, thickness=0.25, density=2700.0, stiffness_damping=ShellDamping(0.0, 0.0, 1e-4)
)


def complex_modes(M: Floats, D: Floats, K: Floats) -> npt.NDArray[np.complex128]:
    """Eigenvalues of `M s^2 + D s + K` above the real axis, in the order of their sizes."""
    n, inverse = len(M), np.linalg.inv(M)
    whole = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ D]])
    found = np.linalg.eigvals(whole)
    return np.array(sorted((s for s in found if s.imag > 0), key=abs))


def test_complex_modes_of_a_body_in_modes() -> None:
    """By its full matrix of damping: they are found at rest, where nothing has to turn along."""
    count = 10
    given = {"model": Modal(modes=count), "mesh": (4, 2), "dt": 1e-4, "t_end": 1e-3}
    scene = scenes.plate_scene(section=THICK, size=(1.0, 0.8), **given)
    (data,) = natural_modes(scene, count=1).model.modal
    K, D = np.diag(data.stiffness), data.damping
    exact = complex_modes(np.diag(data.stiffness / data.omega2), D, K)
    # couplings are no small part, and they move eigenvalues
    share = D / np.sqrt(np.outer(D.diagonal(), D.diagonal()))
    assert np.sort(np.abs(share - np.eye(len(D))).ravel())[-2] > 0.3
    found = campbell(scene, [0.0], count=12, axis=(0, 0, 1)).modes[0]
    own = found.values[found.rigid :]
    np.testing.assert_allclose(own[:4], exact[:4], rtol=1e-6)
    alone = complex_modes(np.diag(data.stiffness / data.omega2), np.diag(D.diagonal()), K)
    assert np.abs(alone[:6] / exact[:6] - 1).max() > 1e-4
