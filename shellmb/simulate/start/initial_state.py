"""States that a run starts from: of another run, a natural mode, or a shape that a user gives."""

import functools
import math
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.errors import SceneError, alike, warn
from shellmb.model.body import Body
from shellmb.model.joints.coordinates import COLUMN
from shellmb.model.model import Model
from shellmb.model.sanity_checks import refuse_folded
from shellmb.preprocessing.bodyfields import kinematic_dofs
from shellmb.preprocessing.modal.tangent import tangent
from shellmb.restart import below
from shellmb.scene import Beam, FromMode, FromRun, FromShape, Scene, Shell
from shellmb.scene.fingerprint import fingerprint
from shellmb.scene.lookup import listed, said
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.user_functions import values_at
from shellmb.schemes.registry import SCHEMES
from shellmb.simulate.eigenmodes import lowest
from shellmb.simulate.problem import Problem
from shellmb.simulate.start.stored import HISTORY, Snapshot, Stored, counted, read_stored, taken_up

# what of a body says which nodes it has
MESH: tuple[str, ...] = (".surface", ".curve", ".mesh", ".elements", ".degree", ".cell", ".model")
MESH += (".geometry_order", ".distortion", ".transverse_shear", ".stretching", ".areas")
# how small the time is in which nothing moves, relative to that of a wave over a body
INSTANT = 1e-8
# of two equal extremes of a mode the one farther along these axes has a positive sign
LEANING, SAME = np.array([1.0, 0.7, 0.3]), 1e-3


@functools.singledispatch
def load_state(start: Any, problem: Problem, scene: Scene) -> bool:
    """Bring the state of a problem to what a scene starts from; collective.

    Args:
        start: The start.
        problem: The problem, whose state is changed.
        scene: The scene, as the user describes it.

    Returns:
        Whether resultants have to be found anew from the strains.

    Raises:
        SceneError: If the start does not fit the scene.
        ConvergenceError: If modes do not converge.
    """
    raise NotImplementedError(f"start {start!r}")


@load_state.register
def _(start: FromRun, problem: Problem, scene: Scene) -> bool:
    model = problem.model
    who = f"start from the run in {start.run}"
    stored = read_stored(Path(start.run), model.comm, start.at is None)
    _check_schemes(stored, problem, who)
    _check_bodies(scene, stored, who)
    known = counted(Path(start.run), model.comm, start.at)
    if known is None and scene.joints:
        warn(
            f"{who}: its {HISTORY}, which counts whole turns of joints, is missing or cannot be "
            "read; rotations that its state does not have begin within half a turn"
        )
    problem.counted = known or {}
    problem.controlled = taken_up(problem.model.signals, scene, stored, who)
    if start.at is not None:
        return _take_frame(start, problem, scene, stored, who)
    anew = False
    following = [
        *model.mechanism.bodies,
        *(part for v in model.volumes for part in (v, *v.surfaces)),
    ]
    for body in model.bodies:
        levels = problem.levels[body.name]
        given = stored.arrays.get(f"{body.name}/q")
        fits = given is not None and given.shape == levels.q.x.array.shape
        if not fits:
            if body.kinematic and body not in following:
                raise SceneError(
                    f"{who}: it has no '{body.name}' with the nodes that this scene's has; the "
                    "bodies of both must have the same meshes and models"
                )
            # joints and volumes of this scene alone, or of another scheme: forces, coordinates and
            # what is enclosed follow from the bodies
            anew = True
            continue
        levels.q.x.array[:] = given
        v = stored.arrays.get(f"{body.name}/v")
        if start.velocities and v is not None and "v" in levels.rates:
            levels.rates["v"].x.array[:] = v
    return anew or not _same_sections(scene, stored)


def _take_frame(start: FromRun, problem: Problem, scene: Scene, stored: Stored, who: str) -> bool:
    """Positions and directors of a frame, and their velocities."""
    assert start.at is not None
    moving = stored.dynamic and start.velocities and "v" in problem.scheme.rates
    for body in scene.meshed:
        _check_exact(body, who, "leave out at")
        if body.rigid:
            raise SceneError(f"{who}: {said(body)} is rigid; frames are of its mesh, leave out at")
    with alike(problem.model.comm):
        frame = Snapshot(Path(start.run), start.at, who)
        for each in scene.bodies:
            own, nodes, X, D = problem.model.nodes_of(each.name)
            (u, d), *rates = frame.nodes(scene, each.name, X, D.shape[1], moving)
            levels = problem.levels[own.name]
            _place(own, levels.q.x.array, nodes, D, u, d)
            for v, dv in rates:
                _place(own, levels.rates["v"].x.array, nodes, 0 * D, v, dv)
    return True


