"""Internal forces of a shell over a step, and over a sub-interval of it."""

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
from shellmb.forms.constraints.pathconstraints import constraint_row, massless_row
from shellmb.forms.steps.mixed import Interval, LinearMixed, vector
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.path import Measure, Row, Step, is_quadratic, measure
from shellmb.forms.steps.pathwork import interval_work
from shellmb.forms.steps.pathwork_nonlinear import NonlinearPath
from shellmb.model.body import SubInterval, Term
from shellmb.model.pathterms import path_terms, point_terms, together

if TYPE_CHECKING:
    from shellmb.model.shells.shell import ShellModel


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


def general(shell: ShellModel, span: Interval, dq: Expr) -> Form:
    """Internal forces over a sub-interval, whatever the strains and the section."""
    section, layout = shell.section.formulation, shell.layout

    def strains(q: Expr) -> Expr:
        return vector(shell.strains(q))

    if isinstance(section, LinearMixed):
        full, red = interval_work(section, layout, strains, span, dq)
    else:
        assert isinstance(section, NonlinearMixed)
        full, red = section.virtual_work(shell.strains, layout, span, dq)
    form = shell.integrate((full, red))
    if shell.rules.lines is not None:
        lines = hourglass.LineSection(), layout, shell.line_strains
        first, second = interval_work(*lines, span, dq)
        form += shell.hourglass((first, second))
    return form


def directors(shell: ShellModel, span: Interval, dq: Expr) -> Form:
    """Constraints of the directors at the end of a sub-interval, with their forces."""
    layout, D = shell.layout, shell.director
    lam, dlam = layout.part(span.unknown, "lam"), layout.part(dq, "lam")
    work = lam * ufl.dot(D + layout.part(span.mid, "w"), layout.part(dq, "w"))
    violation = shell_forms.director_constraint(layout.part(span.at, "w"), D)
    return shell.section.force * (work + dlam * violation) * shell.rules.nodes


def within(
    shell: ShellModel, sub: SubInterval, dq: Expr, trial: Expr
) -> tuple[Form | None, list[Term]]:
    """As of `Body.within`: the section's forces are terms where strains are quadratic."""
    if not _is_quadratic(shell) or sub.row is None:
        return shell.internal(sub.span, dq), []
    return directors(shell, sub.span, dq), [work(shell, sub.row, dq, trial)]


def _is_quadratic(shell: ShellModel) -> bool:
    """Whether forms at mean, chord and bow of a path are exact: of linear sections they are."""
    return isinstance(shell.section.formulation, LinearMixed) and _quadratic_strains(shell)


def _quadratic_strains(shell: ShellModel) -> bool:
    if shell.shell.strains is None:
        return True
    state = ufl.Coefficient(shell.mixed.space)
    return is_quadratic(lambda q: vector(shell.strains(q)), state)


def work(shell: ShellModel, row: Row, dq: Expr, trial: Expr) -> Term:
    """Internal forces of a row, the hourglass control with them."""
    section, layout, strain = shell.section.formulation, shell.layout, strain_measure(shell)
    assert isinstance(section, LinearMixed)
    found = path_terms(
        section, layout, strain, row, dq, trial, lambda d: shell.integrate((d[0], d[1]))
    )
    return _controlled(shell, found, row, dq, trial)


def _controlled(shell: ShellModel, term: Term, row: Row, dq: Expr, trial: Expr) -> Term:
    """A term with the hourglass control of its row, if there is any."""
    if shell.rules.lines is None:
        return term
    lines = path_terms(
        hourglass.LineSection(),
        *(shell.layout, _lines(shell, strain_measure(shell)), row, dq, trial),
        lambda d: shell.hourglass((d[0], d[1])),
    )
    return together(term, lines)


def along(
    shell: ShellModel, step: Step, k: int, dq: Expr, trial: Expr
) -> tuple[Form | None, list[Term]]:
    """Internal forces, and the constraints of the directors; arguments as of `Body.along`.

    Raises:
        SceneError: If a strain measure of the user is not quadratic.
    """
    if not _quadratic_strains(shell):
        own = shell.shell.strains
        raise SceneError(
            f"shell '{shell.name}': strains is {getattr(own, '__name__', own)}, which is not "
            "quadratic in displacement and director; with schemes that are quadratic in time it "
            "must be, or use scheme 'ep' or 'ed'"
        )
    layout = shell.layout

    def constraint(q: Expr) -> Expr:
        w = layout.part(q, "w")
        return ufl.as_vector([shell_forms.director_constraint(w, shell.director)])

    make = massless_row if shell.inertialess else constraint_row
    row = make(constraint, step.path, k, dq)
    first, second = (layout.part(q, "lam") for q in row.multipliers)
    acting = first * row.own[0] + second * row.other[0] + layout.part(dq, "lam") * row.value[0]
    form = shell.section.force * acting * shell.rules.nodes
    if isinstance(shell.section.formulation, LinearMixed):
        return form, [work(shell, step.row(k), dq, trial)]
    integrate = partial(_integrate, shell)
    term = point_terms(_nonlinear(shell, step), step.points, k, dq, trial, integrate)
    return form, [_controlled(shell, term, step.row(k), dq, trial)]


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
        form = shell.integrate(section.stored(step.bow_of(strain), resultants))
    else:
        form = _integrate(shell, _nonlinear(shell, step).lost())
    if shell.rules.lines is not None:
        e = step.bow_of(_lines(shell, strain))
        form += shell.hourglass((e[0] ** 2 / 2, e[1] ** 2 / 2))
    return form


def mean_resultants(shell: ShellModel, step: Step) -> Expr:
    """Resultants as means over a step, those of the row P0, shape (8,)."""
    section, layout = shell.section.formulation, shell.layout
    if not isinstance(section, LinearMixed):
        return _nonlinear(shell, step).mean_stress()
    e = strain_measure(shell).moment(step.pairs[0][0].moment, step.states)
    return section.joined(e, section.forces(layout, step.path.end))
