"""Damping and relaxation of a body: of its strains, and in proportion to its mass."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import add
from typing import Any, NamedTuple

from mpi4py import MPI

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl import Form
from ufl.core.expr import Expr
from ufl.corealg.traversal import traverse_unique_terminals

from shellmb.arrays import Floats
from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.steps.damping import Branch, Straining, at_state, taken
from shellmb.forms.steps.mixed import MixedStrains
from shellmb.forms.steps.path import Rows, moment_of
from shellmb.meshes.shared import space_on
from shellmb.model.body import Term
from shellmb.model.sections.strains import Integrate, SectionStrains, path_terms
from shellmb.model.sections.strains import together as joined
from shellmb.native.expressions import values_in_cells
from shellmb.native.kernels import compiled
from shellmb.native.programs.tables import points_of
from shellmb.scene import BeamSection, Section


@dataclass(frozen=True)
class StrainDamping:
    """Damping of a body's strains, eq. (D1).

    Args:
        parts: Strains with the section whose stresses resist their rates.
        rates: Makes `following`; None: forces follow from strains point by point.
    """

    parts: Sequence[SectionStrains]
    rates: Callable[[fem.Function, fem.Function], Callable[[], None]] | None = None

    def following(self, q: fem.Function, v: fem.Function) -> Callable[[], None] | None:
        """Function that gives a velocity at a state rates of resultants; None: none needs them."""
        return None if self.rates is None else self.rates(q, v)

    def term(self, along: Straining, tests: Sequence[Expr], trial: Expr) -> Term:
        """Forces in the rows of a step, with their derivatives."""
        terms = []
        for part in self.parts:

            def over_time(densities: Sequence[Expr], on: Integrate = part.integrate) -> Form:
                return on([density / along.dt for density in densities])

            terms.append(path_terms(part, along.rows, tests, trial, over_time))
        return reduce(joined, terms)

    def work(self, along: Straining) -> Form:
        """Work over the step, eq. (D2); never positive."""
        works = (
            part.integrate([-density / along.dt for density in taken(part, along)])
            for part in self.parts
        )
        return reduce(add, works)

    def at(self, q: Expr, v: Expr, dq: Expr) -> Form:
        """Virtual work of the forces at a state with a velocity."""
        works = (part.integrate(at_state(part, q, v, dq)) for part in self.parts)
        return reduce(add, works)


def slowing(section: Section | BeamSection, mesh: Any) -> fem.Constant | None:
    """Rate of a section's damping in proportion to its mass, 1/s; None without any."""
    rate = float(section.mass_damping)
    return fem.Constant(mesh, rate) if rate else None


# relaxation time [s], and whether the branch is relaxed at the start
type Key = tuple[float, bool]


def means(ratio: float, alpha: float, bows: bool) -> Floats:
    """Mean and first moment of a spring's strain over a step, eq. (V3).

    Args:
        ratio: Length of the step over the relaxation time.
        alpha: Dissipation of the scheme.
        bows: Whether its steps have a bow.

    Returns:
        Both from the strain at the start, its change and its bow, shape (2, 3).
    """
    if not bows:
        return np.array([[1, 0.5, 0], [0, 0, 0]]) / (1 + ratio / 2)
    left = np.array([[1 + ratio / 2, -ratio / 6], [ratio / 2, 1 + alpha * ratio / 6]])
    return np.linalg.solve(left, [[1, 0.5, -0.5], [0, 0.5, alpha / 2]])


class Fading(NamedTuple):
    """A strain with the branches that have one stiffness but for factors.

    Args:
        strain: The strain.
        C: Stiffness, shape (n, n).
        branches: Factors on it, by time and whether the branch begins relaxed.
        dx: The rule of its integrals.
        mesh: The mesh.
    """

    strain: Measure
    C: Expr
    branches: Mapping[Key, float]
    dx: ufl.Measure
    mesh: mesh.Mesh


class Course(NamedTuple):
    """A scheme's step, as branches see it.

    Args:
        rows: Makes the rows with a mixture of the change of the strain and its bow, and strains
            that are added.
        alpha: Dissipation.
        bows: Whether its steps have a bow.
    """

    rows: Callable[[Floats, Sequence[Expr]], Straining]
    alpha: float
    bows: bool


