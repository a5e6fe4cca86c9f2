"""Mass, damping and stiffness of a scene as SciPy matrices, and its state space: `sm.matrices`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from shellmb.api.responding.reduction import Unknowns, lowest_modes
from shellmb.api.responding.system import LinearSystem, StateSpace
from shellmb.api.runs import refuse_ranks, requested
from shellmb.arrays import Floats, Ints, reals
from shellmb.errors import SceneError
from shellmb.options.described import checks, options_of, takes
from shellmb.options.run import ELEMENTS, Options
from shellmb.scene import Scene
from shellmb.scene.values.validate import said, show

if TYPE_CHECKING:
    from shellmb.model.model import Model
    from shellmb.scene.types import Vec3

# of the scene's length: a node is at a point that is as near as this
SAME = 1e-9


@checks
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
        branches: What relaxes: stiffness of Maxwell branches by relaxation time [s]. At the angular
            frequency `w` the sum of `i w tau/(1 + i w tau) branches[tau]` is added to `K`.
    """

    M: sp.csr_array
    C: sp.csr_array
    K: sp.csr_array
    basis: sp.csr_array
    scene: Scene
    _model: Model
    _numbers: dict[str, Ints]
    branches: dict[float, sp.csr_array]

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.K.shape[0])

    def row(self, point: Vec3, component: Vec3 | int = 2, body: str | None = None) -> Floats:
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
        target = self.scene.body(body, who)
        own, nodes, X, D = self._model.nodes_of(target.name)
        axis = np.eye(3)[component] if isinstance(component, int) else np.asarray(component)
        place = np.asarray(point)
        away = np.linalg.norm(X - place, axis=1)
        node = int(np.argmin(away))
        numbers = self._numbers[own.name]
        rows = own.mixed.dofs["u"].reshape(-1, 3)[nodes[node]]
        found = axis @ self.basis[numbers[rows]].toarray()
        if D.shape[1] == 3 and own is self._model.rigid:
            # a point of a rigid body moves with its directors
            arms = D[node] @ (place - X[node])
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
        return lowest_modes(self.K, self.M, count)

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
        F, Y = self._rows("inputs", inputs).T, self._rows("outputs", outputs)
        # nothing acts by derivatives or on branches, and no output is direct
        more, direct = 2 + len(self.branches), np.zeros((len(Y), F.shape[1]))
        forces, rows = ((of, *(np.zeros_like(of),) * more) for of in (F, Y))
        orders = forces, rows, (direct,) * (1 + more), np.zeros((2, *direct.shape))
        outs, ins = (tuple(map(str, range(n))) for n in direct.shape)
        of = self.M, self.C, self.K, *orders, ins, outs
        made = LinearSystem(*of, times=tuple(self.branches), branches=tuple(self.branches.values()))
        return made.state_space(modes)

    def _rows(self, name: str, given: Any) -> Floats:
        try:
            found = np.atleast_2d(np.eye(self.size) if given is None else reals(given))
        except (OverflowError, TypeError, ValueError):
            raise SceneError(f"matrices: {name} are {show(given)}; they must be rows") from None
        if found.shape[1:] != (self.size,):
            raise SceneError(
                f"matrices: {name} have {found.shape[1]} columns; they must have {self.size}, one "
                "for each coordinate"
            )
        return found


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
    from shellmb.running.rotating.linearised import SteadyRotation

    refuse_ranks("matrices")
    wanted = requested(scene, parameters, **elements).scene
    state = SteadyRotation(wanted, Axis((0.0, 0.0, 1.0)), MPI.COMM_SELF, loaded)
    state.go(0.0)
    branches = state.branches()
    found = Unknowns(state, (*state.matrices(), *branches.values())).free()
    names = {body.name: k for k, body in enumerate(state.model.bodies)}
    numbers = {name: state.system.numbering.by_field[k] for name, k in names.items()}
    K, C, M, *own = found.A
    relaxing = dict(zip(branches, own, strict=True))
    return Matrices(M, C, K, found.basis, wanted, state.model, numbers, relaxing)
