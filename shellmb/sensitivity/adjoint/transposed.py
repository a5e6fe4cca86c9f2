"""Derivatives of the residuals of a step by its start and by fields, transposed.

With multipliers `mu` of the equations of a step these are `(dR/ds)^T mu` for the state `s` at its
start, and `(dR/dp)^T mu` for a number `p` in each element: derivatives of `mu.R` in UFL, one kernel
each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem, la
from ufl import Form
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from shellmb.arrays import Floats
from shellmb.native.derivatives import by_shares, through
from shellmb.native.kernels import compile_all
from shellmb.schemes.residuals.rows import PathStates
from shellmb.simulate.problem import Problem

# covectors of the functions at the start of a step by body and name: "q" and those of rates
Covector = dict[tuple[str, str], Floats]


class Change(NamedTuple):
    """Change of a coefficient of forms by a number in each element.

    Args:
        coefficient: The coefficient.
        derivative: Its derivative by that number, in the same space.
    """

    coefficient: fem.Function
    derivative: fem.Function


class _ByStart(NamedTuple):
    """`mu.R` of one form, derived by the functions at the start.

    Args:
        body: The body.
        form: The kernel.
        shares: Constant in it: shares of a function of the start in what the form depends on.
        of: Those shares by the name of the function.
        target: A function that takes what is assembled.
    """

    body: str
    form: fem.Form
    shares: fem.Constant
    of: Mapping[str, Floats]
    target: fem.Function


class _ByField(NamedTuple):
    """`mu.R` of one form, derived by a number in each element."""

    number: int
    form: fem.Form
    target: fem.Function


class Transposed:
    """Transposed derivatives of the residuals of a problem.

    Args:
        problem: The problem.
        fields: Changes of coefficients for each field of numbers, with its body.
    """

    def __init__(self, problem: Problem, fields: Sequence[tuple[str, Sequence[Change]]]) -> None:
        self._system = system = problem.system
        self._mu = [fem.Function(f.function.function_space) for f in system.fields]
        bodies = {
            problem.number(body, stage): body
            for body, levels in problem.levels.items()
            for stage in levels.unknown
        }
        starts: list[tuple[str, list[Any], dict[str, Floats], fem.Constant]] = []
        found: list[Form] = []
        by_field: list[tuple[int, Any]] = []
        later: list[Form] = []
        for k, field in enumerate(system.fields):
            body, space = bodies[k], field.function.function_space
            made = problem.forms[body].values()
            states = [forms.states for forms in made if forms.states is not None]
            rows: list[tuple[Form, tuple[int, ...]]] = [(f, (k,)) for f in field.residual]
            rows += [(term.residual, term.rows) for term in field.terms]
            for form, numbers in rows:
                weighed = self._weighed(form, numbers)
                functions, shares = _at_start(form, problem.levels[body], states)
                if functions:
                    constant = fem.Constant(space.mesh, np.zeros(len(functions)))
                    components = [constant[n] for n in range(len(functions))]
                    by = by_shares(weighed, functions, components, ufl.TestFunction(space))
                    if not by.empty():
                        found.append(by)
                        starts.append((body, functions, shares, constant))
                for number, (name, changes) in enumerate(fields):
                    there = [c for c in changes if c.coefficient in form.coefficients()]
                    if name == body and there:
                        later.append(_by_number(weighed, there))
                        by_field.append((number, space.mesh))
        compiled = compile_all([*found, *later])
        self._starts = [
            _ByStart(body, form, constant, shares, fem.Function(functions[0].function_space))
            for form, (body, functions, shares, constant) in zip(compiled, starts, strict=False)
        ]
        self._fields = [
            _ByField(number, form, fem.Function(fem.functionspace(mesh, ("DG", 0))))
            for form, (number, mesh) in zip(compiled[len(found) :], by_field, strict=True)
        ]

    def _weighed(self, form: Form, numbers: Sequence[int]) -> Form:
        """`mu.R`: multipliers in the place of test functions."""
        (test,) = form.arguments()
        mu = [self._mu[k] for k in numbers]
        if len(mu) == 1:
            return ufl.replace(form, {test: mu[0]})
        parts = [m[n] for m in mu for n in range(m.ufl_shape[0])]
        return ufl.replace(form, {test: ufl.as_vector(parts)})

    def take(self, local: Floats) -> None:
        """Take multipliers.

        Args:
            local: One number for each local dof of all fields; zero where values are given.
        """
        offsets = self._system.numbering.offsets
        for mu, first, last in zip(self._mu, offsets, offsets[1:], strict=False):
            mu.x.array[:] = local[first:last]

    def add_by_start(self, covector: Covector, factor: float) -> None:
        """Add `(dR/ds)^T mu` times a factor; collective."""
        for part in self._starts:
            for name, shares in part.of.items():
                part.shares.value[:] = shares
                covector[part.body, name] += factor * _assembled(part.form, part.target)

    def add_by_fields(self, gradients: Sequence[Floats], factor: float) -> None:
        """Add `(dR/dp)^T mu` times a factor to the derivatives by each field; collective."""
        for part in self._fields:
            gradients[part.number][:] += factor * _assembled(part.form, part.target)


class Refreshed:
    """Rates that coordinates take from their places before a step, transposed.

    Args:
        problem: The problem.
    """

    def __init__(self, problem: Problem) -> None:
        self._parts: list[Any] = []
        forms: list[Form] = []
        for group in problem.model.mechanism.coordinate_groups:
            levels = problem.levels[group.name]
            if "v" not in levels.rates:
                continue
            q, v = levels.q, levels.rates["v"]
            weight, test = fem.Function(q.function_space), ufl.TestFunction(q.function_space)
            work = group.layout.part(weight, "x") * group.excess(q, v) * ufl.dx
            forms += [ufl.derivative(work, function, test) for function in (q, v)]
            self._parts.append((group, weight))
        made = iter(compile_all(forms))
        self._parts = [(*part, next(made), next(made)) for part in self._parts]

    def add(self, covector: Covector) -> None:
        """Turn a covector of the state after it into that of the state before it; collective."""
        for group, weight, *forms in self._parts:
            dofs = group.mixed.dofs["x"]
            weight.x.array[:] = 0.0
            weight.x.array[dofs] = covector[group.name, "v"][dofs]
            target = fem.Function(weight.function_space)
            for name, form in zip(("q", "v"), forms, strict=True):
                covector[group.name, name] -= _assembled(form, target)


def _assembled(form: fem.Form, target: fem.Function) -> Floats:
    """A linear form, summed over ranks; zero at ghosts."""
    target.x.array[:] = 0.0
    fem.assemble_vector(target.x.array, form)  # type: ignore[arg-type]
    target.x.scatter_reverse(la.InsertMode.add)
    space = target.function_space
    owned = space.dofmap.index_map.size_local * space.dofmap.index_map_bs
    target.x.array[owned:] = 0.0
    return np.asarray(target.x.array)


def _at_start(
    form: Form, levels: Any, states: Sequence[PathStates]
) -> tuple[list[fem.Function], dict[str, Floats]]:
    """Find what a form depends on that depends on the start, and its functions' shares in it."""
    names = {"q": levels.q, **levels.rates, **{f"{k} dt": f for k, f in levels.scaled.items()}}
    coefficients = set(form.coefficients())
    functions: list[fem.Function] = []
    rows: list[dict[str, float]] = []
    for some in states:
        for function, weights in zip(some.functions, some.weights, strict=True):
            of = {
                name: float(w)
                for name, f in names.items()
                for source, w in zip(some.sources, weights, strict=True)
                if source is f and w
            }
            if function in coefficients and of:
                functions.append(function)
                rows.append(of)
    for name, function in names.items():
        if function in coefficients:
            functions.append(function)
            rows.append({name: 1.0})
    used = dict.fromkeys(name for row in rows for name in row)
    return functions, {n: np.array([row.get(n, 0.0) for row in rows]) for n in used}


def _by_number(form: Form, changes: Sequence[Change]) -> Form:
    """Derivative of `mu.R` by a number in each element."""
    mesh = changes[0].coefficient.function_space.mesh
    number = ufl.TestFunction(fem.functionspace(mesh, ("DG", 0)))
    functions = tuple(c.coefficient for c in changes)
    directions = tuple(ufl.Coefficient(f.ufl_function_space()) for f in functions)
    put = {d: c.derivative * number for d, c in zip(directions, changes, strict=True)}

    def take(value: Any) -> Any:
        derivative = ufl.derivative(value, functions, directions)
        return ufl.replace(apply_derivatives(apply_algebra_lowering(derivative)), put)

    return through(form, take)
