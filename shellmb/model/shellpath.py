"""A shell over a step that is quadratic in time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.errors import SceneError
from shellmb.forms import hourglass
from shellmb.forms import shell as shell_forms
from shellmb.forms.mixed import LinearMixed, vector
from shellmb.forms.mixed_nonlinear import NonlinearMixed
from shellmb.forms.path import Measure, Step, bow_of, constraint_row, is_quadratic, measure
from shellmb.forms.pathwork_nonlinear import NonlinearPath
from shellmb.model.body import Term
from shellmb.model.pathterms import path_terms, point_terms, together

if TYPE_CHECKING:
    from shellmb.model.shell import ShellModel


def strain_measure(shell: ShellModel) -> Measure:
    """Strains of shape (8,) by their derivative."""
    if shell.shell.strains is not None:
        return measure(lambda q: vector(shell.strains(q)))
    surf = shell.surface

    def slope(c: Expr | None, pairs: Sequence[tuple[Expr, Expr]], dq: Expr) -> Expr:
        states = [(w, shell_forms.tangents(*shell.velocities(q), surf)) for w, q in pairs]
        if c is not None:
            states.append((c, shell_forms.reference_tangents(surf)))
        at = shell_forms.combined(states)
        return vector(shell_forms.strain_change(at, *shell.velocities(dq), surf))

    return Measure(slope)


def along(
    shell: ShellModel, step: Step, k: int, dq: Expr, trial: Expr
) -> tuple[Form | None, list[Term]]:
    """Internal forces, and the constraints of the directors; arguments as of `Body.along`.

    Raises:
        SceneError: If a strain measure of the user is not quadratic.
    """
    section, layout = shell.section.formulation, shell.layout
    own = shell.shell.strains
    if own is not None and not is_quadratic(lambda q: vector(shell.strains(q)), step.path.end):
        raise SceneError(
            f"shell '{shell.name}': strains is {getattr(own, '__name__', own)}, which is not "
            "quadratic in displacement and director; with schemes that are quadratic in time it "
            "must be, or use scheme 'ep' or 'ed'"
        )
    strain = strain_measure(shell)
    integrate = partial(_integrate, shell)
    if isinstance(section, LinearMixed):
        term = path_terms(section, *(layout, strain, step, k, dq, trial), integrate)
    else:
        term = point_terms(_nonlinear(shell, step), step.points, k, dq, trial, integrate)
    if shell.rules.lines is not None:
        along_lines = path_terms(
            hourglass.LineSection(),
            *(layout, _lines(shell, strain), step, k, dq, trial),
            lambda densities: shell.hourglass((densities[0], densities[1])),
        )
        term = together(term, along_lines)

    def constraint(q: Expr) -> Expr:
        w = layout.part(q, "w")
        return ufl.as_vector([shell_forms.director_constraint(w, shell.director)])

    row = constraint_row(constraint, step.path, k, dq)
    first, second = (layout.part(q, "lam") for q in row.multipliers)
    work = first * row.own[0] + second * row.other[0] + layout.part(dq, "lam") * row.value[0]
    return shell.section.force * work * shell.rules.nodes, [term]


def _integrate(shell: ShellModel, densities: Sequence[Expr]) -> Form:
    return shell.integrate((densities[0], densities[1]))


def _nonlinear(shell: ShellModel, step: Step) -> NonlinearPath:
    section = shell.section.formulation
    assert isinstance(section, NonlinearMixed)
    strain = strain_measure(shell)
    return NonlinearPath(section, shell.layout, strain, step.states, step.points)


def _lines(shell: ShellModel, strain: Measure) -> Measure:
    """Membrane strains along the coordinate lines of the element, for the hourglass control."""
    jacobian = ufl.Jacobian(shell.mixed.space.mesh)
    return Measure(
        lambda c, pairs, dq: hourglass.lines(strain.slope(c, pairs, dq), shell.surface, jacobian)
    )


def lost(shell: ShellModel, step: Step, bow: Expr) -> Form | None:
    """Elastic energy of the bow of the strains, J; arguments as of `Body.lost`."""
    section, strain = shell.section.formulation, strain_measure(shell)
    if isinstance(section, LinearMixed):
        resultants = section.forces(shell.layout, bow)
        form = shell.integrate(section.stored(bow_of(strain, step.path), resultants))
    else:
        form = _integrate(shell, _nonlinear(shell, step).lost())
    if shell.rules.lines is not None:
        e = bow_of(_lines(shell, strain), step.path)
        form += shell.hourglass((e[0] ** 2 / 2, e[1] ** 2 / 2))
    return form


def mean_resultants(shell: ShellModel, step: Step) -> Expr:
    """Resultants as means over a step, those of the row P0, shape (8,)."""
    section, layout = shell.section.formulation, shell.layout
    if not isinstance(section, LinearMixed):
        return _nonlinear(shell, step).mean_stress()
    e = strain_measure(shell).moment(step.pairs[0][0].moment, step.states)
    return section.joined(e, section.forces(layout, step.path.end))
