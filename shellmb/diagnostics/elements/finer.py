"""Errors of bodies beside better elements, by the response to small loads.

Those are regular ones of degree 3, and half as wide if they are not too many: both are needed for
an estimate within a factor of two of what locks, misses layers, or bends in twist
(`docs/limits.md`). What points or inertia pull is compared under loads of the shape of the body as
it is deformed, which are smooth; very many unknowns with elements that are wider.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.elements.locking import Mesh
from shellmb.errors import ShellmbError, unsaid
from shellmb.meshes.shared import sums_at_nodes
from shellmb.model.locations.nodes import local_point
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.account.energy import Scalar, scalar
from shellmb.observers.fields.nodal import state
from shellmb.preprocessing.modal.tangent import bending_scales
from shellmb.scene import Scene, Shell
from shellmb.scene.loads.loads import PointForce, SurfaceForce
from shellmb.scene.loads.supports import at_rest
from shellmb.scene.settings import StepControl
from shellmb.schemes.linearised import strain_energy
from shellmb.simulate.simulation import Simulation

# unknowns of better elements up to which these are used
FEW = 50000
# better elements, in words and as options of a scene, by how many times as many unknowns they have
CUBIC: dict[str, Any] = {"degree": 3, "cell": "quad"}
BETTER: tuple[tuple[float, str, dict[str, Any]], ...] = (
    (9, "elements of degree 3 that are half as wide", CUBIC | {"divide": 2}),
    (2.25, "elements of degree 3", CUBIC),
    (4, "elements that are half as wide", {"divide": 2}),
)
# distance of nodes of both meshes that are at one place, over the size of the body
NEAR = 1e-6
# energy of what moves rigidly, over the stiffness and the square of its displacement
ROUND_OFF = 1e-18
# part that bodies are off by from which on a run warns
BOUND = 0.02
# displacements of linear runs and angles, rad, that are small, and many of the longest periods
SMALL, TURNED, LONG = 1e-4, 0.3, 100.0
# nodes of finer meshes around one between them
SEVERAL = 16
# powers of the terms of polynomials of degree 4
POWERS = np.array([p for p in np.ndindex(5, 5, 5) if sum(p) < 5])
# what scenes under such loads have of their own
KEPT = "shells supports joins beams rigid_bodies joints glues redundant solver".split()
# what to do where bodies are off
REMEDY = "its elements are too coarse or too distorted; use finer or more regular ones, or degree=3"


class Error(NamedTuple):
    """Error of a shell.

    Args:
        part: The part.
        of: What it is a part of, in words.
        how: The comparison, in words.
    """

    part: float
    of: str
    how: str


@contextmanager
def _quietly() -> Iterator[None]:
    """Ignore what another scene warns of, and end quietly where it is impossible."""
    with unsaid(), suppress(ShellmbError):
        yield


def by_others[T](
    scene: Scene, unknowns: int, solve: Callable[[Scene], T]
) -> tuple[list[T], str] | None:
    """Solve a scene with better elements, or else wider ones, and say which; collective.

    Args:
        scene: The scene.
        unknowns: Of the scene as it is.
        solve: Gives it.

    Returns:
        Of better elements one, of those that are two and four times as wide two; None where neither
        can be solved, as wider ones where meshes are read.
    """
    first, cubic, half = BETTER
    choices = [first, cubic]
    if all(shell.degree == 3 for shell in scene.shells):
        choices = [first, half]
    elif any(shell.cell == "tri" for shell in scene.shells):
        # middles of sides, by which these are off, are no nodes of degree 3
        choices = [first, half, cubic]
    regular = replace(scene, shells=tuple(replace(s, distortion=0.0) for s in scene.shells))
    for more, what, options in choices:
        if more * unknowns < FEW:
            # triangles of files become no quadrilaterals
            with _quietly():
                return [solve(regular.with_options(**options))], what
    if any(shell.surface.of_file for shell in scene.shells):
        return None

    def wider(shell: Shell, times: int) -> Shell:
        a, b = shell.mesh
        return replace(shell, mesh=(max(a // times, 1), max(b // times, 1)))

    with _quietly():
        scenes = (replace(scene, shells=[wider(s, n) for s in scene.shells]) for n in (2, 4))
        return [solve(each) for each in scenes], "elements two and four times as wide"
    return None


def beyond(here: Any, wider: Any, widest: Any) -> Any:
    """Part that a stiffness is off by if errors fall as from mesh to mesh, to a quarter at least.

    Args:
        here: The stiffness, or several.
        wider: That on a mesh twice as wide.
        widest: That on a mesh four times as wide.
    """
    change, before = np.abs(wider - here), np.abs(widest - wider)
    return change / np.maximum(before / np.maximum(change, 1e-300) - 1, 3) / np.abs(here)


def compared(
    simulation: Simulation, states: Mapping[str, Floats], doubted: Iterable[str]
) -> dict[str, Error]:
    """Compare shells with better elements; collective.

    Args:
        simulation: The run, at its end.
        states: Local arrays of shells where they are deformed most.
        doubted: Names of those that are asked for.

    Returns:
        Errors by names of shells; of those that cannot be compared there are none.
    """
    scene, shells, found = simulation.scene, simulation.model.shells, dict[str, Error]()
    flat = {name for name, body in shells.items() if not Mesh(body).curved}
    still: dict[str, Any] = {"scheme": "linear-statics", "dt": scene.t_end}
    bent = (
        _bends(simulation, name, q) and (scene.static or _stretched(simulation, name))
        for name, q in states.items()
        if name in flat
    )
    if scene.path is None and not simulation.scheme.linear and any(bent):
        # what stretches as it bends carries loads otherwise than small ones, by layers around
        # points that hold it: all loads act at once, those of a motion as they are at its end
        whole = partial(scene.with_options, scheme="static", dt=scene.t_end)
        if found := _beside(simulation, whole):
            return found
    if scene.static:
        found = _beside(simulation, lambda: scene.with_options(**still))
    if not found and scene.supports and (scene.static or len(flat) < len(shells)):
        still_there = tuple(s.still for s in scene.supports)
        held = partial(replace, scene, supports=still_there, assemble=False)
        found = _beside(simulation, lambda: held().with_options(**still))
    # where points are pulled along a body it moves the more the finer elements are, as flat ones do
    # that points hold or joints pull
    again = {
        name
        for name in doubted
        if name not in found
        or (name in flat and not scene.static)
        or (
            found[name].part > BOUND
            and (
                _pulled(simulation, name)
                or (name in flat and (scene.joints or any(_points(simulation, name))))
            )
        )
    }
    # one after the other: what is beside it may deform it otherwise than it did
    for names in _pieces(scene, states):
        if again.intersection(names):
            errors = _by_shape(simulation, states, names)
            found |= {name: errors[name] for name in again.intersection(names, errors)}
    return found


def energy_of(simulation: Simulation, name: str) -> Scalar:
    """Gives the strain energy of a shell, J; collective."""
    form = strain_energy(simulation.model.shells[name], simulation.problem.levels[name])
    energy = scalar([form], simulation.model.comm)
    assert energy is not None
    return energy


def _bends(simulation: Simulation, name: str, q: Floats) -> bool:
    """Decide whether a flat shell bends by more than half its thickness; collective."""
    body = simulation.model.shells[name]
    across = q[body.mixed.dofs["u"]].reshape(-1, 3) @ body.node_directors()[:1, 0].T
    far = float(np.max(np.abs(across), initial=0.0))
    return simulation.model.comm.allreduce(far, op=MPI.MAX) > body.section.thickness / 2


def _stretched(simulation: Simulation, name: str) -> bool:
    """Decide whether a flat shell that points hold or pull is held along itself; collective."""
    body = simulation.model.shells[name]
    owned = _held(body, body.fixed)[: body.mixed.subspaces["u"].dofmap.index_map.size_local]
    along = float(np.sum(owned @ (1 - body.node_directors()[:1, 0].T ** 2)))
    return simulation.model.comm.allreduce(along) > 3.5 and any(_points(simulation, name))


def _beside(
    simulation: Simulation, make: Callable[[], Scene], deformation: str = ""
) -> dict[str, Error]:
    """Compare a scene, a linear one mostly, with its better one; collective.

    Args:
        simulation: The run that it is about.
        make: Gives the scene; what is no linear one, as what rolls, is not compared.
        deformation: What energies tell all of, in words; empty if displacements count.
    """

    def response(other: Scene) -> Simulation:
        run = Simulation(other, simulation.model.comm)
        run.run()
        return run

    off = dict[str, float]()
    with _quietly():
        scene = make()
        if found := by_others(scene, simulation.problem.system.size, response):
            run, (other, *widest) = response(scene), found[0]
            off = _apart(run, other, bool(deformation)) if not widest else _beyond(run, *found[0])
            how = f"by its response to {'its' if scene.scheme == 'static' else 'small'} loads on "
            how += found[1]
    of = deformation or "its largest displacement"
    return {name: Error(part, of, how) for name, part in off.items()} if any(off.values()) else {}


def _beyond(*runs: Simulation) -> dict[str, float]:
    """Errors of shells in the first of three runs, by energies; collective."""
    off = dict[str, float]()
    for name in runs[0].model.shells:
        energies = [energy_of(run, name)() for run in runs]
        off[name] = float(beyond(*(1 / e for e in energies))) if min(energies) > 0 else 0.0
    return off


def _points(simulation: Simulation, name: str) -> list[bool]:
    """Decide of each support of a shell, and each load at one place, whether it is at a point."""
    scene, points = simulation.scene, simulation.model.shells[name].surface_mesh.points
    every: list[Any] = [*scene.supports, *(load for load in scene.loads if load.at_point)]
    places = [each.at for each in every if scene.bodies_of(each)[0].name == name]
    return [
        at in points or not isinstance(at, str | tuple) or not isinstance(at[0], str)
        for at in places
    ]


def _pulled(simulation: Simulation, name: str) -> bool:
    """Decide whether a force at a point acts along a shell rather than across it; collective."""
    body, here = simulation.model.shells[name], False
    for load in simulation.scene.loads:
        if isinstance(load, PointForce) and simulation.scene.bodies_of(load)[0].name == name:
            nodes, _ = local_point(body, load.at, load.label)
            across = np.abs(body.node_directors()[nodes, 0] @ np.asarray(load.force))
            here |= bool(np.any(across < np.linalg.norm(load.force) / 2))
    return bool(simulation.model.comm.allreduce(here, op=MPI.LOR))


def _by_shape(
    simulation: Simulation, states: Mapping[str, Floats], names: Sequence[str]
) -> dict[str, Error]:
    """Compare shells that turn as one under loads of the shape in which they are deformed.

    Forces on points, of joints and of inertia are spread over all of it, and no longer known.
    """
    scene, bodies = simulation.scene, [simulation.model.shells[name] for name in names]
    rests = all(map(at_rest, scene.supports))
    points = [point for name in names for point in _points(simulation, name)]
    moved = [_moved(simulation, name, states[name]) for name in names]
    x, u, areas, held = (np.concatenate(parts) for parts in zip(*moved, strict=True))
    held *= bool(points) and not any(points)
    u = _deformed(x, u, areas, held, simulation.scheme.linear, rests)
    far, step = float(np.linalg.norm(u, axis=1).max()), scene.t_end
    # by which it moves little
    force = SMALL * min(b.bending[0] / b.domain.length**3 for b in bodies)
    if not scene.static:
        # also where it is free
        slowest = min(bending_scales(simulation.model))
        force = SMALL * slowest * min(b.bending[1] * b.domain.length for b in bodies)
        step = LONG / float(np.sqrt(slowest))
    ends = np.cumsum([len(part) for part, *_ in moved])[:-1]
    parts = zip(names, np.split(x, ends), np.split(force / (far or 1.0) * u, ends), strict=True)
    more = {name: getattr(scene, name) for name in KEPT} | {
        "supports": tuple(s.still for s in scene.supports),
        "loads": [SurfaceForce(Polynomial(*values), body=name) for name, *values in parts],
        "scheme": "linear-statics" if scene.static else "linear-dynamics",
        # in shorter steps the mid-point rule swings about what is compared
        "step_control": StepControl(min_dt=step),
    }
    make = partial(Scene, scene.name, dt=step, t_end=step, **more)
    return _beside(simulation, make, f"its deformation, of up to {far:.2g} m")


def _pieces(scene: Scene, names: Iterable[str]) -> list[tuple[str, ...]]:
    """Names of shells, of those that are joined together: these turn as one."""
    pieces: dict[str, tuple[str, ...]] = {name: (name,) for name in names}
    for join in scene.joins:
        first, second = (pieces.get(name, ()) for name in (join.first, join.second))
        if first != second:
            pieces |= dict.fromkeys(first + second, first + second)
    return list(dict.fromkeys(pieces.values()))


def _deformed(
    x: Floats, u: Floats, areas: Floats, held: Floats, linear: bool, rests: bool
) -> Floats:
    """Displacements without the rigid motion that is nearest.

    Args:
        x: Places of nodes, shape (n, 3).
        u: Their displacements.
        areas: Those that belong to them.
        held: One where edges hold the body, zero elsewhere.
        linear: Whether displacements are small ones of whatever size.
        rests: Whether these edges rest; the rigid motion counts where it turns little.
    """
    most, size = float(np.linalg.norm(u, axis=1).max()), 1.0
    if linear and most > 0:
        size = SMALL * np.ptp(x, axis=0).max() / most
    X, y = (v - areas @ v / np.sum(areas) for v in (x, x + size * u))
    V, _, W = np.linalg.svd(X.T @ (areas[:, None] * y))
    V[:, 2] *= np.sign(np.linalg.det(V @ W))
    back = (V @ W).T
    if rests and held.any() and np.trace(back) >= 3 - TURNED**2:
        return u
    u = (y @ back - X) / size
    return u if rests else u - held @ u / max(np.sum(held), 1)


class Polynomial:
    """A polynomial of the place that is nearest to a field.

    Args:
        x: Places of nodes, shape (n, 3).
        values: Values there, shape (n, 3).
    """

    def __init__(self, x: Floats, values: Floats) -> None:
        self._middle, self._length = x.mean(axis=0), float(np.ptp(x, axis=0).max())
        self._factors = np.linalg.lstsq(self._powers(x), values, rcond=1e-8)[0]

    def _powers(self, x: Floats) -> Floats:
        y = 2 * (x - self._middle) / self._length
        return np.asarray(np.prod(y[:, None] ** POWERS, axis=2))

    def __call__(self, x: Any) -> Any:
        """Values at places, of the shape (3, ...) each."""
        places = np.asarray(x).reshape(3, -1).T
        return (self._powers(places) @ self._factors).T.reshape(np.shape(x))


def _apart(run: Simulation, finer: Simulation, smooth: bool) -> dict[str, float]:
    """Errors of the first run beside the second one, as of `Finer`; collective."""
    off = {}
    for name, body in run.model.shells.items():
        energies = [energy_of(each, name)() for each in (run, finer)]
        if max(energies) > 0:
            off[name] = 1 - min(energies) / max(energies)
        if name in off and not smooth:
            (x, u, *_), (X, U, *_) = (_moved(e, name, state(e, name)) for e in (run, finer))
            right = _at(x, u, X, U)
            most = max(np.linalg.norm(v, axis=1).max() for v in (u, U))
            apart, farthest = np.linalg.norm(u - right, axis=1), np.linalg.norm(right, axis=1)
            if max(energies) < ROUND_OFF * body.section.stiffness * most**2:
                off[name] = 0.0
            # single nodes of flat bodies matter less
            elif Mesh(body).curved:
                off[name] = max(off[name], float(np.max(apart) / most))
            else:
                off[name] = min(off[name], float(apart[np.argmax(farthest)] / most))
    return off


def _at(x: Floats, u: Floats, X: Floats, U: Floats) -> Floats:
    """Displacements at some nodes of those of a finer mesh.

    Args:
        x: Places, shape (n, 3).
        u: Displacements there of the coarser mesh.
        X: Places of the finer one, shape (N, 3).
        U: Displacements there.
    """
    from scipy.spatial import cKDTree

    tree, close = cKDTree(X), NEAR * np.ptp(X, axis=0).max()
    apart, near = tree.query(x, k=SEVERAL)
    # two at one place along slits and joined edges
    change = np.linalg.norm(U[near[:, :2]] - u[:, None], axis=2)
    change[apart[:, :2] > close] = np.inf
    found = U[near[np.arange(len(x)), change.argmin(axis=1)]]
    # elsewhere polynomials of degree 2
    rest = ~np.isfinite(change).any(axis=1)
    steps = (X[near[rest]] - x[rest, None]) / apart[rest, -1, None, None]
    i, j = np.triu_indices(3)
    terms = np.ones_like(steps[..., :1]), steps, steps[..., i] * steps[..., j]
    first = np.linalg.pinv(np.concatenate(terms, axis=2), 1e-3)[:, 0]
    found[rest] = np.einsum("nk,nkx->nx", first, U[near[rest]])
    # but not across slits: these are not compared
    alone = tree.query(X, k=2)[0][:, 1] > close
    rest &= ~alone[near].all(axis=1)
    found[rest] = u[rest]
    return np.asarray(found)


def _held(body: ShellModel, every: Iterable[Any]) -> Any:
    """Decide which displacements at nodes some of the supports and links hold, shape (n, 3)."""
    given = np.concatenate([np.zeros(0, np.int32), *(each.dofs for each in every)])
    return np.isin(body.mixed.dofs["u"], given).reshape(-1, 3)


def _moved(simulation: Simulation, name: str, q: Floats) -> tuple[Floats, ...]:
    """Places of nodes, displacements, areas, whether they are held; the same on all ranks."""
    body = simulation.model.shells[name]
    space = body.mixed.subspaces["u"]
    u = q[body.mixed.dofs["u"]].reshape(-1, 3)
    areas = sums_at_nodes(space, Mesh(body).areas[:, None, None])
    held = _held(body, (*body.fixed, *body.links)).any(axis=1, keepdims=True)
    every = np.concatenate([body.mixed.nodes("u"), u, areas, held], axis=1)
    owned = every[: space.dofmap.index_map.size_local]
    found = np.concatenate(simulation.model.comm.allgather(owned))
    return found[:, :3], found[:, 3:6], found[:, 6], found[:, 7]
