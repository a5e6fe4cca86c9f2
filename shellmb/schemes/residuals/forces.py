"""Forces of the elastic parts and constraints of a body over sub-intervals and steps."""

from __future__ import annotations

from functools import reduce

from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.constraints.velocity_jump import VelocityJump
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Step
from shellmb.model.body import Body, JumpForms, SubInterval, Term, added
from shellmb.model.sections.strains import together


def interval_forces(body: Body, span: Interval, dq: Expr) -> Form | None:
    """Internal and constraint forces of a sub-interval, or of a single state.

    Args:
        body: The body.
        span: The sub-interval.
        dq: Virtual displacement.
    """
    elastic = [part.interval(span, dq) for part in body.elastic]
    return added([*elastic, *(held.interval(span, dq) for held in body.constraints)])


def sub_forces(
    body: Body, sub: SubInterval, dq: Expr, trial: Expr
) -> tuple[Form | None, list[Term]]:
    """Forces of a sub-interval: what has kernels that know no scheme as terms.

    Args:
        body: The body.
        sub: A sub-interval of a step, or a single state.
        dq: Virtual displacement.
        trial: Direction of derivatives.
    """
    terms: list[Term] = []
    for part in body.elastic:
        term = part.interval_term(sub, dq, trial)
        if term is None:
            return interval_forces(body, sub.span, dq), []
        terms.append(term)
    forms = added(held.interval(sub.span, dq) for held in body.constraints)
    return forms, [reduce(together, terms)] if terms else []


def path_forces(body: Body, step: Step, k: int, dq: Expr) -> Form | None:
    """Forces in a row of a step that is quadratic in time, without those of `path_forms`.

    Args:
        body: The body.
        step: The step.
        k: Row, 0 for P0 and 1 for P1.
        dq: Virtual displacement.
    """
    elastic = [part.row(step, k, dq) for part in body.elastic]
    return added([*elastic, *(held.path(step.path, k, dq) for held in body.constraints)])


def path_term(body: Body, step: Step) -> list[Term]:
    """Forces of stresses over such a step in both of its rows; none without any."""
    found = [part.path_term(step, *body.mixed.arguments) for part in body.elastic]
    terms = [term for term in found if term is not None]
    return [reduce(together, terms)] if terms else []


def velocity_constraint(body: Body, v: Expr, mid: Expr, dv: Expr) -> Form | None:
    """Constraints on velocities at the state `mid`, with their impulses; None without any."""
    return added(held.velocity(v, mid, dv) for held in body.constraints)


def jump_constraint(body: Body, step: VelocityJump, dq: Expr) -> JumpForms:
    """Constraints on velocities at the end of a step that begins with a jump."""
    found = [pair for held in body.constraints if (pair := held.jump(step, dq)) is not None]
    if not found:
        return None
    impulses, forces = zip(*found, strict=True)
    return sum(impulses[1:], impulses[0]), sum(forces[1:], forces[0])


def jump_energy(body: Body, a: Expr, b: Expr) -> Form | None:
    """Elastic part of eq. (34) for the jump from `a` to `b`; None without any."""
    return added(part.jump(a, b) for part in body.elastic)


def bow_energy(body: Body, step: Step, held: Expr) -> Form | None:
    """Elastic energy of the bow of the strains, eq. (Q5); arguments as of `Elastic.bow`."""
    return added(part.bow(step, held) for part in body.elastic)
