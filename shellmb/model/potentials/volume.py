"""Volumes that shells enclose: cones over their surfaces, and what fills them, as bodies.

One multiplier, the pressure, holds the sum of the cones over all surfaces at the volume of what
fills them, which is an unknown of its own: its relative change has the energy of a gas, or is
given. So the work on the shells is what the filling loses, in every scheme, and the matrix has one
full row and column instead of a full block. Schemes that keep the angular momentum have six more:
the rotation of the shells in a step, and the couple that keeps their forces free of a moment.
"""

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

from mpi4py import MPI

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.forms.constraints import volume as forms
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import gradient
from shellmb.meshes.spaces import mixed_space
from shellmb.model.body import Body, Elastic, FixedDofs, NodeLink, PartScale, same_everywhere
from shellmb.model.locations.nodes import said_point
from shellmb.model.massless import LawValues, NodeGroup, Scale
from shellmb.model.multipliers import Constraints
from shellmb.model.sections.strains import ExactEnergy
from shellmb.model.shells.shell import ShellModel
from shellmb.model.supports.prescribed import Prescribed
from shellmb.native.kernels import assembled, compiled
from shellmb.scene import Scene
from shellmb.scene.loads.contacts import EnclosedVolume
from shellmb.scene.lookup import said
from shellmb.scene.schemes import SCHEMES, Traits
from shellmb.scene.values.user_functions import numbers_at

# part of the scene's size within which nodes of several shells are one
TOGETHER = 1e-7
# areas at a free node relative to that of the whole: far above round-off, far below an element's
OPEN = 1e-9
# sine of the angle of directions that count as one
ALIKE = 1e-6
# shells of one volume: all combinations of their sides are tried
MOST = 16


class ReferenceCones:
    """Cones over a shell in the reference configuration.

    Args:
        item: Description of the volume.
        shell: The shell.

    Attributes:
        rule: A rule that is exact for them, so that what is inside a closed surface vanishes.
    """

    def __init__(self, item: EnclosedVolume, shell: ShellModel) -> None:
        self._shell, domain = shell, shell.mixed.space.mesh
        # a product of places and both of their slopes; up to degree 2 the rule of loads is exact
        degree, self.rule = shell.shell.degree, shell.rules.full
        if degree > 2:
            metadata = {"quadrature_degree": 3 * degree - 1}
            self.rule = ufl.Measure("dx", domain, metadata=metadata)
        origin = fem.Constant(domain, np.array(item.origin, dtype=float))
        self.from_origin: Expr = ufl.SpatialCoordinate(domain) - origin
        self._patch = forms.Patch(self.from_origin, shell.surface.e1, shell.surface.e2)

    def volume(self) -> float:
        """Volume of the cones, positive where the director points away from the origin, m^3."""
        form = compiled(forms.cone(self._patch) * self.rule)
        return float(self._shell.mixed.space.mesh.comm.allreduce(fem.assemble_scalar(form)))

    def lids(self) -> tuple[Floats, Floats]:
        """Change of the volume with displacements of owned nodes, less what a pressure does.

        Inside the surface there is nothing of it; at its edges, that of the lids.

        Returns:
            Places (n, 3), m, and derivatives (n, 3), m^2.
        """
        space = self._shell.mixed.subspaces["u"]
        test, surf = ufl.TestFunction(space), self._shell.surface
        work = ufl.dot(ufl.cross(surf.e1, surf.e2), test)
        form = (forms.slope(self._patch, forms.patch(test, surf)) - work) * self.rule
        count = space.dofmap.index_map.size_local
        X = space.tabulate_dof_coordinates()[:count]
        return X, assembled(form).reshape(-1, 3)[:count]


