"""Derivatives of a number by reserve factors: utilisations as numbers that are read of steps.

A utilisation is a function of resultants, and of their derivatives along the shell, at the node
where it is largest. With its derivatives by these, weights `W` at the points of elements make it a
sum of resultants `R`, whose derivatives by the states of a step are those of the form `int W.R dx`.
"""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem, la
from ufl import Form

from shellmb.arrays import Floats
from shellmb.meshes.spaces import reading_element, reading_space
from shellmb.model.sections.section import custom
from shellmb.model.shells.shell import ShellModel
from shellmb.native.kernels import compiled
from shellmb.observers.fields.modal import readable
from shellmb.observers.fields.reserves import Judged, Place, Reserves
from shellmb.observers.fields.through import NodalResultants, PlyRows, PlyState, ply_rows, ply_state
from shellmb.scene import Shell
from shellmb.scene.lookup import said
from shellmb.schemes.base import END
from shellmb.sensitivity.adjoint.elementwise import ElementField, shells_beside
from shellmb.sensitivity.adjoint.objective import FOURTH
from shellmb.sensitivity.adjoint.steps import State, put, starts
from shellmb.sensitivity.adjoint.sweep import StoredSteps
from shellmb.sensitivity.adjoint.transposed import Covector, summed
from shellmb.sensitivity.perturbed_run import PerturbedRun
from shellmb.simulate.simulation import Simulation

# distance of differences, relative to stresses and strains
APART = 1e-5
OFFSETS, WEIGHTS = np.array(FOURTH).T


class Noted(NamedTuple):
    """A largest utilisation, and its derivatives, which are zero but on the rank of its node.

    Args:
        place: Where it is.
        by_resultants: By the resultants at its node.
        by_fields: By a number there of each field, of which the plies are.
    """

    place: Place
    by_resultants: Floats
    by_fields: Floats


class Watch(Reserves):
    """Notes where utilisations are largest in each step, with their derivatives there.

    Args:
        fields: Fields that are differentiated by.

    Attributes:
        noted: Utilisations by name, at the start and at the end of each step.
    """

    def __init__(self, fields: Sequence[ElementField] = ()) -> None:
        super().__init__()
        self._fields, self.noted = fields, list[dict[str, Noted]]()

    def measure(self) -> dict[str, float]:
        """The run's own observer has columns."""
        return {}

    def _judge(self, simulation: Simulation, both: dict[str, Floats]) -> None:
        super()._judge(simulation, both)
        self.noted.append({})
        for each, *_ in self.judged:
            name, values = each.reserve.name, both[each.shell.name]
            place, slope = self.places[name], np.zeros(values.shape[1])
            by = [0.0] * len(self._fields)
            if place.rank == simulation.model.comm.rank:
                body, there = readable(simulation.model)[each.shell.name], values[place.node]
                read = _Node(each, body, place, simulation.scheme.dynamic)
                slope, by = read.slope(there), [read.by_field(f, there) for f in self._fields]
            self.noted[-1][name] = Noted(place, slope, np.array(by))


class _Node:
    """A utilisation as a function of the resultants at a node.

    Args:
        judged: What judges.
        body: The shell.
        place: The place.
        dynamic: As of `layup`.
    """

    def __init__(self, judged: Judged, body: ShellModel, place: Place, dynamic: bool) -> None:
        self._judged, self._body, self._place, self._dynamic = judged, body, place, dynamic

    def _rows(self, shell: Shell) -> tuple[PlyRows, ...]:
        section: Any = shell.section
        x = self._body.mixed.nodes("u")[self._place.node]
        at = section.at(x, said(shell)) if section.functions else section.generic
        return ply_rows(shell, at if self._dynamic else at.at_rest)

    def _values(self, state: PlyState) -> Floats:
        return self._judged.utilisations(state)[:, *self._place[2:]]

    def value(self, there: Floats, shell: Shell | None = None) -> float:
        """Utilisation by the resultants, perhaps of the shell with another section."""
        return float(self._values(ply_state(self._rows(shell or self._body.shell), there[None]))[0])

    def by_field(self, field: ElementField, there: Floats) -> float:
        """Derivative by a number of a field, of which the plies at the node are."""
        if field.body != self._body.name:
            return 0.0
        shells = shells_beside(self._body, field.name)
        return sum(weight * self.value(there, shell) for weight, shell in shells)

    def slope(self, there: Floats) -> Floats:
        """Derivatives by the resultants, through stresses and strains, which are linear in them."""
        rows = self._rows(self._body.shell)
        total, held = (
            None if part is None else np.repeat(part, len(FOURTH), axis=1)
            for part in ply_state(rows, there[None])
        )
        assert total is not None
        # slips of plies that relax are NaN, and in no criterion
        linear = np.nan_to_num(ply_state(rows, np.eye(len(there))).total)
        found, (ply, side) = np.zeros(len(there)), self._place[2:4]
        for kind, part in np.ndindex(2, 5):
            alike = np.s_[:3] if part < 3 else np.s_[3:]
            size = APART * (np.nan_to_num(np.abs(total[kind, 0, ply, side, alike])).max() or 1.0)
            beside = total.copy()
            beside[kind, :, ply, side, part] += size * OFFSETS
            by = float(self._values(PlyState(beside, held)) @ WEIGHTS) / size
            found += by * linear[kind, :, ply, side, part]
        return found


