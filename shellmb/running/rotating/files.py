"""Modes at several rates of rotation, and about states of runs, as they are written."""

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.errors import SceneError
from shellmb.files.writing import write_text
from shellmb.observers.summary import write_json
from shellmb.options.linear import ModesOptions
from shellmb.running.natural_modes.run import Columns, Found, csv, write_shapes
from shellmb.running.natural_modes.vibration import check_count
from shellmb.running.resume import state_of_run
from shellmb.running.rotating.axis import Axis
from shellmb.running.rotating.campbell import Campbell, campbell
from shellmb.running.rotating.modes import RotatingModes, modes_of
from shellmb.running.rotating.state import MovingState, StateModes, check_state
from shellmb.running.standard import SUMMARY
from shellmb.scene import Scene
from shellmb.scene.values.validate import show

TABLE = "campbell.csv"
# entries of the summary of a diagram that those of its rates have, too
OF_RATES = "scene loaded axis about unknowns elements ranks versions results".split()


def find_campbell(scene: Scene, comm: MPI.Comm, count: int, chosen: ModesOptions) -> Found:
    """Modes at several rates of rotation.

    Args:
        scene: The scene.
        comm: Communicator.
        count: Number of modes.
        chosen: The rates, the axis, and whether the loads act.

    Raises:
        SceneError: If something does not turn along.
        ConvergenceError: If an equilibrium or the modes do not converge.
    """
    turning = chosen.loaded, chosen.axis, chosen.about
    found = campbell(scene, () if chosen.rates is None else chosen.rates, comm, count, *turning)
    entries = _head(chosen.loaded, found.axis) | {
        "rates_rad_per_s": found.rates,
        "stable": not found.unstable,
        "verdict": found.verdict,
    }
    first = found.modes[0]
    return Found(found, first.model, first.unknowns, entries, partial(_write_rates, found))


def _write_rates(found: Campbell, directory: Path, summary: dict[str, Any]) -> None:
    """Write the table of all rates, and a directory of modes for each."""
    head = {name: summary[name] for name in OF_RATES}
    for number, modes in enumerate(found.modes, start=1):
        _write_rate(modes, directory / f"rate_{number}", head)
    if found.modes[0].model.comm.rank == 0:
        write_text(directory / TABLE, csv(_branches(found)))
        write_json(directory / SUMMARY, summary)


def find_state_modes(scene: Scene, comm: MPI.Comm, count: int, chosen: ModesOptions) -> Found:
    """Modes about a state of a run.

    Args:
        scene: The scene of the run; for its last state the scheme, steps and end in time do not
            matter.
        comm: Communicator, of as many ranks as the run's.
        count: Number of modes.
        chosen: The run or the time of the state, and the frame, which has one rate at most; by
            itself it turns as the rigid rotation that is nearest to the state.

    Raises:
        SceneError: If there is no such state, it is of another scene, or has no modes.
        ConvergenceError: If a step fails, or accelerations or modes do not follow.
    """
    check_count(count)
    rates, state = chosen.rates, None if chosen.state is None else Path(chosen.state)
    if rates is not None and not (len(rates) == 1 and math.isfinite(rates[0])):
        raise SceneError(
            f"modes: rates are {show(list(rates))}; a state has one finite rate in rad/s, or none"
        )
    rate = None if rates is None else float(rates[0])
    try:
        meant = state_of_run(scene, state, chosen.at, comm)
    except SceneError as error:
        raise SceneError(f"modes: {str(error).removeprefix('resume: ')}") from None
    check_state(scene, meant.scheme)
    moving = MovingState(scene, *meant.reach(comm), comm, rate, chosen.axis, chosen.about)
    found = StateModes(modes_of(moving, count), moving)
    unsteady = moving.unsteady
    entries = _head(True, moving.axis) | {
        "run": None if chosen.state is None else str(chosen.state),
        "t": moving.time,
        "run_again_from": meant.begin,
        "frame_stands_because": moving.standing,
        "stable": not found.modes.unstable,
        "verdict": found.verdict,
        "drift": found.drift,
        "relative_velocity": unsteady.velocity,
        "relative_acceleration": unsteady.acceleration,
        "relative_energy_share": unsteady.energy_share,
        "relative_acceleration_share": unsteady.acceleration_share,
    }
    write = partial(_write_rate, found.modes)
    return Found(found, moving.model, found.modes.unknowns, entries, write)


def _columns(modes: RotatingModes) -> dict[str, Any]:
    """Table of one rate."""
    number = np.arange(1, len(modes.values) + 1)
    return {
        "mode": number,
        # no negative zeros
        "frequency_hz": modes.frequencies + 0.0,
        "omega_rad_per_s": modes.values.imag + 0.0,
        "growth_per_s": modes.values.real + 0.0,
        "damping_ratio": modes.damping + 0.0,
        "whirl": modes.whirl + 0.0,
        "direction": modes.directions,
        "stable": np.isin(number, modes.unstable, invert=True).astype(int),
    }


def _branches(found: Campbell) -> Columns:
    """Table of all rates: modes that are on a branch, with its number."""
    parts = []
    for rate, modes, branches in zip(found.rates, found.modes, found.branches, strict=True):
        of = {int(mode): k for k, mode in enumerate(branches, start=1) if mode >= 0}
        own, there = _columns(modes), sorted(of)
        part = {"rate_rad_per_s": [rate] * len(of), "branch": [of[mode] for mode in there]}
        parts.append(part | {name: np.asarray(own[name])[there] for name in own})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _head(loaded: bool, axis: Axis) -> dict[str, Any]:
    return {"loaded": loaded, "axis": list(axis.axis), "about": list(axis.about)}


def _write_rate(modes: RotatingModes, directory: Path, whole: Mapping[str, Any]) -> None:
    summary = {
        **whole,
        "rate_rad_per_s": modes.rate,
        "frequencies_hz": modes.frequencies,
        "omega_rad_per_s": modes.omega,
        "growth_per_s": modes.values.real,
        "damping_ratios": modes.damping,
        "rigid_modes": modes.rigid,
        "zero_below_per_s": modes.neutral,
    }
    write_shapes(modes.model, modes.fields, _columns(modes), directory, summary)