def sides_of(
    item: EnclosedVolume,
    shells: Sequence[ShellModel],
    lids: Sequence[tuple[Floats, Floats]],
    prescribed: Prescribed,
    length: float,
) -> tuple[Floats, Floats]:
    """Sides of the shells on which the volume is, one or minus one; collective.

    With them what is left of the lids at edges that may move is zero.

    Args:
        item: Description of the volume.
        shells: The shells.
        lids: Of each as from `ReferenceCones.lids`.
        prescribed: What supports hold.
        length: Size of the scene, m.

    Returns:
        The sides, and normals of lids (n, 3).

    Raises:
        SceneError: If there are none such; names the place.
    """
    # loaded where there are volumes only
    from scipy.spatial import cKDTree

    comm, names = shells[0].mixed.space.mesh.comm, said(item)
    if len(shells) > MOST:
        raise SceneError(f"{names}: {len(shells)} shells; they must be {MOST} at most")
    least = OPEN * length**2
    rows = [_free(s, *lid, prescribed, least) for s, lid in zip(shells, lids, strict=True)]
    every = [np.concatenate(comm.allgather(row)) for row in rows]
    of = np.repeat(np.arange(len(every)), [len(row) for row in every])
    X, free, whole, pinned = np.hsplit(np.concatenate(every), (3, 6, 9))
    if not len(X):
        return np.ones(len(shells)), X
    # nodes that several shells share are one
    groups: Ints = np.arange(len(X))
    for a, b in sorted(cKDTree(X).query_pairs(TOGETHER * length)):
        groups[b] = groups[a] = min(groups[a], groups[b])
    open_at, lids_at = np.zeros((2, len(X), len(shells), 3))
    np.add.at(open_at, (groups, of), free)
    np.add.at(lids_at, (groups, of), whole)
    # where shells meet, what one has the other takes, also where nothing moves
    meet = (np.linalg.norm(lids_at, axis=2) > 0).sum(axis=1) > 1
    seen = np.where(meet[:, None, None], lids_at, open_at)
    gram = np.einsum("nik,njk->ij", seen, seen)
    signs = np.array(
        min(
            ((1.0, *more) for more in itertools.product((1.0, -1.0), repeat=len(shells) - 1)),
            key=lambda s: float(np.array(s) @ gram @ np.array(s)),
        )
    )
    left = np.linalg.norm(np.einsum("nik,i->nk", open_at, signs), axis=1)
    worst = int(np.argmax(left))
    if left[worst] > least:
        raise SceneError(
            f"{names}: it is open at {said_point(X[worst], length)}; every edge must be joined "
            f"to another shell of the volume, or be fixed in a plane through origin {item.origin} "
            "as SymmetryPlane and Clamped do"
        )
    full = np.einsum("nik,i->nk", lids_at, signs)
    sizes = np.linalg.norm(full, axis=1)
    closed = sizes > least
    still = (pinned[groups, 0] > 0) & closed
    # along the normal of a plane through the origin where there is one
    if differ(full[still] / sizes[still, None]):
        raise SceneError(
            f"{names}: edges that do not move are in no common plane through origin {item.origin}, "
            f"as at {said_point(X[still][0], length)}, and the volume under their lids is not "
            "known; give such an origin, close the shell by a shell, or use a plane of symmetry"
        )
    return signs, full[closed] / sizes[closed, None]


def differ(directions: Floats) -> bool:
    """Say whether directions (n, 3) are of more than one line."""
    return bool(np.any(np.abs(np.cross(directions, directions[:1])) > ALIKE))


def _free(
    shell: ShellModel, X: Floats, lids: Floats, prescribed: Prescribed, least: float
) -> Floats:
    """Shares of lids at owned nodes: along directions that nothing holds, and in all.

    Args:
        shell: The shell.
        X: Places of its owned nodes, m.
        lids: What is at them, m^2.
        prescribed: What supports hold.
        least: What counts as none, m^2.

    Returns:
        Of each node with some of it the place (3), the former (3), the latter (3), and one where
        nothing moves, shape (n, 10).
    """
    some = np.flatnonzero(np.linalg.norm(lids, axis=1) > least).astype(np.int32)
    left, pinned = lids[some], np.zeros(len(some), dtype=bool)
    for k, dofs in enumerate(shell.mixed.nodal("u")[some]):
        held, _ = prescribed.held(shell.name, shell.mixed.numbers(dofs))
        left[k] -= held.T @ (held @ left[k])
        pinned[k] = len(held) == len(dofs)
    return np.hstack([X[some], left, lids[some], pinned[:, None]])


ADVICE = "a smaller step"
# pressure, relative to its size, below which it counts as zero
SMALL_PRESSURE = 1e-3
# change of a volume in a step, relative to the first volume, below which Gauss points lose nothing
# of a gas: their error is the eighth power of half of it over the volume, times 3e-2
SMOOTH = 1e-3
# a volume below this part of that of a cube as long as the shells is none
FLAT = 1e-9
# parts that a volume has where its force has no moment, and how many components they have
MOMENT_FREE = {"rotation": 3, "couple": 3}


