"""Damping of the strains of a body in modes, which are its amplitudes."""

from __future__ import annotations

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.measure import linear
from shellmb.forms.state import Layout
from shellmb.forms.steps.damping import ViscousModes
from shellmb.meshes.nodes import NodeMesh, constant_vector
from shellmb.model.reduced.data import amplitudes
from shellmb.model.sections.damping import Resisting, StrainDamping

# couplings of modes below this share of what they have by themselves are round-off: with one time
# for all strains there are none
NOTHING = 1e-9


def modal_damping(layout: Layout, nodes: NodeMesh, matrix: Floats | None) -> StrainDamping | None:
    """Damping of the strains of a body in modes; None without any.

    Args:
        layout: Parts of the state, with the amplitudes.
        nodes: Node mesh of the amplitudes.
        matrix: Damping of the modes, shape (K, K), N s/m; None without any.
    """
    if matrix is None:
        return None
    own = np.sqrt(np.outer(matrix.diagonal(), matrix.diagonal()))
    pairs = [tuple(pair) for pair in np.argwhere(np.abs(matrix) > NOTHING * own)]
    values = constant_vector(nodes, np.array([[matrix[pair] for pair in pairs]]), "damping")
    numbers = [values] if len(pairs) == 1 else [values[k] for k in range(len(pairs))]
    D: list[list[Expr | None]] = [[None] * len(matrix) for _ in matrix]
    for (i, k), number in zip(pairs, numbers, strict=True):
        D[i][k] = number

    strain = linear(lambda q: ufl.as_vector(amplitudes(layout, q)))
    dx = ufl.dx(nodes.mesh)
    return StrainDamping(layout, [Resisting(ViscousModes(D), strain, lambda d: d[0] * dx)])
