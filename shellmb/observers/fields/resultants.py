"""Forces and moments in beams and shells at their nodes."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl.algorithms.ad import expand_derivatives
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.meshes.spaces import reading_element
from shellmb.model.frames.beam import BeamModel
from shellmb.model.sections.branches import Branches
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import values_in_cells
from shellmb.observers.fields.by_section import held_plies
from shellmb.schemes.base import Levels
from shellmb.schemes.linearised import change
from shellmb.simulate.simulation import Simulation

# quantity of a probe to its components among a body's resultants
RESULTANTS: dict[str, tuple[int, ...]] = {"force": (0, 1, 2), "moment": (3, 4, 5)}
RESULTANTS |= {"membrane": (0, 1, 2), "bending": (3, 4, 5), "shear": (6, 7)}


class Resultants:
    """Resultants of a beam along its directors, or of a shell along its material directions.

    Those of a beam come twice, shape (12,): forces and moments that balance its loads, and those
    that are conjugate to its strains, which differ by the strains. Of a shell, shape (8,), there
    are the latter only.

    They are read at Gauss points; those of an element are continued to its nodes by the
    polynomial through its points. Where elements meet, the mean of all is given: at a point
    load of a beam, of the values on both sides of it.
    With degree 2 values at nodes are off by `N'' h^2/12` where the exact ones are curved, at free
    edges as inside (docs/reference/python.md has it measured).

    They are means over the step: the averaged stress that acts in the row which balances the
    momentum of the step. Of ED that is the one from the state j to f, where eq. (29) has its
    forces; of schemes quadratic in time it is S_0. Stresses at the end of a step are of no order
    where a body is stiff. In statics, and before the first step, they are those of the state.
    Maxwell branches are in all of them.

    Args:
        simulation: The simulation.
        body: The beam or shell.

    Attributes:
        size: Number of components.
        vectors: What is read, of a state, and in motion as a mean over a step.
    """

    vectors: tuple[Expr, ...] = ()

    def __init__(self, simulation: Simulation, body: ShellModel | BeamModel) -> None:
        self._simulation, problem = simulation, simulation.problem
        self._levels = levels = problem.levels[body.name]
        natural = getattr(body, "natural", None)
        state: Expr = (levels.reference or levels).q
        at = state
        found = [_linear(body.resultants(state), levels, natural)]
        self._start: fem.Function | None = None
        self._branches: Sequence[Branches] = problem.branches.get(body.name, ())
        if simulation.scheme.dynamic:
            step = problem.steps[body.name]
            # looked at when the step is accepted, and its start is overwritten
            self._start = fem.Function(body.mixed.space, name="start")
            found.append(_linear(step.mean_resultants(body), levels, natural))
            at = state if levels.reference else step.mean_state()
        pairs = zip(found, (state, at), ("now", "mean"), strict=False)
        found = [self._whole(body, r, q, when) for r, q, when in pairs]
        self.vectors = tuple(found)
        if self._start is not None:
            found[1] = ufl.replace(found[1], {levels.q: self._start})
        self._prepare(body, found)

    def _springs(self, when: str) -> Sequence[tuple[Expr, Expr]]:
        """Strains and stresses of the branches, if there are any."""
        return [own.springs(when == "mean") for own in self._branches]

    def _whole(self, body: Any, elastic: Expr, q: Expr, when: str) -> Expr:
        """Vector that is read, with branches.

        Args:
            body: The body.
            elastic: Resultants of the long-term section.
            q: State at which the stresses of the branches act.
            when: Of a state "now", or as a "mean" over a step.
        """
        return sum((body.of_stress(stress, q) for _, stress in self._springs(when)), elastic)

    def _prepare(
        self, body: ShellModel | BeamModel, vectors: list[Expr], cells: Ints | None = None
    ) -> None:
        """Make what is read, of states and perhaps as means, in some cells or all of this rank."""
        nodes = body.mixed.subspaces["u"]
        inner = reading_element(nodes)
        points = np.asarray(inner.points, dtype=np.float64)
        self.size = int(vectors[0].ufl_shape[0])
        self._expressions = [values_in_cells(v, points, nodes.mesh, cells) for v in vectors]
        # values at the nodes of an element from those at its points
        at = np.asarray(nodes.element.interpolation_points)
        table = np.asarray(inner.tabulate(0, at))
        self._continued: Floats = table[0, :, :, 0]
        local = nodes.mesh.topology.index_map(nodes.mesh.topology.dim).size_local
        self._nodes = nodes.dofmap.list[:local]

    def solved(self) -> None:
        """Keep the start of a step, while it is at hand."""
        if self._start is not None:
            np.copyto(self._start.x.array, self._levels.q.x.array)

    def elements(self) -> Floats:
        """Values of each element of this rank at its nodes, shape (elements, nodes, size)."""
        # before the first step there is the state only
        if self._simulation.last:
            return self.at_nodes(self._expressions[-1])
        for own in self._branches:
            own.follow()
        return self.at_nodes(self._expressions[0])

    def at_nodes(self, values: Callable[[], Floats]) -> Floats:
        """Values at the nodes of each element that is read, from what finds those at points."""
        return np.asarray(np.einsum("np,epk->enk", self._continued, values()))

    def back(self, slopes: Floats) -> Floats:
        """Derivatives of a number by values at points, from those by `elements`, alike shaped."""
        return np.asarray(np.einsum("np,enk->epk", self._continued, slopes))

    def weights(self, places: Sequence[tuple[Int32s, float]]) -> Floats:
        """Weights of the elements' values at their nodes, shape (elements, nodes); collective.

        Args:
            places: Local nodes of each place, owned or ghost, and the share of the mean of what
                elements have there.
        """
        here = [np.isin(self._nodes, nodes) for nodes, _ in places]
        counts = self._simulation.model.comm.allreduce(np.array([np.sum(each) for each in here]))
        shares = zip(here, places, counts, strict=True)
        return np.asarray(sum(each * (share / n) for each, (_, share), n in shares))

    def at(self, weights: Floats, quantity: str) -> Floats:
        """Part of this rank in a resultant, N, N m or per m, shape (3,); collective.

        Args:
            weights: Those of a point.
            quantity: Which of the resultants; the third component of a shear force is zero.
        """
        found, components = np.zeros(3), RESULTANTS[quantity]
        cells, nodes = np.nonzero(weights)
        values = self.elements()[cells, nodes]
        found[: len(components)] = weights[cells, nodes] @ values[:, components]
        return found


class LayerResultants(Resultants):
    """Resultants that stresses of layers follow from where no resultant has all, shape (m + 8,).

    N and M that the long-term section has of its strain, and would have of those of the springs of
    each set of branches (`Layup.among`), and the factor of natural strains of plies
    (`stress_at`); the resultants of the section stand behind.
    """

    def _whole(self, body: Any, elastic: Expr, q: Expr, when: str) -> Expr:
        whole, springs = super()._whole(body, elastic, q, when), self._springs(when)
        # triangles have a second group of each set, of shear alone
        sets = springs[:: max(1, len(springs) // max(1, len(body.shell.section.generic.branches)))]
        every = [elastic, *(body.section.formulation.stress(strain) for strain, _ in sets)]
        factor = [getattr(body.natural, when)] if held_plies(body.shell) else []
        return ufl.as_vector([*(r[k] for r in every for k in range(6)), *factor, *whole])


class Strained(Resultants):
    """Strains that do not follow from resultants, and their energy per area or length.

    Of shells with a nonlinear section, and of sections that relax; these have the long-term energy.
    Shape (9,), of a beam (7,).

    Args:
        simulation: The simulation.
        body: The shell or beam.
    """

    def __init__(self, simulation: Simulation, body: ShellModel | BeamModel) -> None:
        self._simulation, self._start, self._branches = simulation, None, ()
        parts = body.strained(simulation.problem.state(body.name))
        self._prepare(body, [ufl.as_vector(parts)])


def _linear(vector: Expr, levels: Levels, natural: object = None) -> Expr:
    """Resultants of small displacements by their linear part, and what they are at the reference.

    That is nothing without natural strains.
    """
    if levels.reference is None:
        return vector
    linear = expand_derivatives(change(vector, levels))
    return linear if natural is None else linear + vector