class Filling(NodeGroup):
    """Content of a volume: its relative change `v`, and the multiplier that is the pressure.

    Where forces have no moment, it has the parts of `MOMENT_FREE`, too.

    Args:
        item: Description.
        comm: Communicator.
        volume: In the reference configuration, m^3.
        pressure: Size of pressures, Pa.
        moment_free: Whether forces on the shells have no moment.

    Attributes:
        resists: False, as of potentials.
        surfaces: What encloses it.
        held: Sizes of the parts that it has in common with these.
    """

    resists = False
    surfaces: Sequence["Enclosing"] = ()

    def __init__(
        self,
        item: EnclosedVolume,
        comm: MPI.Comm,
        volume: float,
        pressure: float,
        moment_free: bool,
    ) -> None:
        self.item, self.volume, self.moment_free = item, volume, moment_free
        who = said(item)
        self.held = {"mu": 1} | (MOMENT_FREE if moment_free else {})
        parts = PartScale("v", f"volume of {who}", 1.0, ADVICE), *_scales(who, self.held)
        super().__init__(f"{who}: filling", comm, 1, own={"v": 1, **self.held}, parts=parts)
        self.kinematic, self.jump_parts = frozenset({"v"}), frozenset({"v", "mu"})
        self.pressure, self._size = self.constant(pressure), self.constant(volume)
        if item.gas is None:
            change, whose = item.change, f"{who}: change"
            given = None if change is None else lambda t: numbers_at(change(t), t, whose)
            self.fixed.append(FixedDofs(self.mixed.dofs["v"], given))

    def _change(self, q: Expr) -> Expr:
        return ufl.as_vector([self.layout.part(q, "v")])

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """The energy of a gas."""
        if self._stored is None:
            return ()
        return (ExactEnergy(self._change, self._stored, self._size, self.dx, smooth=SMOOTH),)

    @cached_property
    def _stored(self) -> Callable[[Any], Expr] | None:
        """Energy of a gas over the volume, as a function of the change of the volume."""
        gas = self.item.gas
        if gas is None:
            return None
        pressure, outside = self.constant(gas.pressure), self.constant(gas.outside)
        n = None if gas.exponent == 1 else self.constant(gas.exponent - 1)
        return lambda e: forms.gas_energy(e[0], pressure, n, outside)

    @cached_property
    def _pressure(self) -> LawValues | None:
        """Pressure of a gas over that outside, which is the slope of its energy; collective."""
        stored = self._stored
        if stored is None:
            return None
        return LawValues(self.nodes, lambda v: -gradient(lambda x: stored([x]), v), (1,))

    @property
    def constraints(self) -> tuple[Constraints, ...]:
        """The volume of the filling, of which the surfaces take theirs."""

        def content(q: Expr) -> Expr:
            return ufl.as_vector([self._size * (1 + self.layout.part(q, "v"))])

        return (_held(self, forms.Content(content), self.pressure, self.dx),)

    def values(self, q: Floats, multipliers: Floats) -> tuple[float, float]:
        """Volume, m^3, and pressure over that outside, Pa; collective.

        Args:
            q: Local array of a state.
            multipliers: That of the step that led there: a given volume has a mean pressure.
        """
        found = np.append(self.gathered("v", q), self.gathered("mu", multipliers))
        if self._pressure is None:
            pressure = float(self.pressure.value) * found[1]
        else:
            pressure = float(self._pressure(found[:1])[0])
        return float(self.volume * (1 + found[0])), pressure


