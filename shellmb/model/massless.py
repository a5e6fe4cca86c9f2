"""Base of bodies at nodes of others, loads with the time factors of one stage, values of laws.

Parts of a body on a node mesh may be unknowns of other bodies: the paper's Boolean identification.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl import Form
from ufl.algorithms import expand_derivatives
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.forms.constraints.joints import Place
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import NodeMesh, constant_vector, node_mesh, node_space, set_constants
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import Body, LoadFactors, NodeLink, PartScale, TimeFunction, added
from shellmb.native.expressions import values_at_states


def timed_loads[T](
    domain: mesh.Mesh,
    loads: Sequence[tuple[TimeFunction | None, T]],
    work: Callable[[T, Expr, Expr], Form],
) -> LoadFactors:
    """Loads of a body, each multiplied by a factor that the scheme sets.

    Args:
        domain: Mesh of the body.
        loads: The loads, each with its function of time.
        work: Virtual work of a load for a factor of one, at a configuration in a direction.
    """
    factors = [fem.Constant(domain, 0.0) for _ in loads]
    # where they stand in memory: to set a constant by DOLFINx takes as long as a small body
    values = [np.asarray(factor.value) for factor in factors]

    def take(numbers: Floats) -> None:
        for value, number in zip(values, numbers, strict=True):
            value[...] = number

    def virtual_work(mid: Expr, dq: Expr) -> Form | None:
        return added(c * work(load, mid, dq) for c, (_, load) in zip(factors, loads, strict=True))

    return LoadFactors([time for time, _ in loads], take, virtual_work)


def node_loads(
    nodes: NodeMesh,
    values: Floats,
    times: Sequence[TimeFunction | None],
    work: Callable[[Expr, Expr, Expr], Expr],
) -> LoadFactors:
    """Loads at a node each, multiplied by factors that the scheme sets.

    Args:
        nodes: Their node mesh.
        values: The loads, shape (n, size).
        times: Their functions of time.
        work: Virtual work of loads at a configuration in a direction.
    """
    loads = constant_vector(nodes, 0 * values, "loads")
    return LoadFactors(
        times,
        lambda factors: set_constants(loads, nodes, factors[:, None] * values),
        lambda mid, dq: work(loads, mid, dq) * ufl.dx(nodes.mesh),
    )


class Scale(NamedTuple):
    """Communicator of a model, and the sizes that its constraints are relative to.

    Args:
        comm: Communicator.
        force: Size of forces, the unit of multipliers, N.
        length: Size of the scene, m.
    """

    comm: MPI.Comm
    force: float
    length: float

    @property
    def couple(self) -> float:
        """Size of moments, N m."""
        return self.force * self.length

    def of(
        self, count: int, directions: Collection[int]
    ) -> tuple[float | list[float], float | list[float]]:
        """Sizes of forces and of violations of constraints: one number where all are of a kind.

        The work of a multiplier of size one is the same for all of them.

        Args:
            count: Number of constraints.
            directions: Which hold directions; others hold positions.
        """
        sizes = [1.0 if k in directions else self.length for k in range(count)]
        if 0 < len(directions) < count:
            return [self.couple / size for size in sizes], sizes
        return self.couple / sizes[0], sizes[0]


# names of the bodies of some items, and global dofs there, one row for each
Targets = tuple[Sequence[str], Ints]
NONE: Mapping[str, Any] = MappingProxyType({})


class Places(Protocol):
    """Places of the items of a group, whose unknowns are those of bodies."""

    @property
    def targets(self) -> Mapping[str, Targets]:
        """Parts of the group's space with what they are of the bodies."""

    def bind(self, nodes: NodeMesh) -> None:
        """Take the group's node mesh, with one node for each place."""

    def place(self, q: Expr, layout: Layout) -> Place:
        """The places and their vectors at a state of the group."""


