"""Mass, damping and stiffness of a scene as SciPy matrices, and its state space: `sm.matrices`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from shellmb.api.resolve_scene import requested
from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.options.described import options_of, takes
from shellmb.options.run import ELEMENTS, Options
from shellmb.scene import Scene
from shellmb.scene.lookup import find_body, said
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from petsc4py import PETSc

    from shellmb.model.model import Model

# singular values of constraints below this part of the largest are zero
DEPENDENT = 1e-9
# of the scene's length: a node is at a point that is as near as this
SAME = 1e-9
# parts of states that are forces of constraints, and those that are resultants
MULTIPLIERS, RESULTANTS = ("lam", "mu", "hold"), ("N", "S")


class StateSpace(NamedTuple):
    """Matrices of ``x' = A x + B u, y = C x + D u``, as `scipy.signal.StateSpace` takes them.

    Args:
        A: Shape (2 n, 2 n).
        B: Shape (2 n, inputs).
        C: Shape (outputs, 2 n).
        D: Zero, shape (outputs, inputs).
    """

    A: Floats
    B: Floats
    C: Floats
    D: Floats


@dataclass(frozen=True)
class Matrices:
    """Matrices of ``M x'' + C x' + K x = f`` in coordinates that no constraint ties.

    Resultants are eliminated, directors, frames, joints and supports are included. The
    coordinates `x` have no meaning of their own: `row` gives displacements in terms of them.

    Args:
        M: Mass matrix, sparse, shape (n, n).
        C: Damping matrix.
        K: Stiffness matrix.
        basis: What each coordinate does to the unknowns of the system, sparse, shape (unknowns, n).
        scene: The scene.
    """

    M: sp.csr_array
    C: sp.csr_array
    K: sp.csr_array
    basis: sp.csr_array
    scene: Scene
    _model: Model
    _numbers: dict[str, Ints]

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.K.shape[0])

    def row(
        self, point: Sequence[float], component: int | Sequence[float] = 2, body: str | None = None
    ) -> Floats:
        """A displacement in terms of the coordinates, ``u = row @ x``; ``row * F`` is a force.

        Args:
            point: Coordinates of a node of a shell or a beam, or of any point of a rigid body [m].
            component: 0, 1, 2 for x, y, z, or a direction.
            body: Name of the body; None: the only one.

        Returns:
            Shape (n,).

        Raises:
            SceneError: If there is no such body or node.
        """
        who = "matrices: row"
        target = find_body(self.scene, body, who)
        own, nodes, X, D = self._model.nodes_of(target.name)
        axis = np.eye(3)[component] if isinstance(component, int) else np.asarray(component, float)
        away = np.linalg.norm(X - np.asarray(point, dtype=float), axis=1)
        node = int(np.argmin(away))
        numbers = self._numbers[own.name]
        rows = own.mixed.dofs["u"].reshape(-1, 3)[nodes[node]]
        found = axis @ self.basis[numbers[rows]].toarray()
        if D.shape[1] == 3 and own is self._model.rigid:
            # a point of a rigid body moves with its directors
            arms = D[node] @ (np.asarray(point, dtype=float) - X[node])
            turned = own.mixed.dofs["w"].reshape(-1, 3, 3)[nodes[node]]
            for arm, dofs in zip(arms, turned, strict=True):
                found = found + arm * (axis @ self.basis[numbers[dofs]].toarray())
        elif away[node] > SAME * self._model.length:
            near = tuple(float(f"{c:.6g}") for c in X[node])
            raise SceneError(
                f"{who}: {said(target)} has no node at {show(tuple(point))}; the nearest one is at "
                f"{near}"
            )
        return np.asarray(found).ravel()

    def modes(self, count: int) -> tuple[Floats, Floats]:
        """The lowest undamped modes, normalised to a mass of one.

        Args:
            count: How many, fewer than coordinates.

        Returns:
            Squares of the angular frequencies, shape (count,) [rad^2/s^2], and the modes as
            columns, shape (n, count).
        """
        if not 0 < count < self.size:
            raise SceneError(
                f"matrices: modes is {count}; it must be from 1 to {self.size - 1}, the number of "
                "coordinates less one"
            )
        scale = abs(self.K.diagonal()).max() / abs(self.M.diagonal()).max()
        shift = -1e-9 * float(scale)
        values, vectors = spla.eigsh(self.K.tocsc(), count, self.M.tocsc(), sigma=shift)
        order = np.argsort(values)
        return values[order], vectors[:, order]

    def state_space(
        self, inputs: Any = None, outputs: Any = None, modes: int | None = None
    ) -> StateSpace:
        """The state space, with the coordinates and their rates as states.

        Args:
            inputs: Rows of forces as of `row`, shape (inputs, n); None: one for each coordinate.
            outputs: Rows of displacements as of `row`, shape (outputs, n); None: all coordinates.
            modes: Number of undamped modes that the coordinates are reduced to; None: none, all
                coordinates stay, in dense matrices.

        Raises:
            SceneError: If a row has another length, or there are not so many modes.
        """
        rows = {"inputs": inputs, "outputs": outputs}
        unit = np.eye(self.size)
        given = {}
        for name, value in rows.items():
            given[name] = unit if value is None else np.atleast_2d(np.asarray(value, dtype=float))
            if given[name].shape[1] != self.size:
                raise SceneError(
                    f"matrices: {name} have {given[name].shape[1]} columns; they must have "
                    f"{self.size}, one for each coordinate"
                )
        if modes is None:
            solve = spla.splu(self.M.tocsc()).solve
            stiff, damped = solve(self.K.toarray()), solve(self.C.toarray())
            forces, seen = solve(given["inputs"].T), given["outputs"]
        else:
            values, vectors = self.modes(modes)
            stiff, damped = np.diag(values), vectors.T @ (self.C @ vectors)
            forces, seen = vectors.T @ given["inputs"].T, given["outputs"] @ vectors
        n = len(stiff)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-stiff, -damped]])
        B = np.vstack([np.zeros_like(forces), forces])
        C = np.hstack([seen, np.zeros_like(seen)])
        return StateSpace(A, B, C, np.zeros((len(seen), forces.shape[1])))


@takes(*options_of(Options, *ELEMENTS))
def matrices(
    scene: Scene | str,
    loaded: bool = False,
    *,
    parameters: Mapping[str, Any] | None = None,
    **elements: Any,
) -> Matrices:
    """Mass, damping and stiffness matrices of a scene, in one process.

    Args:
        scene: A scene, the name of a bundled one, or the path of a Python file.
        loaded: Whether about the static equilibrium under the scene's loads, or the reference.
        parameters: Values of the parameters of a scene that is named.
        **elements: Choices that replace the scene's, as `shellmb modes` has them.

    Raises:
        SceneError: If the scene is impossible, a body has no mass, or there are several ranks.
        ConvergenceError: If there is no equilibrium.
    """
    from mpi4py import MPI

    from shellmb.running.rotating.axis import Axis
    from shellmb.running.rotating.steady import SteadyRotation

    if MPI.COMM_WORLD.size > 1:
        raise SceneError(
            f"matrices: there are {MPI.COMM_WORLD.size} ranks; it must be called in one process"
        )
    wanted = requested(scene, parameters, **elements).scene
    state = SteadyRotation(wanted, Axis((0.0, 0.0, 1.0)), MPI.COMM_SELF, loaded)
    state.go(0.0)
    K, C, M = (_scipy(A) for A in state.matrices())
    names = {body.name: k for k, body in enumerate(state.model.bodies)}
    numbers = {name: state.system.numbering.by_field[k] for name, k in names.items()}

    def those(parts: Sequence[str]) -> Ints:
        found = [
            numbers[b.name][b.mixed.dofs[p].ravel()]
            for b in state.model.bodies
            for p in parts
            if p in b.mixed.dofs
        ]
        return np.unique(np.concatenate([*found, np.zeros(0, dtype=np.int64)])).astype(np.int64)

    free = np.ones(state.system.size, dtype=bool)
    free[state.system.fixed] = False
    resultants, tied = those(RESULTANTS), those(MULTIPLIERS)
    resultants, tied = resultants[free[resultants]], tied[free[tied]]
    moving = free.copy()
    moving[resultants] = moving[tied] = False
    q = np.flatnonzero(moving)
    if len(resultants):
        # each cell has its own
        inner = spla.splu(K[resultants][:, resultants].tocsc())
        rest = np.concatenate([q, tied])
        column = K[resultants][:, rest]
        change = K[rest][:, resultants] @ sp.csc_array(_solved(inner, column))
        whole = K[rest][:, rest] - change
        stiff, rows = whole[: len(q)][:, : len(q)], whole[len(q) :][:, : len(q)]
    else:
        stiff, rows = K[q][:, q], K[tied][:, q]
    T = null_space(sp.csr_array(rows))
    mass, damping, stiffness = (sp.csr_array(T.T @ A @ T) for A in (M[q][:, q], C[q][:, q], stiff))
    places = sp.csr_array((np.ones(len(q)), (q, np.arange(len(q)))), (len(free), len(q)))
    basis = sp.csr_array(places @ T)
    return _with_mass(Matrices(mass, damping, stiffness, basis, wanted, state.model, numbers))


def _solved(inner: Any, column: sp.csr_array) -> sp.csc_array:
    """Solutions for sparse right-hand sides, a few at a time."""
    column, found = column.tocsc(), []
    for first in range(0, column.shape[1], 200):
        found.append(sp.csc_array(inner.solve(column[:, first : first + 200].toarray())))
    return sp.csc_array(sp.hstack(found, format="csc"))


def _with_mass(found: Matrices) -> Matrices:
    """Coordinates without inertia follow the others as in statics."""
    from dataclasses import replace

    sizes = abs(found.M).sum(axis=1)
    light = np.flatnonzero(sizes <= DEPENDENT**2 * sizes.max())
    if not len(light):
        return found
    heavy = np.setdiff1d(np.arange(found.size), light)
    if abs(found.C[light]).sum() > 0:
        raise SceneError(
            "matrices: dampers act on directors or coordinates without inertia; give them inertia "
            "(rotary_inertia=True, or a mass)"
        )
    follow = -spla.splu(found.K[light][:, light].tocsc()).solve(found.K[light][:, heavy].toarray())
    T = sp.lil_array((found.size, len(heavy)))
    T[heavy, np.arange(len(heavy))] = 1.0
    T[light] = follow
    T = sp.csr_array(T)
    M, C, K = (sp.csr_array(T.T @ A @ T) for A in (found.M, found.C, found.K))
    return replace(found, M=M, C=C, K=K, basis=sp.csr_array(found.basis @ T))


def null_space(rows: sp.csr_array) -> sp.csr_array:
    """An orthonormal basis of what violates no constraint, as columns.

    Args:
        rows: The constraints, shape (m, n). Those that share no unknown are looked at apart.
    """
    from scipy.sparse.csgraph import connected_components

    m, n = rows.shape
    graph = sp.block_array([[None, rows], [rows.T, None]], format="csr") if m else None
    tied = np.zeros(n, dtype=bool)
    tied[rows.indices[rows.data != 0]] = True
    parts: list[tuple[Ints, Floats]] = [(np.flatnonzero(~tied), np.zeros(0))]
    entries: list[tuple[Ints, Ints, Floats]] = []
    count = len(parts[0][0])
    entries.append((parts[0][0], np.arange(count), np.ones(count)))
    if graph is not None:
        _, labels = connected_components(graph, directed=False)
        order = np.argsort(labels[m:], kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(labels[m:][order])) + 1)
        by_label = {int(labels[m + g[0]]): g for g in groups if tied[g[0]]}
        row_order = np.argsort(labels[:m], kind="stable")
        row_groups = np.split(row_order, np.flatnonzero(np.diff(labels[:m][row_order])) + 1)
        for group in row_groups:
            columns = by_label.get(int(labels[group[0]]))
            if columns is None:
                continue
            _, sizes, V = np.linalg.svd(rows[group][:, columns].toarray())
            rank = int(np.sum(sizes > DEPENDENT * sizes[0]))
            basis = V[rank:].T
            places = count + np.arange(basis.shape[1])
            i, j = np.meshgrid(columns, places, indexing="ij")
            entries.append((i.ravel(), j.ravel(), basis.ravel()))
            count += basis.shape[1]
    i, j, v = (np.concatenate(part) for part in zip(*entries, strict=True))
    return sp.csr_array((v, (i, j)), shape=(n, count))


def _scipy(A: PETSc.Mat) -> sp.csr_array:
    ends, columns, entries = A.getValuesCSR()
    return sp.csr_array((entries, columns, ends), shape=A.getSize())
