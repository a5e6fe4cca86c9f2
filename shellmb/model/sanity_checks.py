"""Warnings if a model is hardly what is meant: sizes, units, shapes, edges that nothing joins."""

import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any

from mpi4py import MPI

import basix
import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Bools, Floats
from shellmb.errors import SceneError, warn
from shellmb.forms import frame as frame_forms
from shellmb.forms.shell import along
from shellmb.model.frames.beam import BeamModel
from shellmb.model.locations import nodes
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import values_in_cells
from shellmb.scene import EdgeForce, Gravity, PointForce, Pressure, Scene, SurfaceForce
from shellmb.scene.lookup import by_kind, connected, said
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.units import parse_units
from shellmb.scene.values.validate import as_names

# part of an area or length by which an element has collapsed
COLLAPSED = 1e-3
# edges that are nearer than this part of the shell's length lie on one another
SAME = 1e-6


def doubt_thickness(comm: MPI.Comm, bodies: Iterable[ShellModel | BeamModel]) -> None:
    """Warn of shells thicker and beams wider than they are long: mostly mistakes of units.

    Args:
        comm: Communicator.
        bodies: Shells and beams.
    """
    for body in bodies if comm.rank == 0 else ():
        (what, size), length = body.extent, body.domain.length
        if size > length:
            warn(
                f"{said(body.described)}: the {what} is {size:.4g} m and it is {length:.4g} m "
                "long; the theory is for thin bodies, so check the units",
            )


# places along an edge that are compared
ALONG = np.linspace(0.0, 1.0, 9)


def doubt_slits(comm: MPI.Comm, shells: Mapping[str, ShellModel]) -> None:
    """Warn of shells whose opposite edges lie on one another and are not joined.

    Args:
        comm: Communicator.
        shells: Shells by name.
    """
    if comm.rank != 0:
        return
    zero, one = np.zeros_like(ALONG), np.ones_like(ALONG)
    opposite = {
        ("left", "right"): ((zero, ALONG), (one, ALONG)),
        ("bottom", "top"): ((ALONG, zero), (ALONG, one)),
    }
    for shell in shells.values():
        surface, length = shell.shell.surface, shell.surface_mesh.length
        for (first, second), places in opposite.items():
            if surface.slit or not {first, second} <= set(surface.edges or ()):
                continue
            a, b = (surface.position(*place) for place in places)
            if np.ptp(a, axis=1).max() < SAME * length or np.abs(a - b).max() > SAME * length:
                # an edge that is a point is a pole, and no slit
                continue
            warn(
                f"{said(shell.shell)}: its edges '{first}' and '{second}' lie on one another and "
                "are not joined: the shell is slit there; use Cylinder, Sphere or Disc with 360 "
                "degrees to close it, or Parametric(..., slit=True) if the slit is meant",
            )


def check_probes(scene: Scene, meshed: Mapping[str, Any]) -> None:
    """Points of probes are found before anything is read off forms; collective.

    Raises:
        SceneError: If one is not on its body.
    """
    for probe in scene.probes:
        (target,) = scene.bodies_of(probe)
        if target.name in meshed:
            body, who = meshed[target.name], f"probe '{probe.name}'"
            places: Any = [probe.at]
            if nodes.is_point(probe.at):
                places, _ = nodes.surrounding(body, probe.at, who)
            for place in places:
                nodes.local_point(body, place, who)
        if probe.frame is not None and probe.frame in meshed:
            nodes.local_point(meshed[probe.frame], probe.frame_at, f"probe '{probe.name}'")


def refuse_folded(body: ShellModel | BeamModel, q: fem.Function, who: str) -> None:
    """Refuse a state in which a surface or line has collapsed, or is turned over; collective.

    What is left of the area of an element (of the length, of a beam) is taken along the directors.

    Args:
        body: The shell or beam.
        q: The state.
        who: Where the state comes from, for the error.

    Raises:
        SceneError: Says where, and what is left there.
    """
    domain, u, w = body.domain.mesh, *body.layout.moved(q)
    if hasattr(body, "surface"):
        surf = body.surface
        sides = (e + along(u, e) for e in (surf.e1, surf.e2))
        left, what = ufl.dot(ufl.cross(*sides), surf.D + w), "area"
    else:
        t, first = body.line.t, frame_forms.vectors(body.line.D + w)[0]
        left, what = ufl.dot(t + along(u, t), first), "length"
    points, _ = basix.make_quadrature(domain.basix_cell(), 4)
    value = ufl.as_vector([left, *ufl.SpatialCoordinate(domain)])
    found = values_in_cells(value, points, domain)().reshape(-1, 4)
    worst = min(map(tuple, found), default=(np.inf,))
    least, *x = min(domain.comm.allgather(worst))
    if least < COLLAPSED:
        place, share = nodes.said_point(np.array(x), body.domain.length), round(least, 3) + 0.0
        raise SceneError(
            f"{who}: at {place} {share:g} of the {what} is left, along the directors; it "
            "must be greater than 0 everywhere: the shape must not map to a point or line, fold, "
            "or turn over without rotation="
        )


