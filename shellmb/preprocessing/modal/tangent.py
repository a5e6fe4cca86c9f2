"""Stiffness and mass matrices of a model at a state, as eigenproblems and reductions need them."""

from collections.abc import Callable, Mapping

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form

from shellmb.arrays import Floats
from shellmb.model.body import TimeFunction, added
from shellmb.model.frames.beam import BeamModel
from shellmb.model.model import Model
from shellmb.model.shells.shell import ShellModel
from shellmb.preprocessing.bodyfields import body_field
from shellmb.schemes.interval import at_state
from shellmb.schemes.residuals.residual import sub_forces
from shellmb.schemes.residuals.rows import Span
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import DependentFunctions, Field

# forms that add up to each block of a matrix
Blocks = dict[tuple[int, int], list[Form]]


def tangent(
    model: Model,
    arrays: Mapping[str, Floats] | None = None,
    factor: Callable[[TimeFunction | None], float] | None = None,
) -> tuple[BlockSystem, Blocks, Blocks]:
    """Block system at a state, with the forms of its stiffness and mass matrices.

    Args:
        model: The bodies.
        arrays: Local arrays of the state by `NAME/q`; None: the reference. One of statics has none
            of the inertia of bodies in modes, which follows from modes and frames.
        factor: Factors of the loads at that state by their time functions; None: no loads.
    """
    fields: list[Field] = []
    followers: list[DependentFunctions] = []
    absent: list[tuple[Callable[[Floats], None], Floats]] = []
    stiffness: Blocks = {}
    alone: list[list[Form]] = []
    mass: Blocks = {}
    numbers = {body.name: k for k, body in enumerate(model.bodies)}
    for k, body in enumerate(model.bodies):
        space = body.mixed.space
        q = fem.Function(space)
        if arrays and f"{body.name}/q" not in arrays and body.follow is not None:
            absent.append((body.follow, np.asarray(q.x.array)))
        elif arrays:
            q.x.array[:] = arrays[f"{body.name}/q"]
        dq, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        sub = Span(at_state(q), [q], 0)
        form, terms = sub_forces(body, sub, dq, trial)
        if sub.states is not None:
            followers.append(DependentFunctions(**vars(sub.states)))
        forms = [form]
        loads = body.loads() if factor is not None else None
        if loads is not None and factor is not None:
            loads.update(factor)
            work = loads.virtual_work(q, dq)
            forms.append(-work if work is not None else None)
        residual = added(forms)
        alone.append([form for term in terms for form in term.alone])
        alone[k] += [] if residual is None else [residual]
        inertia = body.inertia(trial, dq)
        if inertia is not None:
            mass[k, k] = [inertia]
        fields.append(body_field(body, q, (), numbers))
    system = BlockSystem(model.comm, fields, followers)
    for k, some in enumerate(alone):
        stiffness[k, k] = [by for form in some for j, by in system.derivatives(form) if j == k]
    if absent:
        system.join([array.copy() for array in system.arrays])
        for follow, state in absent:
            follow(state)
    system.follow()
    return system, stiffness, mass


def bending_scale(body: ShellModel | BeamModel) -> float:
    """`D/(m L^4)` of a shell or beam: the size of the square of its lowest frequency, rad^2/s^2."""
    stiffness, mass = body.bending
    return stiffness / mass / body.domain.length**4


def bending_scales(model: Model) -> list[float]:
    """Scales of the bending frequencies of all shells and beams, rad^2/s^2."""
    return [bending_scale(body) for body in model.meshed.values()]