class MaxwellBranches(list["Branches"]):
    """The branches of a body: those of each of its strains.

    Args:
        name: Name for the columns of histories.
        layout: Parts of the body's state.
        fading: Its strains with branches.
    """

    def __init__(self, name: str, layout: Layout, fading: Sequence[Fading]) -> None:
        self.name, self._layout = f"{name}.relaxation", layout
        super().__init__(Branches(f"{self.name}/{k}", one) for k, one in enumerate(fading))

    def term(self, course: Course, tests: Sequence[Expr], trial: Expr) -> Term:
        """Forces in the rows of a step, with their derivatives; called once for each stage."""
        return reduce(joined, [own.term(self._layout, course, tests, trial) for own in self])

    def energy(self) -> float:
        """Energy of the springs at the accepted state, J; collective."""
        return self._sum([own.energy() for own in self])

    def loss(self) -> tuple[float, float]:
        """Energy that the scheme and the branches dissipate in the step just solved, J."""
        first, second = map(self._sum, zip(*(own.loss() for own in self), strict=True))
        return first, second

    def forces(self, mean: bool = False) -> Floats:
        """Stresses of branches of one component, times weights, of the cells of this rank.

        Args:
            mean: Whether they are means over the step just solved, not those of its start.
        """
        return reduce(add, (own.forces(mean) for own in self))[:, 0]

    def _sum(self, parts: Sequence[float]) -> float:
        return float(self[0].comm.allreduce(sum(parts), op=MPI.SUM))