def _check_exact(body: SceneBody, who: str, right: str) -> None:
    if not body.exact and not body.rigid:
        raise SceneError(
            f"{who}: {said(body)} has a reduced or linear model; its model must be 'exact', or "
            f"{right}"
        )


def _place(
    body: Body, q: Floats, nodes: Ints, D: Floats, u: Floats | None, d: Floats | None
) -> None:
    """Give nodes of a body their displacements and directors."""
    if u is not None:
        q[body.mixed.dofs["u"].reshape(-1, 3)[nodes]] = u
    if d is not None:
        rows = body.mixed.dofs["w"].reshape(-1, body.mixed.parts["w"][1])[nodes]
        q[rows] = (d - D).reshape(rows.shape)


@load_state.register
def _(start: FromShape, problem: Problem, scene: Scene) -> bool:
    model = problem.model
    target = scene.body(start.body, "start from a shape")
    _check_exact(target, "start from a shape", "the scene must start from a run or a mode")
    body, nodes, X, D = model.nodes_of(target.name)
    who = f"start from a shape of {said(target)}"
    q = problem.levels[body.name].q.x.array
    x = np.ascontiguousarray(X.T)
    u = d = None
    with alike(model.comm):
        if start.displacement is not None:
            u = values_at(start.displacement, x, 3, f"{who}: displacement").T
        if start.rotation is not None:
            d = rotated(D, values_at(start.rotation, x, 3, f"{who}: rotation").T)
    _place(body, q, nodes, D, u, d)
    if target.name in model.meshed:
        refuse_folded(model.meshed[target.name], problem.levels[body.name].q, who)
    return True


@load_state.register
def _(start: FromMode, problem: Problem, scene: Scene) -> bool:
    model, scheme = problem.model, problem.scheme
    arrays = {f"{b.name}/q": problem.levels[b.name].q.x.array for b in model.bodies}
    # unloaded about the reference, as `shellmb modes` has them
    loaded = "equilibrium" in scene.starts
    factor = (lambda function: problem.start_factor(0.0, function)) if loaded else None
    system, stiffness, mass = tangent(model, arrays, factor)
    found = lowest(model, system, stiffness, mass, start.number, loaded)
    if found.values[start.number - 1].imag != 0.0:
        raise SceneError(
            f"start from a mode: mode {start.number} is complex, because loads follow the bodies; "
            "the mode must be a real one"
        )
    values = system.local_values(found.vectors[start.number - 1])
    parts = {f.name: values[system.numbering.slice(k)] for k, f in enumerate(system.fields)}
    size = _signed_size(model, parts)
    for body in model.bodies:
        levels, shape = problem.levels[body.name], parts[body.name] / size
        if "v" in levels.rates:
            moving = kinematic_dofs(body)
            levels.rates["v"].x.array[moving] += start.velocity * shape[moving]
        _displace(body, levels.q.x.array, start.amplitude * shape, scheme.linear)
    return True


def count(problem: Problem) -> None:
    """Give coordinates of joints what another run has counted, to the nearest of which they go.

    Args:
        problem: The functions of all bodies.
    """
    for (name, kind), coordinate in problem.model.mechanism.table.items():
        value = problem.counted.get(f"{name}.{COLUMN[kind]}")
        if value is not None:
            problem.levels[coordinate.group.name].q.x.array[coordinate.local()] = value
    for group in problem.model.mechanism.coordinate_groups:
        q = problem.levels[group.name].q
        for fixed in group.fixed:
            # what is prescribed says its turns itself
            q.x.array[fixed.dofs] = fixed.value(0.0)
        group.begin(q)


def rotated(D: Floats, turns: Floats) -> Floats:
    """Vectors turned by rotation vectors.

    Args:
        D: The vectors, shape (n, m, 3).
        turns: Rotation vectors, shape (n, 3), rad.
    """
    # a run without such a start does not load it
    from scipy.spatial.transform import Rotation

    return np.asarray(D @ Rotation.from_rotvec(turns).as_matrix().mT)


def instant(model: Model, dt: float) -> float:
    """A time in which bodies move by round-off only, whatever the forces between them, s.

    Args:
        model: The bodies.
        dt: Step of the scene, s.
    """
    bodies = ((*b.stretching, b.domain.length) for b in model.meshed.values())
    waves = [length * math.sqrt(mass / stiffness) for stiffness, mass, length in bodies]
    return INSTANT * min([dt, *waves])


