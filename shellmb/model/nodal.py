"""Bodies that act on single nodes: kinks, planes that are not axis-parallel, point loads."""

from collections.abc import Callable
from functools import cached_property

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.build.nodes import NodeMesh, constant_vector, node_mesh, node_space, set_constants
from shellmb.forms import nodal as nodal_forms
from shellmb.forms.discrete import variation
from shellmb.forms.loads import dead_force
from shellmb.forms.mixed import Interval
from shellmb.forms.state import Layout
from shellmb.kernels import JIT_OPTIONS
from shellmb.model.body import LoadFactors, Massless, NodeLink, PartScale, TimeFunction

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


def node_links(
    nodes: NodeMesh, mixed_dofs: npt.NDArray[np.int32], body: str, targets: Ints
) -> NodeLink:
    """Link of a part of a node mesh to nodal dofs of a shell.

    Args:
        nodes: The node mesh.
        mixed_dofs: Local dofs of the part, node after node.
        body: Name of the shell.
        targets: Global dofs in the shell's space, one row per node, shape (n, size).
    """
    return NodeLink(mixed_dofs, body, targets[nodes.item].ravel())


class NodalConstraint(Massless):
    """One scalar constraint at each of a list of nodes, with its multiplier.

    Args:
        name: Name of the constraint.
        comm: Communicator.
        parts: Name of each nodal vector to (shell, global dofs of shape (n, 3), reference values
        (n, 3)).
        constraint: Function of the nodal vectors and of the data, a scalar.
        data: Values that the constraint needs at each node, shape (n, m).
        scale: Size of the multiplier's force, N.
    """

    def __init__(
        self,
        name: str,
        comm: MPI.Comm,
        parts: dict[str, tuple[str, Ints, Floats]],
        constraint: Callable[[dict[str, Expr], Expr], Expr],
        data: Floats,
        scale: float,
    ) -> None:
        nodes = node_mesh(comm, len(data))
        mixed = node_space(nodes, {**dict.fromkeys(parts, 3), "mu": 1})
        links = tuple(
            node_links(nodes, mixed.dofs[part], shell, dofs)
            for part, (shell, dofs, _) in parts.items()
        )
        title = PartScale("mu", f"multiplier of {name}", 1e-3, "a smaller step")
        super().__init__(name, mixed, (title,), links)
        self._layout = Layout(mixed.parts)
        self._reference = {
            part: constant_vector(nodes, values, part) for part, (_, _, values) in parts.items()
        }
        self._constraint = constraint
        self._data = constant_vector(nodes, data, "data")
        self._scale = fem.Constant(nodes.mesh, float(scale))

    def _violation(self, q: Expr) -> Expr:
        values = {p: r + self._layout.part(q, p) for p, r in self._reference.items()}
        return self._constraint(values, self._data)

    def internal(self, span: Interval, dq: Expr) -> Form:
        """Constraint at the end of the sub-interval, its force along the mid-point gradient."""
        mu = self._scale * self._layout.part(span.unknown, "mu")
        dmu = self._scale * self._layout.part(dq, "mu")
        gradient = variation(self._violation, span.mid, dq)
        return (mu * gradient + dmu * self._violation(span.at)) * ufl.dx

    @cached_property
    def _evaluation(self) -> tuple[fem.Function, fem.Expression, fem.Function]:
        """A state, the violation there as an expression, and a function for its values."""
        state = fem.Function(self.mixed.space)
        values = fem.Function(fem.functionspace(self.mixed.space.mesh, ("DG", 0)))
        points = values.function_space.element.interpolation_points
        violation = fem.Expression(self._violation(state), points, jit_options=JIT_OPTIONS)
        return state, violation, values

    def constraint_error(self, q: fem.Function) -> float:
        """Largest violation of the constraint on this rank."""
        state, violation, values = self._evaluation
        state.x.array[:] = q.x.array
        values.interpolate(violation)
        return float(np.max(np.abs(values.x.array), initial=0.0))


def kink(
    name: str,
    comm: MPI.Comm,
    first: tuple[str, Ints, Floats],
    second: tuple[str, Ints, Floats],
    scale: float,
) -> NodalConstraint:
    """The angle between the directors of two shells is locked at each node of their common edge."""
    angle = np.sum(first[2] * second[2], axis=1, keepdims=True)
    return NodalConstraint(
        name,
        comm,
        {"d1": first, "d2": second},
        lambda q, data: nodal_forms.locked_kink(q["d1"], q["d2"], data),
        angle,
        scale,
    )


def plane(
    name: str, comm: MPI.Comm, vector: tuple[str, Ints, Floats], normals: Floats, scale: float
) -> NodalConstraint:
    """A nodal vector (a change from the reference) stays in the plane with the given normal."""
    shell, dofs, _ = vector
    return NodalConstraint(
        name,
        comm,
        {"q": (shell, dofs, np.zeros((len(normals), 3)))},
        lambda q, data: nodal_forms.in_plane(q["q"], data),
        normals,
        scale,
    )


class _PointFactors:
    """Point loads with the time factors of one stage."""

    def __init__(self, body: "PointLoads") -> None:
        self._body = body
        self._force = constant_vector(body.nodes, np.zeros((len(body.forces), 3)), "force")

    def update(self, average: Callable[[TimeFunction | None], float]) -> None:
        """Set the forces from the loads' time functions."""
        factors = np.array([average(time) for time in self._body.times])
        set_constants(self._force, self._body.nodes, factors[:, None] * self._body.forces)

    def virtual_work(self, mid: Expr, dq: Expr) -> Form | None:
        """Virtual work of the forces."""
        return dead_force(self._force, self._body.layout.part(dq, "u")) * ufl.dx


class PointLoads(Massless):
    """Dead forces at nodes of shells.

    Args:
        comm: Communicator.
        targets: For each force the shell's name and the global dofs of the displacement, shape
        (3,).
        forces: The forces, shape (n, 3), N.
        times: Their time functions.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        targets: list[tuple[str, Ints]],
        forces: Floats,
        times: list[TimeFunction | None],
    ) -> None:
        self.nodes = node_mesh(comm, len(forces))
        mixed = node_space(self.nodes, {"u": 3})
        rows = mixed.dofs["u"].reshape(-1, 3)
        links = []
        for shell in dict.fromkeys(name for name, _ in targets):
            here = np.array([targets[item][0] == shell for item in self.nodes.item], dtype=bool)
            place = [targets[item][1] for item in self.nodes.item[here]]
            dofs = np.concatenate([*place, np.zeros(0, dtype=np.int64)])
            links.append(NodeLink(rows[here].ravel(), shell, dofs))
        super().__init__("point loads", mixed, (), tuple(links))
        self.layout = Layout(mixed.parts)
        self.forces, self.times = forces, times

    def loads(self) -> LoadFactors | None:
        """The forces with factors of their own."""
        return _PointFactors(self)
