"""Relaxation that modes lack where strains of different kinds have different damping times."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.preprocessing.modal.isolated import IsolatedBody
from shellmb.preprocessing.modal.ritz import Held

# below this share of all that a body gives way by it is round-off: with one time for all strains
# that is along the modes themselves
NOTHING = 1e-6


def relaxing(
    held: IsolatedBody, found: list[PETSc.Vec], mixed: Floats, stiffness: Floats, center: Floats
) -> Floats | None:
    """`D K^-1 D` of the body's modes less what they have of it; None without damping.

    A body gives way to the forces of damping of a mode in shapes that perhaps no mode has: at a
    frequency `w` its stiffness is smaller by `w^2` times this.

    Args:
        held: The body in its supports.
        found: Ritz vectors.
        mixed: The modes in terms of these, rigid motions apart, shape (n, K).
        stiffness: Stiffness of the modes, shape (K,), N/m.
        center: Centre of mass, shape (3,), m.

    Returns:
        Shape (K, K), N s^2/m.
    """
    viscous = held.damping
    if viscous is None:
        return None
    body = Held(held, held.K, center, frames=False)
    moved = body.answers([viscous * vector for vector in found])
    n, products = len(found), held.gram(held.K, [*found, *moved])
    known, whole = mixed.T @ products[:n, n:] @ mixed, mixed.T @ products[n:, n:] @ mixed
    left = whole - known.T @ (known / stiffness[:, None])
    size = np.sqrt(np.outer(whole.diagonal(), whole.diagonal()))
    return np.asarray(np.where(np.abs(left) > NOTHING * size, left, 0.0))
