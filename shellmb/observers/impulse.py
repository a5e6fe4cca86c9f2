"""Impulses of all loads and added terms, as eq. (29) sees them.

The last row of a scheme, tested with a rigid translation and with a rigid rotation of its mid-point
configuration. The virtual work is assembled into the nodes, those of joints and point loads
included, and what arrives at shells, beams and rigid bodies is summed up there.
"""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem

from shellmb.kernels import compiled
from shellmb.model.body import Body
from shellmb.observers.nodal import NodalBody, nodal_bodies, values_of
from shellmb.simulate.simulation import Simulation

Floats = npt.NDArray[np.float64]


def last_middle(simulation: Simulation, body: str) -> Floats:
    """Dofs of a body at the middle of the last stage of the step just solved.

    In statics the state itself; in linear statics, whose unknown is small, the reference.
    """
    problem, scheme = simulation.problem, simulation.scheme
    levels = problem.levels[body]
    if scheme.linear:
        return np.asarray(levels.q.x.array)
    end = levels.unknown[problem.last].x.array
    if not scheme.dynamic:
        return np.asarray(end)
    before = levels.unknown["j"] if "j" in levels.unknown else levels.q
    return np.asarray((before.x.array + end) / 2)


class Impulse:
    """Impulse and moment of impulse about the origin of everything that acts from outside.

    Args:
        simulation: The simulation; the call is collective.
    """

    def __init__(self, simulation: Simulation) -> None:
        problem = simulation.problem
        self._system, last = problem.system, problem.last
        self._forms: list[tuple[int, fem.Form]] = []
        for body in simulation.model.bodies:
            k = problem.number(body.name, last)
            self._forms += [(k, form) for form in self._acting(simulation, body)]
        self._carriers: list[tuple[NodalBody, int, npt.NDArray[np.int32]]] = []
        for name, carrier in nodal_bodies(simulation.model).items():
            # a node that two bodies share counts on the one that it belongs to
            links = [link.dofs for link in carrier.links]
            index_map = carrier.mixed.space.dofmap.index_map
            ghosts = index_map.size_local + np.arange(index_map.num_ghosts)
            elsewhere = np.concatenate([*links, ghosts]).astype(np.int32)
            self._carriers.append((carrier, problem.number(name, last), elsewhere))
        self._total = self._system.x.duplicate()

    @staticmethod
    def _acting(simulation: Simulation, body: Body) -> list[fem.Form]:
        """Virtual work of loads and added terms in the last stage."""
        problem = simulation.problem
        last = problem.forms[body.name][problem.last]
        dq = ufl.TestFunction(body.mixed.space)
        work = [
            form
            for sample in last.samples
            for form in (sample.of_loads(dq), sample.of_terms(body, dq))
        ]
        return [compiled(form) for form in work if form is not None and not form.empty()]

    def of_step(self, simulation: Simulation) -> dict[str, Floats]:
        """Impulses of the step just solved, by the kind of momentum, each of shape (3,)."""
        assert simulation.last is not None
        system, result = self._system, np.zeros((2, 3))
        numbering = system.numbering
        if self._forms:
            local = np.zeros(len(numbering.local_to_global))
            for k, form in self._forms:
                fem.assemble_vector(local[numbering.slice(k)], form)  # type: ignore[arg-type]
            self._total.set(0.0)
            numbers = numbering.local_to_global.astype(PETSc.IntType)
            self._total.setValues(numbers, local, addv=PETSc.InsertMode.ADD)
            self._total.assemble()
            forces = system.local_values(self._total)
            for body, k, elsewhere in self._carriers:
                r = forces[numbering.slice(k)].copy()
                r[elsewhere] = 0.0
                result += _resultant(body, last_middle(simulation, body.name), r)
        simulation.model.comm.Allreduce(MPI.IN_PLACE, result)
        result *= simulation.last.dt
        return {"momentum": result[0], "angular momentum": result[1]}


def _resultant(body: NodalBody, q: Floats, r: Floats) -> Floats:
    """Force and moment about the origin of nodal forces `r` at the state `q`, shape (2, 3)."""
    dofs, at = body.mixed.dofs, values_of(body, q)
    force = r[dofs["u"]].reshape(-1, 3)
    moment = np.cross(at.position, force).sum(axis=0)
    couples = np.cross(at.directors, r[dofs["w"]].reshape(at.directors.shape))
    moment += couples.sum(axis=(0, 1))
    if "bubble" in dofs:
        # it turns with the body, and does not move with it
        bubble, share = (a[dofs["bubble"]].reshape(-1, 3) for a in (q, r))
        moment += np.cross(bubble, share).sum(axis=0)
    return np.array([force.sum(axis=0), moment])