# in m, kg and s
LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
# gravity of the earth by the units of length and time that it tells
EARTH = {9.81: ("m", "s"), 981.0: ("cm", "s"), 9810.0: ("mm", "s"), 9.81e-3: ("mm", "ms")}
# speeds of waves in solids, from soft gels to diamond and to bodies that are made nearly
# rigid, m/s; where only gravity tells the units, bodies may be softer
SLOWEST, SOFTEST, FASTEST = 1.0, 0.1, 1e6
# metals by Young's modulus in GPa and density in kg/m^3
METALS = (
    (185.0, 240.0, 7500.0, 8200.0),
    (62.0, 82.0, 2550.0, 2900.0),
    (95.0, 130.0, 4300.0, 4700.0),
)
# Pa, kPa, MPa, GPa and dyn/cm^2 in a GPa, and which densities belong to them, per kg/m^3
MODULI = {1e9: (1.0,), 1e6: (1e-3, 1e-9), 1e3: (1e-12, 1e-6), 1.0: (1e-9,), 1e10: (1e-3,)}
DENSITIES = (1.0, 1e-3, 1e-6, 1e-9, 1e-12)
# E over density of moduli in GPa with kg/m^3 at most, and of moduli in Pa with g/cm^3
GIGA, GRAMS = 0.1, (1e9, 1.5e11)
# strains of loads beyond which nothing is left of a body's shape, and of weight
FLOWS, FALLS = 10.0, 100.0


def doubt_units(comm: MPI.Comm, scene: Scene, bodies: Iterable[ShellModel | BeamModel]) -> None:
    """Warn of moduli, densities and loads that do not fit one another.

    The units are those that the scene names, or those that gravity tells. Without both only pairs
    that are known in no consistent system are doubted: a scene may be without units.

    Args:
        comm: Communicator.
        scene: The scene.
        bodies: Shells and beams.
    """
    for body in bodies if comm.rank == 0 else ():
        if body.material is None:
            continue
        E, density = body.material
        sentence = _by_waves(scene, E, density) or _by_loads(scene, body, E, density)
        if sentence:
            warn(f"{said(body.described)}: {sentence}, so check the units")


def _by_waves(scene: Scene, E: float, density: float) -> str:
    """Doubt a modulus with a density; empty: none."""
    # what is at rest has the same equilibrium with any density
    if scene.static or not density > 0:
        return ""
    pair, scale = f"E = {E:.4g} and density = {density:.4g}", _scale(scene)
    if scale is not None:
        length, time = scale
        speed = math.sqrt(E / density) * LENGTHS[length] / TIMES[time]
        named = scene.units is not None
        # what has nearly no mass may be meant, where no units are named
        if speed < (SLOWEST if named else SOFTEST) or (named and speed > FASTEST):
            return (
                f"by {pair} waves run at {speed:.3g} m/s, where {length} and {time} are the units "
                "of length and time as the scene or gravity says; in solids they run at 1 to "
                "20000 m/s"
            )
        if named:
            return ""
    for low, high, light, heavy in METALS:
        for modulus, right in MODULI.items():
            for unit in DENSITIES:
                metal = low * modulus <= E <= high * modulus and light <= density / unit <= heavy
                if metal and unit not in right:
                    return (
                        f"{pair} are those of a metal ({E / modulus:.4g} GPa and "
                        f"{density / unit:.4g} kg/m^3) in units that do not belong together, as "
                        "GPa or MPa with kg/m^3, or Pa with g/cm^3"
                    )
    giga = 500 <= density <= 25e3 and E / density < GIGA and E >= 1e-3
    grams = 0.5 <= density <= 25 and E >= 1e9 and GRAMS[0] <= E / density <= GRAMS[1]
    if giga or grams:
        units = "GPa with kg/m^3" if giga else "Pa with g/cm^3"
        return f"by {pair} waves run at {math.sqrt(E / density):.3g}, as with {units}"
    return ""