def _displace(body: Body, q: Floats, change: Floats, linear: bool) -> None:
    """Move a state along a change; directors are turned by it."""
    if linear:
        q += change
        return
    D = body.manifold.directors
    for part in sorted(body.kinematic):
        dofs = body.mixed.dofs[part].ravel()
        if part == "frame":
            _turn(q, dofs, np.tile(np.eye(3).ravel(), (len(dofs) // 9, 1)), change)
        elif part == "w" and D is not None:
            _turn(q, dofs, D, change)
        else:
            q[dofs] += change[dofs]


def _turn(q: Floats, dofs: Int32s, D: Floats, change: Floats) -> None:
    """Turn directors by small changes of them, which are the sizes of rotations."""
    rows = dofs.reshape(len(D), -1, 3)
    d = D.reshape(rows.shape) + q[rows]
    cross = np.cross(d, change[rows]).sum(axis=1)
    # of three directors each rotation is counted twice
    turns = cross if rows.shape[1] == 1 else cross / 2
    q[rows] = rotated(d, turns) - D.reshape(rows.shape)


def _signed_size(model: Model, parts: dict[str, Floats]) -> float:
    """Largest displacement in a mode, with its sign, the same on all ranks."""
    best = (0.0, 0.0)
    for body in model.bodies:
        if "u" not in body.kinematic or not (body.name in model.meshed or body is model.rigid):
            continue
        u = parts[body.name][body.mixed.dofs["u"]].reshape(-1, 3)
        if not len(u):
            continue
        X = model.meshed[body.name].mixed.nodes("u") if body.name in model.meshed else 0.0 * u
        weights = np.abs(u) * (1 + SAME * (X @ LEANING / model.length))[:, None]
        k = np.unravel_index(np.argmax(weights), u.shape)
        best = max(best, (float(weights[k]), float(u[k])))
        if body is model.rigid:
            # bodies that turn about their centres move by the length of the scene
            w = model.length * parts[body.name][body.mixed.dofs["w"]].ravel()
            turned = float(w[np.argmax(np.abs(w))])
            best = max(best, (abs(turned), turned))
    return max(model.comm.allgather(best))[1] or 1.0


def _check_schemes(stored: Stored, problem: Problem, who: str) -> None:
    """Linear and nonlinear states are not of one kind."""
    name = str(stored.scene.get("scheme"))
    linear = name in SCHEMES and SCHEMES[name](1.0).linear
    if linear != problem.scheme.linear:
        kinds = ("small" if linear else "large", "small" if problem.scheme.linear else "large")
        raise SceneError(
            f"{who}: its displacements are {kinds[0]} (scheme '{name}'), those of this scene are "
            f"{kinds[1]} (scheme '{problem.scheme.name}'); both must be of one kind"
        )


def _check_bodies(scene: Scene, stored: Stored, who: str) -> None:
    """All bodies have the same nodes in both scenes."""
    now = fingerprint(scene)
    for body in scene.meshed:
        path = _path(body)
        then, here = below(stored.scene, path), below(now, path)
        if not then:
            raise SceneError(
                f"{who}: it has no {said(body)}; it must have all bodies of this scene"
            )
        for key in (*then, *(k for k in here if k not in then)):
            was, is_ = then.get(key, "missing"), here.get(key, "missing")
            if key.startswith(MESH) and was != is_:
                raise SceneError(
                    f"{who}: {said(body)} has another mesh or model ({key[1:]} was {was}, is "
                    f"{is_}); both must be the same"
                )
    names = [b.name for b in scene.rigid_bodies]
    found = stored.names("rigid_bodies")
    if names and found != names:
        raise SceneError(
            f"{who}: its rigid bodies are {listed(found) or 'none'}, those of this scene are "
            f"{listed(names)}; both must be the same, in the same order"
        )


def _path(body: Shell | Beam) -> str:
    """Path at which a fingerprint has a body."""
    return f"{body.home}[{body.name!r}]"


def _same_sections(scene: Scene, stored: Stored) -> bool:
    """Decide whether resultants that were stored are those of this scene's sections."""
    now = fingerprint(scene)
    paths = [_path(body) for body in scene.meshed]
    return all(below(stored.scene, path) == below(now, path) for path in paths)


def largest_misfit(problem: Problem) -> tuple[float, str, str]:
    """Largest distance of supports from the state at the start; collective.

    Returns:
        The distance, relative to the scene's length or of a direction; name of the body in the
        system; the distance in words.
    """
    model = problem.model
    worst = (0.0, "", "")
    for body in model.bodies:
        q = problem.levels[body.name].q.x.array
        for fixed in body.fixed:
            if not len(fixed.dofs):
                continue
            apart = np.abs(q[fixed.dofs] - fixed.value(0.0))
            for part in sorted(body.kinematic & {"u", "w"}):
                here = apart[np.isin(fixed.dofs, body.mixed.dofs[part].ravel())]
                largest = float(np.max(here, initial=0.0))
                scale = model.length if part == "u" else 1.0
                words = f"{largest:.3g}" + ("" if part == "u" else " in its director or frame")
                worst = max(worst, (largest / scale, body.name, words))
    return max(model.comm.allgather(worst))
