"""Internal forces of a shell over a step, and over a sub-interval of it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.errors import SceneError
from shellmb.forms import hourglass
from shellmb.forms import shell as shell_forms
from shellmb.forms.constraints.leap import Leap, leap_row
from shellmb.forms.constraints.pathconstraints import held_row
from shellmb.forms.measure import Measure, at_middle
from shellmb.forms.steps.anystrain import AnyStrain, ExactInterval
from shellmb.forms.steps.mixed import Interval, LinearMixed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.path import Path, Rows, Step, is_quadratic, moment_of
from shellmb.forms.steps.pathwork import interval_work
from shellmb.forms.steps.pathwork_nonlinear import NonlinearPath
from shellmb.model.body import Leaping, SubInterval, Term
from shellmb.model.pathterms import any_terms, path_terms, point_terms, together
from shellmb.model.shells.bound import BoundShell


def general(shell: BoundShell, span: Interval, dq: Expr) -> Form:
    """Internal forces over a sub-interval, whatever the strains and the section."""
    section, layout, strain = shell.section.formulation, shell.layout, shell.strain
    quadratic, h = quadratic_strains(shell), shell.thickness
    acting = at_middle if quadratic else ExactInterval((1, 1, 1, h**2, h**2, h**2, 1, 1))
    if isinstance(section, LinearMixed):
        full, red = interval_work(section, layout, strain, span, dq, acting)
    else:
        assert isinstance(section, NonlinearMixed)
        full, red = section.virtual_work(strain, layout, span, dq, acting)
    form = shell.integrate((full, red))
    if shell.rules.lines is not None:
        lines = hourglass.LineSection(), layout, shell.line_strain
        acting = at_middle if quadratic else ExactInterval((1, 1))
        first, second = interval_work(*lines, span, dq, acting)
        form += shell.hourglass((first, second))
    return form


def directors(shell: BoundShell, span: Interval, dq: Expr) -> Form:
    """Constraints of directors and frame at the end of a sub-interval, with their forces."""
    layout = shell.layout
    lam, dlam = layout.part(span.unknown, "lam"), layout.part(dq, "lam")
    work, violation = shell.length.change(span.mid, dq), shell.length.value(span.at)
    form = shell.section.force * (lam * work[0] + dlam * violation[0]) * shell.rules.nodes
    return sum((tie.work(span, dq) for tie in shell.ties), form)


def lengths_kept(shell: BoundShell, v: Expr, mid: Expr, dv: Expr) -> Form:
    """Velocities do not change the directors' length; as of `Body.velocity_constraint`."""
    lam, dlam = (shell.layout.part(q, "lam") for q in (v, dv))
    rate, work = (shell.length.change(mid, q)[0] for q in (v, dv))
    return shell.section.force * (lam * work + dlam * rate) * shell.rules.nodes


def leaping(shell: BoundShell, leap: Leap, dq: Expr) -> Leaping:
    """Directors' velocities at the end of a step with a jump; as of `Body.leaping`."""
    row = leap_row(shell.length.value, leap, dq)
    lam, dlam = (shell.layout.part(q, "lam") for q in (leap.jump, dq))
    force, nodes = shell.section.force, shell.rules.nodes
    impulses = lam * row.impulse[0] + dlam * row.value[0]
    return force * impulses * nodes, force * lam * row.force[0] * nodes


def within(
    shell: BoundShell, sub: SubInterval, dq: Expr, trial: Expr
) -> tuple[Form | None, list[Term]]:
    """As of `Body.within`: the section's forces are terms where strains are quadratic."""
    if not _is_quadratic(shell) or sub.rows is None:
        return general(shell, sub.span, dq) + directors(shell, sub.span, dq), []
    return directors(shell, sub.span, dq), [work(shell, sub.rows, [dq], trial)]


def _is_quadratic(shell: BoundShell) -> bool:
    """Whether forms at mean, chord and bow of a path are exact: of linear sections they are."""
    return isinstance(shell.section.formulation, LinearMixed) and quadratic_strains(shell)


def quadratic_strains(shell: BoundShell) -> bool:
    """Whether strains are at most quadratic in the state."""
    if shell.shell.strains is None:
        return True
    state = ufl.Coefficient(shell.mixed.space)
    return is_quadratic(shell.strain.value, state)


def work(shell: BoundShell, rows: Rows, tests: Sequence[Expr], trial: Expr) -> Term:
    """Internal forces of some rows, the hourglass control with them."""
    section, layout, strain = shell.section.formulation, shell.layout, shell.strain
    assert isinstance(section, LinearMixed)
    integrate = partial(_integrate, shell)
    found = path_terms(section, layout, strain, rows, tests, trial, integrate)
    return _controlled(shell, found, rows, tests, trial)


