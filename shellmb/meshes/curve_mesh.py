"""The mesh of one beam: a line of intervals in space with a frame of directors at every node."""

from dataclasses import dataclass
from typing import ClassVar

from mpi4py import MPI

import basix
import basix.ufl
import dolfinx.mesh
import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.raw import check_extent, interval_nodes
from shellmb.meshes.shared import line_mesh
from shellmb.scene.beams.beam import Beam
from shellmb.scene.beams.curves import Curve
from shellmb.scene.values.validate import refused, said, unit_vector

# cosine of the angle to the tangent beyond which a direction has no useful projection across it
NEARLY_TANGENT = 0.95
ALMOST_TANGENT = 1 - 1e-9
# intervals along a curve in which directors are transported, at least
TRANSPORT = 256


@dataclass(frozen=True)
class LineMesh:
    """A meshed reference line.

    The nodes of a beam of degree k are counted along the line: the start of element e is node k e.

    Args:
        name: Name of the beam.
        mesh: Mesh with tdim 1 and gdim 3, its elements from the start of the line to its end.
        points: Position of each named point, shape (3,) [m].
        length: Arc length [m].
        triads: Reference directors D1, D2, D3 (one after the other) of every node, the same on
            every rank, shape (n, 9).
        degree: Degree k of the beam.
    """

    name: str
    mesh: dolfinx.mesh.Mesh
    points: dict[str, Floats]
    length: float
    triads: Floats
    degree: int

    kind: ClassVar[str] = "beam"

    def numbers(self, space: fem.FunctionSpace) -> Ints:
        """Number along the line of each local node (owned and ghost) of a space.

        Args:
            space: Lagrange space of the beam's degree on `mesh`, of any shape.
        """
        index = space.dofmap.index_map
        numbers = np.zeros(index.size_local + index.num_ghosts, dtype=np.int64)
        place = np.argsort(np.argsort(space.element.interpolation_points[:, 0]))
        cells = np.asarray(self.mesh.topology.original_cell_index, dtype=np.int64)
        along = self.degree * cells[:, None] + place
        numbers[space.dofmap.list[: len(cells)]] = along % len(self.triads)
        return numbers

    def frames(self, space: fem.FunctionSpace) -> fem.Function:
        """Reference directors as a function.

        Args:
            space: Lagrange space of the beam's degree with nine components.
        """
        function = fem.Function(space, name="D")
        function.x.array[:] = self.triads[self.numbers(space)].ravel()
        return function


def build_line(beam: Beam, comm: MPI.Comm) -> LineMesh:
    """Mesh the curve of a beam with elements of equal length in its parameter.

    At every node D1 is the unit tangent and D3 the projection of `up` across it, D2 = D3 x D1.
    Without `up`, D3 begins as the projection of the z axis (where that is nearly tangent, of the
    axis that is the least so) and is carried along the curve without turning about it.

    Args:
        beam: The beam, whose curve is not along a shell.
        comm: Communicator of the mesh; the call is collective.

    Raises:
        SceneError: If `up` is tangent somewhere.
    """
    curve, degree, closed = beam.curve, beam.degree, beam.curve.closed
    # of lower order, or through other nodes, the geometry would bound the error: the length of an
    # element is right to the order 2 k with these
    order = 1 if curve.straight else degree
    ends = np.arange(beam.elements)[:, None]
    xi = np.append(((ends + interval_nodes(degree)[:-1]) / beam.elements).ravel(), 1.0)
    x = curve.position(xi if order == degree else np.linspace(0, 1, beam.elements + 1)).T
    check_extent(np.abs(np.diff(x, axis=0)).max(axis=1), "m", said(beam))
    tangents = _unit(curve.tangent(xi).T)
    if beam.up is None:
        third = _transported(curve, xi, tangents)
    else:
        third = np.tile(unit_vector(beam.up, said(beam)), (len(xi), 1))
        steep = np.abs(np.sum(third * tangents, axis=1))
        if np.max(steep) > ALMOST_TANGENT:
            where = ", ".join(f"{c:g}" for c in curve.position(xi[[np.argmax(steep)]])[:, 0])
            right = f"it is tangent to the curve at ({where}) and must point across it everywhere"
            raise refused(beam, "up", right)
    second = _unit(np.cross(third, tangents))
    triads = np.hstack([tangents, second, np.cross(tangents, second)])
    points = {key: np.asarray(value, dtype=float) for key, value in curve.points.items()}
    keep = len(xi) - closed
    return _line_mesh(beam.name, comm, x, order, closed, points, triads[:keep], degree)


