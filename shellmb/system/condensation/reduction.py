"""The linear systems of Newton's method with as few unknowns as there are degrees of freedom.

Between assembly and the linear solver, exact and invisible to the forms:

1. element-wise unknowns are eliminated cell by cell;
2. unit directors and orthonormal triples with their multipliers are projected on their tangent
   spaces (`Q_m` of the paper): five unknowns per shell node, six per frame;
3. what only one cell has after that is eliminated there, too.

Fields declare which of their dofs are element-wise and which carry directors; nothing here knows
what they are for. The solution is that of the unreduced system, multipliers included.
"""

from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.clock import now
from shellmb.native import library as native
from shellmb.system.assembly.fields import general_position
from shellmb.system.assembly.loops import LoopResiduals
from shellmb.system.assembly.meshgroups import MeshGroup, mesh_groups
from shellmb.system.condensation.matrix import reduced_matrix
from shellmb.system.condensation.meshreduction import MeshReduction, SingularCell, check
from shellmb.system.condensation.substitution import DirectSolution, Passes
from shellmb.system.couplings import CoupledEntries
from shellmb.system.direct.linear import Linear
from shellmb.system.direct.solver import DirectSolver, Purpose
from shellmb.system.newton.convergence import unknown_scales
from shellmb.system.nullspace.directornodes import DirectorNodes
from shellmb.system.nullspace.nodes import SystemNodes
from shellmb.system.nullspace.numbers import ReducedNumbers


