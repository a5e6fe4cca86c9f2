"""Errors of static states beside a mesh twice as fine, by the response to small loads."""

from __future__ import annotations

import time
import warnings
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.elements.sampled import energy_of
from shellmb.errors import ShellmbError, ShellmbWarning
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.nodal import state
from shellmb.scene import LinearSection
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
        stiff: By how much their strain energies differ, as those of stiffer ones do.
        how: What it is, in words.
    """

    off: dict[str, float]
    stiff: dict[str, float]
    how: str


_KNOWN: WeakKeyDictionary[Simulation, Finer | None] = WeakKeyDictionary()


def comparable(body: ShellModel) -> bool:
    """Decide whether a comparison tells of a body."""
    return isinstance(body.shell.section, LinearSection) and body.shell.stretching


def known(simulation: Simulation, body: ShellModel) -> Finer | None:
    """Comparison with a finer mesh that tells of a body, made once for all bodies; collective.

    None in motions, of many unknowns, and where none is possible.
    """
    if not comparable(body):
        return None
    if simulation not in _KNOWN:
        few = 4 * simulation.problem.system.size < FEW
        _KNOWN[simulation] = _compared(simulation) if simulation.scene.static and few else None
    return _KNOWN[simulation]


def _compared(simulation: Simulation) -> Finer | None:
    from scipy.spatial import cKDTree

    begin, comm = time.perf_counter(), simulation.model.comm
    off, stiff = {}, {}
    try:
        # the run has warned of its scene
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ShellmbWarning)
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
        energies = [energy_of(run, name)() for run in runs]
        stiff[name] = LEFT * (max(energies) / max(min(energies), 1e-300) - 1)
    cost = f"{time.perf_counter() - begin:.1f} s"
    how = f"by its response to small loads on twice as many elements along each side ({cost})"
    return Finer(off, stiff, how)


def _moved(simulation: Simulation, name: str) -> tuple[Floats, Floats]:
    """Places and displacements of all nodes, the same on all ranks, shape (n, 3) each."""
    body = simulation.model.shells[name]
    u = state(simulation, name)[body.mixed.dofs["u"]].reshape(-1, 3)
    both = np.concatenate([body.mixed.nodes("u"), u], axis=1)
    x, moved = np.split(np.concatenate(simulation.model.comm.allgather(both)), 2, axis=1)
    return x, moved
