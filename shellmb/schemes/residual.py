"""Residual of one body for one stage: inertia + internal forces - loads - added terms."""

from dataclasses import dataclass

import ufl
from dolfinx import fem
from ufl import Form

from shellmb.model.body import Body, LoadFactors
from shellmb.schemes.base import Levels, Scheme, Stage


@dataclass(frozen=True)
class StageForms:
    """Residual of a body's stage with what feeds it.

    Args:
        stage: Where forms are taken; None for the row of an unknown jump.
        residual: Forms that add up to the residual: the body's own forces, loads, added terms.
        loads: The loads with their time factors, if any.
    """

    stage: Stage | None
    residual: tuple[Form, ...]
    loads: LoadFactors | None


def stage_forms(
    body: Body, scheme: Scheme, levels: Levels, dt: fem.Constant, time: fem.Constant
) -> dict[str, StageForms]:
    """Residuals of all stages of a scheme for one body.

    Args:
        body: The body.
        scheme: The scheme.
        levels: The body's functions.
        dt: Length of the step.
        time: Time at the middle of the step.
    """
    result = {}
    for name, stage in scheme.expand(levels, dt).items():
        unknown = levels.unknown[name]
        dq = ufl.TestFunction(unknown.function_space)
        loads = body.loads()
        internal = body.internal(stage.span, dq)
        if internal is not None and scheme.linear:
            # the span is the undeformed state; the unknown is the direction
            internal = ufl.derivative(internal, levels.q, unknown)
        path = body.path(stage.span, dq) if stage.path else None
        inertia = None if stage.rate is None else body.inertia(stage.rate, dq)
        external = None if loads is None else loads.virtual_work(stage.span.mid, dq)
        extra = body.extra(stage.span.mid, stage.rates, dq, time)
        own = [form for form in (inertia, internal, path) if form is not None]
        parts = [sum(own[1:], own[0])] if own else []
        parts += [-form for form in (external, extra) if form is not None]
        result[name] = StageForms(stage, tuple(parts), loads)
    jump = scheme.jump(levels, dt) if "b" in levels.unknown else None
    if jump is not None:
        db = ufl.TestFunction(levels.unknown["b"].function_space)
        rows = (
            body.inertia(jump.defect, db),
            body.velocity_constraint(jump.jump, jump.mid, db),
        )
        found = [form for form in rows if form is not None]
        result["b"] = StageForms(None, (sum(found[1:], found[0]),) if found else (), None)
    return result