def _scale(scene: Scene) -> tuple[str, str] | None:
    """Units of length and time that a scene tells by their names or by gravity."""
    names = parse_units(scene.units).names
    if names and names[0] in LENGTHS and names[2] in TIMES:
        return names[0], names[2]
    for load in scene.weights:
        g = math.hypot(*load.acceleration)
        for earth, units in EARTH.items():
            if abs(g / earth - 1) < 0.01:
                return units
    return None


# loads that stretch bodies: where they say how large they are, and the stress over that by density,
# length, height and width
_STRETCHING: dict[type, tuple[str, Callable[[float, float, float, float], float]]] = {
    Gravity: ("acceleration", lambda density, length, h, width: density * length),
    PointForce: ("force", lambda density, length, h, width: 1 / (h * width)),
    EdgeForce: ("force", lambda density, length, h, width: 1 / h),
    SurfaceForce: ("force", lambda density, length, h, width: length / h),
    Pressure: ("p", lambda density, length, h, width: length / h),
}


def _by_loads(scene: Scene, of: ShellModel | BeamModel, E: float, density: float) -> str:
    """Doubt loads that would stretch a body by a multiple of itself; empty: none."""
    body: Any = of.described
    (_, h), length = of.extent, float(of.domain.length)
    width = h if body.label == "beam" else length
    for load in scene.loads:
        # where all is linear, loads have any size
        if scene.linear or body not in scene.bodies_of(load):
            continue
        name, over = by_kind(_STRETCHING, load) or ("", None)
        value: Any = getattr(load, name, None)
        if over is None or callable(value):
            continue
        stress = float(np.linalg.norm(value)) * over(density, length, h, width)
        if stress > (FALLS if load.weighs else FLOWS) * E:
            return (
                f"{said(load)} causes stresses of about {stress:.3g}, {stress / E:.3g} times E = "
                f"{E:.4g}"
            )
    return ""


type Sets = dict[Hashable, Hashable]


def doubt_unjoined(scene: Scene, comm: MPI.Comm, meshes: Mapping[str, Any]) -> None:
    """Warn of shells with an edge on another shell that nothing connects there; collective.

    What moves against one another may touch: shells that joints, springs, contacts or glued beams
    connect, directly or by other bodies, are not meant, nor are edges that are both supported.

    Args:
        scene: The scene as it is described.
        comm: Communicator.
        meshes: Shells and beams by name, those that are rigid among them.
    """
    shells = {n: _Shell(m) for n, m in meshes.items() if m.described.directors == 1}
    if comm.rank != 0 or len(shells) < 2:
        return
    at_edges, joined, linked, pairs = _connections(scene)
    held = {
        (body.name, edge)
        for support in scene.supports
        for body in scene.bodies_of(support)
        for edge in _named(getattr(support, "at", None))
    }
    for a, b in combinations(shells, 2):
        joint, tied = ({sets.get(name, name) for name in (a, b)} for sets in (joined, linked))
        if frozenset({a, b}) in pairs or len(joint) > len(tied):
            continue
        for one, other in ((a, b), (b, a)):
            found = next(_touching(one, shells[one], other, shells[other], at_edges, held), None)
            if found is not None:
                mine, theirs = found
                there = f"and '{theirs}'" if theirs else f"of '{one}'"
                how = (
                    f"Join({one!r}, {other!r}, {mine!r}, {theirs!r}), an EdgeHinge"
                    if theirs
                    else f"a Join along edges, for which '{other}' must be split there"
                )
                warn(
                    f"shells '{one}' and '{other}' touch along '{mine}' {there}, and nothing "
                    f"connects them there; connect them, as by {how}, another joint or a Contact, "
                    "or leave a gap"
                )
                break


class _Shell:
    """Nodes of a shell and of its edges, of all ranks; collective.

    Args:
        model: The shell.
    """

    def __init__(self, model: ShellModel) -> None:
        self.close = 2 * nodes.ON_NODE * model.surface_mesh.length
        every = model.mixed.nodes("u")
        owned = np.arange(len(every)) < model.mixed.subspaces["u"].dofmap.index_map.size_local
        comm = model.domain.mesh.comm

        def gathered(nodes: Any) -> Floats:
            return np.concatenate(comm.allgather(every[nodes[owned[nodes]]]))

        self.nodes = gathered(np.arange(len(every)))
        edges = {
            e: gathered(nodes.local_nodes(model, e, "edges")) for e in model.surface_mesh.edges
        }
        # a pole is no edge
        self.edges = {e: x for e, x in edges.items() if len(x) > 2 and np.ptp(x, axis=0).max() > 0}