class NodeGroup(Body):
    """A body on a node mesh, with one node for each of its items.

    Args:
        name: Name in the system.
        comm: Communicator.
        count: Number of items.
        targets: Parts of its space that are unknowns of other bodies.
        own: Sizes of the parts that are its own, by name.
        places: Places of its items, with parts that are unknowns of other bodies, too.
        parts: Sizes of values, as of `Body`.
    """

    def __init__(
        self,
        name: str,
        comm: MPI.Comm,
        count: int,
        targets: Mapping[str, Targets] = NONE,
        own: Mapping[str, int] = NONE,
        places: Sequence[Places] = (),
        parts: tuple[PartScale, ...] = (),
    ) -> None:
        self.nodes = nodes = node_mesh(comm, count)
        wanted, self._at = dict(targets), places
        for place in places:
            wanted |= place.targets
            place.bind(nodes)
        sizes = {part: dofs.shape[1] for part, (_, dofs) in wanted.items()}
        mixed, links = node_space(nodes, {**sizes, **own}), []
        for part, (bodies, dofs) in wanted.items():
            rows = mixed.dofs[part].reshape(-1, sizes[part])
            owner, there = np.array(bodies)[nodes.item], dofs[nodes.item]
            # the same bodies on all ranks
            for body in dict.fromkeys(bodies):
                mine = owner == body
                links.append(NodeLink(rows[mine].ravel(), body, there[mine].ravel()))
        super().__init__(name, mixed, parts, tuple(links))
        self.layout, self.dx = Layout(mixed.parts), ufl.dx(nodes.mesh)

    def places(self, q: Expr) -> list[Place]:
        """Places of the items and their vectors at a state."""
        return [place.place(q, self.layout) for place in self._at]

    def place(self, q: Expr) -> Place:
        """The first of these places."""
        return self.places(q)[0]

    def per_item(self, values: Any, name: str) -> fem.Function:
        """A function with values of its own at each item, shape (n, ...)."""
        rows = np.array(values, dtype=float)
        return constant_vector(self.nodes, rows.reshape(len(rows), -1), name)

    def constant(self, value: float | Floats) -> fem.Constant:
        """A Constant on its mesh."""
        return fem.Constant(self.nodes.mesh, np.asarray(value, dtype=float))

    def gathered(self, part: str, values: Floats) -> Floats:
        """Values of a part of all items from a local array of a state, (n, size); collective."""
        size = self.mixed.parts[part][1]
        return gathered(self.nodes, values[self.mixed.dofs[part]].reshape(-1, size))

    def reader(self, value: Callable[[Expr, Expr], Expr]) -> Callable[[Floats, Floats], Floats]:
        """Make what finds a vector in all local items.

        Args:
            value: The vector by a state and velocities.

        Returns:
            Gives it, shape (local items, n), by local arrays of both.
        """
        q, v = (fem.Function(self.mixed.space) for _ in range(2))
        find = values_at_states(value(q, v), q)

        def read(state: Floats, velocity: Floats) -> Floats:
            v.x.array[:] = velocity
            return np.asarray(find(state[None])[0])

        return read

    def numbers(self, part: str) -> Ints:
        """Global dofs of a part in the order of the items, shape (n, size); collective."""
        return numbers_of(self.nodes, self.mixed, part)


def numbers_of(nodes: NodeMesh, mixed: MixedSpace, part: str) -> Ints:
    """Global dofs of a part of a space on a node mesh; as of `NodeGroup.numbers`."""
    own = mixed.dofs[part].reshape(-1, mixed.parts[part][1])
    return gathered(nodes, mixed.numbers(own))


def gathered[T: (Floats, Ints)](nodes: NodeMesh, local: T) -> T:
    """Values of all items from those of the local cells, shape (cells, ...); collective."""
    domain = nodes.mesh
    mine = domain.topology.index_map(1).size_local
    found = np.zeros((domain.topology.index_map(1).size_global, *local.shape[1:]), local.dtype)
    found[nodes.item[:mine]] = local[:mine]
    domain.comm.Allreduce(MPI.IN_PLACE, found)
    return found


class LawValues:
    """Evaluates a law at one state for each node of a mesh, and at more states in turns.

    Args:
        nodes: The nodes.
        law: Gives a scalar or vector in UFL, as a function of the states; parameters that differ
            from node to node are its own.
        sizes: Size of each of its arguments; those of force elements are coordinate, rate and time.
    """

    def __init__(
        self, nodes: NodeMesh, law: Callable[..., Expr], sizes: Sequence[int] = (1, 1, 1)
    ) -> None:
        self._nodes = nodes
        self._count = count = nodes.mesh.topology.index_map(1).size_global
        self._given = [
            constant_vector(nodes, np.zeros((count, n)), f"state {k}") for k, n in enumerate(sizes)
        ]
        # a derivative may be a plain number where what it is of is none
        value = expand_derivatives(ufl.as_ufl(law(*self._given)))
        if not ufl.domain.extract_domains(value):
            # a law may be a plain number, and an expression needs a mesh
            value = value + constant_vector(nodes, np.zeros((count, 1)), "nothing")
        value = value if value.ufl_shape else ufl.as_vector([value])
        self._size, self._find = len(value), values_at_states(value, self._given[0])

    def __call__(self, *states: Floats) -> Floats:
        """Values at states, shape (n,), of vectors (n, size); collective.

        Args:
            states: The arguments, each of shape (n,) or (n, size).
        """
        columns = [np.reshape(each, (len(each), -1)) for each in states]
        found = np.empty((len(columns[0]), self._size))
        for begin in range(0, len(found), self._count):
            # nodes that are left over repeat some states
            rows = np.resize(np.arange(begin, min(begin + self._count, len(found))), self._count)
            for function, values in zip(self._given, columns, strict=True):
                set_constants(function, self._nodes, values[rows])
            (local,) = self._find(self._given[0].x.array[None])
            found[begin : begin + self._count] = gathered(self._nodes, local)[: len(found) - begin]
        return found[:, 0] if self._size == 1 else found
