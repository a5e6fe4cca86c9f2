"""Runs tell of elements with which a body moves otherwise than with better ones.

At point forces and along edges that are held, thin curved bodies bend within a layer of the width
`sqrt(R t)`, which wider elements miss; distorted ones lock; bodies that do not stretch have too
many or too few constraints; at free edges twisting moments fall to zero within a third of the
thickness. Signs of this cost little, but do not say by how much a body is off: resultants jump
between elements, sides of triangles bulge, edges twist. Better elements tell.

Layers along free edges in which twisting moments fall to zero, and what elements miss of them.

Twisting moments of shells that shear vanish at free edges, within a layer of the width `l`, `l^2 =
D66/G`, a third of the thickness (E. Reissner, J. Appl. Mech. 12 (1945) A69-77). Elements that are
wider keep a twisting moment `m` at the edge, and miss the energy `l m^2/(2 D66)` per length: a
strip of one element twists too little by `2 l` over its width. Triangles miss all of it. Directors
of quadrilaterals are of second degree across the edge, and shear sees the linear part: of `n` of
them across a strip, of the depth `h`, the energy has the part `g/tanh(y/2)`, `g = 6 y/(y^2 + 12)`
with `y = h/(n l)`, and the moment at the edge is `1 - 2 g/y` of what it would be. Measured:
`tests/diagnostics/test_edges.py`.
"""

from typing import Any

from mpi4py import MPI

import basix
import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.diagnostics.base import Cautions, Sampled, said_of
from shellmb.diagnostics.elements.finer import BOUND, REMEDY, Error, compared, energy_of
from shellmb.diagnostics.elements.locking import Mesh, Roughness, excess
from shellmb.model.model import Model
from shellmb.model.sections.section import SectionFields
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.nodal import Nodes, state
from shellmb.restart import constant
from shellmb.scene import LinearSection
from shellmb.scene.loads.loads import EdgeMoment
from shellmb.scene.loads.supports import at_rest
from shellmb.simulate.simulation import Simulation

# share of jumps in the strain energy below which nothing was off by two per cent
ROUGH = 0.0018
# strain of round-off, by displacements of the size of the body
NOISE = 1e-14

# of sections of their own energy: stiffness against twisting over that of stretching and the square
# of the thickness, and the square of the layer's width over that
TWIST, LAYER = 0.35 / 12, 0.1
# distance of nodes that are at one place, over the size of the shell
NEAR = 1e-6


class Coarse(Sampled):
    """Looks whether shells move as those of better elements, where they store most energy."""

    name = "coarse mesh"
    runs = True
    remembered = ("_most", "_states")

    def _begin(self) -> None:
        # by shell the largest energy, and the state, which other numbers of ranks do not take up
        self._most: dict[str, float] = {}
        self._states: dict[str, Floats] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the energies; statics end where they are largest."""
        self._energies = {name: energy_of(simulation, name) for name in simulation.model.shells}
        self.idle = not simulation.scheme.dynamic

    def _look(self, simulation: Simulation) -> None:
        for name, energy in self._energies.items():
            if (found := energy()) > (self._most[name] if name in self._states else 0.0):
                self._most[name] = found
                self._states[name] = constant(state(simulation, name).copy())

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that does not; collective."""
        self._look(simulation)
        scene, shells = simulation.scene, simulation.model.shells
        half, doubted = 0.0 if simulation.scheme.linear else 0.5, {}
        for name, q in self._states.items():
            signs = Signs(simulation.model, name)
            if signs.doubtful(q, half * q, self._most[name]):
                doubted[name] = signs
        errors = compared(simulation, self._states, doubted) if doubted else {}
        for name, signs in doubted.items():
            if (error := errors.get(name)) is None:
                q = self._states[name]
                share = signs.rough.energy(q) / self._most[name]
                part = excess(shells[name], q, share)
                error = Error(part, "its largest displacement", "by jumps of resultants")
            if error.part > BOUND:
                # what moved supports alone deform has its displacements from them
                loaded = scene.loads or scene.volumes or shells[name].shell.natural
                alone = scene.static and not loaded and not all(map(at_rest, scene.supports))
                of_what = "the forces of its supports" if alone else error.of
                says = (
                    f"{said_of(simulation, name)} is off by about {100 * error.part:.0f} % of "
                    f"{of_what}, {error.how}: {REMEDY}"
                )
                yield self.caution(name, error.part, BOUND, says)


