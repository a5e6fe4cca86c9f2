"""Campbell diagrams in a directory: table, summary, picture, and the shapes at each rate."""

import math
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.barrier import arrive
from shellmb.errors import SceneError
from shellmb.files.writing import write_text
from shellmb.observers.summary import write_json
from shellmb.options.linear import ModesOptions
from shellmb.running.natural_modes.run import ModesDirectory, modes_directory, write_shapes
from shellmb.running.natural_modes.vibration import check_count
from shellmb.running.results import Results, add_results
from shellmb.running.resume import state_of_run
from shellmb.running.rotating.axis import Axis
from shellmb.running.rotating.campbell import Campbell, campbell
from shellmb.running.rotating.modes import RotatingModes, modes_of
from shellmb.running.rotating.state import MovingState, StateModes, check_state
from shellmb.running.standard import SUMMARY
from shellmb.scene import Scene
from shellmb.scene.values.validate import show

TABLE, PICTURE = "campbell.csv", "campbell.png"
# entries of the summary of a diagram that those of its rates have, too
OF_RATES = ("scene", "loaded", "axis", "about", "unknowns", "ranks", "versions", "results")

HEADER = "mode,frequency_hz,omega_rad_per_s,growth_per_s,damping_ratio,whirl,direction,stable"


def find_campbell(
    scene: Scene,
    out: Path | str,
    count: int,
    chosen: ModesOptions,
    *,
    results: Results | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
) -> Campbell:
    """Find modes at several rates of rotation and write them.

    Args:
        scene: The scene.
        out: Directory to write.
        count: Number of modes.
        chosen: The rates, the axis, and whether the loads act.
        results: Gives the `results` of the summary.
        comm: Communicator.
        pictures: Whether the diagram and the modes are drawn.

    Raises:
        SceneError: If something does not turn along, or `out` is not empty or cannot be written.
        ConvergenceError: If an equilibrium or the modes do not converge.
        RunError: If the function `results` raises, or the disk is full.
    """
    with modes_directory(scene, out, comm) as run:
        turning = chosen.loaded, chosen.axis, chosen.about
        found = campbell(scene, chosen.rates or (), comm, count, *turning)
        summary = _head(run, chosen.loaded, found.axis, found.modes[0]) | {
            "rates_rad_per_s": found.rates,
            "stable": not found.unstable,
            "verdict": found.verdict,
            "warnings": found.warnings,
        }
        head = {name: summary[name] for name in OF_RATES}
        for number, modes in enumerate(found.modes, start=1):
            # a directory of modes itself
            _write_rate(run.directory / f"rate_{number}", modes, head)
        if comm.rank == 0:
            write_text(run.directory / TABLE, "\n".join(_table(found)) + "\n")
            write_json(run.directory / SUMMARY, summary)
        add_results(summary, run.directory, results, found, comm, "mode_results")
        if pictures and comm.rank == 0:
            from shellmb.show.campbell import draw_campbell

            draw_campbell(run.directory / TABLE, run.directory / PICTURE)
        arrive(comm)
    return found


def find_state_modes(
    scene: Scene,
    out: Path | str,
    count: int,
    chosen: ModesOptions,
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
) -> StateModes:
    """Find modes about a state of a run and write them as `shellmb.running.natural_modes.run` does.

    Args:
        scene: The scene of the run; for its last state the scheme, steps and end in time do not
            matter.
        out: Directory to write.
        count: Number of modes.
        chosen: The run or the time of the state, and the frame, which has one rate at most; by
            itself it turns as the rigid rotation that is nearest to the state.
        comm: Communicator, of as many ranks as the run's.
        pictures: Whether the modes are drawn.

    Raises:
        SceneError: If there is no such state, it is of another scene, or has no modes.
        ConvergenceError: If a step fails, or accelerations or modes do not follow.
        RunError: If the disk is full.
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
    with modes_directory(scene, out, comm) as run:
        reached = meant.reach(comm)
        moving = MovingState(scene, *reached, comm, rate, chosen.axis, chosen.about)
        found = StateModes(modes_of(moving, count), moving)
        unsteady = moving.unsteady
        summary = _head(run, True, moving.axis, found.modes) | {
            "run": None if chosen.state is None else str(chosen.state),
            "t": moving.time,
            "run_again_from": meant.begin,
            "frame_stands_because": moving.standing,
            "stable": not found.modes.unstable,
            "verdict": found.verdict,
            "warnings": found.warnings,
            "drift": found.drift,
            "relative_velocity": unsteady.velocity,
            "relative_acceleration": unsteady.acceleration,
            "relative_energy_share": unsteady.energy_share,
            "relative_acceleration_share": unsteady.acceleration_share,
        }
        _write_rate(run.directory, found.modes, summary)
        run.draw(pictures)
    return found


def _rows(modes: RotatingModes) -> list[str]:
    """Lines of the table of one rate, without their branches."""
    lines = []
    for k, value in enumerate(modes.values):
        numbers = (modes.frequencies[k], value.imag, value.real, modes.damping[k], modes.whirl[k])
        said = ",".join(repr(float(number) + 0.0) for number in numbers)
        stable = int(k + 1 not in modes.unstable)
        lines.append(f"{k + 1},{said},{modes.directions[k]},{stable}")
    return lines


def _table(found: Campbell) -> list[str]:
    lines = [f"rate_rad_per_s,branch,{HEADER}"]
    for rate, modes, branches in zip(found.rates, found.modes, found.branches, strict=True):
        of = {int(mode): k for k, mode in enumerate(branches, start=1) if mode >= 0}
        for mode, row in enumerate(_rows(modes)):
            if mode in of:
                lines.append(f"{float(rate)!r},{of[mode]},{row}")
    return lines


def _head(run: ModesDirectory, loaded: bool, axis: Axis, modes: RotatingModes) -> dict[str, Any]:
    """Entries that all summaries begin with."""
    return run.summary(modes.model, modes.unknowns) | {
        "loaded": loaded,
        "axis": list(axis.axis),
        "about": list(axis.about),
    }


def _write_rate(directory: Path, modes: RotatingModes, whole: dict[str, Any]) -> None:
    summary = {
        **whole,
        "rate_rad_per_s": modes.rate,
        "frequencies_hz": modes.frequencies,
        "omega_rad_per_s": modes.omega,
        "growth_per_s": modes.values.real,
        "damping_ratios": modes.damping,
        "rigid_modes": modes.rigid,
        "zero_below_per_s": modes.neutral,
        "elements": modes.model.elements,
    }
    write_shapes(directory, modes.model, modes.fields, [HEADER, *_rows(modes)], summary)
