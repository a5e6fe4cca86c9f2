"""Strains of a shell with their section, and of its hourglass control."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import ufl
from ufl.core.expr import Expr

from shellmb.forms import hourglass
from shellmb.forms import shell as shell_forms
from shellmb.forms.measure import Measure
from shellmb.forms.steps.mixed import LinearMixed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.path import is_quadratic
from shellmb.forms.surface import Surface
from shellmb.model.sections.strains import GeneralStrains, HyperelasticStrains, Integrate, Strains
from shellmb.model.shells.bound import BoundShell


def shell_strains(shell: BoundShell) -> tuple[Strains, ...]:
    """Arguments of a shell's energy: its strains, followed by those along element lines.

    Args:
        shell: The shell.
    """
    integrate, control = shell.integrate, shell.hourglass
    quadratic = quadratic_strains(shell)
    section, h = shell.section.formulation, shell.thickness
    weight = (1, 1, 1, h**2, h**2, h**2, 1, 1)
    if isinstance(section, LinearMixed):
        own: Strains = _linear(shell, section, shell.strain, integrate, quadratic, weight)
    else:
        assert isinstance(section, NonlinearMixed)
        common = section, shell.layout, shell.strain, integrate
        own = HyperelasticStrains(*common, quadratic, weight, _product_of(shell))
    if shell.rules.lines is None:
        return (own,)
    lines = hourglass.LineSection()
    return own, _linear(shell, lines, shell.line_strain, control, quadratic, (1, 1))


def _linear(
    shell: BoundShell,
    section: object,
    strain: Measure,
    integrate: Integrate,
    quadratic: bool,
    weight: Sequence[object],
) -> Strains:
    """Strains with a section that is linear."""
    common = section, shell.layout, strain, integrate
    if quadratic:
        return Strains(*common)
    return GeneralStrains(*common, weight, _product_of(shell))


def _product_of(shell: BoundShell) -> Callable[[Expr, Expr], Expr]:
    """Product of two states of a shell, by their gradients and directors."""
    return partial(_product, shell.straining, shell.surface, shell.thickness)


def _product(
    straining: Callable[[Expr], tuple[Expr, Expr]], surface: Surface, h: Expr, a: Expr, b: Expr
) -> Expr:
    first, second = (shell_forms.tangents(*straining(q), surface) for q in (a, b))
    sizes = 1, 1, 1, h**2, h**2
    return sum(s * ufl.dot(x, y) for s, x, y in zip(sizes, first, second, strict=True))


def quadratic_strains(shell: BoundShell) -> bool:
    """Decide whether strains are at most quadratic in the state."""
    if shell.shell.strains is None:
        return True
    return is_quadratic(shell.strain.value, ufl.Coefficient(shell.mixed.space))