class Signs:
    """Signs that a shell may be off.

    Args:
        model: All bodies.
        name: Its name.

    Attributes:
        rough: Energy of jumps of its resultants.
    """

    def __init__(self, model: Model, name: str) -> None:
        self._body = body = model.shells[name]
        self.rough, self._edges, mesh = Roughness(body), edges_of(body, model), Mesh(body)
        uneven = mesh.triangles or mesh.distorted
        # single nodes move much by little energy, and elements of degree 3 twist too far
        self._always = (uneven and mesh.curved) or (body.shell.degree > 2 and spanning(body, model))

    def doubtful(self, q: Floats, about: Floats, energy: float) -> bool:
        """Decide whether there are any in a state or mode; collective.

        Args:
            q: Local array of it.
            about: State that it is a small change of.
            energy: Its strain energy, J.
        """
        if energy <= self._round_off(q):
            return False
        if self._always:
            return True
        if self._edges is not None and self._edges.share(q, about, energy) > BOUND:
            return True
        return self.rough.energy(q) > ROUGH * energy

    def _round_off(self, q: Floats) -> float:
        """Strain energy below which a state is a rigid motion and round-off, J; collective."""
        body = self._body
        found = np.array([np.max(np.abs(q[body.mixed.dofs["u"]]), initial=0.0)])
        body.mixed.space.mesh.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
        length = body.domain.length
        strain = NOISE * (1 + float(found[0]) / length)
        return float(body.section.stiffness * (strain * length) ** 2)


class Edges:
    """Free edges of a shell.

    Args:
        body: The shell.
        model: All bodies.

    Attributes:
        none: Whether there are none that elements could miss anything of.
    """

    def __init__(self, body: ShellModel, model: Model) -> None:
        space = body.mixed.subspaces["u"]
        element, free = space.element.basix_element, _free(body, model)
        self._comm, cells = space.mesh.comm, space.dofmap.list[: len(free)]
        self._nodes = Nodes(body)
        corners, ends = basix.geometry(element.cell_type), basix.topology(element.cell_type)[1]
        stiffness, layer = _twisting(body)
        x, (rule, weights) = body.node_positions(), basix.make_quadrature(element.cell_type, 2)
        tangents = np.einsum("dpk,ckx->dcpx", _slopes(element, rule), x[cells])
        # its area and half the length of its free edges
        areas = np.linalg.norm(np.cross(*tangents), axis=2) @ np.asarray(weights)
        here = np.array([np.sum(areas), 0.0])
        found = []
        for k, (start, end) in enumerate(ends):
            nodes, along = cells[free[:, k]], corners[end] - corners[start]
            points = corners[start] + np.array([[0.5 - 12**-0.5], [0.5 + 12**-0.5]]) * along
            slopes = _slopes(element, points)
            a = np.einsum("dpk,ckx->cpdx", slopes, x[nodes])
            t = np.einsum("d,cpdx->cpx", along, a)
            length, normal = np.linalg.norm(t, axis=2), np.cross(a[:, :, 0], a[:, :, 1])
            frame = np.stack([t, np.cross(t, _unit(normal))], axis=2) / length[..., None, None]
            parts = np.linalg.inv(a @ np.swapaxes(a, 2, 3)) @ a @ np.swapaxes(frame, 2, 3)
            depth = np.linalg.norm(normal, axis=2) / length
            found.append((nodes, np.einsum("cpde,dpk->ecpk", parts, slopes), length, depth))
            here[1] += np.sum(length) / 2
        area, whole = self._comm.allreduce(here)
        # by side of the reference cell: nodes, functions' slopes along it and across, and weights
        self._sides: list[tuple[Any, Floats, Floats]] = []
        most = 0.0
        for nodes, slopes, length, depth in found if whole > 0 else []:
            missed = layer * np.ones_like(depth)
            if len(ends) == 4:
                missed *= _missed(whole * depth**2 / (2 * area * layer))
            self._sides.append((nodes, slopes, missed * stiffness / 4 * length))
            # of the energy of twist in elements between two free edges
            most = max(most, float(np.max(2 * missed / depth, initial=0.0)))
        self.none = not self._comm.allreduce(most, op=MPI.MAX) > BOUND

    def share(self, q: Floats, about: Floats, energy: float) -> float:
        """Energy that elements miss, as a part of all; collective.

        Args:
            q: Local array of a change of a state.
            about: State that it is a small change of.
            energy: All of it, J.
        """
        now, base = self._nodes.values(q), self._nodes.values(about)
        u, w = now.displacement, now.director - now.reference_directors[:, 0]
        x, d, found = base.position, base.director, 0.0
        for nodes, (along, across), weights in self._sides:

            def of(slopes: Floats, values: Floats, nodes: Any = nodes) -> Floats:
                return np.asarray(np.einsum("cpk,ckx->cpx", slopes, values[nodes]))

            twist = of(along, x) * of(across, w) + of(along, u) * of(across, d)
            twist += of(across, x) * of(along, w) + of(across, u) * of(along, d)
            found += float(np.sum(weights * np.sum(twist, axis=2) ** 2))
        return float(self._comm.allreduce(found)) / energy