def _touching(
    one: str, a: _Shell, other: str, b: _Shell, at_edges: Sets, held: set[tuple[str, str]]
) -> Iterator[tuple[str, str | None]]:
    """Edges of a shell on another one where neither joins nor supports hold them together."""
    close = max(a.close, b.close)
    low, high = b.nodes.min(axis=0) - close, b.nodes.max(axis=0) + close
    inside = {e: x for e, x in a.edges.items() if ((x >= low) & (x <= high)).all()}
    along = {e: [f for f, y in b.edges.items() if _on_edge(x, y, close)] for e, x in inside.items()}
    if len(a.edges) > 2 and all(map(along.get, a.edges)):
        # a shell that lies on another one altogether is a copy of it
        return
    for edge, x in inside.items():
        if not along[edge] and not _near(x, b.nodes, close).all():
            continue
        own, *ends = (at_edges.get(e, e) for e in ((one, edge), *((other, f) for f in along[edge])))
        supported = (one, edge) in held and any((other, f) in held for f in along[edge])
        if not supported and own not in ends:
            yield edge, next(iter(along[edge]), None)


def _near(x: Floats, y: Floats, close: float) -> Bools:
    """Decide which places are nodes of a shell."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(y).query(x)[0] <= close)


def _on_edge(x: Floats, y: Floats, close: float) -> bool:
    """Decide whether places lie on an edge with these nodes, one of them at a node."""
    from scipy.spatial import cKDTree

    distance, near = cKDTree(y).query(x, k=3)
    if not (distance[:, 0] <= close).any():
        return False
    a, b, c = (y[near[:, k]] for k in range(3))
    # an edge that is curved leaves its chords by as much as the third node leaves the line
    bulge = np.minimum(_from_line(c, a, b), _from_line(b, a, c))
    away = np.minimum(_from_line(x, a, b), np.linalg.norm(x - a, axis=1))
    longest = np.linalg.norm(b - a, axis=1)
    beside = np.maximum(distance[:, 0], distance[:, 1]) <= longest * (1 + 1e-6)
    return bool(np.all((distance[:, 0] <= close) | ((away <= close + bulge) & beside)))


def _from_line(x: Floats, a: Floats, b: Floats) -> Floats:
    """Distances of places from lines through two others."""
    along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    r = x - a
    return np.linalg.norm(r - np.sum(r * along, axis=1, keepdims=True) * along, axis=1)


def _connections(scene: Scene) -> tuple[Sets, Sets, Sets, set[frozenset[str]]]:
    """Find what is connected: edges, bodies by joins, bodies by anything, pairs of bodies directly.

    Args:
        scene: The scene.
    """
    hinges = [j for j in scene.joints if j.along_edges]
    along: list[Any] = [*scene.joins, *hinges]
    edges = [
        ((item.first, mine), (item.second, theirs))
        for item in along
        for mine in _named(item.at)
        for theirs in _named(item.second_at)
    ]
    ends = [(join.first, join.second) for join in scene.joins]
    direct = [(glue.beam, glue.shell) for glue in scene.glues]
    direct += [(item.first, item.second) for item in scene.joints if item not in hinges]
    elements: tuple[Any, ...] = scene.force_elements
    direct += [(e.first, e.second) for e in elements if hasattr(e, "second")]
    for contact in scene.contacts:
        touched = getattr(contact.obstacle, "shell", None) or contact.obstacle_body or GROUND
        direct += [(body.name, touched) for body in scene.bodies_of(contact)]
    linked = (*ends, *direct, *((h.first, h.second) for h in hinges))
    pairs = [pair for pair in linked if GROUND not in pair]
    return _sets(edges), _sets(ends), _sets(pairs), {frozenset(pair) for pair in direct}


def _named(where: Any) -> Iterable[str]:
    """Edges by their names; none of places that are given otherwise."""
    return [n for n in as_names(where) if isinstance(n, str)] if where is not None else []


def _sets(pairs: Iterable[tuple[Any, Any]]) -> Sets:
    """Of each thing that pairs connect the number of what is connected with it."""
    return {one: k for k, some in enumerate(connected((), pairs)) for one in some}
