"""Contact of points of one body with both faces of a shell, or of a shell with itself."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats, Ints
from shellmb.errors import SceneError
from shellmb.forms import contact
from shellmb.model.locations.ends import End
from shellmb.model.locations.nodes import said_point, shared_nodes
from shellmb.model.potentials.contact import TOUCHING
from shellmb.model.potentials.points import ActingPoints, Points
from shellmb.model.shell_contact.facets import Candidates, crossings, facets_of, find, nearest
from shellmb.model.shell_contact.mean_distance_slopes import Families, Places
from shellmb.model.shell_contact.uncovered_contact import Between
from shellmb.model.shells.shell import ShellModel
from shellmb.scene.loads.contacts import Contact
from shellmb.scene.lookup import said


class Law(NamedTuple):
    """Law of the penetrations of some points.

    Args:
        reach: Distance at which contact begins, m.
        stiffness: Stiffness of each point, shape (n,), N/m.
        item: Smoothing, damping and friction.
    """

    reach: float
    stiffness: Floats
    item: Contact

    def only(self, which: Ints) -> "Law":
        """Law of some of the points."""
        return self._replace(stiffness=self.stiffness[which])


def energy(e: Expr, stiffness: Expr, reach: Expr, smoothing: Expr) -> Expr:
    """Energy at a distance, as a part of the reach, shape (1,)."""
    return contact.energy(reach * (1 - e[0]), stiffness, smoothing)


# distances that are blended where a point is as near to several facets, of that at which it touches
BLEND = 1e-4
# in those, how much further than the nearest one facets have no weight: exp(-36) is round-off
FELT = 36.0
# distance along a shell within which it does not touch itself, of that at which it touches
BESIDE = 3.0
# parts of a triangle by which a way through it may miss its edge
BESIDE_EDGE = 1e-9


class Touching(NamedTuple):
    """Points that touch at one of some states, with all facets that they may feel.

    Args:
        law: Law of the points.
        families: Pairs of points and facets.
        places: Nearest places of all pairs at each state.
        point: Numbers of the points, shape (n,).
        nodes: Nodes of the facet of each pair, in the slots behind that of the point, (p, k - 1).
        vertices: Vertices of the facets as combinations of these, shape (p, 3, k - 1).
    """

    law: Law
    families: Families
    places: list[Places]
    point: Ints
    nodes: Ints
    vertices: Floats

    @property
    def distances(self) -> Floats:
        """Distances of the points at each state, shape (n, states), m."""
        found = [self.families.least(place.distance)[0] for place in self.places]
        return np.stack(found, axis=1)


class FacesContact:
    """Contact of the points of a body with the faces of a shell; all ranks know all of it.

    Args:
        item: Description.
        points: The points.
        body: The shell that has them; None: they are of a beam or a rigid body.
        shell: The shell that has the faces; may be the same one.
        length: Size of the scene, m.

    Attributes:
        y: Reference positions of the points, shape (n, 3), m.
        y_dofs: Global dofs of their displacements in the body's space, shape (n, 3).
        d: Reference directors of the points that matter, shape (n, directors, 3).
        d_dofs: Global dofs of their changes in the body's space, shape (n, directors, 3).
        arms: Components of the points' offsets from their nodes along directors, shape (n, k), m;
            k is zero where points are nodes.
        arm_dofs: Global dofs of the changes of these, shape (n, 3 k).
        whole: Reference positions of all points, also of those without a share of the area, m.
        whole_dofs: Global dofs of their displacements.
        whole_arms: Arms of these and their dofs.
        holder: Name of the body in the system that has the dofs.
        x: Reference positions of the shell's nodes, shape (m, 3), m.
        x_dofs: Global dofs of their displacements in the shell's space, shape (m, 3).
        law: Law of all points.
        between: What watches the bodies between their nodes.
        width: Distances that are blended, m.
        alone: Whether a shell touches itself.
    """

    def __init__(
        self,
        item: Contact,
        points: Points,
        body: ShellModel | None,
        shell: ShellModel,
        length: float,
    ) -> None:
        self.item, self.shell, self._length = item, shell.name, length
        self.body, self.holder = points.ends[0].owner, points.ends[0].body
        faces: Any = item.obstacle
        reach = item.radius + faces.thickness / 2
        # of triangles corners have no share of the area
        has = points.weights > TOUCHING * points.weights.max()
        ends = [end for end, some in zip(points.ends, has, strict=True) if some]
        self.y = np.array([end.point for end in ends])
        self.y_dofs = np.array([end.dofs["u"] for end in ends])
        # friction turns the points' surfaces, if these are not the points themselves
        turns = item.friction * item.radius > 0
        self.d = np.array([end.directors[: len(end.directors) * turns] for end in ends])
        self.d_dofs = np.array([end.dofs["w"] for end in ends]).reshape(len(ends), -1, 3)
        self.d_dofs = self.d_dofs[:, : self.d.shape[1]]
        self.arms, self.arm_dofs = _arms(ends)
        self.whole = np.array([end.point for end in points.ends])
        self.whole_dofs = np.array([end.dofs["u"] for end in points.ends])
        self.whole_arms = _arms(points.ends)
        nodes = shared_nodes(shell, None, said(item))
        self.x, self.x_dofs = nodes.x, nodes.dofs["u"]
        self.law = Law(reach, item.stiffness * points.weights[has], item)
        # and the distance from the nearest of all facets at which none of them is felt
        self.width, self.alone = BLEND * reach, self.body == self.shell
        self._far = reach + FELT * self.width
        self.facets = facets_of(shell, self.x_dofs[:, 0])
        own = None
        if item.at is None and body is not None and not self.alone:
            own = facets_of(body, self.whole_dofs[:, 0])
        apart = self._far_along()
        self._apart = None if apart is None else apart[has]
        self.between = Between(points.segments, self.facets, own, apart, reach)
        sides = self.x[self.facets.cells]
        sizes = np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=2)
        self.slack = max(reach, float(np.median(sizes)) / 2)
        if item.smoothing > reach / 2:
            raise SceneError(
                f"{said(item)}: smoothing is {item.smoothing:g}; it must be less than half of the "
                f"distance of mid-surfaces that touch, which is {reach:g}"
            )

    def _far_along(self) -> Bools | None:
        """Cells far enough along the shell to touch points of it, (n, cells); None: all."""
        if not self.alone:
            return None
        # loaded where a shell touches itself only
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import dijkstra

        cells, count = self.facets.cells, len(self.x)
        size = cells.shape[1]
        i, j = (
            cells[:, k].ravel() for k in (np.repeat(range(size), size), np.tile(range(size), size))
        )
        lengths = np.linalg.norm(self.x[i] - self.x[j], axis=1)
        differ = i != j
        pairs = np.unique(np.stack([i, j])[:, differ], axis=1, return_index=True)
        graph = csr_array((lengths[differ][pairs[1]], tuple(pairs[0])), shape=(count, count))
        number = {tuple(dofs): k for k, dofs in enumerate(self.x_dofs.tolist())}
        own = np.array([number[tuple(dofs)] for dofs in self.whole_dofs.tolist()])
        limit = BESIDE * self.law.reach
        ways = dijkstra(graph, directed=False, indices=own, limit=limit + lengths.max())
        within = ways[:, cells].min(axis=2) <= limit
        # nor its own element, nor one beside it
        touching = (cells[None] == own[:, None, None]).any(axis=2)
        has = np.zeros((len(cells), count), dtype=np.float32)
        np.put_along_axis(has, cells, 1.0, 1)
        nodes = touching.astype(np.float32) @ has > 0
        return ~(within | nodes[:, cells].any(axis=2))

    def candidates(self, y: Floats, x: Floats, slack: float = 0.0) -> Candidates:
        """Pairs that may touch until something has moved by half of a slack.

        Args:
            y: Positions of the points, m.
            x: Positions of the shell's nodes, m.
            slack: More than the usual slack, m.
        """
        far = self._far + FELT * self.width
        return find(self.facets, y, x, far, self.slack + slack, self._apart)

    def coupled(self, found: Candidates) -> Any:
        """Slots whose forces depend on each other: points, the shell's nodes, then directors."""
        # loaded where shells touch only
        from scipy.sparse import coo_array, csr_array

        cells = self.facets.cells[self.facets.cell[found.triangle]]
        n, ends = len(self.y), len(self.y) + len(self.x)
        slots = [n + cells.ravel(), found.point, ends + self.directors(found.point).ravel()]
        rows = [np.repeat(found.point, len(some) // max(1, len(found.point))) for some in slots]
        columns = np.concatenate(slots)
        shape = n, ends + self.d[:, :, 0].size
        has = coo_array((np.ones(len(columns)), (np.concatenate(rows), columns)), shape=shape)
        return csr_array(has.T.tocsr() @ has.tocsr())

    def directors(self, points: Ints) -> Ints:
        """Numbers of the directors of points among all, shape (m, directors)."""
        count = self.d.shape[1]
        return points[:, None] * count + np.arange(count)

    def touching(self, found: Candidates, states: list[tuple[Floats, Floats]]) -> Touching | None:
        """Points that touch at some of the states; None: there is none.

        Args:
            found: Pairs that may.
            states: Positions of points and nodes, m.
        """
        if not len(found.point):
            return None
        near = [nearest(y[found.point], self.facets.places(x, found.triangle)) for y, x in states]
        g = np.stack([some.distance for some in near])
        least = np.minimum.reduceat(g, found.first, axis=1)
        counts = np.diff(found.first, append=len(found.point))
        touches = np.repeat(least.min(axis=0) < self._far, counts)
        felt = (g < np.repeat(least, counts, axis=1) + FELT * self.width).any(axis=0)
        pairs = np.flatnonzero(touches & felt)
        if not len(pairs):
            return None
        point, first, owner = np.unique(found.point[pairs], return_index=True, return_inverse=True)
        triangle = found.triangle[pairs]
        nodes = self.facets.cells[self.facets.cell[triangle]]
        vertices = self.facets.vertices[triangle]
        places = []
        for (y, x), every in zip(states, near, strict=True):
            some = every.only(pairs)
            on = np.einsum("pk,pkj->pj", some.weights, vertices)
            weights = np.column_stack([np.ones(len(pairs)), -on])
            turns = np.concatenate([np.zeros((len(pairs), 2, 1)), -(some.turns @ vertices)], 2)
            here = y[point[owner]][:, None]
            slots = np.concatenate([here, x[nodes]], axis=1) - here
            places.append(Places(slots, weights, turns, some.inverse, some.distance))
        families = Families(owner, first, self.width)
        return Touching(self.law.only(point), families, places, point, nodes, vertices)

    def through(self, found: Candidates, a: Any, b: Any) -> int | None:
        """A point that crosses the shell on a straight path between two states, if any."""
        places = [(y[found.point], self.facets.places(x, found.triangle)) for y, x in (a, b)]
        y, v = zip(*places, strict=True)
        pairs, share = crossings(y, v)
        at = [part[pairs] for part in (*y, *v)]
        on = at[0] + share[:, None] * (at[1] - at[0])
        corners = at[2] + share[:, None, None] * (at[3] - at[2])
        sizes = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        # what is so near to an edge has passed through all of the thickness beside it
        near = nearest(on, corners).distance < BESIDE_EDGE * sizes + self.law.reach / 100
        return int(found.point[pairs][near][0]) if near.any() else None

    def check_start(self) -> None:
        """Refuse points that touch at the start.

        Raises:
            SceneError: If there are any.
        """
        touching = self.touching(self.candidates(self.y, self.x), [(self.y, self.x)])
        if touching is None:
            return
        of, (place,) = touching.families, touching.places
        # not blended: bodies may start as near as they may be
        depth = self.law.reach - np.minimum.reduceat(place.distance, of.first)
        inside = depth > TOUCHING * self._length
        if not inside.any():
            return
        worst = int(np.argmax(depth))
        x = self.y[touching.point[worst]]
        raise SceneError(
            f"{said(self.item)}: {int(inside.sum())} of {len(self.y)} points of '{self.body}' "
            f"start in '{self.shell}', the one at {said_point(x, self._length)} by "
            f"{depth[worst]:.3g} m; they must start at least {self.law.reach:g} m from its "
            "mid-surface, which is radius and half of the thickness"
        )


def _arms(ends: Sequence[End]) -> tuple[Floats, Ints]:
    """Offsets of points from their nodes along directors, and dofs of these; none at nodes."""
    count = len(ends[0].directors) if any(np.any(end.offset != 0) for end in ends) else 0
    arms = np.array([end.offset[:count] for end in ends])
    return arms, np.array([end.dofs["w"][: 3 * count] for end in ends])


def faces_contacts(
    points_of: ActingPoints, shells: Mapping[str, ShellModel], length: float
) -> list[FacesContact]:
    """All contacts with faces of shells; collective.

    Args:
        points_of: Finds where they act.
        shells: The shells.
        length: Size of the scene, m.

    Raises:
        SceneError: If there is no such place, or points touch at the start.
    """
    found, scene = [], points_of.scene
    for item in scene.contacts:
        faces: Any = item.obstacle
        if faces.deforms:
            (body,), shell = scene.bodies_of(item), shells[faces.shell]
            found.append(FacesContact(item, points_of(item), shells.get(body.name), shell, length))
            found[-1].check_start()
    return found