class Enclosing(Body):
    """The surface of one shell as a part of what encloses a volume.

    It is on the shell's own mesh, with the shell's displacements, and a pressure that is the same
    on all cells.

    Args:
        item: Description.
        shell: The shell.
        sign: One where its director points outwards, or minus one.
        filling: What fills the volume.
    """

    def __init__(
        self, item: EnclosedVolume, shell: ShellModel, sign: float, filling: Filling
    ) -> None:
        self._cones = ReferenceCones(item, shell)
        domain, cell = shell.mixed.space.mesh, shell.mixed.space.mesh.basix_cell()
        nodal = shell.mixed.subspaces["u"].ufl_element()
        elements = {
            part: basix.ufl.element("DG", cell, 0, shape=(size,) if size > 1 else ())
            for part, size in filling.held.items()
        }
        mixed = mixed_space(domain, {"u": nodal} | elements, frozenset())
        who = said(item)
        links = [_displacements(mixed, shell)]
        for part in filling.held:
            links.append(same_everywhere(mixed, part, filling.name, filling.numbers(part)[0]))
        parts = _scales(who, filling.held)
        super().__init__(f"{who}: surface '{shell.name}'", mixed, parts, tuple(links))
        self.kinematic, self.jump_parts = frozenset({"u"}), frozenset({"mu"})
        self._layout, self._shell, self._sign = Layout(mixed.parts), shell, sign
        self._pressure = fem.Constant(domain, float(filling.pressure.value))
        self._length = (
            fem.Constant(domain, np.cbrt(filling.volume)) if filling.moment_free else None
        )

    @property
    def constraints(self) -> tuple[Constraints, ...]:
        """Less the volume of its cones."""
        cones, surf, part = self._cones, self._shell.surface, self._layout.part
        places = (
            lambda q: forms.patch(cones.from_origin + part(q, "u"), surf),
            lambda q: forms.patch(part(q, "u"), surf),
        )
        if self._length is None:
            law = forms.Cones(*places, self._sign)
        else:
            length = self._length

            def motion(q: Expr) -> forms.RotationAndCouple:
                return forms.RotationAndCouple(part(q, "rotation"), length * part(q, "couple"))

            law = forms.MomentFreeCones(*places, self._sign, motion, length)
        return (_held(self, law, self._pressure, cones.rule),)


def _held(body: Body, law: Any, pressure: fem.Constant, dx: ufl.Measure) -> Constraints:
    """List what the pressure holds; that it holds, Newton's method sees."""
    places = [body.mixed.parts[part] for part in ("mu", *MOMENT_FREE) if part in body.mixed.parts]
    numbers = [first + k for first, size in places for k in range(size)]
    held = law, lambda q: ufl.as_vector([q[k] for k in numbers]), pressure, dx
    return Constraints(*held, lambda states: np.zeros(len(states)))


def _scales(who: str, held: Iterable[str]) -> tuple[PartScale, ...]:
    """Scales of the pressure, and of the rotation and the couple where there are some."""
    scales = {"mu": (f"pressure of {who}", SMALL_PRESSURE)}
    return tuple(PartScale(p, *scales.get(p, (f"{p} of {who}", 1.0)), ADVICE) for p in held)


def _displacements(mixed: Any, shell: ShellModel) -> NodeLink:
    """Displacements are the shell's."""
    mine, theirs = mixed.subspaces["u"].dofmap.list, shell.mixed.subspaces["u"].dofmap.list
    order = np.empty(int(mine.max(initial=-1)) + 1, dtype=np.int64)
    order[mine.ravel()] = theirs.ravel()
    rows = mixed.dofs["u"].reshape(-1, 3)[: len(order)]
    targets = shell.mixed.dofs["u"].reshape(-1, 3)[order]
    return NodeLink(rows.ravel(), shell.name, shell.mixed.numbers(targets.ravel()))


def enclosed_volumes(
    scene: Scene, scale: Scale, shells: Mapping[str, ShellModel], prescribed: Prescribed
) -> list[Filling]:
    """All enclosed volumes of a scene by what fills them; collective.

    Args:
        scene: The scene.
        scale: Communicator and sizes.
        shells: Its shells, joined and supported.
        prescribed: What supports hold.

    Raises:
        SceneError: If the shells do not close a volume; names the place.
    """
    found = []
    for item in scene.volumes:
        members = [shells[name] for name in item.shells or shells]
        cones = [ReferenceCones(item, shell) for shell in members]
        lids = [c.lids() for c in cones]
        signs, normals = sides_of(item, members, lids, prescribed, scale.length)
        parts = [c.volume() for c in cones]
        volume, size = float(np.dot(signs, parts)), max(s.surface_mesh.length for s in members)
        if abs(volume) < FLAT * size**3:
            raise SceneError(
                f"{said(item)}: the shells enclose no volume from origin {item.origin}; it must be "
                "a point of the planes that close them"
            )
        outwards = np.sign(volume)
        gas = item.gas
        pressure = scale.force / scale.length**2 if gas is None else max(gas.pressure, gas.outside)
        # planes of two normals hold it
        traits = SCHEMES.get(scene.scheme_name, Traits())
        moment_free = traits.keeps_angular_momentum and not differ(normals)
        filling = Filling(item, scale.comm, abs(volume), pressure, moment_free)
        filling.surfaces = [
            Enclosing(item, shell, float(outwards * sign), filling)
            for shell, sign in zip(members, signs, strict=True)
        ]
        found.append(filling)
    return found
