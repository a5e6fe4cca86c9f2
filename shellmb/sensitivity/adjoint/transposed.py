"""Derivatives of the residuals of a step by its states and by fields, transposed.

With multipliers `mu` of the equations of a step these are `(dR/du)^T mu` for its unknowns `u`,
`(dR/ds)^T mu` for the state `s` at its start, and `(dR/dp)^T mu` for a number `p` in each element:
derivatives of `mu.R` in UFL. A form has one kernel for all states, which differ in their shares of
what the form takes, and a pass of it over the cells costs about as much as a residual.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem, la
from ufl import Form

from shellmb.arrays import Floats
from shellmb.native.assembler import is_native
from shellmb.native.derivatives import by_directions
from shellmb.native.kernels import compile_all, compile_each
from shellmb.simulate.problem import Problem
from shellmb.system.assembly.fields import Field
from shellmb.system.assembly.loops import LoopResiduals, MeshCells, Rows
from shellmb.system.assembly.residuals import DolfinxResiduals, Residuals

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


def _weighed(form: Form, mu: Sequence[fem.Function]) -> Form:
    """`mu.R` of one form.

    Args:
        form: The form.
        mu: Multipliers of its rows, in the place of test functions.
    """
    (test,) = form.arguments()
    parts = [m[n] for m in mu for n in range(m.ufl_shape[0])]
    return ufl.replace(form, {test: mu[0] if len(mu) == 1 else ufl.as_vector(parts)})


class _Placed(NamedTuple):
    """A derivative with the function whose dofs its rows are."""

    derivative: Form
    function: fem.Function


class Transposed:
    """Transposed derivatives of the residuals of a problem.

    Args:
        problem: The problem.
        fields: Changes of coefficients for each field of numbers, with its body.
    """

    def __init__(self, problem: Problem, fields: Sequence[tuple[str, Sequence[Change]]]) -> None:
        self._system = system = problem.system
        self._mu = [fem.Function(f.function.function_space) for f in system.fields]
        shares = _shares(problem)
        unknown = {field.function for field in system.fields}
        self._starts = {f: key for f, key in _starts(problem).items() if f not in unknown}
        self._numbers = [fem.Function(_constants_on(changes)) for _, changes in fields]
        placed: list[list[_Placed]] = [[], [], []]
        for form, rows in self._forms():
            mu = [self._mu[k] for k in rows]
            for function, of in shares.items():
                if there := [f for f in form.coefficients() if f in of]:
                    every = [f for f in form.coefficients() if _alike(f, function, shares)]
                    by = _by_state(form, mu, every, [of.get(f, 0.0) for f in every])
                    placed[function not in unknown].append(_Placed(by, function))
                    assert set(there) <= set(every)
            for number, (_, changes) in zip(self._numbers, fields, strict=True):
                found = [c for c in changes if c.coefficient in form.coefficients()]
                if found:
                    by = _by_number(form, mu, found, number.function_space)
                    placed[2].append(_Placed(by, number))
        kernels = iter(compile_each([p.derivative for some in placed for p in some]))
        by_unknown, by_start, by_number = (
            [(made, p.function) for p in some if (made := next(kernels)) is not None]
            for some in placed
        )
        functions = [field.function for field in system.fields]
        self._by_unknown = _Sums(functions, by_unknown)
        self._by_start = _Sums(list(self._starts), by_start)
        self._by_number = _Sums(self._numbers, by_number)

    def _forms(self) -> list[tuple[Form, tuple[int, ...]]]:
        """Residuals with the numbers of the fields whose rows they have."""
        found: list[tuple[Form, tuple[int, ...]]] = []
        for k, field in enumerate(self._system.fields):
            found += [(form, (k,)) for form in field.residual]
            found += [(term.residual, term.rows) for term in field.terms]
        return found

    def refresh(self) -> None:
        """Take the values of constants, after they changed."""
        for sums in (self._by_unknown, self._by_start, self._by_number):
            sums.loops.refresh()

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
        self._by_unknown.loops.add(local)

    def add_start(self, covector: Covector, factor: float) -> None:
        """Add `(dR/ds)^T mu` times a factor; collective."""
        for function, values in self._by_start().items():
            covector[self._starts[function]] += factor * values

    def add_by_fields(self, gradients: Sequence[Floats], factor: float) -> None:
        """Add `(dR/dp)^T mu` times a factor to the derivatives by each field; collective."""
        found = self._by_number()
        for gradient, number in zip(gradients, self._numbers, strict=True):
            gradient += factor * found[number]


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
        fields = [Field(f.name, f, (), ()) for f in functions]
        self._places = [slice(*pair) for pair in itertools.pairwise(ends.tolist())]
        self._local = np.zeros(ends[-1])
        self.loops: Residuals
        if not is_native():
            placed = [(form, (functions.index(f),)) for form, f in forms]
            self.loops = DolfinxResiduals(placed, fields, ends[:-1].tolist())
            return
        meshes: dict[int, list[int]] = {}
        for k, f in enumerate(functions):
            meshes.setdefault(id(f.function_space.mesh), []).append(k)
        parts: list[Rows] = []
        for numbers in meshes.values():
            held = [np.zeros(len(functions[k].x.array), np.int8) for k in numbers]
            cells = MeshCells([fields[k] for k in numbers], [int(ends[k]) for k in numbers], held)
            here = [functions[k] for k in numbers]
            parts.append((cells, [(form, (here.index(f),), -1) for form, f in forms if f in here]))
        self.loops = LoopResiduals(parts)

    def __call__(self) -> dict[fem.Function, Floats]:
        """Sums over all ranks by their functions, zero at ghosts; collective."""
        self._local[:] = 0.0
        self.loops.add(self._local)
        return {
            f: _summed(f.function_space, self._local[place])
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


def _alike(
    f: Any, function: fem.Function, shares: Mapping[fem.Function, Mapping[fem.Function, float]]
) -> bool:
    """Decide whether a coefficient is a state of the body that a function is of."""
    known = any(f in of for of in shares.values())
    return known and f.function_space == function.function_space


def _by_state(
    form: Form,
    mu: Sequence[fem.Function],
    functions: Sequence[fem.Function],
    shares: Sequence[float],
) -> Form:
    """`mu.R` derived by what functions of one space have shares of."""
    space = functions[0].function_space
    constant, test = fem.Constant(space.mesh, np.array(shares)), ufl.TestFunction(space)
    return by_directions(_weighed(form, mu), functions, [share * test for share in constant])


def _by_number(
    form: Form, mu: Sequence[fem.Function], changes: Sequence[Change], space: fem.FunctionSpace
) -> Form:
    """`mu.R` derived by a number in each element."""
    number, functions = ufl.TestFunction(space), [c.coefficient for c in changes]
    return by_directions(_weighed(form, mu), functions, [c.derivative * number for c in changes])


def _constants_on(changes: Sequence[Change]) -> fem.FunctionSpace:
    """Numbers of the elements of the mesh on which coefficients change."""
    return fem.functionspace(changes[0].coefficient.function_space.mesh, ("DG", 0))


def _summed(space: fem.FunctionSpace, values: Floats) -> Floats:
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
            for name, form in zip(("q", "v"), forms, strict=True):
                values = np.zeros_like(weight.x.array)
                fem.assemble_vector(values, form)
                covector[group.name, name] -= _summed(weight.function_space, values)