class Branches:
    """Branches of a strain.

    Args:
        name: Name in files.
        fading: The strain with the branches.

    Attributes:
        values: Strains of the springs at the points, shape (branches, local dofs).
        C: Stiffness.
    """

    def __init__(self, name: str, fading: Fading) -> None:
        self.name = name
        self._strain, self._dx, self.C = fading.strain, fading.dx, fading.C
        self._section = Branch(fading.C)
        self._times = np.array([time for time, _ in fading.branches])
        self._relaxed = [relaxed for _, relaxed in fading.branches]
        self._factors = np.array(list(fading.branches.values()))
        (integral,) = (ufl.as_ufl(1.0) * fading.dx).integrals()
        rule, domain = points_of(integral), fading.mesh
        self._points, self._size = rule.places[0], int(fading.C.ufl_shape[0])
        element = basix.ufl.quadrature_element(
            domain.basix_cell(), (self._size,), points=self._points, weights=rule.weights
        )
        self._domain, self.comm = domain, domain.comm
        self.space = space_on(domain, element)
        topology = domain.topology
        self._dofs = self.space.dofmap.list[..., None] * self._size + np.arange(self._size)
        own = topology.index_map(topology.dim).size_local
        self._own = slice(0, own)
        # through its values at the points, so that resultants can be read elsewhere
        triangles = topology.cell_name() == "triangle"
        degree = 2 if triangles else round(len(self._points) ** (1 / topology.dim)) - 1
        single = basix.ufl.element("P", domain.basix_cell(), degree, discontinuous=True)
        at_nodes = space_on(domain, basix.ufl.blocked_element(single, shape=(self._size,)))
        table = single.basix_element.tabulate(0, self._points)[0, :, :, 0]
        self._through = np.linalg.inv(table)
        self._nodes = at_nodes.dofmap.list[..., None] * self._size
        self._nodes = self._nodes + np.arange(self._size)
        self.given = fem.Function(at_nodes), fem.Function(at_nodes)
        self._now = fem.Function(at_nodes)
        weights = fem.assemble_vector(compiled(ufl.TestFunction(self.space)[0] * fading.dx))
        self._weights = weighed = weights.array[self._dofs[:own, :, 0]]
        C = self._at_points(self._section.matrix())[:own]
        C = C.reshape(*weighed.shape, self._size, self._size)
        self._weighed = weighed[..., None, None] * C / 2
        self.values = np.zeros((len(self._times), fem.Function(self.space).x.array.size))
        self._rows: list[tuple[Straining, Course]] = []
        self._dt = 0.0
        self._found: tuple[Floats, Floats, Floats, Floats] | None = None

    def _at_points(self, value: Expr) -> Floats:
        """Values at the points, shape (cells, points, size)."""
        return values_in_cells(value, self._points, self._domain, np.s_[:])()

    @cached_property
    def _moments(self) -> list[Expr]:
        """Change and bow of the strain, by the rows of the last stage."""
        along = self._rows[-1][0]
        states = along.rows.states[: along.rows.moving]
        return [moment_of(self._strain, moment, states) for moment in along.change]

    @cached_property
    def _changes(self) -> list[Callable[[], Floats]]:
        where = self._points, self._domain, np.s_[:]
        return [values_in_cells(moment, *where) for moment in self._moments]

    def term(self, layout: Layout, course: Course, tests: Sequence[Expr], trial: Expr) -> Term:
        """Forces in the rows of a step."""
        along = course.rows(self._mixture(1.0, course)[0], self.given)
        self._rows.append((along, course))

        def integrate(densities: Sequence[Expr]) -> Form:
            return densities[0] * self._dx

        of = MixedStrains(self._section, layout, self._strain)
        return path_terms(of, along.rows, tests, trial, integrate)

    def springs(self, mean: bool) -> tuple[Expr, Expr]:
        """Strain of the springs, of all times by their factors, and its stress.

        Args:
            mean: Whether it is the mean over the step, as of the strain; if not, the one that
                `follow` takes, of the accepted state.
        """
        rows = self._rows[-1][0].rows
        moving = rows.states[: rows.moving]
        e = moment_of(self._strain, rows.stresses[0].moment, moving) if mean else self._now
        return e, self._section.stress(e)[0]

    def _mixture(self, dt: float, course: Course) -> tuple[Floats, Floats]:
        """Weights of change and bow in both stresses, and of the branches' strains, (2, n)."""
        self._steps = [means(dt / time, course.alpha, course.bows) for time in self._times]
        found = [f * m for f, m in zip(self._factors, self._steps, strict=True)]
        return np.sum(found, axis=0)[:, 1:], np.array([m[:, 0] for m in found]).T

    def begin(self, q: fem.Function) -> None:
        """Take the start: springs of branches that are not relaxed have all of the strain there."""
        found = self._scattered(self._at_points(self._strain.value(q)))
        for values, relaxed in zip(self.values, self._relaxed, strict=True):
            values[:] = 0.0 if relaxed else found

    def stiffness(self, q: fem.Function) -> Iterator[tuple[float, Form]]:
        """Time of each branch with its stiffness about a state where it is relaxed."""
        tested = self._strain.change(q, ufl.TestFunction(q.function_space))
        for time, stress in self.stresses(q, ufl.TrialFunction(q.function_space)):
            yield time, ufl.inner(stress, tested) * self._dx

    def stresses(self, q: fem.Function, change: Expr) -> Iterator[tuple[float, Expr]]:
        """Time of each branch with its stress by a change of a state where it is relaxed."""
        stress = self._section.stress(self._strain.change(q, change))[0]
        for time, factor in zip(self._times.tolist(), self._factors, strict=True):
            yield time, fem.Constant(self._domain, float(factor)) * stress

    def _scattered(self, values: Floats) -> Floats:
        out = np.zeros(self.values.shape[1])
        out[self._dofs] = values
        return out

    def prepare(self, dt: float) -> None:
        """Set the numbers of a step of a length [s]."""
        self._found = None
        for along, course in self._rows if dt != self._dt else ():
            mixture, self._shares = self._mixture(dt, course)
            _renew(along.rows, course.rows(mixture, self.given).rows)
        self._dt = dt
        for function, shares in zip(self.given, self._shares, strict=True):
            self._mix(function, shares)

    def _mix(self, function: fem.Function, shares: Floats) -> None:
        """Give a function shares of the strains of all branches."""
        function.x.array[self._nodes] = self._continued((shares @ self.values)[self._dofs])

    def _continued(self, at: Floats) -> Floats:
        """Values at the nodes of cells from those at their points."""
        return np.asarray(np.einsum("np,cpi->cni", self._through, at))

    def held(self, q: fem.Function, dq: Expr) -> Form:
        """Work of the stresses that `follow` takes, of the accepted state."""
        stress = self._section.stress(self._now)[0]
        return ufl.inner(stress, self._strain.change(q, dq)) * self._dx

    def follow(self) -> None:
        """Take the stresses of the accepted state."""
        self._mix(self._now, self._factors)

    def _solved(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Mean, first moment, bow and change of the springs' strains over the step just solved."""
        if self._found is not None:
            return self._found
        found = [self._scattered(change().reshape(self._dofs.shape)) for change in self._changes]
        first, bow = found if len(found) > 1 else (found[0], np.zeros_like(found[0]))
        given = np.array([np.stack([X, first, bow]) for X in self.values])
        both = np.array([m @ g for m, g in zip(self._steps, given, strict=True)])
        ratios = (self._dt / self._times)[:, None]
        mean, moment = both[:, 0], both[:, 1]
        self._found = mean, moment, bow - ratios / 3 * moment, first - ratios * mean
        return self._found

    def change(self) -> Floats:
        """Change of the strains over the step just solved, shape as of `values`."""
        return self._solved()[3]

    def accept(self) -> None:
        """Take the strains at the end of the step that was solved."""
        self.values += self.change()

    @cached_property
    def carried(self) -> tuple[list[fem.Function], Form]:
        """Change and bow of the strain times functions, as `back` sets them."""
        functions = [fem.Function(self._now.function_space) for _ in self._moments]
        pairs = zip(functions, self._moments, strict=True)
        return functions, sum(ufl.inner(*pair) for pair in pairs) * self._dx

    def back(self, of: Floats) -> Floats:
        """Covector of the strains at the start for one of those at the end, by themselves."""
        ratios = (self._dt / self._times)[:, None]
        # (V1), (V3): by the strain at the start, its change and its bow
        shares = np.array([1.0, 1.0, 0.0]) - ratios * np.array(self._steps)[:, 0]
        for function, share in zip(self.carried[0], shares.T[1:], strict=False):
            at = (share @ of)[self._dofs[self._own]] / self._weights[..., None]
            function.x.array[self._nodes[self._own]] = self._continued(at)
        return shares[:, :1] * of

    def back_given(self, covectors: Sequence[Floats]) -> Floats:
        """Covector of the strains at the start for those of `given`."""
        found = np.zeros_like(self.values)
        for covector, shares in zip(covectors, self._shares, strict=True):
            at = np.einsum("np,cni->cpi", self._through, covector[self._nodes])
            found[:, self._dofs] += shares[:, None, None, None] * at
        return found

    def _norms(self, values: Floats) -> Floats:
        """Halves of the products of strains of all branches with their stresses, J."""
        at = values[:, self._dofs[self._own]]
        return self._factors * np.einsum("bcpi,cpij,bcpj->b", at, self._weighed, at)

    def forces(self, mean: bool) -> Floats:
        """Stresses times weights of the cells of this rank, shape (cells, size)."""
        at = (self._solved()[0] if mean else self.values)[:, self._dofs[self._own]]
        found = 2 * np.einsum("b,cpij,bcpj->ci", self._factors, self._weighed, at)
        return np.asarray(found)

    def kept(self) -> tuple[str, dict[str, Floats], fem.FunctionSpace]:
        """Strains of the springs, which a restart needs, with their space and a name."""
        return self.name, {str(k): X for k, X in enumerate(self.values)}, self.space

    def energy(self) -> float:
        """Energy of the springs of this rank, J."""
        return float(self._norms(self.values).sum())

    def loss(self) -> tuple[float, float]:
        """Energy that is dissipated in the step just solved, of this rank, J."""
        mean, moment, bow, _ = self._solved()
        course = self._rows[-1][1]
        ratios = self._dt / self._times
        spent = 2 * ratios * (self._norms(mean) + self._norms(moment) / 3)
        scheme = course.alpha * self._norms(bow) if course.bows else np.zeros(1)
        return float(scheme.sum()), float(spent.sum())


def branches_of(body: Any) -> MaxwellBranches | None:
    """New Maxwell branches of a body; None without any."""
    make = getattr(body, "branches", None)
    found: MaxwellBranches | None = None if make is None else make()
    return found


def _renew(rows: Rows, other: Rows) -> None:
    """Take the numbers of other rows, of the same kind."""
    for mine, its in zip(_constants(rows), _constants(other), strict=True):
        mine.value[...] = its.value


def _constants(item: Any) -> Iterator[Any]:
    """Constants of rows, in the order in which these were made."""
    if isinstance(item, Expr):
        yield from (c for c in traverse_unique_terminals(item) if isinstance(c, fem.Constant))
    elif isinstance(item, tuple):
        for part in item:
            yield from _constants(part)