class Reduction(Linear):
    """Solves the linear systems of a block system by reduced ones.

    The system's residuals are assembled by the same loops from then on.

    Args:
        nodes: Nodes of the block system that carry directors.
        prefix: PETSc options prefix, unique per system.

    Attributes:
        A: The reduced matrix.
    """

    solver: DirectSolver

    def __init__(self, nodes: SystemNodes, prefix: str) -> None:
        super().__init__(system := nodes.system)
        self._groups = groups = mesh_groups(system)
        system.take_loops(LoopResiduals(group.residuals for group in groups))
        kept = [system.coupled.dofs.local] if system.couplings else []
        self.numbers = ReducedNumbers(nodes, [group.cells for group in groups], kept)
        self._prefix = prefix
        self.renew()
        self.numbers.weights[:] = self._weights()

    def renew(self) -> None:
        """Make the matrix, with all entries that there may be from now on."""
        system = self.system
        with general_position(system.forms), ExitStack() as sizes:
            for group in self._groups:
                sizes.enter_context(group.cells.of_size_one())
            self._allocate(self._groups)
        scales = self.numbers.scales(unknown_scales(system))
        self.solver = DirectSolver(self.A, self._prefix, scales, values=self._matrix.values)
        self._passes = Passes(self.numbers, self.parts)
        self._at_once: DirectSolution | None = None
        if self.numbers.full.serial:
            vectors = self._rhs, self._solution
            self._at_once = DirectSolution(self.numbers, self.parts, *vectors)
        pairs = zip(self.parts, self._matrix.targets, strict=True)
        members = [part.jacobian(values) for part, values in pairs]
        self._lib, self._pointer = native.cells().lib, native.CArrays()
        self._jacobians = len(members), self._pointer.many("Jacobian", members)
        # of several solutions at a time: their passes, and their vectors by how many they are
        self._beside = list[Passes]()
        self._columns: dict[int, tuple[Floats, list[PETSc.Mat]]] = {}

    @property
    def size(self) -> int:
        """Number of reduced unknowns over all ranks."""
        return int(self.A.getSize()[0])

    def _allocate(self, groups: list[MeshGroup]) -> None:
        """Find out which entries are not always zero, at a state in general position."""
        numbers = self.numbers
        numbers.update()
        self.parts = [MeshReduction(g.cells, g.jacobians(), numbers) for g in groups]
        for part in self.parts:
            part.loop.refresh()
        self._coupled = None
        if self.system.couplings:
            places = numbers.matrix_places(numbers.kept)
            self._coupled = CoupledEntries(self.system.coupled, *places)
        self._matrix = reduced_matrix(numbers, self.parts, self._coupled)
        self.A = self._matrix.A
        self._rhs, self._solution = self.A.createVecs()
        self._load = np.zeros(len(numbers.full.wanted))

    def _weights(self) -> Floats:
        """Forces of multipliers of size one, measured: forms may scale them as they like."""
        system, numbers = self.system, self.numbers
        out = np.ones(numbers.multipliers)
        widest = max((s.multipliers.shape[1] for s in numbers.nodes.values()), default=0)
        system.gather()
        start, x, b = system.x.copy(), system.x.duplicate(), system.b.duplicate()

        def forces(shift: Floats) -> Floats:
            start.copy(x)
            x.array[:] += shift
            system.scatter(x)
            system.residual(x, b)
            return numbers.full.seen(b.array_r)

        none = forces(np.zeros(system.numbering.owned))
        for c in range(widest):
            sets = {k: s for k, s in numbers.nodes.items() if s.multipliers.shape[1] > c}
            rows = [numbers.multipliers_of(k)[:, c] for k in sets]
            ids = np.concatenate([*rows, np.zeros(0, np.int64)])
            # forces that are no numbers are said where they are solved for
            with np.errstate(invalid="ignore"):
                change = forces(numbers.full.set(ids, np.ones(len(ids)))) - none
            for k, nodes in sets.items():
                direction = nodes.constraint_rows(system.fields)[:, c]
                offset = int(system.numbering.offsets[k])
                force = change[nodes.dofs + offset] * ~nodes.fixed
                size = (direction * direction).sum(axis=1)
                weight = (force * direction).sum(axis=1) / np.where(size > 0, size, 1.0)
                _check_nodal(force - weight[:, None] * direction, force, nodes)
                weight[weight == 0.0] = 1.0
                numbers.of_node(out, k)[:, c] = weight
        system.scatter(start)
        return out

    def _assemble(self) -> None:
        """The reduced Jacobian at the state that the fields' functions hold."""
        numbers = self.numbers
        numbers.update()
        self._given = numbers.correction()
        shifted = bool(np.count_nonzero(self._given))
        if not numbers.full.serial:
            shifted = bool(numbers.full.comm.allreduce(shifted, op=MPI.MAX))
        self._load[:] = 0.0
        # what is solved for is subtracted
        shift = (-self._given, self._load) if shifted else (None, None)
        check(self._lib.jacobians(*self._jacobians, *map(native.doubles, shift)))
        if self._coupled is not None:
            self._matrix.add(*self._coupled.at(self._given, self._load))
        self._matrix.end()

    def factorise(self, purpose: Purpose = Purpose.EXACT) -> str | None:
        """Assemble and factorise at the state that the fields hold."""
        start = now()
        try:
            self._assemble()
        except SingularCell as failure:
            return str(failure)
        self.jacobians += 1
        middle = now()
        reason = self.solver.factorise(purpose)
        self.seconds["jacobian"] += middle - start
        self.seconds["factor"] += now() - middle
        return reason

    def solve(self, b: PETSc.Vec, dx: PETSc.Vec, fresh: bool) -> str | None:
        """Solve `J dx = b`, all unknowns included.

        Args:
            b: Residual of the unreduced system, assembled at the current state.
            dx: What is to be subtracted from the unknowns.
            fresh: Whether the Jacobian was assembled at this very state.
        """
        start = now()
        if not fresh:
            self._given = self.numbers.correction()
        load, passes = self._load if fresh else None, self._passes
        reason = None
        if self.solver.direct and self._at_once is not None:
            self.solver.solutions += 1
            error, inside = self._at_once.solve(self.solver.made, b, load, self._given, dx)
            if error:
                reason = f"the direct solver failed (error {error})"
        else:
            passes.before(b.array_r, load, self._rhs.array)
            before = now()
            reason = self.solver.solve(self._rhs, self._solution)
            inside = now() - before
            passes.after(self._solution.array_r, self._given, dx.array)
        self.seconds["solve"] += inside
        self.seconds["reduction"] += now() - start - inside
        return reason

    def in_c(self) -> tuple[Any, ...] | None:
        """For C, a solution with an earlier factorisation; None: there is no call for it."""
        solver, at_once = self.solver, self._at_once
        if at_once is None or solver.many or not solver.direct:
            return None
        return at_once.in_c(solver.made, self.numbers.correction())

    def solve_many(self, given: Sequence[PETSc.Vec], found: Sequence[PETSc.Vec]) -> str | None:
        """Solve for several right-hand sides with an earlier factorisation.

        Factors of large systems are read once for all of them.

        Args:
            given: Residuals of the unreduced system.
            found: Take what is to be subtracted from the unknowns.
        """
        if len(given) == 1 or self._at_once is None or not self.solver.many:
            return super().solve_many(given, found)
        start, shift = now(), self.numbers.correction()
        (rhs, solutions), matrices = self._vectors(len(given))
        for passing, b, column in zip(self._beside, given, rhs, strict=False):
            passing.before(b.array_r, None, column)
        before = now()
        self.solver.solve_many(*matrices)
        inside = now() - before
        for passing, dx, column in zip(self._beside, found, solutions, strict=False):
            passing.after(column, shift, dx.array)
        self.seconds["solve"] += inside
        self.seconds["reduction"] += now() - start - inside
        return None

    def _vectors(self, count: int) -> tuple[Floats, list[PETSc.Mat]]:
        """Right-hand sides and solutions of so many reduced systems, as rows and as matrices."""
        while len(self._beside) < count:
            self._beside.append(Passes(self.numbers, [part.beside() for part in self.parts]))
        if count not in self._columns:
            # columns follow one another, as PETSc has them
            vectors = np.zeros((2, count, self.size))
            of, comm = (self.size, count), PETSc.COMM_SELF
            matrices = [PETSc.Mat().createDense(of, array=v.T, comm=comm) for v in vectors]
            self._columns[count] = vectors, matrices
        return self._columns[count]

    def solve_transposed(self, b: PETSc.Vec) -> str | None:
        """Solve `J^T x = b` for all but the equations of lengths and angles at nodes.

        It takes the factors and the reduced matrix, rows and columns exchanged. Forces of
        multipliers at nodes must be zero in `b`. `multipliers` gets the solution.

        Args:
            b: Right-hand side.
        """
        self._passes.before(b.array_r, None, self._rhs.array, transposed=True)
        reason = self.solver.solve_transposed(self._rhs, self._solution)
        self.multipliers = self._passes.after_transposed(self._solution.array_r)
        return reason

    def follow(self) -> None:
        """Take tangent spaces at the state that the fields hold, and keep the factors."""
        self.numbers.update()

    @property
    def covers(self) -> bool:
        """Decide whether a transposed solution has all that derivatives by the start need.

        Lengths and angles at the end of a step do not depend on its start, unlike those of rates
        at its middle.
        """
        nodes = self.numbers.nodes.values()
        return all(s.rates is None and not s.massless and not s.declared.linear for s in nodes)


def _check_nodal(rest: Floats, force: Floats, nodes: DirectorNodes) -> None:
    """Multipliers act along their constraints, or the fields declare what is not so."""
    here = ~nodes.held
    if np.any(np.abs(rest[here]) > 1e-6 * (np.abs(force[here]).max(initial=0.0) + 1e-300)):
        raise ValueError(f"{nodes.field.name}: multipliers do not act on the directors declared")