def line_mesh_from_nodes(
    name: str,
    comm: MPI.Comm,
    x: Floats,
    order: int,
    third: Floats,
    degree: int,
    closed: bool = False,
) -> LineMesh:
    """Mesh a line of given nodes, along a shell.

    Third directors are kept as they are, so that they may be the shell's own; first directors are
    the tangents' projections across them.

    Args:
        name: Name of the beam.
        comm: Communicator of the mesh; the call is collective, with the same arguments everywhere.
        x: Nodes of the geometry in the order of the line, the last of a closed line not being the
            first again, shape (order * elements + 1 (closed: 0), 3) [m].
        order: Order of the geometry.
        third: Unit third directors at the nodes of the beam in the order of the line, shape
            (degree * elements + 1 (closed: 0), 3).
        degree: Degree of the beam.
        closed: Whether the line is closed.

    Raises:
        SceneError: If a third director is tangent to the line.
    """
    if closed:
        x = np.vstack([x, x[:1]])
    # the mean of the two elements that meet at a node
    directions, sums = _unit(_slopes(x, order, interval_nodes(degree))), np.zeros(third.shape)
    np.add.at(sums, _along(len(directions), degree) % len(third), directions)
    tangents = _unit(sums)
    steep = np.sum(tangents * third, axis=1, keepdims=True)
    if np.max(np.abs(steep)) > ALMOST_TANGENT:
        raise SceneError(
            f"beam '{name}': the shell's director is tangent to the line somewhere; "
            "the beam must run along the shell"
        )
    first = _unit(tangents - steep * third)
    triads = np.hstack([first, np.cross(third, first), third])
    points = {"start": x[0], "end": x[-1]}
    return _line_mesh(name, comm, x, order, closed, points, triads, degree)


def _line_mesh(
    name: str,
    comm: MPI.Comm,
    x: Floats,
    order: int,
    closed: bool,
    points: dict[str, Floats],
    triads: Floats,
    degree: int,
) -> LineMesh:
    """Elements shared out over the ranks in the order of the line; some ranks may get none."""
    cells = _along((len(x) - 1) // order, order)[:, [0, order, *range(1, order)]]
    s, weights = np.polynomial.legendre.leggauss(4)
    sizes = np.linalg.norm(_slopes(x, order, (1 + s) / 2), axis=2)
    length = float(np.sum(sizes @ weights) / 2)
    if closed:
        x = x[:-1]
        cells %= len(x)
    variant = basix.LagrangeVariant.gll_warped
    element = basix.ufl.element("P", "interval", order, lagrange_variant=variant, shape=(3,))
    mesh = line_mesh(comm, element, cells, x)
    mesh.topology.create_connectivity(0, 1)
    return LineMesh(name, mesh, points, length, triads, degree)


def _along(elements: int, order: int) -> Ints:
    """Nodes of the elements of a line by their numbers along it, shape (elements, order + 1)."""
    return np.asarray(order * np.arange(elements)[:, None] + np.arange(order + 1))


def _slopes(x: Floats, order: int, s: Floats) -> Floats:
    """Derivatives of the position in each element at places `s` on [0, 1], (elements, n, 3)."""
    powers = np.linalg.inv(np.vander(interval_nodes(order), increasing=True))
    shapes = np.stack([j * s ** (j - 1) for j in range(1, order + 1)], axis=1) @ powers[1:]
    return np.einsum("ja,eai->eji", shapes, x[_along((len(x) - 1) // order, order)])


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _transported(curve: Curve, xi: Floats, tangents: Floats) -> Floats:
    """Directions across the tangents that do not turn about them along the way, shape (n, 3).

    By double reflection, of fourth order (W. Wang et al., ACM Trans. Graph. 27 (2008) 2:1-18).
    """
    t0 = tangents[0]
    steep = np.abs(t0)
    axis = 2 if steep[2] < NEARLY_TANGENT else int(np.argmin(steep))
    r = np.eye(3)[axis]
    r = _unit(r - (r @ t0) * t0)
    pieces = -(-TRANSPORT // (len(xi) - 1))
    fine = np.append(
        (xi[:-1, None] + np.diff(xi)[:, None] * np.arange(pieces) / pieces).ravel(), xi[-1]
    )
    x, t = curve.position(fine).T, curve.tangent(fine).T
    found = [r]
    for k in range(len(fine) - 1):
        chord = x[k + 1] - x[k]
        r, along = _reflected(chord, r), _reflected(chord, t[k])
        # on a straight piece the second reflection has nothing to do
        rest = t[k + 1] - along
        r = _reflected(rest, r) if rest @ rest > 1e-30 else r
        found.append(r)
    third = np.array(found[::pieces])
    if curve.closed:
        # what the way round turns it by is taken back evenly
        end = third[-1]
        angle = np.arctan2(np.cross(third[0], end) @ t0, third[0] @ end)
        back = -angle * np.arange(len(third)) / (len(third) - 1)
        across = np.cross(tangents, third)
        third = np.cos(back)[:, None] * third + np.sin(back)[:, None] * across
    return third


def _reflected(normal: Floats, v: Floats) -> Floats:
    """Mirror image of `v` in the plane with the given normal."""
    return np.asarray(v - 2 * (normal @ v) / (normal @ normal) * normal)
