"""What follows from resultants at a point by the section alone: strains, energy, stresses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from shellmb.scene import Beam, Laminate, LinearSection, Shell

Floats = npt.NDArray[np.float64]
# values at points, shape (n, k), from resultants there, shape (n, 8) or (n, 6)
type Derived = Callable[[Floats], Floats]


def shell_compliance(shell: Shell, held: bool = True) -> Floats:
    """Strains (eps, kap, gam) of resultants (N, M, Q), shape (8, 8); of linear sections.

    Args:
        shell: The shell.
        held: Whether strains that are held at zero are; else they are what the section itself
            would give to the forces that hold them.
    """
    section = shell.section
    assert isinstance(section, LinearSection)
    stiffness = np.zeros((8, 8))
    stiffness[:3, :3], stiffness[3:6, 3:6], stiffness[6:, 6:] = section.A, section.D, section.G
    # without stretching there is nothing that bending could be coupled to
    if section.coupled and shell.coupling and shell.stretching:
        stiffness[:3, 3:6] = stiffness[3:6, :3] = section.B
    compliance = np.linalg.inv(stiffness)
    if held and not shell.stretching:
        compliance[:3] = 0.0
    if held and not shell.transverse_shear:
        compliance[6:] = 0.0
    return compliance


def beam_compliance(beam: Beam) -> Floats:
    """Strains (Gamma, K) of forces and moments, shape (6, 6), as in `forms.beam.BeamMixed`."""
    C = np.asarray(beam.section.stiffness, dtype=float)
    A, B, D = C[:3, :3], C[:3, 3:], C[3:, 3:]
    H = np.linalg.solve(A, B) if beam.coupling else np.zeros((3, 3))
    free = [k for k, on in enumerate((beam.stretching, *2 * (beam.transverse_shear,))) if on]
    # K of N and M, and Gamma of N and of K
    K = np.linalg.inv(D - B.T @ H) @ np.hstack([-H.T, np.eye(3)])
    Gamma = np.zeros((3, 6))
    Gamma[np.ix_(free, free)] = np.linalg.inv(A[np.ix_(free, free)])
    Gamma[free] -= (H @ K)[free]
    return np.vstack([Gamma, K])


def strains_by(compliance: Floats) -> Derived:
    """Strains from resultants."""
    return lambda R: np.asarray(R @ compliance.T)


def energy_by(compliance: Floats) -> Derived:
    """Strain energy per area or length from resultants, shape (n,)."""
    return lambda R: np.asarray(np.einsum("ni,ij,nj->n", R, compliance, R) / 2)


def principal(R: Floats) -> Floats:
    """Principal membrane forces, the larger one first, shape (n, 2)."""
    middle, half = (R[:, 0] + R[:, 1]) / 2, (R[:, 0] - R[:, 1]) / 2
    radius = np.hypot(half, R[:, 2])
    return np.stack([middle + radius, middle - radius], axis=1)


def surface_stress(shell: Shell) -> Derived:
    """Stresses 11, 22, 12 at the lower and the upper face along the shell's material axes.

    Args:
        shell: The shell, with a linear section.
    """
    section = shell.section
    assert isinstance(section, LinearSection)
    layers, z = section.layers, _heights(section)
    lower = _stress_at(shell, layers[0].plane, z[0])
    upper = _stress_at(shell, layers[-1].plane, z[-1])
    both = np.vstack([lower, upper])
    return lambda R: np.asarray(R @ both.T)


def ply_stress(shell: Shell, number: int) -> Derived:
    """Stresses at the lower and the upper face of a ply along and across its fibres.

    Args:
        shell: The shell, with a laminate.
        number: Which ply, from 0 at the lower face of the laminate.
    """
    section = shell.section
    assert isinstance(section, Laminate)
    angle = np.radians(section.plies[number].angle)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array(
        [[c * c, s * s, 2 * c * s], [s * s, c * c, -2 * c * s], [-c * s, c * s, c * c - s * s]]
    )
    z, plane = _heights(section), section.layers[number].plane
    both = np.vstack([turn @ _stress_at(shell, plane, z[number + k]) for k in (0, 1)])
    return lambda R: np.asarray(R @ both.T)


def _heights(section: LinearSection) -> Floats:
    """Heights of the faces of the layers above the reference surface, shape (n + 1,)."""
    t = np.array([layer.thickness for layer in section.layers])
    faces = np.concatenate([[0.0], np.cumsum(t)])
    return np.asarray(faces - faces[-1] / 2 + section.offset)


def _stress_at(shell: Shell, plane: Floats, z: float) -> Floats:
    """Stresses at a height from resultants, shape (3, 8)."""
    compliance = shell_compliance(shell, held=False)
    return np.asarray(plane @ (compliance[:3] + z * compliance[3:6]))
