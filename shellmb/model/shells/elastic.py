"""Strains of a shell with their section, and of its hourglass control."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms import hourglass
from shellmb.forms import shell as shell_forms
from shellmb.forms.measure import Measure
from shellmb.forms.steps.mixed import LinearMixed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.path import is_quadratic
from shellmb.model.sections.strains import GeneralStrains, HyperelasticStrains, Integrate, Strains
from shellmb.model.shells.bound import BoundShell


def shell_strains(shell: BoundShell) -> tuple[Strains, ...]:
    """Arguments of a shell's energy: its strains, followed by those along element lines.

    Args:
        shell: The shell.
    """

    def integrate(densities: Sequence[Expr]) -> Form:
        return shell.integrate((densities[0], densities[1]))

    def control(densities: Sequence[Expr]) -> Form:
        return shell.hourglass((densities[0], densities[1]))

    quadratic = quadratic_strains(shell)
    section, h = shell.section.formulation, shell.thickness
    weight = (1, 1, 1, h**2, h**2, h**2, 1, 1)
    if isinstance(section, LinearMixed):
        own: Strains = _linear(shell, section, shell.strain, integrate, quadratic, weight)
    else:
        assert isinstance(section, NonlinearMixed)
        common = section, shell.layout, shell.strain, integrate
        own = HyperelasticStrains(*common, quadratic, weight, partial(_product, shell))
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
    return GeneralStrains(*common, weight, partial(_product, shell))


def _product(shell: BoundShell, a: Expr, b: Expr) -> Expr:
    """Product of two states, by their gradients and directors."""
    first, second = (shell_forms.tangents(*shell.straining(q), shell.surface) for q in (a, b))
    h = shell.thickness
    sizes = 1, 1, 1, h**2, h**2
    return sum(s * ufl.dot(x, y) for s, x, y in zip(sizes, first, second, strict=True))


def quadratic_strains(shell: BoundShell) -> bool:
    """Decide whether strains are at most quadratic in the state."""
    if shell.shell.strains is None:
        return True
    return is_quadratic(shell.strain.value, ufl.Coefficient(shell.mixed.space))
