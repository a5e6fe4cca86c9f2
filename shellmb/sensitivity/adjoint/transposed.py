"""Derivatives of the residuals of a step by its states and by fields, transposed.

With multipliers `mu` of the equations of a step these are `(dR/du)^T mu` for its unknowns `u`,
`(dR/ds)^T mu` for the state `s` at its start, and `(dR/dp)^T mu` for a number `p` in each element:
derivatives of `mu.R` in UFL. A form has one kernel for all states, which differ in their shares of
what the form takes, and a pass of it over the cells costs about as much as a residual.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem, la
from ufl import Form

from shellmb.arrays import Floats
from shellmb.native.derivatives import by_directions
from shellmb.native.kernels import compile_all, together
from shellmb.sensitivity.adjoint.steps import relaxing
from shellmb.simulate.problem import Problem
from shellmb.system.assembly.fields import Field
from shellmb.system.assembly.meshgroups import residuals_of

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


class Transposed:
    """Transposed derivatives of the residuals of a problem.

    Args:
        problem: The problem.
        fields: Changes of coefficients for each field of numbers, with its body.
        read: Numbers that are read of steps.
    """

    def __init__(
        self,
        problem: Problem,
        fields: Sequence[tuple[str, Sequence[Change]]],
        read: Sequence[Form] = (),
    ) -> None:
        self._system = system = problem.system
        self._mu = [fem.Function(f.function.function_space) for f in system.fields]
        self._rest = _Derivatives(problem, list(self._weighed()), fields)
        self._relaxing, self._all = relaxing(problem), [self._rest]
        if self._relaxing:
            # strains of branches at the end of a step are further equations, whose multipliers
            # are their covectors
            ahead = [group.carried[1] for group in self._relaxing.values()]
            self._all.append(_Derivatives(problem, ahead, []))
        self._ahead = self._all[1:]
        self._read = [_Derivatives(problem, read, fields)] if read else []
        self._all += self._read
        self._explicit = [(self._rest, -1.0), *((each, 1.0) for each in self._read)]

    def _weighed(self) -> Iterator[Form]:
        """Residuals times multipliers."""
        for k, field in enumerate(self._system.fields):
            terms = [(term.residual, term.rows) for term in field.terms]
            for form, rows in [*((form, (k,)) for form in field.residual), *terms]:
                mu, (test,) = [self._mu[n] for n in rows], form.arguments()
                parts = [m[n] for m in mu for n in range(m.ufl_shape[0])]
                # in the place of test functions
                yield ufl.replace(form, {test: mu[0] if len(mu) == 1 else ufl.as_vector(parts)})

    def refresh(self) -> None:
        """Take the values of constants, after they changed."""
        for each in self._all:
            for sums in (each.by_unknown, each.by_start, each.by_number):
                sums.loops.refresh()

    def carry(self, ends: Covector, starts: Covector, local: Floats) -> None:
        """Add what is read, and covectors of branches at the end, in the unknown states.

        Covectors of branches at the start are added, too.

        Args:
            ends: Of the end of the step.
            starts: Of its start.
            local: One number for each local dof of all fields.
        """
        for key, group in self._relaxing.items():
            starts[key] += group.back(ends[key])
        for each in self._read:
            each.by_unknown.loops.add(local)
        for ahead in self._ahead:
            ahead.by_unknown.loops.add(local)
            ahead.add_start(starts, 1.0)

    def take(self, local: Floats) -> None:
        """Take multipliers.

        Args:
            local: One number for each local dof of all fields; zero where values are given.
        """
        offsets = self._system.numbering.offsets
        for mu, first, last in zip(self._arrays, offsets, offsets[1:], strict=False):
            mu[:] = local[first:last]

    @cached_property
    def _arrays(self) -> list[Floats]:
        """Numbers of the multipliers: DOLFINx looks them up anew whenever it is asked."""
        return [np.asarray(mu.x.array) for mu in self._mu]

    def add_unknown(self, local: Floats) -> None:
        """Add `(dR/du)^T mu` to local values of all fields.

        Args:
            local: One number for each local dof of all fields.
        """
        self._rest.by_unknown.loops.add(local)

    def add_start(self, covector: Covector) -> None:
        """Add `-(dR/ds)^T mu`, and derivatives of what is read; collective."""
        for each, factor in self._explicit:
            given = each.add_start(covector, factor)
            for key, group in self._relaxing.items():
                covector[key] += factor * group.back_given([given[f] for f in group.given])

    def add_by_fields(self, gradients: Sequence[Floats]) -> None:
        """Add `-(dR/dp)^T mu`, and derivatives of what is read, by each field; collective."""
        for each, factor in self._explicit:
            found = each.by_number()
            for gradient, number in zip(gradients, each.numbers, strict=True):
                gradient += factor * found[number]


class _Derivatives:
    """Derivatives of numbers by the states of a step and by fields.

    Args:
        problem: The problem.
        weighed: Numbers, whose sum is differentiated.
        fields: Changes of coefficients for each field of numbers, with its body.
    """

    def __init__(
        self,
        problem: Problem,
        weighed: Sequence[Form],
        fields: Sequence[tuple[str, Sequence[Change]]],
    ) -> None:
        shares = _shares(problem)
        unknown = {field.function for field in problem.fields}
        self._starts = {f: key for f, key in _starts(problem).items() if f not in unknown}
        given = [f for group in relaxing(problem).values() for f in group.given]
        shares |= {f: {f: 1.0} for f in given}
        states = {f for of in shares.values() for f in of}
        meshes = [changes[0].coefficient.function_space.mesh for _, changes in fields]
        # numbers of the elements
        self.numbers = [fem.Function(fem.functionspace(mesh, ("DG", 0))) for mesh in meshes]
        placed: list[tuple[tuple[int, fem.Function], Form]] = []
        for form in weighed:
            seen = form.coefficients()
            for function, of in shares.items():
                if any(f in of for f in seen):
                    space = function.function_space
                    every = [f for f in seen if f in states and f.function_space == space]
                    weights = fem.Constant(space.mesh, np.array([of.get(f, 0.0) for f in every]))
                    by = [weights[k] for k in range(len(every))]
                    test = ufl.TestFunction(space)
                    derivative = by_directions(form, every, [share * test for share in by])
                    placed.append(((int(function not in unknown), function), derivative))
            for number, (_, changes) in zip(self.numbers, fields, strict=True):
                if found := [c for c in changes if c.coefficient in seen]:
                    test = ufl.TestFunction(number.function_space)
                    by = [c.derivative * test for c in found]
                    derivative = by_directions(form, [c.coefficient for c in found], by)
                    placed.append(((2, number), derivative))
        made = together(placed)
        by_unknown, by_start, by_number = (
            [(form, f) for (kind, f), some in made.items() if kind == k for form in some]
            for k in range(3)
        )
        self.by_unknown = _Sums([field.function for field in problem.fields], by_unknown)
        self.by_start = _Sums([*self._starts, *given], by_start)
        self.by_number = _Sums(self.numbers, by_number)

    def add_start(self, covector: Covector, factor: float) -> Mapping[fem.Function, Floats]:
        """Add derivatives by the state at the start times a factor, and return all; collective."""
        found = self.by_start()
        for function, key in self._starts.items():
            covector[key] += factor * found[function]
        return found


class _Sums:
    """Assembles linear forms, each with the dofs of a function.

    Args:
        functions: Functions whose dofs the sums have, one after the other.
        forms: Compiled forms with the function of each.

    Attributes:
        loops: What adds them.
    """

    def __init__(
        self, functions: Sequence[fem.Function], forms: Sequence[tuple[fem.Form, fem.Function]]
    ) -> None:
        self._functions = functions
        ends = np.cumsum([0, *(len(f.x.array) for f in functions)])
        self._places = [slice(*pair) for pair in itertools.pairwise(ends.tolist())]
        self._local = np.zeros(ends[-1])
        fields = [Field(f.name, f, (), ()) for f in functions]
        held = [np.zeros(len(f.x.array), np.int8) for f in functions]
        placed = [(form, (functions.index(f),)) for form, f in forms]
        self.loops = residuals_of(fields, ends[:-1].tolist(), held, placed)

    def __call__(self) -> dict[fem.Function, Floats]:
        """Sums over all ranks by their functions, zero at ghosts; collective."""
        self._local[:] = 0.0
        self.loops.add(self._local)
        return {
            f: summed(f.function_space, self._local[place])
            for f, place in zip(self._functions, self._places, strict=True)
        }


def _starts(problem: Problem) -> dict[fem.Function, tuple[str, str]]:
    """Functions at the start of a step, with their body and name."""
    found: dict[fem.Function, tuple[str, str]] = {}
    for body, levels in problem.levels.items():
        found |= {f: (body, name) for name, f in {"q": levels.q, **levels.rates}.items()}
        found |= {f: (body, f"{name} dt") for name, f in levels.scaled.items()}
    return found


def _shares(problem: Problem) -> dict[fem.Function, dict[fem.Function, float]]:
    """Functions of the start and of the unknown states, with their shares in what forms take."""
    shares = {f: {f: 1.0} for f in _starts(problem)}
    shares |= {field.function: {field.function: 1.0} for field in problem.fields}
    for stages in problem.forms.values():
        for states in (forms.states for forms in stages.values() if forms.states is not None):
            for f, weights in zip(states.functions, states.weights, strict=True):
                for source, weight in zip(states.sources, weights, strict=True):
                    if weight:
                        shares[source][f] = float(weight)
    return shares


def summed(space: fem.FunctionSpace, values: Floats) -> Floats:
    """Local values summed over ranks; zero at ghosts; collective."""
    index_map = space.dofmap.index_map
    if space.mesh.comm.size == 1:
        return values
    owned = index_map.size_local * space.dofmap.index_map_bs
    vector = la.vector(index_map, space.dofmap.index_map_bs)
    vector.array[:] = values
    vector.scatter_reverse(la.InsertMode.add)
    vector.array[owned:] = 0.0
    return np.asarray(vector.array)


class Refreshed:
    """Rates that coordinates take from their places before a step, transposed.

    Args:
        problem: The problem.
    """

    def __init__(self, problem: Problem) -> None:
        self._parts: list[Any] = []
        for group in problem.model.mechanism.coordinate_groups:
            levels = problem.levels[group.name]
            if "v" not in levels.rates:
                continue
            q, v = levels.q, levels.rates["v"]
            weight, test = fem.Function(q.function_space), ufl.TestFunction(q.function_space)
            work = group.layout.part(weight, "x") * group.excess(q, v) * ufl.dx
            forms = compile_all([ufl.derivative(work, function, test) for function in (q, v)])
            self._parts.append((group, weight, *forms))

    def add(self, covector: Covector) -> None:
        """Turn a covector of the state after it into that of the state before it; collective."""
        for group, weight, *forms in self._parts:
            dofs = group.mixed.dofs["x"]
            weight.x.array[:] = 0.0
            weight.x.array[dofs] = covector[group.name, "v"][dofs]
            for name, form in zip(("q", "v"), forms, strict=True):
                values = np.zeros_like(weight.x.array)
                fem.assemble_vector(values, form)
                covector[group.name, name] -= summed(weight.function_space, values)
