"""Derivatives by parameters of a scene: of all that a run finds, and of natural frequencies."""

from __future__ import annotations

import json
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt
import pandas as pd

from shellmb.api.modal import at_most, modes
from shellmb.api.runs import placed
from shellmb.api.sensitivity.record import ABOUT, RUN, SIDES, Sensitivities, side_folder
from shellmb.errors import SceneError, warn
from shellmb.files.writing import write_text
from shellmb.options.described import options_of, takes
from shellmb.options.run import ELEMENTS, Options
from shellmb.scene import Scene
from shellmb.sensitivity.parameters import Parameter, differentiated, independent

if TYPE_CHECKING:
    from mpi4py import MPI

    from shellmb.simulate.simulation import Simulation

# communicators of a scene beside a run, those of meshes that are moved left out: seven were seen
OWN = 20


@takes(*options_of(Options))
def sensitivities(
    scene: Callable[..., Scene] | str,
    parameters: Sequence[str],
    out: Path | str | None = None,
    *,
    values: Mapping[str, Any] | None = None,
    scales: Mapping[str, float] | None = None,
    columns: Literal["all", "probes"] = "all",
    fields: bool = True,
    at: Literal["length", "load"] = "length",
    resume: bool = False,
    comm: MPI.Comm | None = None,
    **options: Any,
) -> Sensitivities:
    """Run a scene and differentiate its histories, results and fields by parameters.

    Derivatives are those of the motion in its time steps, exact to about seven digits; they are
    found step by step beside the run, whose factorisations they share (`sensitivity.tangent`).

    Args:
        scene: A function that makes the scene from its parameters, the name of a bundled scene, or
            the path of a Python file.
        parameters: Names of the parameters.
        out: Directory to write, new or empty; None: a temporary one, which is gone with the result.
        values: Values of parameters of the scene that replace its defaults.
        scales: Sizes of parameters, where their values do not tell: of one that is zero, say.
        columns: "all" columns of the history, or those of "probes" only, which costs less; with
            controllers all of them.
        fields: Whether fields have derivatives, too.
        at: On a static path, derivatives at the same arc "length", or at the same "load" factor;
            the latter grow without bound at limit points.
        resume: Whether to go on in `out`, where this run was stopped; all else is given again.
        comm: Communicator; None: all ranks.
        **options: Choices that replace the scene's, as `shellmb run` has them.

    Returns:
        The run and its derivatives.

    Raises:
        SceneError: If the scene, a parameter or `out` is impossible.
        ConvergenceError: If a step fails at the smallest step size, or a step that ends with an
            event is too short for the differences.
    """
    made = differentiated(scene, values, **options)
    chosen = made.parameters(parameters, scales)
    base = made.base()
    if at != "length" and base.path is None:
        raise SceneError(
            f"sensitivities: at is '{at}', and scene '{base.name}' follows no static path; leave "
            "it out"
        )
    if base.controllers or base.all_events:
        # their sensors may read any column
        fields, columns = fields and columns == "all", "all"
    scenes = {p: made.beside(base, p) for p in (c.widened(base) for c in chosen)}
    unmoved = [p for p, both in scenes.items() if independent(*both)]
    said = [p.without_effect(base, scenes[p][0]) for p in unmoved]
    if base.errors:
        said.append("errors=True has no effect beside derivatives; run the scene alone for errors")
    place = placed(out, comm)
    directory, world = place.directory, place.comm
    begun = world.bcast((directory / RUN).is_dir())
    if begun and not resume:
        raise SceneError(
            f"sensitivities: out is {out}, in which a run with derivatives was begun; give another "
            "directory, or go on with it by resume=True (--resume)"
        )
    if resume and not begun:
        raise SceneError(
            f"sensitivities: out is {out}, in which no run with derivatives was begun; give the "
            "directory of the one that was stopped, or resume=False"
        )
    from shellmb.running.directory import claimed
    from shellmb.running.execute import execute
    from shellmb.running.resume import resume as go_on
    from shellmb.sensitivity.paths import PathTangents
    from shellmb.sensitivity.perturbed_run import PerturbedScene
    from shellmb.sensitivity.tangent import Pair, Tangents

    fields = fields and columns == "all"
    begin = clock.perf_counter()
    sides: dict[Parameter, list[PerturbedScene]] = {}

    def make(run: Simulation) -> list[Pair]:
        for p, both in scenes.items():
            _check_room(run, len(sides), len(scenes))
            folders = (directory / side_folder(p.name, side) for side in SIDES)
            with p.named():
                sides[p] = [
                    PerturbedScene(scene, folder, columns, fields, run)
                    for scene, folder in zip(both, folders, strict=True)
                ]
        return [Pair(p, above, below) for p, (above, below) in sides.items()]

    paths = base.path is not None
    tangents = PathTangents(make, at == "load") if paths else Tangents(make)
    how: dict[str, Any] = {"comm": world, "pictures": False, "results": made.results}
    with claimed(directory, world, new=not resume):
        if resume:
            run = go_on(directory / RUN, [tangents], scene=base, **how)
        else:
            run = execute(base, directory / RUN, [tangents], **how)
        for side in (side for both in sides.values() for side in both if columns == "all"):
            side.evaluate(run.summary, clock.perf_counter() - begin, made.results)
        said += dict.fromkeys(tangents.said)
        said += [pair.kinked for pair in tangents.pairs if pair.kinks]
        about = {
            "scene": base.name,
            "parameters": [asdict(p) for p in scenes],
            "independent": [p.name for p in unmoved],
            "columns": columns,
            "fields": fields,
            "warnings": said,
            "points": tangents.points,
            "iterations": tangents.iterations,
        }
        if world.rank == 0:
            _write(directory, about, [p for p in scenes if p not in unmoved])
    world.Barrier()
    return place.held_by(Sensitivities(directory, run))