def _slopes(element: Any, points: Any) -> Floats:
    """Slopes of an element's functions, shape (2, points, functions)."""
    return np.asarray(element.tabulate(1, points))[1:, :, :, 0]


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _missed(y: Floats) -> Floats:
    """Part of the energy by the moment at the edge that quadrilaterals miss."""
    y = np.maximum(y, 0.5)
    g = 6 * y / (y**2 + 12)
    return np.asarray((1 - g / np.tanh(y / 2)) / (1 - 2 * g / y) ** 2)


def _twisting(body: ShellModel) -> tuple[float, float]:
    """Stiffness against twisting, N m, and width of the layer, m; collective."""
    section, sizes = body.shell.section, body.section
    if not isinstance(section, LinearSection):
        square = sizes.thickness**2
        return TWIST * sizes.stiffness * square, float(np.sqrt(LAYER * square))
    fields = SectionFields(body.shell, body.mixed.space.mesh)
    D = fields.mean(lambda at: at.D[..., 2, 2] - at.B[..., 2, 2] ** 2 / at.A[..., 2, 2])
    G = fields.mean(lambda at: (at.G[..., 0, 0] + at.G[..., 1, 1]) / 2)
    return D, float(np.sqrt(D / G))


def _free(body: ShellModel, model: Model) -> Bools:
    """Sides of this rank's cells where no twisting moment acts, shape (cells, sides); collective.

    Directors are not held there, no load turns them, and no other body is there.
    """
    space, name = body.mixed.subspaces["u"], body.shell.name
    topology = space.mesh.topology
    count = topology.index_map(2).size_local
    closure = space.element.basix_element.entity_closure_dofs
    sides = topology.connectivity(2, 1).array.reshape(-1, len(closure[1]))[:count]
    free = np.diff(topology.connectivity(1, 2).offsets)[sides] == 1
    for load in model.scene.loads:
        if isinstance(load, EdgeMoment) and model.scene.bodies_of(load)[0].name == name:
            free &= ~np.isin(sides, body.surface_mesh.facets(load.at, name))
    X, dofs = body.mixed.nodes("u"), body.mixed.dofs["w"]
    given = [*(x.dofs for x in body.fixed), *(x.dofs for x in body.links), np.zeros(0, np.int32)]
    held = np.isin(dofs, np.concatenate(given)).reshape(-1, 3).any(axis=1)
    others = [b.mixed.nodes("u") for n, b in model.meshed.items() if n != name]
    if others:
        from scipy.spatial import cKDTree

        others = [x for rank in space.mesh.comm.allgather(others) for x in rank]
        near = NEAR * body.surface_mesh.length
        held |= cKDTree(np.concatenate(others)).query(X, distance_upper_bound=near)[0] <= near
    nodes = space.dofmap.list[:count]
    for k, local in enumerate(closure[1]):
        free[:, k] &= ~held[nodes[:, local]].all(axis=1)
    return np.asarray(free)


def spanning(body: ShellModel, model: Model) -> bool:
    """Decide whether a quadrilateral reaches from one free edge to another; collective."""
    free = _free(body, model)
    found = bool((free & free[:, ::-1]).any())
    return bool(model.comm.allreduce(found, op=MPI.LOR))


def edges_of(body: ShellModel, model: Model) -> Edges | None:
    """Free edges of a shell; None where elements could not miss anything; collective.

    Moments of sections whose plies are turned against their axes do not follow from twist alone:
    nothing is known of these. What does not shear has no layers.
    """
    section = body.shell.section
    turned = isinstance(section, LinearSection) and section.generic.D[:2, 2].any()
    found = Edges(body, model) if body.shell.transverse_shear and not turned else None
    return None if found is None or found.none else found
