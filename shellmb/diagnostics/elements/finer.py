"""Errors of static states beside a mesh twice as fine, by the response to small loads."""

from __future__ import annotations

import time
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ShellmbError
from shellmb.observers.fields.nodal import state
from shellmb.simulate.simulation import Simulation

# error over the difference from a mesh twice as fine
LEFT = 1.2
# unknowns of that up to which it is solved
FEW = 40000
# distance of nodes of both meshes that are at one place, over the size of the body
NEAR = 1e-6


class Finer(NamedTuple):
    """A comparison.

    Args:
        off: Errors by names of shells, as parts of the largest displacement of both runs.
        how: What it is, in words.
    """

    off: dict[str, float]
    how: str


_KNOWN: WeakKeyDictionary[Simulation, Finer | None] = WeakKeyDictionary()


def compared(simulation: Simulation) -> Finer | None:
    """The comparison, made once; None in motions, of many unknowns, and where none is possible."""
    if simulation not in _KNOWN:
        few = 4 * simulation.problem.system.size < FEW
        _KNOWN[simulation] = _compared(simulation) if simulation.scene.static and few else None
    return _KNOWN[simulation]


def _compared(simulation: Simulation) -> Finer | None:
    from scipy.spatial import cKDTree

    begin, comm, off = time.perf_counter(), simulation.model.comm, {}
    try:
        scene = simulation.scene.with_options(scheme="linear-statics")
        runs = [Simulation(each, comm) for each in (scene, scene.with_options(divide=2))]
        for run in runs:
            run.run()
    except ShellmbError:
        return None
    for name in simulation.model.shells:
        (x, u), (X, U) = (_moved(run, name) for run in runs)
        apart, near = cKDTree(X).query(x)
        change = np.linalg.norm(u - U[near], axis=1)[apart < NEAR * np.ptp(X, axis=0).max()]
        most = max(np.linalg.norm(v, axis=1).max() for v in (u, U))
        off[name] = LEFT * float(change.max(initial=0.0) / most) if most > 0 else 0.0
    cost = f"{time.perf_counter() - begin:.1f} s"
    how = f"by its response to small loads on twice as many elements along each side ({cost})"
    return Finer(off, how)


def _moved(simulation: Simulation, name: str) -> tuple[Floats, Floats]:
    """Places and displacements of all nodes, the same on all ranks, shape (n, 3) each."""
    body = simulation.model.shells[name]
    u = state(simulation, name)[body.mixed.dofs["u"]].reshape(-1, 3)
    both = np.concatenate([body.mixed.nodes("u"), u], axis=1)
    x, moved = np.split(np.concatenate(simulation.model.comm.allgather(both)), 2, axis=1)
    return x, moved