def _write(directory: Path, about: dict[str, Any], moved: Sequence[Parameter]) -> None:
    """Write what was found, with what it says against itself."""
    write_text(directory / ABOUT, json.dumps(about, indent=1) + "\n")
    found = Sensitivities(directory)
    found.write()
    zero = [
        f"no result and no probe depends on '{p.name}' near {p.value:g}: their derivatives by it "
        "are round-off"
        for p in moved
        if found.is_round_off(p)
    ]
    if zero:
        about["warnings"] += zero
        write_text(directory / ABOUT, json.dumps(about, indent=1) + "\n")


def _check_room(run: Simulation, made: int, count: int) -> None:
    """Refuse more parameters than MPI has communicators for, which ends the program; collective."""
    from shellmb.meshes.lifetime import room_for

    if room_for(run.model.comm, 2 * (len(run.meshes.made) + OWN)):
        return
    advice = f"differentiate by at most {made} parameters at a time" if made else "free other runs"
    raise SceneError(
        f"sensitivities: {count} parameters are too many for one run of '{run.scene.name}': MPI "
        f"has communicators for the scenes beside it of {made}; {advice}, or differentiate one "
        "number by all of them with `adjoint`"
    )


# relative distance of the scenes at both sides: eigenvalues have twelve digits
APART = 1e-4
# relative distance from the next frequency below which one has no derivative of its own
SIMPLE = 10 * APART


@takes(*options_of(Options, *ELEMENTS))
def frequency_sensitivities(
    scene: Callable[..., Scene] | str,
    parameters: Sequence[str],
    count: int = 6,
    loaded: bool = False,
    *,
    values: Mapping[str, Any] | None = None,
    scales: Mapping[str, float] | None = None,
    **options: Any,
) -> pd.DataFrame:
    """Natural frequencies and their derivatives, by central differences.

    Args:
        scene: A function that makes the scene from its parameters, the name of a bundled scene, or
            the path of a Python file.
        parameters: Names of the parameters.
        count: Number of frequencies; a scene that has fewer has rows for these.
        loaded: Whether about the loaded state, as of `modes`.
        values: Values of parameters of the scene that replace its defaults.
        scales: Sizes of parameters, where their values do not tell.
        **options: Choices that replace the scene's.

    Returns:
        A row for each frequency: the frequency [Hz], and its derivative by each parameter. The
        derivative is NaN, with a warning, where two frequencies nearly coincide.

    Raises:
        SceneError: If the scene or a parameter is impossible.
    """
    if count < 1:
        raise SceneError(f"sensitivities: count is {count}; it must be at least 1")
    made = differentiated(scene, values, **options)
    chosen = [p.apart(APART) for p in made.parameters(parameters, scales)]
    base = made.base()
    scenes = {p: made.beside(base, p) for p in chosen}
    # one more tells whether the last one is simple
    here = _frequencies(base, count + 1, loaded)
    known = min(count, len(here))
    gaps = np.abs(np.diff(here)) / np.maximum(np.abs(here[1:]), np.finfo(float).tiny)
    near = np.concatenate([[False], gaps < SIMPLE]) | np.concatenate([gaps < SIMPLE, [False]])
    table = pd.DataFrame(
        {"frequency": here[:known]}, index=pd.RangeIndex(1, known + 1, name="mode")
    )
    for p, (above, below) in scenes.items():
        sides = [_frequencies(s, count + 1, loaded)[: len(here)] for s in (above, below)]
        if any(len(side) < len(here) for side in sides):
            raise SceneError(
                f"sensitivities: parameter '{p.name}' changes how many frequencies there are; it "
                "must not"
            )
        slopes = (sides[0] - sides[1]) / p.width
        table[p.name] = np.where(near, np.nan, slopes)[:known]
        if not slopes.any():
            said = f"no frequency depends on '{p.name}' near {p.value:g}: its derivatives are zero"
            if independent(above, below):
                said = p.without_effect(base, above)
            warn(said)
    if near[:known].any():
        said = ", ".join(str(k + 1) for k in np.flatnonzero(near[:known]))
        warn(f"frequencies {said} nearly coincide with others: they have no own derivatives")
    return table


def _frequencies(scene: Scene, count: int, loaded: bool) -> npt.NDArray[np.float64]:
    """Natural frequencies, Hz; fewer where there are fewer."""
    found = at_most(count, lambda n: modes(scene, count=n, loaded=loaded, pictures=False))
    return np.array(found.frequencies)
