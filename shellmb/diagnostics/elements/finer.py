"""Errors of bodies beside better elements, by the response to small loads.

Those are of degree 3, and half as wide if they are not too many: both are needed for an estimate
within a factor of two of what locks, misses layers, or bends in twist (`docs/limits.md`).
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.elements.measures import Mesh
from shellmb.diagnostics.elements.sampled import energy_of
from shellmb.errors import ShellmbError, ShellmbWarning
from shellmb.model.locations.nodes import local_point
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.nodal import state
from shellmb.scene import Fixed, Scene
from shellmb.scene.loads.loads import PointLoad
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
# what to do where bodies are off
REMEDY = "its elements are too coarse or too distorted; use finer or more regular ones, or degree=3"


class Finer(NamedTuple):
    """A comparison.

    Args:
        off: Errors by names of shells, as parts of the largest displacement.
        how: What it is, in words.
    """

    off: dict[str, float]
    how: str


_KNOWN: WeakKeyDictionary[Simulation, Finer | None] = WeakKeyDictionary()


def known(simulation: Simulation, name: str) -> Finer | None:
    """Comparison with better elements that tells of a shell, made once for all; collective.

    None of many unknowns, and where no load moves it, or no support holds it.
    """
    if not comparable(simulation, name):
        return None
    if simulation not in _KNOWN:
        _KNOWN[simulation] = _compared(simulation)
    found = _KNOWN[simulation]
    return found if found is not None and name in found.off else None


def comparable(simulation: Simulation, name: str) -> bool:
    """Decide whether a shell is compared: not flat ones in motion or on points; collective.

    Under forces at points displacements along a shell have no limit.
    """
    scene, body = simulation.scene, simulation.model.shells[name]
    loads = [load for load in scene.loads if isinstance(load, PointLoad)]
    loads = [load for load in loads if scene.bodies_of(load)[0].name == name]
    if Mesh(body).curved:
        return not any(_along(body, load) for load in loads)
    places = [support.at for support in scene.supports if isinstance(support, Fixed)]
    # coordinates, or the name of a point
    points = any(at in body.surface_mesh.points or not isinstance(at[0], str) for at in places)
    return scene.static and not (points or loads or scene.joints)


def _along(body: ShellModel, load: PointLoad) -> bool:
    """Decide whether a force acts along a shell rather than across it; collective."""
    nodes, _ = local_point(body, load.at, load.label)
    force = np.asarray(getattr(load, "force", np.zeros(3)))
    across = np.abs(body.node_directors()[nodes, 0] @ force)
    here = bool(np.any(across < np.linalg.norm(force) / 2))
    return bool(body.mixed.space.mesh.comm.allreduce(here, op=MPI.LOR))


def by_better[T](scene: Scene, unknowns: int, solve: Callable[[Scene], T]) -> tuple[T, str] | None:
    """Solve a scene with better elements, and say which; collective.

    Args:
        scene: The scene.
        unknowns: Of the scene as it is.
        solve: Gives it.

    Returns:
        None if there are too many unknowns, or where none can be solved.
    """
    first, cubic, half = BETTER
    choices = [first, cubic]
    if all(shell.degree == 3 for shell in scene.shells):
        choices = [first, half]
    elif any(shell.cell == "tri" for shell in scene.shells):
        # middles of sides, by which these are off, are no nodes of degree 3
        choices = [first, half, cubic]
    # the run has warned of its scene
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShellmbWarning)
        for more, what, options in choices:
            if more * unknowns < FEW:
                begin = time.perf_counter()
                # triangles of files become no quadrilaterals
                with suppress(ShellmbError):
                    found = solve(scene.with_options(**options))
                    return found, f"{what} ({time.perf_counter() - begin:.1f} s)"
    return None


def _compared(simulation: Simulation) -> Finer | None:
    def responses(finer: Scene) -> list[Simulation]:
        runs, linear = [simulation], simulation.scheme.name == "linear-statics"
        for scene in [finer] if linear else [simulation.scene, finer]:
            still = scene.with_options(scheme="linear-statics", dt=scene.t_end)
            runs.append(Simulation(still, simulation.model.comm))
            runs[-1].run()
        return runs[-2:]

    found = by_better(simulation.scene, simulation.problem.system.size, responses)
    if found is None:
        return None
    runs, what = found
    return Finer(_apart(*runs), f"by its response to small loads on {what}")


def _apart(*runs: Simulation) -> dict[str, float]:
    """Errors of the first run beside the second one, as of `Finer`; collective."""
    from scipy.spatial import cKDTree

    off = {}
    for name, body in runs[0].model.shells.items():
        (x, u), (X, U) = (_moved(run, name) for run in runs)
        # two at one place along slits and joined edges
        apart, near = cKDTree(X).query(x, k=2)
        change = np.linalg.norm(u[:, None] - U[near], axis=2)
        change[apart > NEAR * np.ptp(X, axis=0).max()] = np.inf
        change = change.min(axis=1)
        change = change[np.isfinite(change)]
        most = max(np.linalg.norm(v, axis=1).max() for v in (u, U))
        energies = [energy_of(run, name)() for run in runs]
        if most > 0 and max(energies) > 0:
            both = float(change.max(initial=0.0) / most), 1 - min(energies) / max(energies)
            # nodes near corners of flat bodies matter less
            off[name] = max(both) if Mesh(body).curved else min(both)
    return off


def _moved(simulation: Simulation, name: str) -> tuple[Floats, Floats]:
    """Places and displacements of all nodes, the same on all ranks, shape (n, 3) each."""
    body = simulation.model.shells[name]
    u = state(simulation, name)[body.mixed.dofs["u"]].reshape(-1, 3)
    both = np.concatenate([body.mixed.nodes("u"), u], axis=1)
    x, moved = np.split(np.concatenate(simulation.model.comm.allgather(both)), 2, axis=1)
    return x, moved
