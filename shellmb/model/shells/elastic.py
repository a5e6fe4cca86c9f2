"""Strains of a shell with their section."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from mpi4py import MPI

import basix
import numpy as np
import ufl
from dolfinx import fem
from ufl.constantvalue import Zero
from ufl.core.expr import Expr

from shellmb.errors import SceneError
from shellmb.forms import shell as shell_forms
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.path import is_quadratic
from shellmb.forms.surface import Surface
from shellmb.model.sections.strains import GeneralStrains, HyperelasticStrains, Strains
from shellmb.model.shells.discrete_shell import DiscreteShell
from shellmb.native.expressions import compiled_expression
from shellmb.scene.values.validate import show

# a strain at rest, of a shell as thick as it is, that counts as round-off
NONE = 1e-10


def shell_strains(shell: DiscreteShell) -> tuple[Strains, ...]:
    """Strains of a shell with their section.

    Args:
        shell: The shell.

    Raises:
        SceneError: If strains of the user are not zero at rest.
    """
    quadratic = quadratic_strains(shell)
    section, h = shell.section.formulation, shell.thickness
    _refuse_prestrain(shell)
    weight = (1, 1, 1, h**2, h**2, h**2, 1, 1)
    common = shell.layout, shell.strain, shell.integrate
    if isinstance(section, NonlinearMixed):
        return (HyperelasticStrains(section, *common, quadratic, weight, _product_of(shell)),)
    if quadratic:
        return (Strains(section, *common),)
    return (GeneralStrains(section, *common, weight, _product_of(shell)),)


def _refuse_prestrain(shell: DiscreteShell) -> None:
    """Refuse strains of the user that are not zero at rest: resultants begin as zero; collective.

    Raises:
        SceneError: Names the largest of them.
    """
    if shell.strain.rest is None:
        return
    domain, h = shell.mixed.space.mesh, shell.thickness
    e = shell.strain.rest(ufl.Coefficient(shell.mixed.space))
    if isinstance(e, Zero):
        return
    # on the mesh, whatever the strains are of
    one = fem.Constant(domain, 1.0)
    sizes = ufl.as_vector([e[k] * (h if k in (3, 4, 5) else one) for k in range(8)])
    points, _ = basix.make_quadrature(domain.basix_cell(), 4)
    cells = np.arange(domain.topology.index_map(2).size_local, dtype=np.int32)
    found = np.abs(compiled_expression(sizes, np.asarray(points)).eval(domain, cells))
    largest = domain.comm.allreduce(float(np.max(found, initial=0.0)), op=MPI.MAX)
    if not largest < NONE:
        linear = not isinstance(shell.section.formulation, NonlinearMixed)
        raise SceneError(
            f"shell '{shell.name}': strains {show(shell.shell.strains)} gives a strain of "
            f"{largest:.3g} where displacement and director change are 0; it must be 0 there: give "
            f"a prestrain by {'natural, with the opposite sign' if linear else 'the energy'}"
        )


def _product_of(shell: DiscreteShell) -> Callable[[Expr, Expr], Expr]:
    """Product of two states of a shell, by their gradients and directors."""
    return partial(_product, shell.straining, shell.surface, shell.thickness)


def _product(
    straining: Callable[[Expr], tuple[Expr, Expr]], surface: Surface, h: Expr, a: Expr, b: Expr
) -> Expr:
    first, second = (shell_forms.tangents(*straining(q), surface) for q in (a, b))
    sizes = 1, 1, 1, h**2, h**2
    return sum(s * ufl.dot(x, y) for s, x, y in zip(sizes, first, second, strict=True))


def quadratic_strains(shell: DiscreteShell) -> bool:
    """Decide whether strains are at most quadratic in the state."""
    if shell.shell.strains is None:
        return True
    return is_quadratic(shell.strain.value, ufl.Coefficient(shell.mixed.space))