class _Read:
    """Weighed resultants of a shell, which are read of steps.

    Args:
        simulation: The run.
        resultants: Resultants at its nodes.
        name: Its name.
    """

    def __init__(self, simulation: Simulation, resultants: NodalResultants, name: str) -> None:
        body, levels = readable(simulation.model)[name], simulation.problem.levels[name]
        self.name, self.resultants, self._comm = name, resultants, simulation.model.comm
        self._nodes = nodes = body.mixed.subspaces["u"]
        space = reading_space(nodes, resultants.size)
        points: Any = reading_element(nodes).points
        rule = ufl.Measure("dx", nodes.mesh, metadata=custom(points, np.ones(len(points))))
        self.weights, self._cells = fem.Function(space), np.asarray(space.dofmap.list)
        # parts of the area at each point
        one, test = ufl.as_vector([1.0] * resultants.size), ufl.TestFunction(space)
        self._areas = np.asarray(fem.assemble_vector(compiled(ufl.inner(one, test) * rule)).array)
        # of a state, and of a step
        first, *means = resultants.vectors
        last = means[0] if means else ufl.replace(first, {levels.q: levels.unknown[END]})
        self.form: Form = ufl.inner(self.weights, last) * rule
        by_start = ufl.inner(self.weights, first) * rule
        test = ufl.TestFunction(levels.q.function_space)
        self._start = levels.q.function_space, compiled(ufl.derivative(by_start, levels.q, test))

    def take(self, given: Sequence[tuple[float, Noted]]) -> None:
        """Take the weights of a sum of utilisations, each with its factor; collective."""
        sums = self._at_nodes([(factor, n.place, n.by_resultants) for factor, n in given])
        weights, array = self.resultants.back(sums), self.weights.x.array
        array.reshape(-1, self.resultants.size)[self._cells[: len(weights)]] = weights
        array /= np.where(self._areas == 0, 1.0, self._areas)

    def by_fields(self, given: Sequence[tuple[float, Noted]]) -> list[Floats]:
        """Derivatives of the sum by the numbers of each field, (cells,); collective.

        A node has the mean of the elements around it.
        """
        sums = self._at_nodes([(factor, n.place, n.by_fields) for factor, n in given])
        return [self.resultants.shares(values) for values in sums.T]

    def add_start(self, covector: Covector) -> None:
        """Add derivatives by the state at the start; collective."""
        space, form = self._start
        values = np.asarray(fem.assemble_vector(form).array)
        covector[self.name, "q"] += summed(space, values)

    def _at_nodes(self, given: Sequence[tuple[float, Place, Floats]]) -> Floats:
        """Sums of vectors at nodes, on all ranks that have these, shape (n, k); collective."""
        columns = len(given[0][2])
        sums = la.vector(self._nodes.dofmap.index_map, columns)
        array = sums.array.reshape(-1, columns)
        for factor, place, vector in given:
            if place.rank == self._comm.rank:
                array[place.node] += factor * vector
        sums.scatter_forward()
        return array


class Utilisations:
    """Derivatives of a number by utilisations.

    Args:
        simulation: The run.
        watch: What noted them.
        slopes: Derivatives of the number by the values of each utilisation over the steps.
    """

    def __init__(self, simulation: Simulation, watch: Watch, slopes: Mapping[str, Floats]) -> None:
        self._run, self._watch, self._slopes = simulation, watch, slopes
        self._names = defaultdict[str, list[str]](list)
        for each, *_ in watch.judged:
            if np.any(slopes[each.reserve.name]):
                self._names[each.shell.name].append(each.reserve.name)
        self._reads = [_Read(simulation, watch.resultants[name], name) for name in self._names]

    @property
    def forms(self) -> list[tuple[Form, fem.Function]]:
        """Numbers that are read of steps, with their weights."""
        return [(read.form, read.weights) for read in self._reads]

    def take(self, row: int, gradients: Sequence[Floats]) -> None:
        """Take the weights of a row of the history, and add derivatives by fields; collective."""
        noted = self._watch.noted
        for read in self._reads:
            given = [(float(self._slopes[n][row]), noted[row][n]) for n in self._names[read.name]]
            read.take(given)
            by_fields = read.by_fields(given) if gradients else []
            for gradient, shares in zip(gradients, by_fields, strict=True):
                gradient[: len(shares)] += shares

    def add_start(self, covector: Covector) -> None:
        """Add derivatives by the state at the start, which the fields have; collective."""
        for read in self._reads:
            read.add_start(covector)

    def beside(
        self, side: PerturbedRun, first: State
    ) -> tuple[float, Callable[[StoredSteps], float]]:
        """Utilisations of a scene beside the run, at the run's states, times their slopes.

        Args:
            side: The scene.
            first: State of the run at its start.

        Returns:
            Their sum at the start, and as a function of steps; of this rank, collective.
        """
        if not self._reads:
            return 0.0, lambda step: 0.0
        reserves, simulation, problem = Reserves(), side.simulation, side.problem
        dynamic = simulation.scheme.dynamic
        put(first, starts(problem))
        reserves.start(simulation)

        def now(row: int) -> float:
            found = 0.0
            both = {name: each.now() for name, each in reserves.resultants.items()}
            for each, *_ in reserves.judged:
                name, body = each.reserve.name, readable(simulation.model)[each.shell.name]
                place = self._watch.noted[row][name].place
                if place.rank == simulation.model.comm.rank:
                    there = both[each.shell.name][place.node]
                    value = _Node(each, body, place, dynamic).value(there)
                    found += float(self._slopes[name][row]) * value
            return found

        def of_step(step: StoredSteps) -> float:
            side.hold(step.unknowns)
            if dynamic:
                reserves.solved(simulation)
                simulation.last = self._run.last
            else:
                for levels in problem.levels.values():
                    levels.q.x.array[:] = levels.unknown[END].x.array
                problem.arrive(step.t + step.dt)
            return now(step.number + 1)

        return now(0), of_step