def _controlled(
    shell: BoundShell, term: Term, rows: Rows, tests: Sequence[Expr], trial: Expr
) -> Term:
    """A term with the hourglass control of its rows, if there is any."""
    if shell.rules.lines is None:
        return term
    lines = path_terms(
        hourglass.LineSection(),
        *(shell.layout, shell.line_strain, rows, tests, trial),
        lambda d: shell.hourglass((d[0], d[1])),
    )
    return together(term, lines)


def directors_row(shell: BoundShell, path: Path, k: int, dq: Expr) -> Form:
    """Constraints of directors and frame in a row of a step; arguments as of `Body.along`."""
    row = held_row(shell.length.value, path, k, dq, shell.inertialess)
    first, second, dlam = (shell.layout.part(q, "lam") for q in (*row.multipliers, dq))
    acting = first * row.own[0] + second * row.other[0] + dlam * row.value[0]
    form = shell.section.force * acting * shell.rules.nodes
    return sum((tie.row(path, k, dq, shell.inertialess) for tie in shell.ties), form)


def stressed(shell: BoundShell, step: Step) -> Term:
    """Internal forces over a step; as of `Body.stressed`.

    Raises:
        SceneError: If a strain measure of the user is not quadratic, and the section not linear.
    """
    quadratic, arguments = quadratic_strains(shell), shell.mixed.arguments
    if not quadratic and not isinstance(shell.section.formulation, LinearMixed):
        own = shell.shell.strains
        raise SceneError(
            f"shell '{shell.name}': strains is {getattr(own, '__name__', own)}, which is not "
            "quadratic in displacement and director; with a hyperelastic section and a scheme that "
            "is quadratic in time it must be: put the function of such strains into the energy, or "
            "use scheme 'ep' or 'ed'"
        )
    if not quadratic:
        return _of_any_form(shell, step)
    if isinstance(shell.section.formulation, LinearMixed):
        return work(shell, step.rows, *arguments)
    term = point_terms(_nonlinear(shell, step), step.points, *arguments, partial(_integrate, shell))
    return _controlled(shell, term, step.rows, *arguments)


def _of_any_form(shell: BoundShell, step: Step) -> Term:
    """Internal forces for strains of any form, the hourglass control with them."""
    section, layout, h = shell.section.formulation, shell.layout, shell.thickness
    assert isinstance(section, LinearMixed)

    def product(a: Expr, b: Expr) -> Expr:
        first, second = (shell_forms.tangents(*shell.velocities(q), shell.surface) for q in (a, b))
        sizes = 1, 1, 1, h**2, h**2
        return sum(s * ufl.dot(x, y) for s, x, y in zip(sizes, first, second, strict=True))

    tests, trial = shell.mixed.arguments
    make = partial(any_terms, product=product, step=step, tests=tests, trial=trial)
    integrate = partial(_integrate, shell)
    found = make(section, layout, shell.strain, integrate=integrate)
    if shell.rules.lines is None:
        return found
    lines = hourglass.LineSection(), layout, shell.line_strain
    return together(found, make(*lines, integrate=lambda d: shell.hourglass((d[0], d[1]))))


def _bow_of_any(step: Step, strain: Measure) -> Expr:
    """Bow of a strain of any form over a step."""
    p = step.path
    return AnyStrain(strain, (p.mean, p.chord, p.bow, p.swing), step.whole.places).bow


def _integrate(shell: BoundShell, densities: Sequence[Expr]) -> Form:
    return shell.integrate((densities[0], densities[1]))


def _nonlinear(shell: BoundShell, step: Step) -> NonlinearPath:
    section = shell.section.formulation
    assert isinstance(section, NonlinearMixed)
    strain = shell.strain
    return NonlinearPath(section, shell.layout, strain, step.states, step.points)


def lost(shell: BoundShell, step: Step, bow: Expr) -> Form | None:
    """Elastic energy of the bow of the strains, J; arguments as of `Body.lost`."""
    section, lines = shell.section.formulation, shell.rules.lines is not None
    bow_of = step.bow_of if quadratic_strains(shell) else partial(_bow_of_any, step)
    e, along_lines = bow_of(shell.strain), bow_of(shell.line_strain) if lines else None
    if isinstance(section, LinearMixed):
        form = shell.integrate(section.stored(e, section.forces(shell.layout, bow)))
    else:
        form = _integrate(shell, _nonlinear(shell, step).lost())
    if along_lines is not None:
        form += shell.hourglass((along_lines[0] ** 2 / 2, along_lines[1] ** 2 / 2))
    return form


def mean_resultants(shell: BoundShell, step: Step) -> Expr:
    """Resultants as means over a step, those of the row P0, shape (8,)."""
    section, layout = shell.section.formulation, shell.layout
    if not isinstance(section, LinearMixed):
        return _nonlinear(shell, step).mean_stress()
    if quadratic_strains(shell):
        e = moment_of(shell.strain, step.rows.stresses[0].moment, step.states)
    else:
        e = AnyStrain(shell.strain, step.states, step.whole.places).mean
    return section.joined(e, section.forces(layout, step.path.end))
