"""Relaxation of a shell, bound to its mesh."""

from __future__ import annotations

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
import ufl
from ufl.constantvalue import Zero
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms.steps.mixed import assumed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.model.sections.branches import Fading, MaxwellBranches
from shellmb.model.sections.section import couples
from shellmb.model.shells.bound import BoundShell
from shellmb.model.shells.elastic import quadratic_strains
from shellmb.model.shells.varying import SectionFields
from shellmb.scene import LinearSection
from shellmb.scene.shells.lamination import Layup


def maxwell_branches(shell: BoundShell) -> MaxwellBranches | None:
    """Maxwell branches of a shell's section; None without any.

    Args:
        shell: The shell on its mesh.

    Raises:
        SceneError: If strains of the user are not quadratic.
    """
    section = shell.shell.section
    if not (isinstance(section, LinearSection) and section.relaxes):
        return None
    if not quadratic_strains(shell):
        own = shell.shell.strains
        raise SceneError(
            f"shell '{shell.name}': strains is {getattr(own, '__name__', own)}, which is not "
            "quadratic in displacement and director; with relaxation of the section it must be"
        )
    mixed, seen = shell.section.formulation, assumed(shell.strain, shell.layout)
    assert isinstance(mixed, NonlinearMixed)
    fields, found = SectionFields(shell.shell, shell.mixed.space.mesh), []
    for shares, branches in section.generic.branches.items():

        def part(name: str, shares: tuple[float, ...] = shares) -> Expr:
            def value(at: Layup) -> Floats:
                return np.asarray(getattr(at.scaled(shares), name))

            return fields.of(value)

        B, G = part("B") if couples(shell.shell, section) else None, part("G")
        common = branches, shell.rules.full, shell.mixed.space.mesh
        found.append(Fading(seen, _whole(part("A"), B, part("D"), (1 - mixed.a) * G), *common))
        if not isinstance(mixed.a, Zero):
            found.append(Fading(shell.strain, _whole(None, None, None, mixed.a * G), *common))
    return MaxwellBranches(shell.name, shell.layout, found)


def _whole(A: Expr | None, B: Expr | None, D: Expr | None, G: Expr) -> Expr:
    """Stiffness of all strains, shape (8, 8)."""

    def entry(i: int, j: int) -> Expr | int:
        if max(i, j) >= 6:
            return G[i - 6, j - 6] if min(i, j) >= 6 else 0
        block = (A, B, B, D)[2 * (i // 3) + j // 3]
        # coupling of layers is symmetric
        return 0 if block is None else block[i % 3, j % 3]

    return ufl.as_matrix([[entry(i, j) for j in range(8)] for i in range(8)])
