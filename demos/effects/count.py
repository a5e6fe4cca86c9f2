"""Counts of a step's parts: unknowns, integrals, coefficients and kernels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from ufl import Form

from shellmb.native.kernels import kernel_name
from shellmb.simulate.problem import Problem


@dataclass(frozen=True)
class Count:
    """Counts of the parts of a problem, or of a part of it.

    Args:
        unknowns: Unknowns of the block system.
        stored: Numbers that are kept from step to step: states and velocities.
        integrals: Integrals of the residuals, as they are written.
        coefficients: Functions and constants in them.
        kernels: Different programs of residuals and Jacobians.
    """

    unknowns: int
    stored: int
    integrals: int
    coefficients: int
    kernels: int

    def __sub__(self, other: Count) -> Count:
        """Counts that one has beyond another."""
        mine, its = vars(self), vars(other)
        return Count(**{name: mine[name] - its[name] for name in mine})


def count(problem: Problem) -> Count:
    """Count a whole problem."""
    stored = sum(_stored(problem, body.name) for body in problem.model.bodies)
    return Count(problem.system.size, stored, *_forms(problem, range(len(problem.fields))))


def count_bodies(problem: Problem, names: Sequence[str]) -> Count:
    """Count the bodies of the system of which an effect consists; collective.

    Args:
        problem: The problem of one step.
        names: What the names of these bodies begin with.
    """

    def mine(k: int) -> bool:
        return any(problem.fields[k].name.startswith(name) for name in names)

    some = [k for k in range(len(problem.fields)) if mine(k)]
    own = 0
    for k in some:
        field = problem.fields[k]
        linked = np.concatenate([*(link.dofs for link in field.links), np.zeros(0, dtype=np.int32)])
        own += field.size_local - int(np.sum(linked < field.size_local))
    unknowns = int(problem.model.comm.allreduce(own, op=MPI.SUM))
    bodies = [b.name for b in problem.model.bodies if any(b.name.startswith(n) for n in names)]
    stored = sum(_stored(problem, body) for body in bodies)
    return Count(unknowns, stored, *_forms(problem, some))


def _stored(problem: Problem, body: str) -> int:
    levels = problem.levels[body]
    size = int(levels.q.function_space.dofmap.index_map.size_global)
    return size * (1 + len(levels.rates))


def _forms(problem: Problem, fields: Iterable[int]) -> tuple[int, int, int]:
    """Integrals, coefficients and kernels of the rows of some fields."""
    some = list(fields)
    written = [form for k in some for form in problem.fields[k].residual]
    residuals = problem.system.residual_forms
    kernels = kernels_of(form for form, rows in residuals if set(rows) & set(some))
    blocks = problem.system.jacobians.items()
    kernels |= kernels_of(f for (row, _), forms in blocks if row in some for f in forms)
    return sum(map(_integrals, written)), len(coefficients(written)), len(kernels)


def _integrals(form: Form) -> int:
    return len(form.integrals())


def coefficients(forms: Iterable[Form]) -> set[object]:
    """Functions and constants in forms."""
    return {c for form in forms for c in (*form.coefficients(), *form.constants())}


def kernels_of(forms: Iterable[fem.Form]) -> set[str]:
    """Names of the programs of forms: forms that are alike share one."""
    return {kernel_name(form) for form in forms}
