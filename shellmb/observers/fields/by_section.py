"""Strains, energy and stresses at a point, from resultants and the section alone."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.shells.shell import ShellModel
from shellmb.scene import Beam, LinearSection, Shell
from shellmb.scene.shells.lamination import Layup, strain_turn

# values at points, shape (n, k), from resultants there: of a beam shape (n, 6), of a shell (n, 8),
# of one whose branches act what `LayerResultants` has
type Derived = Callable[[Floats], Floats]


def layup(body: ShellModel, dynamic: bool) -> Layup:
    """The section of a shell at its local nodes, or of no point where it does not vary.

    Args:
        body: The shell.
        dynamic: Whether its branches act; in statics they are relaxed, or strained at once.
    """
    section = body.shell.section
    assert isinstance(section, LinearSection)
    if section.functions:
        found = section.at(body.mixed.nodes("u").T, f"shell '{body.name}'")
    else:
        found = section.generic
    return found if dynamic else found.at_rest


def shell_stiffness(shell: Shell, at: Layup) -> Floats:
    """Resultants (N, M, Q) of strains (eps, kap, gam), shape (..., 8, 8); of linear sections."""
    stiffness = np.zeros((*at.D.shape[:-2], 8, 8))
    stiffness[..., :3, :3], stiffness[..., 3:6, 3:6], stiffness[..., 6:, 6:] = at.A, at.D, at.G
    # without stretching there is nothing that bending could be coupled to
    if shell.coupling and shell.stretching:
        stiffness[..., :3, 3:6] = stiffness[..., 3:6, :3] = at.B
    return stiffness


def shell_compliance(shell: Shell, at: Layup, held: bool = True) -> Floats:
    """Strains (eps, kap, gam) of resultants (N, M, Q), shape (..., 8, 8); of linear sections.

    Args:
        shell: The shell.
        at: Its section at points (...).
        held: Whether strains that are constrained to zero are; else they are what the section
            itself would give to the forces that hold them.
    """
    compliance = np.linalg.inv(shell_stiffness(shell, at))
    if held and not shell.stretching:
        compliance[..., :3, :] = 0.0
    if held and not shell.transverse_shear:
        compliance[..., 6:, :] = 0.0
    return compliance


def beam_compliance(beam: Beam) -> Floats:
    """Strains (Gamma, K) of forces and moments, shape (6, 6), as in `forms.beam.BeamMixed`."""
    C = beam.section.long_term
    A, B, D = C[:3, :3], C[:3, 3:], C[3:, 3:]
    H = np.linalg.solve(A, B) if beam.coupling else np.zeros((3, 3))
    free = [k for k, on in enumerate((beam.stretching, *2 * (beam.transverse_shear,))) if on]
    # K of N and M, and Gamma of N and of K
    K = np.linalg.inv(D - B.T @ H) @ np.hstack([-H.T, np.eye(3)])
    Gamma = np.zeros((3, 6))
    Gamma[np.ix_(free, free)] = np.linalg.inv(A[np.ix_(free, free)])
    Gamma[free] -= (H @ K)[free]
    return np.vstack([Gamma, K])


def compliance(body: Any, dynamic: bool) -> Floats:
    """Strains of the resultants of a shell or beam; arguments as of `layup`."""
    if not body.described.section.layered:
        return beam_compliance(body.described)
    return shell_compliance(body.described, layup(body, dynamic))


def strains_by(compliance: Floats) -> Derived:
    """Strains, or stresses, from the first of some resultants, by rows of all points or of each."""
    return lambda R: np.asarray(
        np.einsum("...ij,...j->...i", compliance, R[..., : compliance.shape[-1]])
    )


def energy_by(compliance: Floats) -> Derived:
    """Strain energy per area or length from resultants, shape (n,)."""
    return lambda R: np.asarray(np.einsum("...i,...ij,...j->...", R, compliance, R) / 2)


def principal(R: Floats) -> Floats:
    """Principal membrane forces, the larger one first, shape (n, 2)."""
    middle, half = (R[:, 0] + R[:, 1]) / 2, (R[:, 0] - R[:, 1]) / 2
    radius = np.hypot(half, R[:, 2])
    return np.stack([middle + radius, middle - radius], axis=1)


def surface_stress(shell: Shell, at: Layup) -> Derived:
    """Stresses 11, 22, 12 at the lower and the upper face along the shell's material axes.

    Args:
        shell: The shell, with a linear section.
        at: Its section at points (...).
    """
    upward = range(len(at.layers))
    ends = ((upward, at.heights[0]), (upward[::-1], at.heights[-1]))
    found = [_outermost(shell, at, order, z) for order, z in ends]
    return strains_by(np.concatenate(found, axis=-2))


def face_strain(shell: Shell, at: Layup) -> Derived:
    """Strains 11, 22, 12 at the lower and the upper face, tensor components.

    Args:
        shell: The shell, with a linear section.
        at: Its section at points (...).
    """
    compliance = shell_compliance(shell, at)
    half = np.array([1.0, 1.0, 0.5])[:, None]
    faces = [np.asarray(at.heights[k])[..., None, None] for k in (0, -1)]
    found = [half * (compliance[..., :3, :] + z * compliance[..., 3:6, :]) for z in faces]
    return strains_by(np.concatenate(found, axis=-2))


def principal_at_faces(plane: Floats) -> Floats:
    """Principal values at both faces, the larger one first, shape (n, 4).

    Args:
        plane: Components 11, 22, 12 at both faces, shape (n, 6).
    """
    return np.concatenate([principal(plane[:, :3]), principal(plane[:, 3:])], axis=1)


def von_mises(stress: Floats) -> Floats:
    """Von Mises stresses at both faces, where transverse stresses vanish, shape (n, 2).

    Args:
        stress: Stresses 11, 22, 12 at both faces, shape (n, 6).
    """
    a, b, c = np.moveaxis(stress.reshape(-1, 2, 3), -1, 0)
    return np.asarray(np.sqrt(a**2 + b**2 - a * b + 3 * c**2))


def _outermost(shell: Shell, at: Layup, order: Sequence[int], z: Any) -> Floats:
    """Stresses at a height of the first layer that is not dropped, shape (..., 3, columns)."""
    found = stress_at(shell, at, order[-1], z)
    for k in order[-2::-1]:
        there = np.asarray(at.layers[k].thickness)[..., None, None] > 0
        found = np.where(there, stress_at(shell, at, k, z), found)
    return found


def ply_stress(shell: Shell, at: Layup, number: int) -> Derived:
    """Stresses at the lower and the upper face of a ply along and across its fibres.

    Where a ply is dropped they are zero.

    Args:
        shell: The shell, with a laminate.
        at: Its section at points (...).
        number: Which ply, from 0 at the lower face of the laminate.
    """
    ply = at.layers[number]
    turn = strain_turn(-ply.angle).mT * (np.asarray(ply.thickness)[..., None, None] > 0)
    both = [turn @ stress_at(shell, at, number, at.heights[number + k]) for k in (0, 1)]
    return strains_by(np.concatenate(both, axis=-2))


def stress_at(shell: Shell, at: Layup, number: int, z: Any) -> Floats:
    """Stresses of a layer at a height from `N` and `M`, shape (..., 3, 6), or of `Layup.among`.

    Where plies have natural strains, a last column has what is left of these in the layer.
    """
    compliance = shell_compliance(shell, at, held=False)[..., :6]
    height = np.asarray(z)[..., None, None]
    strain = compliance[..., :3, :] + height * compliance[..., 3:6, :]
    plane = at.layers[number].plane
    found = at.among(plane @ strain, number)
    if held_plies(shell):
        found = np.concatenate([found, plane @ held_strain(shell, at, number, z)], axis=-1)
    return found


def held_plies(shell: Shell) -> bool:
    """Decide whether plies of a shell hold each other from strains that they would have alone."""
    return bool(shell.natural and shell.natural.plies)


def held_strain(shell: Shell, at: Layup, number: int, z: Any) -> Floats:
    """Natural strains of the section less those of a layer at a height, shape (3, 1).

    The layer's stress follows from them, for a factor of one, beside what it has of resultants.
    """
    natural: Any = shell.natural
    own, slope = at.layers[number].from_own(natural.plies[number])
    found = natural.membrane - own + float(z) * (natural.curvature - slope)
    return np.asarray(found)[:, None]
