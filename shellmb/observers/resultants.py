"""Forces and moments in beams and shells at their nodes."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt
import ufl
from ufl.core.expr import Expr

from shellmb.build.spaces import MixedSpace
from shellmb.forms.mixed_nonlinear import NonlinearMixed
from shellmb.forms.path import Step
from shellmb.kernels import compiled_expression
from shellmb.model.beam import BeamModel
from shellmb.model.shell import ShellModel
from shellmb.simulate.simulation import Simulation

Floats = npt.NDArray[np.float64]

# quantity of a probe to its components among a body's resultants
BEAM = {"force": (0, 1, 2), "moment": (3, 4, 5)}
SHELL = {"membrane": (0, 1, 2), "bending": (3, 4, 5), "shear": (6, 7)}
RESULTANTS = {**BEAM, **SHELL}


class Resulting(Protocol):
    """A body with resultants: a shell or a beam."""

    name: str
    mixed: MixedSpace

    def resultants(self, q: Expr) -> Expr | tuple[Expr, Expr]:
        """Its resultants as one vector, or as forces and moments."""
        ...

    def mean_resultants(self, step: Step) -> Expr | tuple[Expr, Expr]:
        """The same as means over a step that is quadratic in time."""
        ...


class Resultants:
    """Resultants of a beam along its directors, or of a shell along its material directions.

    They are accurate at the Gauss points; those of an element are continued to its nodes by the
    polynomial through its points. Where elements meet, the mean of all is given: at a point
    load of a beam, of the values on both sides of it.

    They are those of the state at the end of a step; with schemes that are quadratic in time means
    over the step, because stresses at its end are of no order where a body is stiff.

    Args:
        simulation: The simulation.
        body: The beam or shell.
    """

    def __init__(self, simulation: Simulation, body: Resulting) -> None:
        self._simulation, problem = simulation, simulation.problem
        found = [body.resultants(problem.state(body.name))]
        if body.name in problem.paths:
            found.append(body.mean_resultants(problem.paths[body.name].step))
        self._prepare(body, [_joined(each) if isinstance(each, tuple) else each for each in found])

    def _prepare(self, body: Resulting, vectors: list[Expr]) -> None:
        """Compile what is read, of states and perhaps as means."""
        nodes, inner = body.mixed.subspaces["u"], body.mixed.subspaces["N"]
        points = np.asarray(inner.element.interpolation_points)
        self._mesh = nodes.mesh
        self._size = int(vectors[0].ufl_shape[0])
        self._expressions = [compiled_expression(vector, points) for vector in vectors]
        # values at the nodes of an element from those at its points
        at = np.asarray(nodes.element.interpolation_points)
        table = np.asarray(inner.element.basix_element.tabulate(0, at))
        self._continued: Floats = table[0, :, :, 0]
        local = self._mesh.topology.index_map(self._mesh.topology.dim).size_local
        self._cells = np.arange(local, dtype=np.int32)
        self._nodes = nodes.dofmap.list[:local]

    def elements(self) -> Floats:
        """Values of each element of this rank at its nodes, shape (elements, nodes, size)."""
        # before the first step there is the state only
        expression = self._expressions[-1 if self._simulation.last else 0]
        flat = np.asarray(expression.eval(self._mesh, self._cells), dtype=np.float64)
        values = flat.reshape(len(self._cells), -1, self._size)
        return np.asarray(np.einsum("np,epk->enk", self._continued, values))

    def sums(self, nodes: npt.NDArray[np.int32], quantity: str) -> tuple[Floats, int]:
        """Sum of the elements' values at nodes, shape (3,), in N, N m or per m, and their number.

        Args:
            nodes: Local numbers, owned or ghost; elements of this rank alone count.
            quantity: Which of the resultants; the third component of a shear force is zero.
        """
        total, places = np.zeros(3), np.isin(self._nodes, nodes)
        if not places.any():
            return total, 0
        found = self.elements()[places]
        components = list(RESULTANTS[quantity])
        total[: len(components)] = found.sum(axis=0)[components]
        return total, len(found)


class Strained(Resultants):
    """Strains of a shell with a nonlinear section, and its energy per area, shape (9,).

    Args:
        simulation: The simulation.
        body: The shell.
    """

    def __init__(self, simulation: Simulation, body: ShellModel) -> None:
        self._simulation = simulation
        strains = body.strains(simulation.problem.state(body.name))
        formulation = body.section.formulation
        assert isinstance(formulation, NonlinearMixed)
        energy = formulation.psi(strains)
        parts = [*strains.eps, *strains.kap, *strains.gam, energy]
        self._prepare(body, [ufl.as_vector(parts)])


def _joined(parts: tuple[Expr, Expr]) -> Expr:
    force, moment = parts
    return ufl.as_vector([*(force[k] for k in range(3)), *(moment[k] for k in range(3))])


def has_resultants(body: object, quantity: str) -> bool:
    """Whether a probe's quantity is a resultant of a body."""
    return quantity in (BEAM if isinstance(body, BeamModel) else SHELL)
